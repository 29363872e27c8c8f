"""What a batch must never do: write over an input, leave its folder, lose somebody's work, or stop for odd files."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import IO, Any

import pytest

from postproc.diagnostics import PostprocError
from tests.cli.conftest import Call, call, call_as_written

from .folders import convert, statuses, tree, write

__all__ = ["call", "call_as_written"]
DATA = "MODULE {}\n  PERS num n:=1;\nENDMODULE\n"


def data(*names: str) -> dict[str, str | bytes]:
    return {name: DATA.format(Path(name).stem) for name in names}


def kept(out: Path) -> list[str]:
    """What was put aside, by its path in the tree."""
    aside = out / ".postproc" / "edited"
    return sorted(Path(*p.relative_to(aside).parts[1:]).as_posix() for p in aside.rglob("*") if p.is_file())


def test_a_report_is_never_written_over_an_input_or_an_output(call: Call, tmp_path: Path) -> None:
    source = write(tmp_path / "in", {**data("a.mod", "sub/b.mod"), "note.txt": "text"})
    (tmp_path / "link").symlink_to(source)
    before = tree(source)
    for report in ("in/a.mod", "in/sub/b.mod", "in/note.txt", "link/a.mod", "out/a.mod", "out/note.txt"):
        found = call("batch", source, "-o", tmp_path / "out", "--report", tmp_path / report, "--workers", "1")
        assert found.code == 2 and "error[CLI007]" in found.err, report
        assert tree(source) == before and not (tmp_path / "out").exists()


@pytest.mark.parametrize("pattern", ["../a.mod", "{root}/a.mod", "sub/../../a.mod", "", "/", "**/../*.mod", "a\\u0000"])
def test_files_of_a_job_stand_below_the_jobs_file(call: Call, tmp_path: Path, pattern: str) -> None:
    write(tmp_path, {**data("a.mod"), "jobs/sub/x.mod": DATA.format("x")})
    jobs = tmp_path / "jobs" / "jobs.toml"
    jobs.write_text(f'[[job]]\nname = "t"\nfiles = ["{pattern.format(root=tmp_path)}"]\n')
    before = tree(tmp_path)
    found = call("batch", jobs, "-o", tmp_path / "jobs" / "out", "--workers", "1")
    assert found.code == 2 and "error[BAT009]: " in found.err and f" --> {jobs}:3:" in found.err
    assert tree(tmp_path) == before


def test_patterns_leave_out_the_outputs(tmp_path: Path) -> None:
    jobs = write(tmp_path, {**data("a.mod"), "jobs.toml": '[[job]]\nname = "t"\nfiles = ["**/*.mod"]\n'}) / "jobs.toml"
    for _ in range(2):
        batch, _ = convert(jobs, tmp_path / "out")
        assert [o.task.files for o in batch.outcomes] == [("a.mod",)]
    assert set(tree(tmp_path / "out", without=[".postproc"])) == {"a.mod"}


def test_links_in_the_output_folder_lead_nowhere_else(tmp_path: Path) -> None:
    source = write(tmp_path / "in", {**data("sub/a.mod"), "sub/n.txt": "text"})
    mine = write(tmp_path / "mine", {"a.mod": "mine", "n.txt": "mine"})
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "sub").symlink_to(mine)
    with pytest.raises(PostprocError, match="BAT015"):
        convert(source, tmp_path / "out")
    (tmp_path / "out" / "sub").unlink()
    (tmp_path / "out" / ".postproc").symlink_to(mine)
    with pytest.raises(PostprocError, match="BAT015"):
        convert(source, tmp_path / "out")
    (tmp_path / "out" / ".postproc").unlink()
    convert(source, tmp_path / "out")
    for path in (tmp_path / "out" / "sub").iterdir():
        path.unlink()
    (tmp_path / "out" / "sub").rmdir()
    (tmp_path / "out" / "sub").symlink_to(mine)
    (mine / "n.txt").write_text("text")  # as the batch wrote it, but not in its folder
    write(source, data("b.mod"))
    (source / "sub" / "a.mod").unlink()
    (source / "sub" / "n.txt").unlink()
    convert(source, tmp_path / "out")
    assert sorted(p.name for p in mine.iterdir()) == ["a.mod", "n.txt"]


def test_a_folder_that_cannot_be_read_is_not_gone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    source = write(tmp_path / "in", {**data("a.mod", "locked/b.mod"), "locked/n.txt": "text"})
    convert(source, tmp_path / "out")
    before = tree(tmp_path / "out")
    true_scandir, true_listdir, true_stat = os.scandir, os.listdir, Path.stat

    def refuse(path: object) -> None:
        if str(path).startswith(str(source / "locked")):
            raise PermissionError(13, "Permission denied", str(path))

    def scandir(path: str = ".") -> object:
        refuse(path)
        return true_scandir(path)

    def listdir(path: str = ".") -> object:
        refuse(path)
        return true_listdir(path)

    with monkeypatch.context() as locked:
        locked.setattr(os, "scandir", scandir)
        locked.setattr(os, "listdir", listdir)
        with pytest.raises(PostprocError, match="BAT002"):
            convert(source, tmp_path / "out")
        assert tree(tmp_path / "out") == before

    def stat(self: Path, *, follow_symlinks: bool = True) -> os.stat_result:
        if self != source / "locked":
            refuse(self)
        return true_stat(self, follow_symlinks=follow_symlinks)

    monkeypatch.setattr(Path, "stat", stat)  # chmod 444: its names can be read, and nothing about them
    with pytest.raises(PostprocError, match="BAT002"):
        convert(source, tmp_path / "out")
    assert tree(tmp_path / "out") == before


def test_what_was_made_of_a_file_that_cannot_be_read_stays(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    source = write(tmp_path / "in", {**data("a.mod", "b.mod"), "n.txt": "text"})
    convert(source, tmp_path / "out")
    before = tree(tmp_path / "out")

    def opened(name: Path | str, *mode: str) -> IO[Any]:
        if Path(name).parent == source and Path(name).name != "a.mod":
            raise PermissionError(13, "Permission denied")
        return open(name, *mode)

    with monkeypatch.context() as locked:
        locked.setattr("postproc.files.open", opened, raising=False)
        batch, _ = convert(source, tmp_path / "out")
        assert statuses(batch) == {"a.mod": "unchanged", "b.mod": "failed"} and batch.failed
    assert tree(tmp_path / "out") == before
    again, _ = convert(source, tmp_path / "out")
    assert all(o.cached for o in again.outcomes) and tree(tmp_path / "out") == before


def test_copied_files_that_somebody_edited_are_put_aside(tmp_path: Path) -> None:
    source, out = write(tmp_path / "in", {**data("a.mod"), "sub/n.txt": "text"}), tmp_path / "out"
    convert(source, out)
    (out / "sub/n.txt").write_text("mine")
    batch, _ = convert(source, out)
    assert kept(out) == ["sub/n.txt"] and (out / "sub/n.txt").read_text() == "text"
    assert [f.code for f in batch.findings] == ["BAT016"] and not batch.failed and batch.copied == 1


def test_an_edited_output_with_the_longest_name_is_put_aside(tmp_path: Path) -> None:
    name = "n" * 251 + ".mod"
    source, out = write(tmp_path / "in", data(name, "b.mod")), tmp_path / "out"
    convert(source, out)
    (out / name).write_text("mine")
    batch, _ = convert(source, out)
    assert statuses(batch) == {name: "unchanged", "b.mod": "unchanged"} and kept(out) == [name]


def test_a_path_that_becomes_a_folder_or_a_file_stops_nobody(tmp_path: Path) -> None:
    source, out = write(tmp_path / "in", {**data("p.mod"), "c": "copied"}), tmp_path / "out"
    convert(source, out)
    (source / "p.mod").unlink()
    (source / "c").unlink()
    write(source, {**data("p.mod/q.mod"), "c/deep/er.txt": "copied"})
    assert not convert(source, out)[0].failed
    assert set(tree(out, without=[".postproc"])) == {"p.mod/q.mod", "c/deep/er.txt"} and kept(out) == []
    write(out, {"c/mine.txt": "mine"})
    for name in ("p.mod/q.mod", "c/deep/er.txt"):
        (source / name).unlink()
    for name in ("p.mod", "c/deep", "c"):
        (source / name).rmdir()
    write(source, {**data("p.mod"), "c": "copied"})
    batch, _ = convert(source, out)
    assert not batch.failed and "BAT016" in [f.code for f in batch.findings]
    assert set(tree(out, without=[".postproc"])) == {"p.mod", "c"} and kept(out) == ["c/mine.txt"]


def record(content: object) -> bytes:
    """The bytes of a record's file, as a batch writes them."""
    return json.dumps(content).encode()


def test_a_record_is_data_that_anybody_may_have_changed(tmp_path: Path) -> None:
    source, out = write(tmp_path / "in", data("a.mod")), tmp_path / "out"
    convert(source, out)
    (place,) = (path for path in (out / ".postproc").glob("*.json") if not path.name.startswith("copies"))
    good = json.loads(place.read_bytes())
    victim = write(tmp_path, {"victim.txt": "victim"}) / "victim.txt"
    hash_ = tree(tmp_path)["victim.txt"]
    odd: list[object] = [
        *(
            {**good, "name": "gone.mod", "outputs": {path: hash_}}
            for path in ("../victim.txt", str(victim), "x/../../y")
        ),
        {**good, "name": "gone.mod", "outputs": {".postproc/all.lock": hash_}},
        *({**good, "outputs": outputs} for outputs in ({"a.mod": 7}, {"a.mod": []}, ["a.mod"], None)),
        *({**good, "findings": findings} for findings in ({"code": "RAP001"}, ["RAP001"], [{"code": "RAP001"}], 7)),
        *({key: value for key, value in good.items() if key != missing} for missing in good),
        *({**good, "matter": 3}, [1, 2], None, "text", 7),
    ]
    texts = [record(content) for content in odd] + [b"0" * 64 + b"\n" + record(good), b"", b"[" * 100_000, b"\xff"]
    write(out / ".postproc", {f"{i}.json": text for i, text in enumerate(texts)})
    for text in texts:
        place.write_bytes(text)
        batch, _ = convert(source, out)
        assert statuses(batch) == {"a.mod": "unchanged"} and not batch.failed
        assert victim.read_text() == "victim" and (out / ".postproc/all.lock").is_file()
    again, _ = convert(source, out)
    assert all(o.cached for o in again.outcomes)


def test_names_that_are_not_unicode_are_told_everywhere(call: Call, tmp_path: Path) -> None:
    name = os.fsdecode(b"w\xe9ld.mod")
    source = write(tmp_path / "in", {name: DATA.format("weld"), os.fsdecode(b"n\xff.txt"): "text"})
    page = tmp_path / "page.html"
    found = call("batch", source, "-o", tmp_path / "out", "--workers", "1", "--report", page, "--json")
    assert found.code == 0, found.err
    assert json.loads(found.out)["tasks"][0]["name"] == name and "w?ld.mod" in page.read_text("utf-8")
    assert (tmp_path / "out" / name).is_file()


def test_control_characters_of_names_and_programs_stay_off_the_terminal(call: Call, tmp_path: Path) -> None:
    name = "a\x1b]52;c;aGk=\x07\x9b\u202e\n[9] ok.mod"
    source = write(tmp_path / "in", {name: "MODULE \x1b[2Jm\n x\u202ey\nENDMODULE\n".encode(), f"{name}.txt": "text"})
    (source / f"{name}.txt").chmod(0)
    for words in (
        ("batch", source, "-o", tmp_path / "out", "--workers", "1"),
        ("compensate", source / name),
        ("inspect", source / name),
    ):
        found = call(*words)
        assert r"\x1b]52;c;aGk=\x07\x9b\u202e\n[9] ok.mod" in found.err
        for text in (found.out, found.err):
            assert not set(text) & set("\x1b\x07\x9b\u202e"), words


@pytest.mark.parametrize("name", ["0.json", "edited", "deep/link", "edited/0"])
def test_nothing_is_written_through_a_link_where_the_state_is_kept(tmp_path: Path, name: str) -> None:
    source = write(tmp_path / "in", data("a.mod"))
    convert(source, tmp_path / "out")
    planted = tmp_path / "out" / ".postproc" / name
    planted.parent.mkdir(exist_ok=True)
    planted.unlink(missing_ok=True)
    planted.symlink_to(tmp_path / "out" / "a.mod" if name.endswith("n") else tmp_path)
    before = tree(tmp_path)
    with pytest.raises(PostprocError, match="BAT015"):
        convert(source, tmp_path / "out")
    assert tree(tmp_path) == before


def test_a_report_does_not_replace_the_state_of_a_batch(call: Call, tmp_path: Path) -> None:
    source = write(tmp_path / "in", data("a.mod"))
    convert(source, tmp_path / "out")
    before = tree(tmp_path)
    for name in ("copies-all.json", "new.html"):
        place = tmp_path / "out" / ".postproc" / name
        found = call("batch", source, "-o", tmp_path / "out", "--report", place, "--workers", "1")
        assert found.code == 2 and "error[CLI007]" in found.err
        assert tree(tmp_path) == before
