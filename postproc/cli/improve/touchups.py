"""``postproc touchups``: targets that were taught anew, as a measurement table."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from postproc.cli.options import AS_WRITTEN, Flag, Output, positive
from postproc.cli.output import check_outputs, present, write
from postproc.cli.printing import say_next, show
from postproc.cli.program_options import ProgramOptions
from postproc.cli.programs import settled
from postproc.cli.progress import watching
from postproc.cli.versions import Version, opened_version
from postproc.diagnostics import Diagnostic, PostprocError, Source, has_errors

if TYPE_CHECKING:
    from postproc.measure.touchups import TouchUps
    from postproc.model.arm import Model
    from postproc.rapid.program.program import Program
    from postproc.settings import Settings


def run(
    nominal: str,
    touched: str | None = None,
    /,
    *,
    wobj_free: Flag = False,
    wobj_fixed: Flag = False,
    noise: Annotated[float, AS_WRITTEN, Parameter(validator=positive)] = 0.3,
    output: Output = None,
    stated: ProgramOptions = ProgramOptions(),
    json: Flag = False,
) -> int:
    """Make a measurement table of the targets that were taught anew between two versions of a program.

    Each version is a RAPID module, a folder, a backup, or REVISION:PATH of a git repository. One module alone is read
    for the originals that the controller keeps beside touched-up targets, ``o_p50`` beside ``p50``.

    Args:
        nominal: the version that says where the work is.
        touched: the version that was touched up.
        wobj_free: each work object may stand somewhat elsewhere than the program says. Default.
        wobj_fixed: work objects stand where the program says, in the base of the arm.
        noise: standard deviation of a touch-up per axis [mm].
        output: CSV file to write. Default: stdout.
        json: print the postproc/touchups/1 document.
    """
    from postproc.measure.touchup_table import share_told, touchup_findings, touchup_table
    from postproc.results.touchups import touchups_document

    if wobj_free and wobj_fixed:
        help_ = "leave one of them out"
        raise PostprocError.of("CLI011", "`--wobj-free` and `--wobj-fixed` contradict each other", help=help_)
    with opened_version(nominal) as first, opened_version(touched or nominal) as second:
        check_outputs([first.path, second.path], output)
        settings = stated.settings_at(second.home)
        found, arm, sources = _found(first if touched is not None else None, second, settings)
    told = None if not arm.effects else share_told(found, arm, noise, not wobj_fixed)
    findings = list(touchup_findings(found, told, sources))
    if not found.rows:
        raise PostprocError([replace(d, severity="error") for d in findings] or [_nothing(found)], 1)
    show(findings)
    write(output, touchup_table(found, sources, noise, not wobj_fixed)) if output is not None or not json else None
    title = " ".join(Path(name).name for name in (nominal, touched) if name is not None)
    present(touchups_document(title, found, told, findings), json=json, text=True, on_stderr=True)
    if output is not None and not json:
        frames = () if not wobj_fixed else ("--effects", "joint_offset,joint_compliance")
        say_next("calibrates the arm", "fit", output, "--robot", arm.robot_name, *frames, "-o", "arm.toml")
    return 0


def _found(nominal: Version | None, touched: Version, settings: Settings) -> tuple[TouchUps, Model, list[Source]]:
    """Return the touch-ups of all tasks that differ, the model of their arm, and the files that were touched up.

    Args:
        nominal: the version before; None where the touched one keeps the originals of its targets.

    Raises:
        PostprocError: CLI003 a file beside a folder, CLI002 no task in both, CLI013 several arms, or a program that
            cannot be read.
    """
    from postproc.measure.touchups import TouchUps, find_touchups, with_kept_originals
    from postproc.robot.cells.station import Station

    if nominal is not None and nominal.is_folder != touched.is_folder:
        text = f"`{nominal.name}` and `{touched.name}` are a folder and a file"
        raise PostprocError.of("CLI003", text, help="name two programs, or two folders")
    before = None if nominal is None else nominal.tasks(settings)
    arms: list[Model] = []
    found, files = TouchUps(), list[Source]()
    for name, sources in touched.tasks(settings).items():
        was = None if before is None else before.get(name)
        if before is not None and (was is None or [s.data for s in was] == [s.data for s in sources]):
            continue
        _, arm = settled(
            settings, str(touched.home / Path(name).name if touched.is_folder else touched.place), bare=True
        )
        program = _read(sources)
        was = with_kept_originals(program) if was is None else was
        with watching(f"comparing `{name}`"):
            one = find_touchups(_read(was), program, arm.robot, arm.station or Station())
        same = {s.data for s in was}
        if one.rows or one.shifted:
            arms, files = [*arms, arm], [*files, *(s for s in sources if not s.read_only and s.data not in same)]
        found += one
    if len({arm.robot.name for arm in arms}) > 1:
        names = " and ".join(sorted({f"`{arm.robot.name}`" for arm in arms}))
        raise PostprocError.of("CLI013", f"programs of {names} were touched up", help="name the folder of one task")
    return found, arms[0] if arms else settled(settings, str(touched.place), bare=True)[1], files


def _read(sources: list[Source]) -> Program:
    """Read a program.

    Raises:
        PostprocError: there is an error in it.
    """
    from postproc.rapid.program.program import read_program

    program = read_program(sources)
    if has_errors(program.diagnostics):
        raise PostprocError(program.diagnostics)
    return program


def _nothing(found: TouchUps) -> Diagnostic:
    """Return DAT052: no target was touched up."""
    others = "; ".join(f"{count} {reason}" for reason, count in found.omitted.items() if count)
    text = f"none of {found.compared} targets was touched up" + (f": {others}" if others else "")
    help_ = "name the version before and the one after touching up, in this order; both need the same routines"
    return Diagnostic("DAT052", "error", text, help=help_)
