"""Programs with the function in them: which statements get it, which must not, and what else is written.

A row of ``corpus.txt`` each, as ``tests/compensation/rows.py`` writes it; without an option the function is used where
it is needed. Program and module can be loaded together, and known targets come out right.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.build import written
from tests.compensation.build import broken, placed
from tests.compensation.rows import assert_row, converted
from tests.corpus import Case, cases
from tests.runtime.loading import Loaded

ALL = list(cases(Path(__file__).with_name("corpus.txt"), broken, placed))


@pytest.mark.parametrize("case", ALL, ids=[case.place for case in ALL])
def test_a_program_gets_the_function_as_its_row_says(case: Case) -> None:
    conversion = converted(case, run_time="where-needed")
    assert_row(case, conversion)
    if conversion.module is None:
        assert not conversion.outputs or "ppCorrected(" not in written(conversion).replace("! ppCorrected(", "")
        return
    assert Loaded([written(conversion), conversion.module.decode()]).faults() == []
    residuals = [o.residual_mm or 0.0 for o in conversion.outcomes if o.status == "run_time"]
    assert max(residuals, default=0.0) < 0.002
