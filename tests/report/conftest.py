"""Results that the tests of the pages share, and what a page carries."""

from __future__ import annotations

import base64
import json
import re
from typing import Any

import numpy as np
import pytest

from postproc.arrays import Array
from postproc.compensation.conversion import Conversion
from postproc.compensation.options import Options
from postproc.diagnostics import Source
from postproc.files import resource
from postproc.model.file import default_model
from postproc.runtime.passes import correct_program


@pytest.fixture(scope="session")
def conversion() -> Conversion:
    data = resource("samples", "paper_case.mod").read_bytes()
    options = Options(tolerance_m=1e-5, force=(200.0, -200.0, -200.0))
    return correct_program(Source("paper_case.mod", data), default_model(), options)


@pytest.fixture(scope="session")
def seam() -> Conversion:
    data = resource("samples", "hull_seam.mod").read_bytes()
    return correct_program(Source("hull_seam.mod", data), default_model(), Options(tolerance_m=1e-5))


def carried(page: str, name: str = "document") -> Any:
    """What a page carries in a script element."""
    found = re.search(rf'<script type="application/json" id="{name}">(.*?)</script>', page, re.DOTALL)
    assert found
    return json.loads(found[1])


def tables(page: str) -> dict[str, Any]:
    """Tables that stand in a page, by what they hold."""
    specs = re.findall(r'<div data-table><script type="application/json">(.*?)</script>', page, re.DOTALL)
    return {spec["label"]: spec for spec in map(json.loads, specs)}


def numbers(column: dict[str, Any]) -> Array:
    """Numbers of a column, read as a browser reads them."""
    kinds = {"f4": "<f4", "i4": "<i4", "u2": "<u2"}
    values = np.frombuffer(base64.b64decode(column["data"]), kinds[column["type"]]).astype(float)
    if column["type"] == "u2":
        values = np.where(values > 0, column["low"] + values * column["step"], np.nan)
    return values if column["width"] == 1 else values.reshape(-1, column["width"])


def points(svg: str) -> list[tuple[float, float]]:
    """Points of a chart, in pixels."""
    return [(float(x), float(y)) for x, y in re.findall(r"M([\d.]+) ([\d.]+)h0", svg)]
