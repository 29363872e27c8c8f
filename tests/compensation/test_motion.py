"""The states of a motion: worked out once where a move goes on as the one before has ended."""

from __future__ import annotations

import numpy as np

from postproc.compensation.options import Options
from postproc.compensation.path.motion import Motion
from postproc.compensation.reading import read_motion
from postproc.diagnostics import Source
from postproc.model.equilibrium import predict
from postproc.rapid.execution.walk import walk
from postproc.rapid.program.program import read_program
from tests.build import FORCE, arm, module, target

PLACES = [(1200, -300), (1200, -100), (1200, 0), (1300, 100), (1300, 200)]


def motion(body: str, **options: object) -> Motion:
    program = read_program([Source("m.mod", module("", body).encode())])
    found, findings = read_motion(arm(), walk(program), Options(force=FORCE, **options))  # type: ignore[arg-type]
    assert found is not None, findings
    return found


def shared(body: str, **options: object) -> set[int]:
    """Moves whose start is taken from the goal before; the same poses are reached by every sample's own state."""
    m = motion(body, **options)
    rows = slice(0, len(m.place))
    own, of_own = m.distinct(rows)
    apart = predict(arm(), m.at(rows))
    assert np.abs(predict(arm(), m.at(own))[of_own] - apart).max() < 1e-9
    return set(m.samples.move[np.setdiff1d(np.arange(rows.stop), own)].tolist())


def test_a_start_is_the_goal_before() -> None:
    body = "\n".join(f"MoveL {target(x, y)},v100,z1,tT;" for x, y in PLACES)
    assert shared(body) == {1, 2, 3, 4}


def test_another_tool_or_the_arc_makes_another_state() -> None:
    a, b, c, d, e = (target(x, y) for x, y in PLACES)
    body = f"MoveL {a},v100,z1,tT;\nArcLStart {b},v100,sm,wd,fine,tT;\nArcL {c},v100,sm,wd,z1,tT;\n"
    body += f"ArcLEnd {d},v100,sm,wd,fine,tT;\nMoveL {e},v100,z1,tT;"
    assert shared(body) == {1, 2, 3, 4}
    assert shared(body, force_on="arc") == {1, 3}
    assert shared(f"MoveL {a},v100,fine,tT;\nMoveL {b},v100,fine,tLong;\nMoveL {c},v100,fine,tLong;") == {2}
