"""Options that write pages: whole files, never over an input, with the same figures as the terminal."""

from __future__ import annotations

import json
from pathlib import Path

from tests.cli.conftest import Call
from tests.report.conftest import carried


def test_a_program_gets_its_page_and_its_certificate(call: Call, samples: Path, tmp_path: Path) -> None:
    page, certificate = tmp_path / "page.html", tmp_path / "certificate.html"
    done = call(
        "compensate",
        samples / "hull_seam.mod",
        "-o",
        tmp_path / "out.mod",
        "--report",
        page,
        "--certificate",
        certificate,
    )
    assert done.code == 0
    assert carried(page.read_text("utf-8"))["welds"][0]["name"] == "rShellSeam"
    assert "The tolerance is kept in the model" in certificate.read_text("utf-8")
    over = call(
        "compensate", samples / "hull_seam.mod", "-o", tmp_path / "o.mod", "--certificate", samples / "hull_seam.mod"
    )
    assert over.code and (samples / "hull_seam.mod").read_bytes().startswith(b"%%%")


def test_a_seam_gets_them_too(call: Call, samples: Path, tmp_path: Path) -> None:
    page, certificate = tmp_path / "page.html", tmp_path / "certificate.html"
    given = ("--with", samples / "cell_data.sys", "--tool", "tTorch", "--wobj", "wobjShell")
    done = call(
        "seam",
        samples / "seam.csv",
        *given,
        "-o",
        tmp_path / "Seam.mod",
        "--report",
        page,
        "--certificate",
        certificate,
    )
    assert done.code == 0, done.err
    assert "PROC main()" in page.read_text("utf-8") and "name, date, signature" in certificate.read_text("utf-8")


def test_what_differs_is_a_page(call: Call, samples: Path, tmp_path: Path) -> None:
    out, page = tmp_path / "out.mod", tmp_path / "diff.html"
    call("compensate", samples / "hull_seam.mod", "-o", out)
    done = call("diff", samples / "hull_seam.mod", out, "--report", page, "--json")
    document = json.loads(done.out)
    shown = carried(page.read_text("utf-8"))
    assert shown["differences"] == document["differences"] and len(shown["differences"]) == 13
    first = shown["differences"][0]
    assert sum(x**2 for x in first["shift_mm"]) ** 0.5 - first["distance_mm"] < 1e-9


def test_an_arm_gets_a_certificate(call: Call, samples: Path, tmp_path: Path) -> None:
    certificate = tmp_path / "certificate.html"
    table = samples / "measurements" / "simulated_backlash.csv"
    done = call("compare", samples / "models" / "irb4600_60_205.toml", table, "--certificate", certificate)
    assert done.code == 0
    assert "ISO 9283 pose repeatability RP, largest" in certificate.read_text("utf-8")
