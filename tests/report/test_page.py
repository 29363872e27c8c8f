"""Pages stand alone, say the main thing first and carry their document."""

from __future__ import annotations

import builtins
import json
import re
from typing import Any

import numpy as np
import pytest

from postproc.report.compensation import compensation_page
from postproc.report.figures import residual_vectors
from postproc.report.page import Section, render_page, table
from postproc.report.svg import bars, scatter

DOCUMENT: dict[str, Any] = {
    "schema": "postproc/compensate/1",
    "statements": [
        {
            "line": 12,
            "routine": "rSeam<1>",
            "status": "compensated",
            "reason": None,
            "shift_mm": 0.41,
            "residual_mm": 0.0008,
        },
        {
            "line": 14,
            "routine": "rSeam<1>",
            "status": "skipped",
            "reason": "loop </script> index",
            "shift_mm": None,
            "residual_mm": float("nan"),
        },
    ],
    "max_error_before_mm": 1.5,
    "max_error_after_mm": 0.004,
    "added_targets": 3,
    "cycle_time_s": 12.5,
    "diagnostics": [],
}


def embedded(page: str) -> Any:
    found = re.search(r'<script type="application/json" id="document">(.*?)</script>', page, re.DOTALL)
    assert found
    return json.loads(found[1])


def test_compensation_page() -> None:
    page = compensation_page("a<b>.mod", DOCUMENT)
    assert "falls from 1.50 mm to 0.004 mm" in page
    assert "a&lt;b&gt;.mod" in page
    assert "rSeam<1>" not in page.split('id="document"')[0]
    assert "loop &lt;/script&gt; index" in page
    document = embedded(page)
    assert document["statements"][1]["reason"] == "loop </script> index"
    assert document["statements"][1]["residual_mm"] is None


def test_pages_load_nothing_from_elsewhere() -> None:
    html, _ = residual_vectors(np.random.default_rng(0).normal(size=(50, 3)), np.full((50, 3), 1e-4))
    page = render_page("t", "s", [Section("a", html)], {})
    assert "plotly-graph-div" in page
    assert len(page) > 3e6
    own = page.replace(page[page.index("<script>") : page.index("</script>")], "")
    assert not re.search(r"""(src|href)\s*=\s*["']""", own)
    plain = render_page("t", "s", [Section("a", scatter(np.arange(5.0), np.arange(5.0), "x", "y", 1.0))], {})
    assert len(plain) < 1e4


def test_vectors_are_drawn_without_plotly(monkeypatch: pytest.MonkeyPatch) -> None:
    original = builtins.__import__

    def without(name: str, *rest: Any) -> Any:
        if name.startswith("plotly"):
            raise ImportError(name)
        return original(name, *rest)

    monkeypatch.setattr(builtins, "__import__", without)
    html, times = residual_vectors(np.eye(3), np.full((3, 3), 1e-3))
    assert html.count("<svg") == 2
    assert times == pytest.approx(0.12 / (np.sqrt(3) * 1e-3), rel=0.1)
    assert residual_vectors(np.full((2, 3), np.nan), np.zeros((2, 3))) == ("", 1.0)


def test_charts_place_points_and_band() -> None:
    svg = scatter(np.array([0.0, 1.0, np.nan]), np.array([2.0, -2.0, 5.0]), "q1 [deg]", "error", band=1.0)
    circles = [(float(x), float(y)) for x, y in re.findall(r'<circle cx="([\d.]+)" cy="([\d.]+)"', svg)]
    assert len(circles) == 2
    assert circles[0][0] < circles[1][0]
    assert circles[0][1] < circles[1][1]  # larger is higher up
    assert "<rect" in svg
    assert scatter(np.array([np.nan]), np.array([1.0]), "x", "y") == ""
    widths = [float(w) for w in re.findall(r'width="([\d.]+)" height="18"', bars(["a", "b"], [1.0, 0.5], "mm", 0.1))]
    assert widths[1] == pytest.approx(widths[0] / 2, abs=0.1)


def test_tables_escape_and_align() -> None:
    html = table(("name", "value"), [("<x>", 1.23456), ("y", None)])
    assert "&lt;x&gt;" in html
    assert '<td class="number">1.235</td>' in html
    assert table(("name",), []) == "<table><tr><th>name</th></tr></table>"
