"""Squares of ways in the text of added targets."""

from __future__ import annotations

import numpy as np

from postproc.compensate.text.bends import is_steep, squares_of


def test_what_changes_by_millimetres_with_a_way_that_hardly_differs_is_no_law() -> None:
    ways = np.array([[-340.0, 220.0 + 8 * n, 27.5 + 0.05 * n] for n in range(6)])
    squares = squares_of("p", "q", ways)
    assert not is_steep([[0.5, -0.7, 0.2]], squares)
    # With 28 mm of height a millimetre more adds 15 mm.
    assert is_steep([[2447.3, -267344.0, -241734.6]], squares)
    assert not is_steep([], squares) and not is_steep([[1.0, 0.0, 0.0]], {})
