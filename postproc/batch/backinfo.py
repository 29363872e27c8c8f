"""BACKINFO/backinfo.txt lists the modules of each task: a controller that is restored loads those alone."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import PurePosixPath

from postproc.batch.lines import Line
from postproc.batch.values import Task, page_of

_TASK = rb"(?im)^>>%s:[^\n]*\n(?:(?!>>)[^\n]*\S[^\n]*(?:\n|\Z))*"  # its head and the lines below, up to a blank one


def is_backinfo(path: str) -> bool:
    """Tell whether a path is that of BACKINFO/backinfo.txt, in any case."""
    return [part.lower() for part in PurePosixPath(path).parts[-2:]] == ["backinfo", "backinfo.txt"]


def added_modules(path: str, tasks: Iterable[Task], lines: Iterable[Line]) -> list[tuple[str, str]]:
    """Return the modules that a batch added to the tasks of a backup: name of the task's folder, and path inside it.

    Args:
        path: of backinfo.txt. tasks: all of the batch. lines: of its journal, the newest last.
    """
    home = PurePosixPath(path).parent.parent
    own = {task.name: {*task.files, page_of(task.name)} for task in tasks}
    outputs = {line.name: line.outputs for line in lines if line.name in own}  # the newest last
    found = []
    for name in sorted(outputs):
        task = PurePosixPath(name)
        if task.parent.parent == home and task.parent.name.lower() == "rapid":
            added = (PurePosixPath(p) for p in sorted(outputs[name].keys() - own[name]))
            found += [(task.name, str(p.relative_to(task))) for p in added if p.is_relative_to(task)]
    return found


def with_modules(data: bytes, modules: Iterable[tuple[str, str]]) -> bytes:
    """Return the content of backinfo.txt with modules added to the list of their task, if it lacks them.

    Args:
        data: the content as it is. modules: (name of the task's folder, path inside it).
    """
    for task, module in modules:
        section = re.search(_TASK % re.escape(task.encode()), data)
        name = module.encode()
        if section is None or re.search(rb"(?im)^" + re.escape(name) + rb"\s", section[0]):
            continue
        end = b"\r\n" if b"\r\n" in section[0] else b"\n"
        before = section[0] if section[0].endswith(b"\n") else section[0] + end
        data = data[: section.start()] + before + name + b" @ " + end + data[section.end() :]
    return data
