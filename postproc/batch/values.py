"""What a batch consists of: tasks with their settings, jobs, and what became of them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from hashlib import sha256
from pathlib import Path, PurePosixPath
from typing import Literal

from postproc.compensation.options import Options
from postproc.diagnostics import Diagnostic, Finding, Matter, Source
from postproc.report.blocks import Values
from postproc.settings import Settings
from postproc.tasks.task import Task

Status = Literal["compensated", "unchanged", "failed"]
MEASURED = ("max_error_before_mm", "max_error_after_mm")
ON_ARM = "expected_on_arm_mm"
"""Figures of a task where a line or an arc of it could be measured; the last one where it is known."""


def page_of(task: str) -> str:
    """Return the path of a task's HTML page in the output tree, from the task's name."""
    return f"report/{task}.html"


@dataclass(frozen=True, slots=True)
class BatchPlan:
    """What a batch does: tasks with their settings, and files that are copied, all relative to ``root``."""

    root: Path
    tasks: tuple[tuple[Task, Settings], ...]
    copies: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Job:
    """All that a worker needs to convert one task, as values.

    Args:
        name: of the task. key: hash of everything the result depends on.
        model: the pickled model.
        page: path of its HTML page in the output tree, None for none.
        made: what the page says it was made with (model, loads, options) as label and text.
        findings: on the files that are read along.
    """

    name: str
    key: str
    sources: tuple[Source, ...] = field(repr=False)
    model: bytes = field(repr=False)
    options: Options = field(default_factory=Options)
    page: str | None = None
    made: Mapping[str, str] = field(default_factory=dict)
    findings: tuple[Diagnostic, ...] = ()


@dataclass(frozen=True, slots=True)
class TaskRecord:
    """What became of a task.

    Args:
        key: hash of everything that it depends on; empty if the same input may become something else.
        outputs: SHA-256 of each file by its path in the tree; none where it failed.
        figures: lengths, counts and times out of the ``postproc/compensate/1`` document.
    """

    name: str
    key: str
    status: Status
    outputs: Mapping[str, str] = field(default_factory=dict)
    figures: Values = field(default_factory=dict)
    findings: tuple[Finding, ...] = ()


def module_place(name: str, files: Sequence[str], stated: Path | None) -> str:
    """Return the path of a task's module for run-time correction, relative to the root.

    It is among its system modules, else beside its first file, with the program's name before it if others are there.

    Args:
        name: of the task. files: its program files. stated: path whose file name the module gets; None for ppModel.sys.
    """
    file = "ppModel.sys" if stated is None else stated.name
    system = next((PurePosixPath(f).parent for f in files if PurePosixPath(f).parent.name.lower() == "sysmod"), None)
    if system is not None:
        return str(system / file)
    first = PurePosixPath(files[0])
    alone = first.is_relative_to(name)  # else the task is a file, or a list of files, among others
    return str(first.parent / (file if alone and str(first) != name else f"{PurePosixPath(name).stem}_{file}"))


def failed(name: str, key: str, findings: Iterable[Diagnostic]) -> TaskRecord:
    """Return the record of a task that has no outputs; its key is empty if the same input might not fail again."""
    return TaskRecord(name, key, "failed", findings=tuple(d.finding for d in findings))


@dataclass(frozen=True, slots=True)
class Shard:
    """Part ``index`` (from 1) of ``count`` of a batch; a hash of its name decides to which a task or file belongs."""

    index: int = 1
    count: int = 1

    def owns(self, name: str) -> bool:
        """Tell whether a task or file belongs to this part, by a hash of its name."""
        number = int.from_bytes(sha256(name.encode("utf-8", "surrogateescape")).digest()[:8], "big")
        return number % self.count == self.index - 1

    @property
    def part(self) -> str:
        """Name of the part in file names: ``all``, or ``1-of-4``."""
        return "all" if self.count == 1 else f"{self.index}-of-{self.count}"


@dataclass(frozen=True, slots=True)
class TaskOutcome:
    """What became of a task: done now, or taken over from an earlier run (``cached``).

    Args:
        arm: keys of the document about the arm and what is corrected. page: its HTML page in the output tree.
    """

    task: Task
    status: Status
    cached: bool
    figures: Values
    findings: tuple[Finding, ...]
    arm: Mapping[str, str] = field(default_factory=dict)
    page: str | None = None


@dataclass(frozen=True, slots=True)
class Batch:
    """All outcomes by name, how many files were copied, and what was found about copies and the output folder."""

    outcomes: tuple[TaskOutcome, ...]
    copied: int
    findings: tuple[Finding, ...]

    @property
    def failed(self) -> bool:
        """Whether any task failed, or a finding about copies or the output folder is an error."""
        return any(f.severity == "error" for f in self.findings) or any(o.status == "failed" for o in self.outcomes)

    @property
    def counts(self) -> dict[str, int]:
        """Number of tasks by status, of those done in an earlier run, and of those that exceed the tolerance somewhere.

        Keys: ``compensated``, ``unchanged``, ``failed``, ``cached``, ``beyond_tolerance``.
        """
        count = {s: sum(o.status == s for o in self.outcomes) for s in ("compensated", "unchanged", "failed")}
        beyond = sum(any(finding.matter is Matter.OFF for finding in o.findings) for o in self.outcomes)
        return {**count, "cached": sum(o.cached for o in self.outcomes), "beyond_tolerance": beyond}
