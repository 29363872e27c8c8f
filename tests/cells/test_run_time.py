"""The function for run time where external axes carry the arm or its work."""

from __future__ import annotations

from dataclasses import replace

import pytest

from tests.cells.test_paths import CASES, FORCE, axis, converted, placed, track


@pytest.mark.parametrize("name", CASES)
def test_the_function_corrects_targets_whatever_carries_arm_and_work(name: str) -> None:
    """The proof drives the arm with the targets that the module gives, external axes where the targets have them."""
    found = converted(CASES[name](), force=FORCE, run_time="all")
    assert found.outputs, [str(d) for d in found.diagnostics]
    told = found.report["run_time"]
    assert {row["status"] for row in found.report["statements"]} == {"run_time"}
    assert told["known_targets"] == len(found.outcomes)
    assert told["max_known_error_mm"] < 0.003
    assert found.report["max_error_before_mm"] > 0.2


def test_an_arm_that_an_external_axis_tilts_is_refused() -> None:
    """Gravity follows the axis, and the module knows one direction of it."""
    _, keys = placed((0, 0, 0), (1, 0, 0), 90)
    case = replace(track(0.0, 0.0, 0.0), axes=axis("a", "rotary", "robot", unit='"ORBIT"') + keys)
    found = converted(case, force=FORCE, run_time="all")
    assert found.outputs == {}
    assert "RUN011" in [d.code for d in found.diagnostics]
