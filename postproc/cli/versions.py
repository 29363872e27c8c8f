"""A version of a program: a file, a folder, or a revision of either in a git repository."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from postproc.cli.programs import read_program_file, read_task
from postproc.diagnostics import PostprocError, Source
from postproc.files import read_source
from postproc.tasks.discover import discover

if TYPE_CHECKING:
    from postproc.settings import Settings


@dataclass(frozen=True)
class Version:
    """A version of a program.

    Args:
        name: as the user has it. path: where its bytes are. place: where it stands, or stood, in the user's folders.
    """

    name: str
    path: Path
    place: Path

    def tasks(self, settings: Settings) -> dict[str, tuple[Path, list[Source]]]:
        """Return what runs together by the name of its task: where its first file stands, and all files.

        A file is one task, with an empty name, and brings what it needs of the files near it.
        """
        if not self.path.is_dir():
            return {"": (self.place, self._named(read_task(read_program_file(str(self.path)), settings)[0]))}
        tasks = {}
        for task in discover(self.path)[0]:
            files = (*task.files, *task.shared)
            sources = [read_source(self.path / file, read_only=file in task.shared) for file in files]
            tasks[task.name] = self.place / files[0], self._named(sources)
        return tasks

    def _named(self, sources: list[Source]) -> list[Source]:
        """Return the files by the names that the user knows them by."""
        root = str(self.path).removesuffix(str(self.place))
        revision = f"{self.name.partition(':')[0]}:" if root else ""
        return [replace(source, path=revision + source.path.removeprefix(root)) for source in sources]


@contextmanager
def opened_version(name: str) -> Iterator[Version]:
    """Give a version of a program by its path, or by ``REVISION:PATH`` of the repository of the current folder.

    Raises:
        PostprocError: CLI002, there is none.
    """
    revision, _, inside = name.partition(":")
    if name == "-" or Path(name).exists() or not inside:
        yield Version(name, Path(name), Path(name))
        return
    place = Path(inside)
    with TemporaryDirectory() as folder:
        kind = _git(name, "cat-file", "-t", f"{revision}:./{place.as_posix()}").strip()
        wanted = place if kind == "tree" else place.parent
        archive = f"{folder}/archive.tar"
        _git(name, "archive", "-o", archive, revision, "--", wanted.as_posix())
        shutil.unpack_archive(archive, f"{folder}/files", filter="data")
        yield Version(name, Path(folder, "files", place), place)


def _git(name: str, *words: str) -> str:
    """Return what git prints.

    Raises:
        PostprocError: CLI002, it does not know the version ``name``.
    """
    try:
        if name.startswith("-"):
            raise OSError("a revision does not begin with `-`")
        return subprocess.run(["git", *words], capture_output=True, check=True, text=True, errors="replace").stdout
    except (OSError, subprocess.CalledProcessError) as error:
        why = getattr(error, "stderr", "").strip().split("\n")[-1] or str(error)
        text = f"there is no file `{name}`, and no such revision: {why}"
        help_ = "name a file, a folder, or REVISION:PATH as git knows it, such as `HEAD~3:cell/seam.mod`"
        raise PostprocError.of("CLI002", text, help=help_) from None
