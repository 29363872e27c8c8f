"""``postproc touchups``: targets that were taught anew, as a measurement table."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from postproc.cli.inputs import short_names
from postproc.cli.options import AS_WRITTEN, CheckFlag, Flag, Output, positive
from postproc.cli.output import check_outputs, present, write
from postproc.cli.printing import say, say_next, show
from postproc.cli.program_options import ProgramOptions
from postproc.cli.programs import settled, sound_program
from postproc.cli.progress import watching
from postproc.cli.versions import Version, opened_version
from postproc.diagnostics import PostprocError, Source, joined

if TYPE_CHECKING:
    from postproc.measure.touchups import TouchUps
    from postproc.model.arm import Model
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
    json: CheckFlag = False,
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
    from postproc.measure.touchups import share_deviation, touchup_findings, touchup_table
    from postproc.results.improve.touchups import touchups_document

    if wobj_free and wobj_fixed:
        help_ = "leave one of them out"
        raise PostprocError.of("CLI011", "`--wobj-free` and `--wobj-fixed` contradict each other", help=help_)
    with opened_version(nominal) as first, opened_version(touched or nominal) as second:
        check_outputs([first.path, second.path], output)
        settings = stated.settings_at(second.place if second.path.is_dir() else second.place.parent)
        touchups, arm, sources = _compared(first, second, settings, originals=touched is None)
    deviation = None if arm is None or not arm.effects else share_deviation(touchups, arm, noise, not wobj_fixed)
    findings = list(touchup_findings(touchups, deviation, sources))
    if arm is None:
        raise PostprocError([replace(finding, severity="error") for finding in findings], 1)
    show(findings)
    if output is not None or not json:
        write(output, touchup_table(touchups, sources, noise, not wobj_fixed))
    title = short_names(*(name for name in (nominal, touched) if name is not None))
    present(touchups_document(title, touchups, deviation, findings), json=json, text=True, on_stderr=True)
    if output is not None and not json:
        cell = settings.cell or (second.place if second.path.is_dir() and touchups.station.joints else None)
        words = () if cell is None else ("--cell", cell)
        say_next("calibrates the arm", "fit", output, "--robot", arm.robot_name, *words, "-o", "arm.toml")
        say("compensate the nominal program with that model, never the touched-up one, which holds the error already")
    return 0


def _compared(
    nominal: Version, touched: Version, settings: Settings, originals: bool
) -> tuple[TouchUps, Model | None, list[Source]]:
    """Return the touch-ups of all tasks that differ, the model of their arm, and the files that were touched up.

    Args:
        originals: the touched version keeps the originals of its targets, which are compared with those.

    Returns:
        The model is None, and there are no files, where no target was touched up.

    Raises:
        PostprocError: CLI003 a file and a folder, CLI013 several arms or none, or a program that cannot be read.
    """
    from postproc.measure.touchups import TouchUps, find_touchups, with_kept_originals
    from postproc.robot.cells.station import Station

    if nominal.path.is_dir() != touched.path.is_dir():
        text = f"of `{nominal.name}` and `{touched.name}` one is a folder"
        raise PostprocError.of("CLI003", text, help="name two programs, or two folders")
    before = {} if originals else nominal.tasks(settings)
    arms: dict[str, Model] = {}
    total, files = TouchUps(), list[Source]()
    for task, (place, sources) in touched.tasks(settings).items():
        _, was = before.get(task, (place, sources))
        if not originals and [s.data for s in was] == [s.data for s in sources]:
            continue
        program = sound_program(sources)
        was = with_kept_originals(program) if originals else was
        _, arm = settled(settings, str(place), bare=True)
        with watching(f"comparing `{place}`"):
            one = find_touchups(sound_program(was), program, arm.robot, arm.station or Station())
        if one.rows:
            arms[arm.robot.name] = arm
            files += [s for s in sources if not s.read_only and s.data not in {w.data for w in was}]
        total += one
    if len(arms) > 1:
        text = f"programs of {joined([f'`{name}`' for name in arms])} were touched up"
        raise PostprocError.of("CLI013", text, help="name the folder of one task")
    return total, next(iter(arms.values()), None), files
