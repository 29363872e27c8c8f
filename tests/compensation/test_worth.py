"""What is changed is worth it."""

from __future__ import annotations

import numpy as np
import pytest

from postproc.effects.library.joints.backlash import Backlash
from tests.build import arm, convert, module, target

TWICE = f"""MoveJ {target(1300, -500, 760)},v200,fine,tT;
FOR i FROM 1 TO 3 DO
  seam;
  seamLong;
ENDFOR
"""
SEAMS = "".join(
    f"  PROC {name}()\n    MoveL a,v50,fine,{tool};\n    MoveL Offs(b,0,0,3),v50,fine,{tool};\n  ENDPROC\n"
    for name, tool in (("seam", "tT"), ("seamLong", "tLong"))
)


@pytest.mark.parametrize("soft", [1.0, 40.0])
def test_what_is_changed_loses_at_least_half_of_its_error(soft: float) -> None:
    """At its target, where that is more than the tolerance: else the program is not changed there."""
    data = f"CONST robtarget a:={target(1350, -500)};\nCONST robtarget b:={target(1350, -300)};"
    lost = arm().with_effects(*arm().effects, Backlash(half_gap_rad=soft * np.array([1e-5, 0, 0, 0, 0, 0])))
    found = convert(module(data, TWICE, SEAMS), lost)
    judged = found.judged
    assert judged is not None and judged.plan is not None and judged.before is not None and judged.after is not None
    keys = {o.statement.key: o.status for o in found.outcomes}
    changed = [keys[move.event.statement.key] == "compensated" for move in judged.plan.motion.moves]
    before, after = judged.before.goal_distance, judged.after.goal_distance
    assert sum(changed) > 3
    assert (after <= np.maximum(0.55 * before, 1e-5))[changed].all()
