"""Files that ship with the package are found in a checkout and in an installed wheel."""

from __future__ import annotations

from pathlib import Path

import pytest

import postproc.files
from postproc.files import resource

ROOT = Path(__file__).resolve().parent.parent


def test_a_checkout_uses_the_folders_beside_the_package() -> None:
    assert resource("templates") == ROOT / "templates"
    assert resource("docs", "diagnostics", "CLI.md").is_file()
    assert resource("samples", "hull_seam.mod").is_file()


def test_a_wheel_carries_the_folders_inside_the_package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    package = tmp_path / "site-packages" / "postproc"
    (package / "templates").mkdir(parents=True)
    monkeypatch.setattr(postproc.files, "__file__", str(package / "resources.py"))
    assert resource("templates", "header.j2") == package / "templates" / "header.j2"
