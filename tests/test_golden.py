"""Converted samples against approved outputs, by meaning. ``python -m tests.test_golden`` writes them anew."""

from __future__ import annotations

from pathlib import Path

import pytest

from postproc.compensation.options import TOLERANCE_M, Options
from postproc.diagnostics import Source
from postproc.model.file import default_model
from postproc.rapid.diff.compare import compare_programs
from postproc.rapid.program.program import read_program
from postproc.runtime.passes import correct_program

ROOT = Path(__file__).resolve().parent.parent
STUDY_M = 1e-5  # the tolerance of the hull-welding study
APPROVED = {
    "hull_seam.mod": ("hull_seam.mod", "irb4600_60_205", TOLERANCE_M),
    "corner_arc.mod": ("corner_arc.mod", "irb4600_60_205", TOLERANCE_M),
    "paper_case.mod": ("paper_case.mod", "irb4600_60_205", STUDY_M),
    "paper_case_seed.mod": ("paper_case.mod", "irb4600_60_205_seed", STUDY_M),
}
SAME_MM = 0.005  # well below what compensation is for, well above rounding of platforms


def convert(sample: str, robot: str, tolerance_m: float) -> bytes:
    source = Source(sample, (ROOT / "samples" / sample).read_bytes())
    options = Options(tolerance_m=tolerance_m, force=(200.0, -200.0, -200.0), inertia=False)
    output = correct_program(source, default_model(robot), options).output
    assert output is not None
    return output


@pytest.mark.parametrize("name", APPROVED)
def test_outputs_are_as_approved(name: str) -> None:
    approved = read_program(Source(name, (ROOT / "tests" / "golden" / name).read_bytes()))
    written = read_program(Source(name, convert(*APPROVED[name])))
    found = compare_programs(approved, written, SAME_MM)
    assert found.equal, found.differences


def test_a_moved_target_would_be_noticed() -> None:
    text = (ROOT / "tests" / "golden" / "hull_seam.mod").read_bytes()
    approved = read_program(Source("a", text))
    at = text.index(b"pSeam50:=[[") + len(b"pSeam50:=[[")
    moved = text[:at] + text[at:].replace(b".", b".9", 1)
    assert not compare_programs(approved, read_program(Source("b", moved)), SAME_MM).equal


if __name__ == "__main__":
    for name, case in APPROVED.items():
        (ROOT / "tests" / "golden" / name).write_bytes(convert(*case))
