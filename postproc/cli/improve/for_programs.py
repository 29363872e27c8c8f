"""Programs that a plan of measurements is for: `postproc plan .. --for PROGRAM`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from postproc.cli.printing import show
from postproc.cli.programs import named_files, read_program_file, read_task
from postproc.diagnostics import PostprocError, has_errors
from postproc.tasks.contradictions import contradictions
from postproc.tasks.discover import task_around
from postproc.tasks.task import with_arm

if TYPE_CHECKING:
    from postproc.compensation.options import Options
    from postproc.diagnostics import Diagnostic, Source
    from postproc.identification.planning.weld_targets import WeldTargets
    from postproc.model.arm import Model
    from postproc.settings import Settings
    from postproc.tasks.task import Task


def weld_targets(names: Sequence[str], side_files: Sequence[Path]) -> Callable[[Model], list[WeldTargets]] | None:
    """Read programs, and return what corrects them by a model and says where they weld; None for no program.

    Loads and options are those that ``compensate`` takes: of the program, of the ``postproc.toml`` near it and of its
    controller's backup. The arm is that of the model, whatever arm these name.

    Args:
        names: files of the programs. side_files: modules that are read along.

    Raises:
        PostprocError: a program cannot be read; from the function that is returned: its controller contradicts,
            `compensate` refuses it, or CLI018, it has no weld target that the arm reaches.
    """
    from postproc.settings_files import settings_at

    read = []
    for name in names:
        source, task = read_program_file(name), task_around(Path(name))
        if task.findings:
            raise PostprocError(task.findings)
        settings = settings_at(Path(name).parent)
        stated = tuple(pair for pair in settings.inherited if pair[0] not in ("robot", "model"))
        settings = replace(settings, side_files=(*settings.side_files, *side_files), inherited=stated)
        settings = with_arm(settings, task)
        read.append((name, settings, task, read_task(source, settings)))
    return (lambda model: [_of_program(model, *one) for one in read]) if read else None


def _of_program(
    model: Model, name: str, settings: Settings, task: Task, read: tuple[list[Source], Options, Sequence[Diagnostic]]
) -> WeldTargets:
    """Return where a program welds, corrected by a model; raises as `weld_targets` says."""
    from postproc.identification.planning.weld_targets import WeldTargets
    from postproc.runtime.passes import correct_program
    from postproc.settings import read_station

    sources, options, findings = read
    against = contradictions(settings, task, model.robot)
    if has_errors(against):
        raise PostprocError(against)
    show(against)
    station = settings.station if settings.cell is None else read_station(settings.cell)
    model = model if station is None else replace(model, station=station)
    conversion = correct_program(sources, model, replace(options, run_time="off"), findings=findings)
    if not conversion.outputs:
        raise PostprocError(named_files(conversion.diagnostics, sources), conversion.exit_code)
    targets = WeldTargets.of(Path(name).name, conversion)
    if targets is None:
        text = f"`{name}` has no weld target that this arm reaches"
        help_ = "name a program that welds (`ArcL`, `ArcC`), or leave `--for` out; `postproc inspect` lists its targets"
        raise PostprocError.of("CLI018", text, help=help_)
    return targets
