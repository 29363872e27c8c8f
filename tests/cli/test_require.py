"""``--require``: an exit code of whether the tolerance is kept, in the model or on the arm; outputs are written."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from postproc.cli import hooks
from postproc.cli.app import build
from postproc.cli.run import run
from tests.compensation.build import effect, small

from .conftest import Call
from .test_first_words import FITTED, SEAM

SURE = FITTED.replace("1.6e-15", "1e-18").replace("unexplained_mm = 0.04", "unexplained_mm = 0.004")
GAP = FITTED.partition("[fit]")[0] + effect("backlash", "half_gap_rad = [2e-4, 2e-4, 2e-4, 0.0, 0.0, 0.0]")
"""A model that is sure of itself, and one of an arm with a gap that a joint crosses in the seam."""
LAST = (
    "all 1 are as approved",
    "1 of 1 programs are without what `--require` asks: {program}; an approval does not cure that; "
    "the line of each says what does",
)
MODELS = {"kept": SURE, "not_shown": FITTED, "not_kept": GAP}


def programs(folder: Path, verdict: str) -> tuple[Path, Path]:
    """A seam that turns joints back, and the model with which a conversion of it has that verdict."""
    program, model = folder / "in" / "seam.mod", folder / f"{verdict}.toml"
    program.parent.mkdir(exist_ok=True)
    text = SEAM.replace("1300,-400", "1300,-320").replace("1300,-200", "1300,320")
    program.write_text(text, "latin-1")
    model.write_text(MODELS[verdict])
    return program, model


@pytest.mark.parametrize(
    ("verdict", "unmet"),
    [("kept", ()), ("not_shown", ("arm",)), ("not_kept", ("model", "arm"))],
    ids=["kept", "not shown", "not kept"],
)
def test_a_tolerance_that_is_required_and_not_kept_is_an_exit_code(
    call_as_written: Call, tmp_path: Path, verdict: str, unmet: tuple[str, ...]
) -> None:
    program, model = programs(tmp_path, verdict)
    for require in ("model", "arm"):
        out = tmp_path / require
        one = call_as_written("compensate", program, "-m", model, "-o", out / "one.mod", "--require", require)
        many = call_as_written("batch", program.parent, "-m", model, "-o", out, "--require", require)
        assert (one.code, many.code) == (int(require in unmet),) * 2
        assert (out / "one.mod").read_bytes() == (out / "seam.mod").read_bytes()
        for said in (one, many):
            last = said.err.splitlines()[-1]
            assert last.startswith(f"`--require {require}`: the tolerance is not ") == (require in unmet)
            assert ("`seam.mod`, weld `main` in lines " in last) == (require in unmet)
            cure = "measure the arm (`postproc plan`, " if verdict == "not_shown" else "CMP005 and CMP006 say of "
            assert (f". To meet it: {cure}" in last) == (require in unmet)
    plain = call_as_written("compensate", program, "-m", model, "-o", tmp_path / "plain.mod")
    assert plain.code == 0 and "--require" not in plain.err


def test_a_program_of_which_no_line_could_be_measured_meets_no_requirement(call: Call, tmp_path: Path) -> None:
    program = tmp_path / "joints.mod"
    program.write_text(small("MoveJ @{1350,-500},v200,fine,tT;"), "latin-1")
    assert call("compensate", program, "-o", tmp_path / "a.mod").code == 0
    made = call("compensate", program, "-o", tmp_path / "a.mod", "--require", "model")
    text = "the tolerance is not kept in the model: `joints.mod`, no line or arc could be measured"
    assert made.code == 1 and made.err.splitlines()[-1].startswith(f"`--require model`: {text}. To meet it: ")


def test_hooks_hand_the_requirement_on_and_tell_a_change_from_what_is_lacking(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    program, model = programs(tmp_path, "not_shown")
    approved, words = tmp_path / "approved", ("-m", str(model), "--programs", str(program.parent))
    assert run(build(), ["compensate", str(program), "-m", str(model), "-o", str(approved / "seam.mod")]) == 0
    for require, code in (("model", 0), ("arm", 1)):
        assert hooks.main(["check", "--require", require, *words, "--approved", str(approved)]) == code
        last = capsys.readouterr().err.splitlines()[-1]
        assert last == LAST[code].format(program=program.as_posix())
    for how, *kinds in (
        (("--require", "arm", "--force", "100,0,0"), "not as approved", "without what `--require` asks"),
        (("--require", "arm", "--tool", "nothing"), "not converted"),
    ):
        assert hooks.main(["check", *how, *words, "--approved", str(approved)]) >= 1
        said = re.findall(r"(?m)^1 of 1 programs are (.*?): ", capsys.readouterr().err)
        assert said == kinds
