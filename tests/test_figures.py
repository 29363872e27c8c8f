"""Pictures of the pages are drawn by the scripts beside them, and say what the package says today."""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path

FIGURES = Path(__file__).resolve().parent.parent / "docs" / "figures"


def test_the_seam_of_the_readme() -> None:
    spec = importlib.util.spec_from_file_location("draw_seam", FIGURES / "draw_seam.py")
    assert spec is not None and spec.loader is not None
    script = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)
    said = re.compile(r"<text[^>]*>([^<]*)</text>")
    assert said.findall(script.draw()) == said.findall((FIGURES / "seam.svg").read_text("utf-8"))
