"""Lost motion is found by the order of rows, and no order that is not that of measuring gives it a false name."""

from __future__ import annotations

import pytest

from tests.bench.sides import Recipe, diagnosed
from tests.independent import library_effects as K


def test_lost_motion_is_found_by_the_order_of_the_rows() -> None:
    found, _ = diagnosed(Recipe((K.backlash,), told="times"), 7)
    assert [m.key for m in found.missing] == ["backlash"] and found.verdict == "missing"
    assert found.final.held_out_rms < 0.5 * found.base.held_out_rms
    (finding,) = (d for d in found.diagnostics if d.code == "DAT014")
    assert finding.message == "`backlash` takes the side from which a joint came from the pose before, by the times"


@pytest.mark.parametrize("order", ["shuffled", "sorted"])
def test_rows_in_another_order_give_lost_motion_no_name(order: str) -> None:
    found, hidden = diagnosed(Recipe((K.transmission_error,), order, "names"), 9)
    assert [m.key for m in found.missing] == [hidden[0].answer]
    assert found.base.data.sides_from and not [d for d in found.diagnostics if d.code == "DAT014"]


def test_rows_without_an_order_say_how_to_state_it() -> None:
    found, _ = diagnosed(Recipe(told="nobody"), 11)
    assert "--rows-in-order" in found.blind["backlash"] and found.verdict == "complete"
