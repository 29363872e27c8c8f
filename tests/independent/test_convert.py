"""Programs nobody has seen, through the command line, driven by the independent arm."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.independent import convert_many


@pytest.mark.parametrize(
    ("seed", "geometry", "hard"),
    [
        (5, "irb4600_60_205", False),
        (20, "irb4600_60_205", True),
        (39, "irb4600_60_205", False),
        (108, "irb4600_60_205_seed", False),
    ],
)
@pytest.mark.parametrize("air", [0.01, 0.2])
def test_a_converted_program_reaches_the_programmed_path(
    tmp_path: Path, seed: int, geometry: str, hard: bool, air: float
) -> None:
    """At most 0.01 mm along what welds, the air's tolerance (0.2 mm is the default) along other lines and arcs and at
    goals, 15 added targets a metre, nothing else changed in the text.
    """
    outcome = convert_many.run(tmp_path, seed, geometry, hard=hard, air=air)
    assert outcome.faults == []
    assert outcome.report is not None
    assert outcome.report.before > 0.5
    assert outcome.report.added > 0
    assert {s.kind for s in outcome.report.segments} >= {"A", "J", "L"}
