"""Conversions that the tests of the pages share."""

from __future__ import annotations

import pytest

from postproc.compensation.conversion import Conversion
from tests.report.build import corrected


@pytest.fixture(scope="session")
def conversion() -> Conversion:
    return corrected("paper_case.mod", force=(200.0, -200.0, -200.0))


@pytest.fixture(scope="session")
def seam() -> Conversion:
    return corrected("hull_seam.mod")
