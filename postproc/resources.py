"""Where the files that come with the package are: templates, samples, pages of the documentation."""

from __future__ import annotations

import re
from pathlib import Path

SECTION = re.compile(r"^## ([A-Z]{3}\d{3})\b.*?(?=^## |\Z)", re.MULTILINE | re.DOTALL)


def resource(*parts: str) -> Path:
    """Path of a file or folder that ships with the package, such as ``resource("templates", "module.j2")``.

    A wheel carries these folders inside the package. In a checkout (also when installed with ``pip install -e``, which
    leaves a stale copy in site-packages that must not be read) they stand beside it.
    """
    package = Path(__file__).resolve().parent
    packaged = package.joinpath(parts[0])
    root = package if packaged.is_dir() else package.parent
    return root.joinpath(*parts)


def explanations() -> dict[str, str]:
    """Every diagnostic's section of ``docs/diagnostics``, by code."""
    pages = sorted(resource("docs", "diagnostics").glob("*.md"))
    return {found[1]: found[0].strip() for page in pages for found in SECTION.finditer(page.read_text("utf-8"))}
