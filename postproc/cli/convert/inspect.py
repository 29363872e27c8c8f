"""``postproc inspect``: what a program moves, where, and what would be left alone and why."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from postproc.cli.data_names import check_names
from postproc.cli.options import CheckFlag, Format
from postproc.cli.output import present
from postproc.cli.printing import show
from postproc.cli.program_options import ProgramOptions
from postproc.cli.programs import named_files, read_program_file, read_task, settled
from postproc.cli.progress import watching
from postproc.cli.run import BAD_INPUT
from postproc.diagnostics import Matter, has_errors


def run(
    program: str, /, *, stated: ProgramOptions = ProgramOptions(), format: Format = None, json: CheckFlag = False
) -> int:
    """List what a program moves, where, and what would be left alone and why; exit 1 if something is out of reach.

    What would be edited is decided as ``compensate`` does with what ``postproc.toml`` says, and no more.

    Args:
        program: RAPID module; - reads stdin.
        json: print the postproc/inspect/1 document.
    """
    from postproc.compensation.inspection import inspect_program
    from postproc.results.convert.inspection import inspection_document
    from postproc.runtime.passes import correct_program

    source = read_program_file(program)
    settings, arm = settled(stated.settings_at(Path(program).parent), program, bare=True)
    sources, options, findings = read_task(source, settings)
    check_names(stated, sources)
    with watching(f"reading `{source.path}`", len(source.line_starts)) as watch:
        inspection = inspect_program(sources, arm.robot, options, arm.station)
        values = None
        if not has_errors(d for d in inspection.diagnostics if d.matter is not Matter.UNFOLLOWABLE):
            converted = correct_program(sources, arm, options, watch)
            inspection = inspection.decided(converted.outcomes, converted.diagnostics)
            values = converted.report if arm.effects else None
    inspection = replace(inspection, diagnostics=(*findings, *inspection.diagnostics))
    show(named_files(inspection.diagnostics, sources))
    failed = has_errors(inspection.diagnostics)
    form = "json" if json else format
    if form is not None or inspection.rows or not failed:
        document = inspection_document(Path(source.path).name, inspection, settings.document(arm.robot.name), values)
        present(document, form=form, on_stderr=not inspection.rows)
    if any(d.matter is Matter.NO_MODULE for d in inspection.diagnostics):
        return BAD_INPUT
    return int(failed)
