"""``postproc inspect``: what a program moves, where, and what would be left alone and why."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from postproc.cli.conversion import ProgramOptions
from postproc.cli.options import Flag, Format
from postproc.cli.programs import named_files, read_lent, read_program_file, settled
from postproc.cli.progress import watching
from postproc.cli.report import print_document, put, say, show
from postproc.cli.run import BAD_INPUT
from postproc.diagnostics import Matter, has_errors

if TYPE_CHECKING:
    from postproc.compensation.text.values import Place
    from postproc.report.inspection import Row

EDITED: Mapping[Place | None, str] = {
    "declaration": "; its declaration is edited",
    "element": "; its array element is edited",
    "aggregate": "; its numbers are edited",
    "argument": "; an offset is written into its argument",
    "call": "; the argument of its call is edited",
    "derived": "; it moves with the target that it is derived from",
    None: "",
}
HEAD = f" line  {'routine':16} {'instruction':10} {'x':>9}{'y':>9}{'z [mm]':>9}  tool, load, frame; what is edited"


def run(program: str, /, *, given: ProgramOptions = ProgramOptions(), format: Format = None, json: Flag = False) -> int:
    """List what a program moves, where, and what would be left alone and why; exit 1 if something is out of reach.

    What would be edited is decided as ``compensate`` does with what ``postproc.toml`` says, and no more.

    Args:
        program: RAPID module; - reads stdin.
        json: print the postproc/inspect/1 document.
    """
    from postproc.convert import compensate_program
    from postproc.report.inspection import inspect_program

    own = read_program_file(program)
    settings, arm = settled(given.settings_at(Path(program).parent), program, bare=True)
    sources, options = [own, *read_lent(settings.side_files, program)], settings.options
    with watching(f"reading `{own.path}`", len(own.line_starts)) as watch:
        found = inspect_program(sources, arm.robot, options, arm.station)
        if not has_errors(d for d in found.diagnostics if d.matter is not Matter.UNFOLLOWABLE):
            converted = compensate_program(sources, arm, options, watch)
            found = found.decided(converted.outcomes, converted.diagnostics)
    show(named_files(found.diagnostics))
    if (form := "json" if json else format) is not None:
        findings = [d.as_json() for d in found.diagnostics]
        statements = [_document(row) for row in found.rows]
        stated = settings.document(arm.robot.name)
        nearest = [near.as_json() for near in found.nearest]
        document = {"schema": "postproc/inspect/1", **stated, "statements": statements, "nearest": nearest}
        document["diagnostics"] = findings
        print_document(document, form)
    elif found.rows:
        put("\n".join([HEAD, *map(_text, found.rows), *_start(found.start), *(n.render() for n in found.nearest)]))
    elif not has_errors(found.diagnostics):
        say("no motion statements")
    if any(d.matter is Matter.NO_MODULE for d in found.diagnostics):
        return BAD_INPUT
    return int(has_errors(found.diagnostics))


def _text(row: Row) -> str:
    statement = row.statement
    where = "      no position" if row.position_mm is None else "".join(f"{x:9.1f}" for x in row.position_mm)
    head = f"{statement.line:5}  {statement.routine:16} {statement.instruction:10} {where}"
    load = f"  {row.tool} {row.payload_mass:g} kg, {row.wobj}" if row.runs else ""
    axes = "".join(f", eax_{letter} {at:g}" for letter, at in row.external_axes.items())
    times = f", {row.runs} times" if row.runs > 1 else ""
    lines = [head + load + axes + times + EDITED[row.edited], *(f"{'':7}note: {note}" for note in row.notes)]
    return "\n".join([*lines, f"{'':7}left alone: {row.reason}"] if row.reason else lines)


def _start(row: Row | None) -> list[str]:
    """The posture in which the program begins, as far as it is known."""
    if row is None or row.q_deg is None:
        return []
    joints = ", ".join(f"{angle:.1f}" for angle in row.q_deg)
    conf = f", confdata [{','.join(map(str, row.confdata))}]" if row.confdata is not None else ""
    return [f"start: joints {joints} deg{conf}; line {row.statement.line}, {row.statement.instruction}"]


def _document(row: Row) -> dict[str, object]:
    statement = row.statement
    return {
        "line": statement.line,
        "routine": statement.routine,
        "instruction": statement.instruction,
        "runs": row.runs,
        "tool": row.tool or None,
        "wobj": row.wobj or None,
        "payload_kg": row.payload_mass,
        "position_mm": row.position_mm,
        "external_axes": dict(row.external_axes),
        "joints_deg": row.q_deg,
        "confdata": row.confdata,
        "notes": row.notes,
        "edited": row.edited,
        "reason": row.reason,
    }
