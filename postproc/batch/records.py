"""The tree of outputs, and beside it a record of each task: the hash of all it was made from, and of what it became.

A file appears in the tree by renaming, in full or not at all; unfinished ones stand in a folder apart, cleared by the
next run. The record of a task follows its files: a run that was killed repeats what it had not recorded.
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass, field
from functools import cached_property
from hashlib import sha256
from pathlib import Path, PurePosixPath
from typing import IO

from postproc.batch.values import TaskRecord
from postproc.diagnostics import Diagnostic, Finding, Matter, PostprocError
from postproc.files import read_file, real, stays_inside, why, write_atomically
from postproc.grouping import grouped
from postproc.rapid.program.program import ENDINGS
from postproc.tasks.discover import STATE, files_below

COPIES = "copies-"  # begin of the name of a record of copied files


@dataclass
class OutputTree:
    """A folder of outputs while one run owns it.

    Args:
        root: the folder. part: which run writes there, ``all`` or the shard's name. unfinished: folder for files until
            they are moved into the tree.
        before, now: records by the name of their file, of earlier runs and of this one.
        claimed: files that stay, whatever made them before. copied: SHA-256 of copied files by path.
    """

    root: Path
    part: str
    unfinished: Path
    before: dict[str, TaskRecord]
    now: dict[str, TaskRecord] = field(default_factory=dict)
    claimed: set[str] = field(default_factory=set)
    copied: dict[str, str] = field(default_factory=dict)

    @cached_property
    def written(self) -> Mapping[str, Sequence[str]]:
        """SHA-256 hashes of what earlier runs wrote to each file, by its path in the tree."""
        return grouped(output for record in self.before.values() for output in record.outputs.items())

    def record_of(self, task: str) -> TaskRecord | None:
        """Return what this run recorded of a task, or else an earlier one."""
        file = _file_of(task)
        return self.now.get(file, self.before.get(file))

    def has(self, record: TaskRecord) -> bool:
        """Tell whether all files of a record stand in the tree as they were written."""
        return all(self._stands(path, hash_) for path, hash_ in record.outputs.items())

    def keep(self, task: str) -> None:
        """Leave what an earlier run made of a task, and its record, as they are."""
        if (record := self.before.get(_file_of(task))) is not None:
            self.now[_file_of(task)] = record
            self.claimed |= record.outputs.keys()

    def add(self, record: TaskRecord, files: Mapping[str, bytes]) -> list[Finding]:
        """Write the files of a task, then its record; files that it has no longer go.

        Args:
            record: without a key it is not kept: the same input may become something else.

        Returns:
            BAT016 for each file that was edited by hand and has been replaced.
        """
        edited = [finding for path, data in files.items() for finding in self._put(path, data)]
        file = _file_of(record.name)
        self.claimed |= files.keys()
        self.now[file] = record
        self._remove(self.before.get(file))
        if record.key:
            self._write(f"{STATE}/{file}", _encoded(record))
        else:
            (self.root / STATE / file).unlink(missing_ok=True)
        return edited

    def copy(self, path: str, data: bytes) -> list[Finding]:
        """Write a copied file unless it stands there already; return BAT016 if it was edited by hand."""
        self.claimed.add(path)
        self.copied[path] = sha256(data).hexdigest()
        return [] if self._stands(path, self.copied[path]) else list(self._put(path, data))

    def keep_copy(self, path: str) -> None:
        """Leave the copy of a file that cannot be read now as it is."""
        self.claimed.add(path)
        for file, record in self.before.items():
            if file.startswith(COPIES) and path in record.outputs:
                self.copied[path] = record.outputs[path]

    def close(self) -> list[Finding]:
        """Record the copies, and delete what earlier runs made of inputs that are gone; return BAT023 for each file."""
        copies = f"{COPIES}{self.part}.json"
        self.now[copies] = TaskRecord(self.part, copies, "unchanged", self.copied)
        self._write(f"{STATE}/{copies}", _encoded(self.now[copies]))
        removed: list[str] = []
        for file, record in self.before.items():
            if file not in self.now or file.startswith(COPIES):
                removed += self._remove(record)
            if file not in self.now and (self.part == "all" or not file.startswith(COPIES)):
                (self.root / STATE / file).unlink(missing_ok=True)
        help_ = "put its input back and repeat the batch if it is to stay"
        texts = [f"`{self.root / path}` is deleted: its input is gone" for path in sorted(removed)]
        return [Diagnostic("BAT023", "warning", text, help=help_).finding for text in texts]

    def foreign(self) -> list[Finding]:
        """Return BAT023 for each RAPID module of the tree that this run neither made, copied nor kept."""
        if self.part != "all":  # other shards' modules are not known
            return []
        made = self.claimed.union(*(record.outputs for record in self.now.values()))
        names = (name for name in files_below(self.root) if PurePosixPath(name).suffix.lower() in ENDINGS)
        help_ = "delete it, or put its program back: what is approved is what programs become today"
        return [
            Diagnostic(
                "BAT023", "warning", f"`{self.root / name}` comes of no program of this batch", help=help_
            ).finding
            for name in sorted(set(names) - made)
        ]

    def _stands(self, path: str, hash_: str) -> bool:
        """Tell whether a file stands in the tree, also after links of its folders are followed, with this SHA-256."""
        target = self.root / path
        return real(target.parent).is_relative_to(real(self.root)) and _hash(target) == hash_

    def _put(self, path: str, data: bytes) -> Iterator[Finding]:
        """Write a file of the tree; what is in its way and was edited by hand is kept as a copy and reported as BAT016.

        Args:
            path: in the tree. data: its bytes.
        """
        target = self.root / path
        above = [name for parent in PurePosixPath(path).parents if (name := str(parent)) != "."]
        in_way = [name for name in above if _is_file(self.root / name)]
        if target.is_dir() and not target.is_symlink():
            in_way += [p.relative_to(self.root).as_posix() for p in sorted(target.rglob("*")) if _is_file(p)]
        elif _hash(target) not in (None, sha256(data).hexdigest()):
            in_way.append(path)
        for name in in_way:
            hash_ = _hash(self.root / name)
            if hash_ is not None and hash_ not in self.written.get(name, ()):
                kept = f"{STATE}/edited/{hash_[:8]}/{name}"  # each edit by itself
                self._write(kept, (self.root / name).read_bytes())
                text = f"`{name}` was edited since a batch wrote it, and is written anew"
                help_ = f"the edited file is kept as `{self.root / kept}`: make such changes in the input"
                yield Diagnostic("BAT016", "warning", text, help=help_, matter=Matter.EDITED).finding
        with _writing(target):
            for name in in_way:
                (self.root / name).unlink()
            if target.is_dir() and not target.is_symlink():
                shutil.rmtree(target)  # empty folders
        self._write(path, data)

    def _write(self, path: str, data: bytes) -> None:
        """Write a file of the tree atomically.

        Raises:
            PostprocError: BAT004, that fails.
        """
        with _writing(self.root / path):
            write_atomically(self.root / path, data, self.unfinished)

    def _remove(self, record: TaskRecord | None) -> list[str]:
        """Delete the files of a record that nothing claims and nobody edited, and folders that become empty.

        Returns:
            Paths of the deleted files in the tree.
        """
        removed = []
        for path, hash_ in record.outputs.items() if record is not None else ():
            if path not in self.claimed and self._stands(path, hash_):
                (self.root / path).unlink(missing_ok=True)
                removed.append(path)
                with suppress(OSError):  # a folder that is not empty
                    for folder in PurePosixPath(path).parents[:-1]:
                        (self.root / folder).rmdir()
        return removed


@contextmanager
def open_tree(root: Path, part: str) -> Iterator[OutputTree]:
    """Lock an output folder (or one shard's part of it) for one run, and read the records there.

    Args:
        part: ``all``, or the shard's name.

    Raises:
        PostprocError: BAT003 another run owns it, BAT004 it cannot be written.
    """
    unfinished = root / STATE / f"{part}.unfinished"
    with _writing(root):
        unfinished.mkdir(parents=True, exist_ok=True)
        lock = (root / STATE / f"{part}.lock").open("ab")
    with lock:
        if not _is_locked(lock):
            text = f"another batch is writing in `{root}`"
            raise PostprocError.of("BAT003", text, help="wait for it, or give each run its own -o")
        shutil.rmtree(unfinished, ignore_errors=True)
        with _writing(root / STATE):
            unfinished.mkdir()
            records = dict(_read_records(root / STATE))
        yield OutputTree(root, part, unfinished, records)
        shutil.rmtree(unfinished, ignore_errors=True)


def _read_records(folder: Path) -> Iterator[tuple[str, TaskRecord]]:
    """Yield the records in a folder with the names of their files, without those that no batch wrote."""
    for path in sorted(folder.glob("*.json")):
        with suppress(AttributeError, KeyError, RecursionError, TypeError, ValueError):
            yield path.name, _decoded(read_file(path))


def _encoded(record: TaskRecord) -> bytes:
    """Return a record as the bytes of its file: a line of JSON."""
    return json.dumps(asdict(record), sort_keys=True, allow_nan=False, default=lambda matter: matter.name).encode()


def _decoded(data: bytes) -> TaskRecord:
    """Return the record in the bytes of its file; one without a key if another version of the program wrote it.

    Raises:
        AttributeError, KeyError, RecursionError, TypeError, ValueError: no batch wrote that.
    """
    content = json.loads(data.rpartition(b"\n")[2])  # former versions wrote a hash in a line before it
    outputs = {str(path): str(hash_) for path, hash_ in content.pop("outputs").items()}
    if not all(stays_inside(path) and PurePosixPath(path).parts[0] != STATE for path in outputs):
        raise ValueError("it names a file outside of the folder")
    try:
        findings = [Finding(**{**f, "matter": f["matter"] and Matter[f["matter"]]}) for f in content.pop("findings")]
        return TaskRecord(**content, outputs=outputs, findings=tuple(findings))
    except (KeyError, TypeError):
        return TaskRecord(str(content["name"]), "", "failed", outputs)


def _file_of(task: str) -> str:
    """Return the name of the file with the record of a task; it is short, however long the task's name is."""
    return f"{sha256(task.encode('utf-8', 'surrogateescape')).hexdigest()[:32]}.json"


@contextmanager
def _writing(path: Path) -> Iterator[None]:
    """Raise the error BAT004 about a path where something in it cannot be written."""
    try:
        yield
    except OSError as error:
        reason, help_ = why(error)
        raise PostprocError.of("BAT004", f"cannot write `{path}`: {reason}", help=help_) from error


def _is_file(path: Path) -> bool:
    """Tell whether a path is a link, also a broken one, or exists and is no folder."""
    return path.is_symlink() or (path.exists() and not path.is_dir())


def _hash(path: Path) -> str | None:
    """Return the SHA-256 of a file; None where it cannot be read."""
    try:
        return sha256(path.read_bytes()).hexdigest()
    except OSError:
        return None


def _is_locked(file: IO[bytes]) -> bool:
    """Lock an open file, and tell whether this process has it now; True on systems without advisory locks."""
    try:
        import fcntl
    except ImportError:  # no advisory locks here: two runs in one folder then only redo each other's work
        return True
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True
