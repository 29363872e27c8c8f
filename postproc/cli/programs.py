"""RAPID programs that the user names, and the files near them that declare what they lack."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from postproc.cli.inputs import read_source
from postproc.cli.output import check_outputs
from postproc.cli.printing import say, show
from postproc.diagnostics import Diagnostic, PostprocError, Source, has_errors
from postproc.files import real
from postproc.tasks.contradictions import contradictions
from postproc.tasks.discover import task_around
from postproc.tasks.nearby import arm_nearby, read_nearby, with_file_nearby
from postproc.tasks.task import with_arm

if TYPE_CHECKING:
    from postproc.compensation.options import Options
    from postproc.model.arm import Model
    from postproc.rapid.program.program import Program
    from postproc.settings import Settings


def read_program_file(name: str) -> Source:
    """Return one module that the user names; ``-`` is stdin.

    Raises:
        PostprocError: as ``read_source``, or a folder or a list of modules (CLI003).
    """
    path = Path(name)
    if path.is_dir() or (path.suffix.lower() == ".pgf" and path.is_file()):
        what = "a folder" if path.is_dir() else "a list of modules"
        help_ = f"`postproc batch {name} -o FOLDER` converts what belongs together; or name one module"
        raise PostprocError.of("CLI003", f"`{name}` is {what}", help=help_)
    return read_source(name)


def read_lent(files: Iterable[Path], program: str = "-") -> list[Source]:
    """Read modules that a program uses and that are never changed, without the program itself.

    Args:
        files: the modules. program: name of the program's file, which is left out if it is among them.
    """
    return [read_source(str(path), read_only=True) for path in files if real(path) != real(Path(program))]


def sound_program(sources: Source | Sequence[Source]) -> Program:
    """Return a program that was read without an error.

    Raises:
        PostprocError: there is an error in it.
    """
    from postproc.rapid.program.program import read_program

    program = read_program(sources)
    if has_errors(program.diagnostics):
        raise PostprocError(program.diagnostics)
    return program


def check_unchanged(source: Source) -> None:
    """Refuse to overwrite a program whose file was changed while it was converted.

    Raises:
        PostprocError: CLI015.
    """
    if read_source(source.path).data != source.data:
        text = f"`{source.path}` was changed while it was converted: it is left as it is now"
        raise PostprocError.of("CLI015", text, help="run the command again", exit_code=1)


def named_files(diagnostics: Iterable[Diagnostic], sources: Iterable[Source]) -> list[Diagnostic]:
    """Return the findings; those about data without a value name the file nearby that declares it, if any.

    Args:
        sources: all that was read of the program.
    """
    paths = [Path(source.path) for source in sources]
    return [with_file_nearby(diagnostic, paths) for diagnostic in diagnostics]


def read_task(
    program: Source, settings: Settings, *outputs: Path | None
) -> tuple[list[Source], Options, Sequence[Diagnostic]]:
    """Read what runs with a program: side files, and the declarations near it of what it lacks.

    Args:
        outputs: files that will be written; none of them may be one that is read along.

    Returns:
        The program and all that is read with it; the options, completed by what code outside may write of that; and
        findings on what is read along.

    Raises:
        PostprocError: a side file cannot be read, or an output is a file that is read along.
    """
    sources = [program, *read_lent(settings.side_files, program.path)]
    if settings.alone:
        return sources, settings.options, ()
    along = read_nearby(sources)
    check_outputs([source.path for source in along.sources], *outputs)
    other_tasks = replace(settings.options.other_tasks, read_along=along.written)
    return [*sources, *along.sources], replace(settings.options, other_tasks=other_tasks), along.findings


def settled(settings: Settings, program: str, bare: bool = False) -> tuple[Settings, Model]:
    """Return the settings of a program, completed by its controller's backup, and the model of its arm; print both.

    Args:
        program: file name; stdin stands in the current folder.
        bare: the program is only looked at: an arm whose stiffness nobody knows is taken as it is, and so is one whose
            controller corrects by itself.
    """
    from postproc.model.arm import Model
    from postproc.robot.catalogue import load_robot
    from postproc.settings import corrected_twice, read_arm

    task = task_around(Path(program))
    if task.findings:
        raise PostprocError(task.findings)
    settings = with_arm(settings, task, bare)
    named = load_robot(settings.robot) if bare and settings.model is None and settings.robot is not None else None
    if named is not None and named.joint_compliance is None:
        arm = Model(named, robot_name=str(settings.robot))
    else:
        unknown = task.unknown if settings.names_arm else task.unknown or arm_nearby(program, Path(program))
        arm = read_arm(settings, program, unknown, bare=bare)
    say(settings.headline(arm.robot.name))
    for line in settings.inherited_line(Path(program).parent):
        say(line)
    against = contradictions(settings, task, arm.robot)
    if has_errors(against):
        raise PostprocError(against)
    show(against)
    if bare:
        show([replace(d, severity="info") for d in corrected_twice(settings, arm.station)])
    return settings, arm
