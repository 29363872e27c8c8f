"""What a batch leaves behind: the tree of outputs, and beside it a journal of what was made from what.

A file appears in the tree by renaming, whole or not at all; unfinished ones stand in a folder apart, cleared by the
next run. A line of the journal follows the files it speaks of: a run that was killed repeats what it had not noted.
"""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator, Mapping
from collections.abc import Set as AbstractSet
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import cached_property
from hashlib import sha256
from itertools import chain
from pathlib import Path, PurePosixPath
from typing import IO

from postproc.batch.lines import COPY, STATE, Line, Subject, read_lines
from postproc.batch.values import Result
from postproc.diagnostics import Diagnostic, Matter, PostprocError
from postproc.files import real, why, write_whole
from postproc.grouping import grouped

EDITED = "edited"  # in it: files of the tree that somebody changed


@dataclass
class Journal:
    """The state of an output folder while one run owns it.

    Args:
        root: the output folder; part: which run writes here, ``all`` or the shard's name.
        before: lines of earlier runs, the newest last; now: those of this run. log: the open file of the journal.
        held: tasks and files whose earlier outputs stay, since their input cannot be read now.
        findings: about the journal itself.
    """

    root: Path
    part: str
    before: dict[Subject, list[Line]]
    log: IO[bytes]
    findings: list[Diagnostic]
    held: set[Subject] = field(default_factory=set)
    now: dict[Subject, Line] = field(default_factory=dict)

    @cached_property
    def written(self) -> Mapping[str, AbstractSet[str]]:
        """SHA-256 hashes of all that earlier runs wrote to each file, by its path in the tree."""
        found: dict[str, set[str]] = {}
        for line in chain.from_iterable(self.before.values()):
            for path, hash_ in line.outputs.items():
                found.setdefault(path, set()).add(hash_)
        return found

    def find(self, name: str, key: str) -> Line | None:
        """Return the newest line of a task with this key, if its files are unchanged in the tree; else None.

        Args:
            name: of the task. key: hash of all that the result depends on.
        """
        for line in reversed(self.before.get((False, name), [])):
            if line.key == key and all(self.has(path, hash_) for path, hash_ in line.outputs.items()):
                return line
        return None

    def has(self, path: str, hash_: str) -> bool:
        """Tell whether a file of the tree exists with this SHA-256."""
        return self._inside(path) and _hash(self.root / path) == hash_

    def _inside(self, path: str) -> bool:
        """Tell whether a path is inside the tree, also after links of its folders are followed."""
        return real((self.root / path).parent).is_relative_to(real(self.root))

    def keep(self, line: Line) -> Line:
        """Count a line of an earlier run as one of this run, and return it."""
        self.now[line.subject] = line
        return line

    def hold(self, name: str, copied: bool = False) -> None:
        """Let ``close`` keep the earlier outputs of an input that cannot be read now, since it is not gone.

        Args:
            name: of the task, or with ``copied`` of the file.
        """
        self.held.add((copied, name))

    def add(self, result: Result) -> Line:
        """Write the files of a result and its line in the journal.

        Returns:
            The line, with BAT016 for each file that was edited by hand and has been replaced.
        """
        edited = [d.finding for path, data in result.outputs.items() for d in self.put(path, data)]
        hashes = {path: sha256(data).hexdigest() for path, data in sorted(result.outputs.items())}
        key = result.key if result.final else ""
        line = self.note(Line(result.name, key, result.status, hashes, result.figures, result.findings))
        return replace(line, findings=(*line.findings, *edited))

    def copy(self, path: str, data: bytes) -> list[Diagnostic]:
        """Write a copied file into the tree unless it is there already, and note it in the journal.

        Args:
            path: in the tree. data: its bytes.

        Returns:
            BAT016 for what was edited by hand and has been replaced.
        """
        hash_ = sha256(data).hexdigest()
        line = Line(path, COPY, COPY, {path: hash_})
        edited = [] if self.has(path, hash_) else self.put(path, data)
        if line in self.before.get((True, path), []):
            self.keep(line)
        else:
            self.note(line)
        return edited

    def note(self, line: Line) -> Line:
        """Count a line as one of this run and return it; append it to the journal unless its key is empty."""
        self.now[line.subject] = line
        if line.key:
            self.log.write(line.encoded())
            self.log.flush()
        return line

    def put(self, path: str, data: bytes) -> list[Diagnostic]:
        """Write a file of the tree; what is in its way and was edited by hand is kept as a copy and reported as BAT016.

        Args:
            path: in the tree. data: its bytes.
        """
        above = [name for parent in PurePosixPath(path).parents if (name := str(parent)) != "."]
        way = [name for name in above if _is_file(self.root / name)]
        target = self.root / path
        if target.is_dir() and not target.is_symlink():
            below = sorted(p for p in target.rglob("*") if _is_file(p))
            way += [p.relative_to(self.root).as_posix() for p in below]
        elif _hash(target) not in (None, sha256(data).hexdigest()):
            way.append(path)
        edited = [d for name in way for d in self.keep_edited(name)]
        try:
            for name in way:
                (self.root / name).unlink()
            if target.is_dir() and not target.is_symlink():
                shutil.rmtree(target)  # empty folders
        except OSError as error:
            raise _not_written(target, error) from error
        self.write(path, data)
        return edited

    def keep_edited(self, path: str) -> Iterator[Diagnostic]:
        """Copy a file that is to be replaced into folder ``edited`` and yield BAT016, if no batch wrote its bytes."""
        hash_ = _hash(self.root / path)
        if hash_ is not None and hash_ not in self.written.get(path, set()):
            kept = f"{STATE}/{EDITED}/{hash_[:8]}/{path}"  # each edit by itself
            self.write(kept, (self.root / path).read_bytes())
            text = f"`{path}` was edited since a batch wrote it, and is written anew"
            help_ = f"the edited file is kept as `{self.root / kept}`: make such changes in the input"
            yield Diagnostic("BAT016", "warning", text, help=help_, matter=Matter.EDITED)

    def write(self, path: str, data: bytes) -> None:
        """Write a file of the tree atomically: under another name, then renamed.

        Raises:
            PostprocError: BAT004, that fails.
        """
        try:
            write_whole(self.root / path, data, _unfinished(self.root, self.part))
        except OSError as error:
            raise _not_written(self.root / path, error) from error

    def remove(self, outputs: Mapping[str, str]) -> None:
        """Delete unchanged files of the tree, and folders that become empty.

        Args:
            outputs: SHA-256 of each file by its path; a file with another hash stays.
        """
        for path, hash_ in outputs.items():
            if self.has(path, hash_):
                (self.root / path).unlink()
                for folder in (self.root / path).parents:
                    if folder == self.root or not _removed(folder):
                        break

    def close(self, owns: Callable[[str], bool], foreign: AbstractSet[str]) -> None:
        """Delete outputs whose input is gone, and write the journal anew, sorted: lines of this run and of held inputs.

        Args:
            owns: whether a task or file belongs to this run, by its name.
            foreign: paths that other runs put into the tree, which stay.
        """
        held = [self.before[one][-1] for one in self.held if one in self.before]
        lines = [line for line in self.now.values() if line.key] + held
        current = {path for line in lines for path in line.outputs} | foreign
        for line in chain.from_iterable(self.before.values()):
            if owns(line.name):
                self.remove({p: h for p, h in line.outputs.items() if p not in current})
        self.log.close()
        self.write(
            f"{STATE}/{self.part}.jsonl",
            b"".join(line.encoded() for line in sorted(lines, key=lambda line: line.subject)),
        )


@contextmanager
def open_journal(root: Path, part: str) -> Iterator[Journal]:
    """Lock an output folder (or one shard's part of it) for one run, and read the journals there.

    Args:
        part: ``all``, or the shard's name.

    Raises:
        PostprocError: BAT003 another run owns it, BAT004 it cannot be written.
    """
    state = root / STATE
    try:
        _unfinished(root, part).mkdir(parents=True, exist_ok=True)
        lock = (state / f"{part}.lock").open("ab")
    except OSError as error:
        raise _not_written(root, error) from error
    with lock:
        if not _locked(lock):
            text = f"another batch is writing in `{root}`"
            raise PostprocError.of("BAT003", text, help="wait for it, or give each run its own -o")
        shutil.rmtree(_unfinished(root, part), ignore_errors=True)
        _unfinished(root, part).mkdir(exist_ok=True)
        journals = sorted(state.glob("*.jsonl"), key=lambda p: p.stem == part)
        findings: list[Diagnostic] = []
        try:
            before = grouped((line.subject, line) for path in journals for line in read_lines(path, findings))
            log = open(state / f"{part}.jsonl", "ab")  # noqa: SIM115
        except OSError as error:
            raise _not_written(state, error) from error
        with log:
            if log.tell():
                log.write(b"\n")  # what was killed in the middle of a line must not join the next one
            yield Journal(root, part, before, log, findings)
        shutil.rmtree(_unfinished(root, part), ignore_errors=True)


def _not_written(path: Path, error: OSError) -> PostprocError:
    """Return the error BAT004 about a path."""
    reason, help_ = why(error)
    return PostprocError.of("BAT004", f"cannot write `{path}`: {reason}", help=help_)


def _unfinished(root: Path, part: str) -> Path:
    """Return the folder in which files are written before they are moved into the output folder ``root``.

    Args:
        part: name of the shard that writes them, ``all`` without shards.
    """
    return root / STATE / f"{part}.unfinished"


def _removed(folder: Path) -> bool:
    """Delete a folder if it is empty, and tell whether that was done."""
    try:
        folder.rmdir()
    except OSError:
        return False
    return True


def _is_file(path: Path) -> bool:
    """Tell whether a path is a link, also a broken one, or exists and is no folder."""
    return path.is_symlink() or (path.exists() and not path.is_dir())


def _hash(path: Path) -> str | None:
    """Return the SHA-256 of a file; None where it cannot be read."""
    try:
        return sha256(path.read_bytes()).hexdigest()
    except OSError:
        return None


def _locked(file: IO[bytes]) -> bool:
    """Try to lock an open file, and tell whether this process has it; True on systems without advisory locks."""
    try:
        import fcntl
    except ImportError:  # no advisory locks here: two runs in one folder then only redo each other's work
        return True
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True
