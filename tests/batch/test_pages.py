"""With a report every program has a page in the output tree: an output like any other."""

from __future__ import annotations

from pathlib import Path

import pytest

from postproc.batch.jobs import get_ready
from postproc.batch.run import run_batch
from postproc.batch.values import Batch, Shard
from postproc.diagnostics import PostprocError
from tests.batch.folders import ARM, HERE, cached, planned, programs, write


def convert(source: Path, out: Path, report: Path | None) -> Batch:
    return run_batch(get_ready(planned(source, out), Shard(), out, report), HERE, lambda outcome: None)


def test_pages_come_with_a_report_and_go_with_their_programs(tmp_path: Path) -> None:
    source, out, report = programs(tmp_path / "in", 2), tmp_path / "out", tmp_path / "page.html"
    plain = convert(source, out, None)
    assert not list(out.rglob("*.html")) and [o.page for o in plain.outcomes] == [None, None]
    first = convert(source, out, report)
    assert not cached(first)  # each lacked its page
    pages = {o.task.name: o.page for o in first.outcomes}
    assert pages == {name: f"report/{name}.html" for name in ("line0/Seam0.mod", "line1/Seam1.mod")}
    text = (out / "report/line0/Seam0.mod.html").read_text("utf-8")
    assert "postproc compensate line0/Seam0.mod" in text and "MODULE Seam0" in text
    assert cached(convert(source, out, report)) == set(pages)
    assert cached(convert(source, out, None)) == set(pages)  # who wants no pages need not convert again
    (source / "line0/Seam0.mod").unlink()
    convert(source, out, report)
    assert [p.name for p in out.rglob("*.html")] == ["Seam1.mod.html"]


def test_a_page_never_overwrites_an_input(tmp_path: Path) -> None:
    mine = "out/report/line0/Seam0.mod.html"
    jobs = f'[[job]]\nfiles = ["line0/Seam0.mod"]\nrobot = "{ARM}"\nwith = ["{mine}"]\n'
    source = write(programs(tmp_path / "in", 1), {mine: "MODULE Mine\nENDMODULE\n", "jobs.toml": jobs})
    convert(source / "jobs.toml", source / "out", None)
    with pytest.raises(PostprocError) as refused:
        convert(source / "jobs.toml", source / "out", tmp_path / "page.html")
    assert refused.value.diagnostics[0].code == "BAT015" and "is the input" in refused.value.diagnostics[0].message
    assert (source / mine).read_text().startswith("MODULE Mine")
