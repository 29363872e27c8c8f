"""The comment at the head of a corrected module: what was done to it, and how near it comes."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from jinja2.sandbox import SandboxedEnvironment

from postproc import __version__
from postproc.compensation.conversion import Draft, JudgedProgram
from postproc.compensation.judgement.accuracy import remaining_deflection
from postproc.compensation.judgement.figures import COLUMNS, LABELS, shown_figures
from postproc.compensation.options import Options
from postproc.compensation.verdict import verdict_of
from postproc.diagnostics import Source, one_line
from postproc.model.arm import Model
from postproc.numbers import fixed, range_text
from postproc.rapid.syntax.spans import Edit
from postproc.render.module import render_text
from postproc.render.templates import environment, fill, load_template
from postproc.render.text import indent_after, line_style
from postproc.robot.pose import rpy_degrees


def render_outputs(
    draft: Draft, judged: JudgedProgram, further: Iterable[tuple[Source, Edit]] = ()
) -> dict[str, bytes]:
    """The bytes of every file that may change, by path, with a header in each that is edited.

    Args:
        judged: what the headers say.
        further: edits beside those of the draft, with the file of each.
    """
    program, env, values = draft.program, environment(draft.options.template_dir), header_values(draft.model, judged)
    edits = {s.path: list(draft.edits.get(s.path, ())) for s in program.sources}
    for source, edit in further:
        edits[source.path].append(edit)
    files = [s for s in program.sources if not s.read_only]
    for s in files:
        if edits[s.path]:
            head_end = next(m.head[1] for m in program.modules if m.source is s)
            edits[s.path].append(header_edit(env, s, head_end, values))
    return {s.path: render_text(env, s.data, edits[s.path]) for s in files}


def header_values(model: Model, judged: JudgedProgram) -> dict[str, Any]:
    """The values for the template ``header.j2``; those named ``figures`` are lines of text."""
    options = judged.options
    arm = {"robot": model.robot.name, "mounting_deg": rpy_degrees(model.R_world_base)}
    stiffness = remaining_deflection({**arm, **judged.remaining_values()})
    return {
        "version": __version__,
        "robot": model.robot.name,
        "effects": ", ".join(e.key for e in model.effects) or "rigid",
        "wrench": _wrench_text(options),
        "already": ", ".join(options.already),
        "taught": ", ".join(dict.fromkeys(shift.wobj for shift in judged.shifts if shift.omitted)),
        "figures": _figure_lines(judged),
        "verdict": one_line(verdict_of(judged).sentence),
        "stiffness": [line for line in stiffness if line],
        "added": judged.added,
        "left": judged.uncorrected,
        "run_time": judged.run_time,
        "measured": judged.lines - judged.unmeasured,
        "unmeasured": judged.unmeasured,
        "unproved": judged.unproved,
    }


def _figure_lines(judged: JudgedProgram) -> list[str]:
    """The table of figures as aligned lines; none where nothing could be measured."""
    digits, rows = judged.decimals, [list(COLUMNS)] if judged.places else []
    for row in shown_figures(judged.figure_values()):
        lengths = [fixed(row[f"{key}_mm"], digits) for key in ("before", "after", "tolerance")]
        rows.append([LABELS[row["place"]], *lengths, range_text(row["expected_on_arm_mm"], digits, guess=judged.guess)])
    first, *others, last = (max(map(len, column)) for column in zip(*rows, strict=True)) if rows else (0, 0)
    return [
        "  ".join([row[0].ljust(first), *map(str.rjust, row[1:-1], others), row[-1].ljust(last)]).rstrip()
        for row in rows
    ]


def _wrench_text(options: Options) -> str:
    """Process force and moment of the options as text, with where they act; empty if both are zero."""
    parts = [
        f"{name} {', '.join(f'{x:g}' for x in vector)} {unit}"
        for name, vector, unit in (("force", options.force, "N"), ("moment", options.moment, "N m"))
        if any(vector)
    ]
    where = {"all": "along the whole program", "arc": "while the arc burns"}[options.force_on]
    return f"{'; '.join(parts)}, {where}" if parts else ""


def header_edit(env: SandboxedEnvironment, source: Source, head_end: int, values: Mapping[str, object]) -> Edit:
    """Edit that adds the comment on what was done, on lines of its own after the MODULE line.

    Args:
        head_end: byte offset where the MODULE line's declaration ends.
        values: for the template ``header.j2``.
    """
    data = source.data
    _, newline = line_style(data, max(0, head_end - 1))
    line_end = data.find(b"\n", head_end)
    behind = data[head_end : line_end if line_end >= 0 else len(data)]
    # Something else on the MODULE line: a comment stays there, code is moved to a line of its own.
    alone = line_end >= 0 and (not behind.strip() or behind.lstrip().startswith(b"!"))
    offset = line_end + 1 if alone else head_end
    text = fill(load_template(env, "header.j2"), {**values, "indent": indent_after(data, head_end)})
    lines = [line.encode("latin-1", "replace") for line in text.split("\n")]
    block = b"".join(line + newline for line in lines if line.strip())
    return Edit(offset, offset, block if alone else newline + block)
