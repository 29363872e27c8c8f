r"""Commands as a user types them, and what they must say: ``transcripts/*.txt``.

A file is made of stories; each has an empty folder of its own in which ``samples`` is that of the repository and ``arms``
holds the files of the library::

    # what the story shows
    file NAME                    a file with the lines that follow behind `| `
    file NAME is SAMPLE          a copy; lines `  s|old|new` change its first `old`
    file NAME = b"..."           a file with these bytes
    file NAME program A          a short welding program; `track 1500 2700 2300`: one on a track that stands there
    link NAME PLACE, pipe NAME   a link to a place, a pipe
    backup FOLDER                the backup of a controller that drives an IRB 4600-60/2.05
    $ compensate a.mod           a command, ``ARM`` stands for ``--robot irb4600_60_205``; `< FILE` at its end is stdin
      2                          its exit code; where it is 2, no file is written and nothing goes to stdout
      err TEXT, out TEXT         what stderr and stdout hold; `no err TEXT`: what they do not; `first TEXT`: the first line;
                                 `next TEXT`: the lines of stderr that name a next command, one after another;
                                 `like PATTERN`: what stdout matches
      json EXPRESSION            that holds of the document ``d`` on stdout, and of the documents `before` it in the story
      that EXPRESSION            that holds of the texts ``out`` and ``err``
      has NAME TEXT, none NAME, kept NAME      what a file holds, that there is none, that it is as before the command
      same NAME                  stdout is what a file holds
      names FOLDER NAME ..       all that a folder holds
    $ compensate a.mod -> 2 TEXT               the exit code and what stderr holds
"""

from __future__ import annotations

import ast
import io
import json
import os
import re
import shlex
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from postproc.identification.planning import promise
from tests.batch.build import backup, program
from tests.cells.test_paths import track
from tests.conftest import ROOT

from .conftest import ARM, Call, Outcome


@dataclass(frozen=True)
class Story:
    place: str
    lines: tuple[str, ...]


def stories() -> Iterator[Story]:
    for path in sorted(Path(__file__).with_name("transcripts").glob("*.txt")):
        rows = path.read_text("utf-8").splitlines()
        starts = [i for i, row in enumerate(rows) if row.startswith("# ")]
        for i, end in zip(starts, [*starts[1:], len(rows)], strict=True):
            yield Story(f"{path.stem}:{i + 1}", tuple(rows[i + 1 : end]))


def write_file(words: str) -> Path:
    """A file of the story as its first line gives it."""
    name, _, how = words.partition(" ")
    path = Path(name)
    path.parent.mkdir(parents=True, exist_ok=True)
    if how.startswith("= "):
        path.write_bytes(ast.literal_eval(how[2:]))
    elif how.startswith("is "):
        path.write_bytes(Path(how[3:]).read_bytes())
    else:
        kind, *words = how.split() or [""]
        made = {"": lambda: "", "program": program, "track": lambda *extax: track(*map(float, extax)).text}
        path.write_text(made[kind](*words))
    return path


def contents() -> dict[str, bytes]:
    return {str(p): p.read_bytes() for p in Path().rglob("*") if p.is_file() and not {"samples", "arms"} & {*p.parts}}


def check(line: str, outcome: Outcome, before: dict[str, bytes], documents: list[Any]) -> None:
    kind, _, text = line.strip().partition(" ")
    text = text.replace("{TMP}", str(Path.cwd()))
    if kind.isdigit():
        assert outcome.code == int(kind), outcome.err
    elif kind in ("err", "out"):
        assert text in getattr(outcome, kind)
    elif kind == "no":
        stream, _, absent = text.partition(" ")
        assert absent not in getattr(outcome, stream)
    elif kind == "like":
        assert re.search(text, outcome.out)
    elif kind == "first":
        assert outcome.err.splitlines()[0] == text
    elif kind == "json":
        known = {"d": json.loads(outcome.out), "before": documents, "near": pytest.approx, "is_file": os.path.isfile}
        assert eval(text, known), text
    elif kind == "that":
        assert eval(text, {"out": outcome.out, "err": outcome.err}), text
    elif kind == "same":
        assert outcome.out == Path(text).read_bytes().decode()
    elif kind == "next":
        commands = [row.partition("`")[2].partition("`")[0] for row in outcome.err.splitlines() if ": `postproc" in row]
        assert text in commands, commands
    elif kind == "names":
        folder, *names = text.split()
        assert sorted(path.name for path in Path(folder).iterdir()) == names
    elif kind == "has":
        name, _, words = text.partition(" ")
        assert words in Path(name).read_text("latin-1")
    elif kind == "none":
        assert not Path(text).exists()
    else:
        assert kind == "kept", line
        assert Path(text).read_bytes() == before[text]


def make(line: str) -> Path:
    """What a line of a story puts into its folder."""
    kind, _, words = line.partition(" ")
    if kind == "file":
        return write_file(words)
    if kind == "backup":
        return backup(Path(words))
    name, _, place = words.partition(" ")
    os.mkfifo(name) if kind == "pipe" else Path(name).symlink_to(place)
    return Path(name)


@pytest.mark.parametrize("story", list(stories()), ids=lambda story: story.place)
def test_a_command_does_what_its_transcript_says(
    story: Story, call_as_written: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(promise, "TABLES", 3)  # says the same of fewer simulated tables
    Path("samples").symlink_to(ROOT / "samples")
    Path("arms").symlink_to(ROOT / "postproc" / "robot" / "arms")
    at, before = Path(), contents()
    documents: list[Any] = []
    outcome = Outcome(0, "", "")
    for line in story.lines:
        if line.startswith(("file ", "backup ", "link ", "pipe ")):
            at = make(line)
        elif line.startswith("| "):
            at.write_text(at.read_text("utf-8") + line[2:] + "\n", "utf-8")
        elif found := re.fullmatch(r"  s\|(.*)\|(.*)", line):
            data, old = at.read_bytes(), found[1].encode()
            assert old in data, line
            at.write_bytes(data.replace(old, found[2].encode(), 1))
        elif line.startswith("$ "):
            documents += [json.loads(outcome.out)] if outcome.out.startswith("{") else []
            before = contents()
            command, _, expected = line[2:].partition(" -> ")
            command, _, stdin = command.partition(" < ")
            if stdin:
                monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(Path(stdin).read_bytes())))
            words = [w for word in shlex.split(command) for w in (ARM if word == "ARM" else (word,))]
            outcome = call_as_written(*words)
            if outcome.code == 2:
                assert contents() == before and (outcome.out == "" or "--json" in words), line
            if expected:
                code, _, text = expected.partition(" ")
                seen = (outcome.code, text.replace("{TMP}", str(tmp_path)) in outcome.err)
                assert seen == (int(code), True), (line, outcome)
        elif line.strip():
            try:
                check(line, outcome, before, documents)
            except AssertionError as wrong:
                raise AssertionError(f"{line}\n{wrong}\n{outcome.out[:300]}\n{outcome.err}") from None
