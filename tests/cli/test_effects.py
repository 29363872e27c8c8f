"""``effects list``, ``show`` and ``check``."""

from __future__ import annotations

import json
import re
from pathlib import Path

from .conftest import Call

GOOD = '''
from postproc.arrays import Array
from postproc.effects.base import Effect, State, param


class Sag(Effect, reads=("q",)):
    """The forearm sags by its angle."""

    sag_rad: Array = param(unit="rad", shape=(6,), typical=1e-4)

    def displacement(self, state: State) -> Array:
        return self.sag_rad * state.q
'''


def test_list_and_show(call: Call, tmp_path: Path) -> None:
    file = tmp_path / "mine.py"
    file.write_text(GOOD)
    assert "joint_compliance" in call("effects", "list").out
    assert "sag " not in call("effects", "list").out
    assert "The forearm sags by its angle." in call("effects", "list", "--effects", file).out
    shown = call("effects", "show", "backlash")
    assert shown.code == 0
    assert "half_gap_rad [rad]" in shown.out
    # A row has a unit of its own: what is small in one column of numbers does not vanish.
    small = call("effects", "show", "joint_compliance").out + call("effects", "show", "session").out
    assert re.search(r"compliance_rad_per_Nm .* 0\.001 +1e-06 +0\n", small) and re.search(
        r"shift_m .* 3e-05 +0\n", small
    )
    document = json.loads(call("effects", "show", "sag", "--effects", file, "--json").out)
    assert document["schema"] == "postproc/effect/1"
    assert document["parameters"] == {"sag_rad": {"unit": "rad", "null": 0.0}}


def test_check_passes_and_fails(call: Call, tmp_path: Path) -> None:
    file = tmp_path / "mine.py"
    file.write_text(GOOD)
    assert call("effects", "check", file).out == "sag: fit for every command\n"
    file.write_text(GOOD.replace("* state.q", "* 1e3 * state.q"))
    doubted = call("effects", "check", file)
    assert doubted.code == 0 and doubted.err.startswith(
        "warning[EFF018]: at its ordinary size `sag` turns something by"
    )
    assert doubted.out == "sag: fit for every command, if what is told above is meant so\n"
    file.write_text(GOOD.replace("* state.q", "* state.q + 1e-3"))
    outcome = call("effects", "check", file, "--json")
    assert outcome.code == 1
    assert {d["code"] for d in json.loads(outcome.out)["diagnostics"]} >= {"EFF004"}
    assert "mine.py" in outcome.err
    assert call("effects", "check", tmp_path / "none.py").code == 2
    file.write_text(GOOD.replace("class Sag(", "class Backlash("))
    taken = call("effects", "check", file)
    assert (taken.code, "error[EFF007]: the key `backlash` is taken twice" in taken.err) == (1, True)
