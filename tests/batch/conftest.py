"""A folder to work in."""

from __future__ import annotations

from pathlib import Path

import pytest

from .build import Work, work_in


@pytest.fixture
def work(tmp_path: Path) -> Work:
    return work_in(tmp_path)
