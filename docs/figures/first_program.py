"""The picture of the first tutorial: the seam as programmed, uncompensated and compensated."""

from __future__ import annotations

import runpy
from pathlib import Path


def draw(_work: Path, folder: Path) -> None:
    """The picture of the README, drawn anew."""
    seam = runpy.run_path(str(Path(__file__).parent / "draw_seam.py"))["draw"]()
    (folder / "seam.svg").write_text(seam, encoding="utf-8")
