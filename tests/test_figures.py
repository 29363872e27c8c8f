"""Pictures of the pages are drawn by the scripts beside them, and say what the package says today."""

from __future__ import annotations

import re
import runpy
from pathlib import Path

FIGURES = Path(__file__).resolve().parent.parent / "docs" / "figures"


def test_the_seam_of_the_readme() -> None:
    draw = runpy.run_path(str(FIGURES / "draw_seam.py"))["draw"]
    said = re.compile(r"<text[^>]*>([^<]*)</text>")
    assert said.findall(draw()) == said.findall((FIGURES / "seam.svg").read_text("utf-8"))
