"""What a batch must never do: write over an input, leave its folder, lose somebody's work, or stop for odd files."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import IO, Any

import pytest

import postproc.files
from tests.cli.conftest import Call, call, call_as_written

from .build import Work, module, tree, write

__all__ = ["call", "call_as_written"]


def data(*names: str) -> dict[str, str | bytes]:
    """Modules in which nothing moves."""
    return {name: module(Path(name).stem, "PERS num n:=1;") for name in names}


@pytest.mark.parametrize("old", [False, True])
def test_a_report_is_never_written_over_an_input_an_output_or_the_state(call: Call, work: Work, old: bool) -> None:
    work.write({**data("a.mod", "sub/b.mod"), "note.txt": "text"})
    (work.root / "link").symlink_to(work.source)
    if old:
        work.convert()
    before = tree(work.root)
    places = ["in/a.mod", "in/sub/b.mod", "in/note.txt", "link/a.mod", "out/a.mod", "out/note.txt"]
    for report in (*places, "out/.postproc/copies-all.json", "out/.postproc/new.html"):
        outcome = call("batch", work.source, "-o", work.out, "--report", work.root / report, "--workers", "1")
        assert outcome.code == 2 and "error[CLI007]" in outcome.err, report
        assert tree(work.root) == before and work.out.exists() == old


@pytest.mark.parametrize("name", ["sub", ".postproc", ".postproc/0.json", ".postproc/edited", ".postproc/edited/0"])
def test_nothing_is_written_through_a_link_in_the_output_folder(work: Work, name: str) -> None:
    work.write({**data("sub/a.mod"), "sub/n.txt": "text"})
    write(work.root, {"mine/a.mod": "mine", "mine/n.txt": "mine"})
    if name.startswith(".postproc/"):
        work.convert()
    (work.out / name).parent.mkdir(parents=True, exist_ok=True)
    (work.out / name).symlink_to(work.root / "mine")
    before = tree(work.root)
    assert work.refusal().code == "BAT015"
    assert tree(work.root) == before


def test_nothing_is_deleted_through_a_link_in_the_output_folder(work: Work) -> None:
    work.write({**data("sub/a.mod"), "sub/n.txt": "text"})
    work.convert()
    shutil.copytree(work.out / "sub", work.root / "mine")  # as the batch wrote it, but not in its folder
    shutil.rmtree(work.out / "sub")
    (work.out / "sub").symlink_to(work.root / "mine")
    work.write(data("b.mod"))
    work.remove("sub/a.mod", "sub/n.txt")
    work.convert()
    assert sorted(p.name for p in (work.root / "mine").iterdir()) == ["a.mod", "n.txt"]


def locked(monkeypatch: pytest.MonkeyPatch, owner: object, name: str, refuses: Callable[[Path], bool]) -> None:
    """Let a function of the system refuse some paths, as it does for who has no rights (root has all)."""
    true = getattr(owner, name, open)

    def function(path: Path | str = ".", *arguments: Any, **named: Any) -> IO[Any]:
        if refuses(Path(path)):
            raise PermissionError(13, "Permission denied", str(path))
        return true(path, *arguments, **named)

    monkeypatch.setattr(owner, name, function, raising=False)


@pytest.mark.parametrize("rights", ["no names", "names alone"])  # chmod 000 and 444
def test_a_folder_that_cannot_be_read_is_not_gone(work: Work, monkeypatch: pytest.MonkeyPatch, rights: str) -> None:
    folder = work.write({**data("a.mod", "locked/b.mod"), "locked/n.txt": "text"}) / "locked"
    work.convert()
    before = tree(work.out)
    with monkeypatch.context() as patch:
        if rights == "names alone":
            locked(patch, Path, "stat", lambda path: folder in path.parents)
        else:
            for name in ("scandir", "listdir"):
                locked(patch, os, name, lambda path: path.is_relative_to(folder))
        assert work.refusal().code == "BAT002"
    assert tree(work.out) == before


def test_what_was_made_of_a_file_that_cannot_be_read_stays(work: Work, monkeypatch: pytest.MonkeyPatch) -> None:
    work.write({**data("a.mod", "b.mod"), "n.txt": "text"})
    work.convert()
    before = tree(work.out)
    with monkeypatch.context() as patch:
        locked(patch, postproc.files, "open", lambda path: path.parent == work.source and path.name != "a.mod")
        made = work.convert()
    assert made.statuses == {"a.mod": "unchanged", "b.mod": "failed"} and made.batch.failed
    assert tree(work.out) == before
    assert work.convert().cached == {"a.mod", "b.mod"} and tree(work.out) == before


def test_files_that_somebody_edited_are_put_aside_also_copies_and_those_with_the_longest_name(work: Work) -> None:
    name = "n" * 251 + ".mod"
    work.write({**data(name), "sub/n.txt": "text"})
    work.convert()
    write(work.out, {name: "mine", "sub/n.txt": "mine"})
    made = work.convert()
    assert work.edited() == [name, "sub/n.txt"] and (work.out / "sub/n.txt").read_text() == "text"
    assert made.codes(name) == [f.code for f in made.batch.findings] == ["BAT016"]
    assert made.statuses == {name: "unchanged"} and not made.batch.failed and made.batch.copied == 1


def test_a_path_that_becomes_a_folder_or_a_file_stops_nobody(work: Work) -> None:
    work.write({**data("p.mod"), "c": "copied"})
    work.convert()
    work.remove("p.mod", "c")
    work.write({**data("p.mod/q.mod"), "c/deep/er.txt": "copied"})
    assert not work.convert().batch.failed
    assert set(work.outputs()) == {"p.mod/q.mod", "c/deep/er.txt"} and work.edited() == []
    write(work.out, {"c/mine.txt": "mine"})
    work.remove("p.mod/q.mod", "c/deep/er.txt", "p.mod", "c/deep", "c")
    work.write({**data("p.mod"), "c": "copied"})
    batch = work.convert().batch
    assert not batch.failed and "BAT016" in [f.code for f in batch.findings]
    assert set(work.outputs()) == {"p.mod", "c"} and work.edited() == ["c/mine.txt"]


def test_a_record_is_data_that_anybody_may_have_changed(work: Work) -> None:
    work.write(data("a.mod"))
    work.convert()
    (place,) = (path for path in (work.out / ".postproc").glob("*.json") if not path.name.startswith("copies"))
    good = json.loads(place.read_bytes())
    victim = write(work.root, {"victim.txt": "victim"}) / "victim.txt"
    hash_ = tree(work.root)["victim.txt"]
    away = ("../victim.txt", str(victim), "x/../../y", ".postproc/all.lock")
    odd: list[object] = [
        *({**good, "name": "gone.mod", "outputs": {path: hash_}} for path in away),
        *({**good, "outputs": value} for value in ({"a.mod": 7}, {"a.mod": []}, ["a.mod"], None)),
        *({**good, "findings": value} for value in ({"code": "RAP001"}, ["RAP001"], [{"code": "RAP001"}], 7)),
        *({key: value for key, value in good.items() if key != missing} for missing in good),
        *({**good, "matter": 3}, [1, 2], None, "text", 7),
    ]
    texts = [json.dumps(content).encode() for content in odd]
    texts += [b"0" * 64 + b"\n" + json.dumps(good).encode(), b"", b"[" * 100_000, b"\xff"]
    write(work.out / ".postproc", {f"{i}.json": text for i, text in enumerate(texts)})
    for text in texts:
        place.write_bytes(text)
        made = work.convert()
        assert made.statuses == {"a.mod": "unchanged"} and not made.batch.failed
        assert victim.read_text() == "victim" and (work.out / ".postproc/all.lock").is_file()
    assert work.convert().cached == {"a.mod"}


def test_names_that_are_not_unicode_are_told_everywhere(call: Call, work: Work) -> None:
    name, page = os.fsdecode(b"w\xe9ld.mod"), work.root / "page.html"
    work.write({name: module("weld"), os.fsdecode(b"n\xff.txt"): "text"})
    outcome = call("batch", work.source, "-o", work.out, "--workers", "1", "--report", page, "--json")
    assert outcome.code == 0, outcome.err
    assert json.loads(outcome.out)["tasks"][0]["name"] == name and "w?ld.mod" in page.read_text("utf-8")
    assert (work.out / name).is_file()


def test_control_characters_of_names_and_programs_stay_off_the_terminal(call: Call, work: Work) -> None:
    name = "a\x1b]52;c;aGk=\x07\x9b\u202e\n[9] ok.mod"
    work.write({name: "MODULE \x1b[2Jm\n x\u202ey\nENDMODULE\n".encode(), f"{name}.txt": "text"})
    (work.source / f"{name}.txt").chmod(0)
    batch: tuple[str | Path, ...] = ("batch", work.source, "-o", work.out, "--workers", "1")
    for words in (batch, ("compensate", work.source / name), ("inspect", work.source / name)):
        outcome = call(*words)
        assert r"\x1b]52;c;aGk=\x07\x9b\u202e\n[9] ok.mod" in outcome.err
        assert not set(outcome.out + outcome.err) & set("\x1b\x07\x9b\u202e"), words
