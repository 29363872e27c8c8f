"""What a batch leaves behind: the tree of outputs, and beside it a journal of what was made from what.

A file appears in the tree by renaming, whole or not at all; unfinished ones stand in a folder apart, cleared by the
next run. A line of the journal follows the files it speaks of: a run that was killed repeats what it had not noted.
"""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Callable, Iterator, Mapping
from collections.abc import Set as AbstractSet
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cached_property
from hashlib import sha256
from itertools import chain
from pathlib import Path
from typing import IO, Any

from postproc.batch.values import Result
from postproc.diagnostics import Diagnostic, PostprocError
from postproc.grouping import grouped

STATE = ".postproc"
EDITED = "edited"  # in it: files of the tree that somebody changed
Line = dict[str, Any]  # name, key, status, outputs (path to hash), figures, findings
KINDS = {"name": str, "key": str, "status": str, "outputs": dict}
Subject = tuple[bool, str]  # whether a file is copied, and its name; a task may be called like a file
COPY = "copy"  # key of files that are not converted


@dataclass
class Journal:
    """The state of an output folder while one run owns it.

    Args:
        root: the output folder; part: which run writes here, ``all`` or the shard's name.
        before: lines of earlier runs, the newest last; now: those of this run.
    """

    root: Path
    part: str
    before: dict[Subject, list[Line]]
    log: IO[bytes]
    now: dict[Subject, Line] = field(default_factory=dict)

    @cached_property
    def written(self) -> Mapping[str, AbstractSet[str]]:
        """Hashes of what earlier runs wrote, by file."""
        found: dict[str, set[str]] = {}
        for line in chain.from_iterable(self.before.values()):
            for path, hash_ in line["outputs"].items():
                found.setdefault(path, set()).add(hash_)
        return found

    def find(self, name: str, key: str) -> Line | None:
        """The line about a task that was made from the same input, if all it wrote still stands in the tree."""
        for line in reversed(self.before.get((False, name), [])):
            if line["key"] == key and all(self.holds(path, hash_) for path, hash_ in line["outputs"].items()):
                return line
        return None

    def holds(self, path: str, hash_: str) -> bool:
        try:
            return sha256((self.root / path).read_bytes()).hexdigest() == hash_
        except OSError:
            return False

    def keep(self, line: Line) -> Line:
        """Take over a line of an earlier run."""
        self.now[_subject(line)] = line
        return line

    def add(self, result: Result) -> Line:
        """Write the files of a result, then its line; the line as it is told, with what was edited by hand since."""
        edited = [d.as_json() for path, data in result.outputs.items() for d in self.spare(path, data)]
        for path, data in result.outputs.items():
            self.write(path, data)
        line = self.note(
            {
                "name": result.name,
                "key": result.key if result.final else "",
                "status": result.status,
                "outputs": {path: sha256(data).hexdigest() for path, data in sorted(result.outputs.items())},
                "figures": dict(result.figures),
                "findings": [dict(f) for f in result.findings],
            }
        )
        return {**line, "findings": [*line["findings"], *edited]}

    def spare(self, path: str, data: bytes) -> Iterator[Diagnostic]:
        """Put a file aside that is about to be written anew and is not as a batch wrote it."""
        try:
            there = (self.root / path).read_bytes()
        except OSError:
            return
        hash_ = sha256(there).hexdigest()
        if there != data and hash_ not in self.written.get(path, set()):
            kept = f"{STATE}/{EDITED}/{path}.{hash_[:8]}"  # each edit by itself
            self.write(kept, there)
            text = f"`{path}` was edited since a batch wrote it, and is written anew"
            help_ = f"the edited file is kept as `{self.root / kept}`: make such changes in the input"
            yield Diagnostic("BAT016", "warning", text, help=help_)

    def copy(self, path: str, data: bytes) -> None:
        """Put a file into the tree as it is."""
        hash_ = sha256(data).hexdigest()
        line = {"name": path, "key": COPY, "status": COPY, "outputs": {path: hash_}, "figures": {}, "findings": []}
        if not self.holds(path, hash_):
            self.write(path, data)
        if line in self.before.get((True, path), []):
            self.keep(line)
        else:
            self.note(line)

    def note(self, line: Line) -> Line:
        self.now[_subject(line)] = line
        if line["key"]:
            self.log.write(_encoded(line))
            self.log.flush()
        return line

    def write(self, path: str, data: bytes) -> None:
        """A file of the tree: written apart, forced to the disk, renamed."""
        target = self.root / path
        unfinished = _unfinished(self.root, self.part) / target.name
        try:
            target.parent.mkdir(parents=True, exist_ok=True)
            with open(unfinished, "wb") as file:
                file.write(data)
                file.flush()
                os.fsync(file.fileno())
            os.replace(unfinished, target)
        except OSError as error:
            raise _not_written(target, error) from error

    def remove(self, outputs: Mapping[str, str]) -> None:
        """Take files out of the tree, but only as this program wrote them; emptied folders go too."""
        for path, hash_ in outputs.items():
            if self.holds(path, hash_):
                (self.root / path).unlink()
                for folder in (self.root / path).parents:
                    if folder == self.root or any(folder.iterdir()):
                        break
                    folder.rmdir()

    def close(self, owns: Callable[[str], bool], foreign: AbstractSet[str]) -> None:
        """Take out what no input stands behind any more; write the journal anew, sorted, without what is past.

        Args:
            owns: whether a task or file is this run's business; foreign: files that other runs put into the tree.
        """
        current = {path for line in self.now.values() for path in line["outputs"]} | foreign
        for line in chain.from_iterable(self.before.values()):
            if owns(line["name"]):
                self.remove({p: h for p, h in line["outputs"].items() if p not in current})
        self.log.close()
        lines = sorted((line for line in self.now.values() if line["key"]), key=_subject)
        self.write(f"{STATE}/{self.part}.jsonl", b"".join(map(_encoded, lines)))


@contextmanager
def open_journal(root: Path, part: str) -> Iterator[Journal]:
    """Own an output folder (or one shard's part of it) for one run.

    Raises:
        PostprocError: BAT003 another run owns it, BAT004 it cannot be written.
    """
    state = root / STATE
    try:
        _unfinished(root, part).mkdir(parents=True, exist_ok=True)
        lock = (state / f"{part}.lock").open("wb")
    except OSError as error:
        raise _not_written(root, error) from error
    with lock:
        if not _locked(lock):
            text = f"another batch is writing in `{root}`"
            raise PostprocError.of("BAT003", text, help="wait for it, or give each run its own -o")
        for unfinished in _unfinished(root, part).iterdir():
            unfinished.unlink()
        journals = sorted(state.glob("*.jsonl"), key=lambda p: p.stem == part)
        before = grouped((_subject(line), line) for path in journals for line in _lines(path))
        with open(state / f"{part}.jsonl", "ab") as log:
            if log.tell():
                log.write(b"\n")  # what was killed in the middle of a line must not join the next one
            yield Journal(root, part, before, log)
        shutil.rmtree(_unfinished(root, part), ignore_errors=True)


def _not_written(path: Path, error: OSError) -> PostprocError:
    text = f"cannot write `{path}`: {error.strerror}"
    return PostprocError.of("BAT004", text, help="check the folder, its rights and the space on the disk")


def _unfinished(root: Path, part: str) -> Path:
    return root / STATE / f"{part}.unfinished"


def _encoded(line: Mapping[str, Any]) -> bytes:
    return json.dumps(line, sort_keys=True, separators=(",", ":"), allow_nan=False).encode() + b"\n"


def _subject(line: Line) -> Subject:
    return line["key"] == COPY, str(line["name"])


def _lines(path: Path) -> Iterator[Line]:
    for text in path.read_bytes().split(b"\n"):
        try:
            line = json.loads(text)
        except ValueError:
            continue  # empty, or torn by a kill
        if isinstance(line, dict) and all(isinstance(line.get(name), kind) for name, kind in KINDS.items()):
            yield {"figures": {}, "findings": [], **line}


def _locked(file: IO[bytes]) -> bool:
    try:
        import fcntl
    except ImportError:  # no advisory locks here: two runs in one folder then only redo each other's work
        return True
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True
