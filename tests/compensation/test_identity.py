"""A correction of nothing: an arm that does not bend gets the program as it is, byte for byte."""

from __future__ import annotations

from pathlib import Path

import pytest

from postproc.compensation.options import Options
from postproc.diagnostics import Source
from postproc.model.file import parse_model
from postproc.runtime.passes import correct_program

ROOT = Path(__file__).resolve().parents[2]
RIGID = b'robot = "irb4600_60_205"\n[effects.joint_compliance]\ncompliance_rad_per_Nm = [0, 0, 0, 0, 0, 0]\n'
PROGRAMS = (
    "samples/corner_arc.mod", "samples/hull_seam.mod", "samples/panel_300.mod",
    *(f"tests/worlds/programs/{name}.mod" for name in (
        "handed_targets", "line_from_home", "moved_step_by_step", "own_movement", "palletizer", "record_of_targets",
        "target_function", "trap_writes_target",
    )),
)  # fmt: skip


@pytest.mark.parametrize("name", PROGRAMS)
def test_nothing_to_correct_is_the_input(name: str) -> None:
    """Offsets of zero were written around what runs several times, and quaternions of circle points with another sign."""
    source = Source(name, (ROOT / name).read_bytes())
    found = correct_program(source, parse_model(Source("m.toml", RIGID)), Options(inertia=False, tolerance_m=1e-5))
    assert found.report["statements"]
    assert found.output == source.data
