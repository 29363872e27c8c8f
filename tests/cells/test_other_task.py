"""Work on a positioner that another task moves, beside an arm on a track: both tasks call their axis eax_a."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from postproc.compensation.conversion import Conversion
from postproc.compensation.options import Options
from postproc.diagnostics import Source
from postproc.runtime.passes import correct_program
from postproc.settings import Settings
from postproc.tasks.discover import discover, task_around
from postproc.tasks.task import with_arm
from tests.cells import world as W
from tests.independent import arm as A

from .test_paths import ARM, DOWN, FORCE, LIMIT, model, placed, turned

TURN = """MODULE Turn
  CONST jointtarget jAt:=[[0,0,0,0,0,0],[30,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    MoveExtJ jAt,vrot50,fine;
    WHILE TRUE DO
      WaitSyncTask sReady,tAll;
      MORE
    ENDWHILE
  ENDPROC
ENDMODULE
"""
AT = 1500.0  # of the track [mm]
FRAME, _ = placed((1150, 150, 450), (1, 0, 0), 20)
WORLD = W.World(
    base=W.slide(0, (1.0, 0.0, 0.0)),
    units={"STN1": lambda axes: A.shift(AT / 1000) @ W.turn(0, (0, 0, 1.0), FRAME)(W.still(axes)[:, :1, 0] * 0 + 30)},
)


@pytest.fixture(scope="module")
def text() -> str:
    goals = [
        W.Goal((150, -250, 250), DOWN, {0: AT}, "MoveJ"),
        W.Goal((150, -250, 150), DOWN, {0: AT}, "ArcLStart"),
        W.Goal((180, 200, 150), turned((0, 0, 1), 10), {0: AT}, "ArcLEnd"),
    ]
    return W.program(ARM, WORLD, goals, "STN1")


def converted(root: Path, text: str, more: str) -> Conversion:
    """The program in a backup whose other task goes on with these statements."""
    files = {
        f"SYSPAR/{name}.cfg": (Path(__file__).parent / f"other_task/{name}.cfg").read_text("utf-8")
        for name in ("MOC", "SYS")
    }
    files["BACKINFO/backinfo.txt"] = ">>TASK1: (T_ROB1,,)\n\n>>TASK2: (T_POS1,,)\n"
    files["RAPID/TASK1/PROGMOD/Weld.mod"] = text
    files["RAPID/TASK2/PROGMOD/Turn.mod"] = TURN.replace("MORE", more)
    for name, content in files.items():
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_text(content)
    (task,) = [task for task in discover(root)[0] if task.name.endswith("TASK1")]
    together = with_arm(Settings(), task).station
    alone = with_arm(Settings(), task_around(root / "RAPID/TASK1/PROGMOD/Weld.mod")).station
    assert together is not None and alone is not None and alone.standing == together.standing
    options = Options(tolerance_m=1e-5, force=FORCE, inertia=False)
    return correct_program(Source("w.mod", text.encode()), model().at_station(together), options)


def test_where_it_stands_all_the_time_the_work_is_known(tmp_path: Path, text: str) -> None:
    found = converted(tmp_path, text, "")
    assert found.output is not None, [d.message for d in found.diagnostics]
    (said,) = [d for d in found.diagnostics if d.code == "MOT013"]
    assert said.message == "`STN1`, which another task moves, is taken to stand at eax_a = 30"
    checked = W.check(text, found.output.decode(), WORLD, ARM, np.array(FORCE))
    assert not checked.problems and checked.before > 0.1 and checked.after <= LIMIT


@pytest.mark.parametrize(
    "more", ["MoveExtJ [[0,0,0,0,0,0],[60,9E9,9E9,9E9,9E9,9E9]],vrot50,fine;", "MoveExtJ jAsked,vrot50,fine;"]
)
def test_where_it_moves_or_nobody_knows_the_work_is_left_with_that_reason(tmp_path: Path, text: str, more: str) -> None:
    """Its eax_a is degrees of the plate; the 1500 mm of the track, that task's own eax_a, are not taken for it."""
    found = converted(tmp_path, text, more)
    assert not found.outputs
    (stop,) = [d for d in found.diagnostics if d.code == "CMP003"]
    assert "another task moves `STN1`, and its program does not say that it stands at one position" in (stop.help or "")
