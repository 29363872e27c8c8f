"""Small programs and what the conversion makes of each: a row in ``corpus/*.txt``, as ``rows`` writes it.

`drive` has the independent arm driven along the written program, `follow` too where arguments of calls change; with
`burning` the force acts on it while the arc burns, and the seams come out right.
"""

from __future__ import annotations

from math import hypot
from pathlib import Path

import pytest

from tests.build import FORCE, independent
from tests.compensation.build import broken, placed
from tests.compensation.rows import assert_row, converted
from tests.corpus import Case, cases

ALL = [
    case for path in sorted((Path(__file__).parent / "corpus").glob("*.txt")) for case in cases(path, broken, placed)
]


@pytest.mark.parametrize("case", ALL, ids=[case.place for case in ALL])
def test_a_program_is_corrected_as_its_row_says(case: Case) -> None:
    found = converted(case)
    assert_row(case, found)
    if {"drive", "follow"} & set(case.facets):
        report = independent(case.text, found, case.options.get("force", FORCE))
        assert report.violations == [] or "follow" in case.facets
        assert report.after == pytest.approx(found.report["max_error_after_mm"], abs=0.002)
        assert report.goal_after <= max(hypot(o.residual_mm or 0.0, o.along_mm or 0.0) for o in found.outcomes) + 0.003
    if "burning" in case.facets:
        welds = [s for s in independent(case.text, found, on_arc=True).segments if s.welding]
        assert max(s.after for s in welds) <= 0.01 and max(s.goal_after for s in welds) <= 0.002
