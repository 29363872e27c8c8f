"""The corrected module: the original bytes with numbers replaced, arguments replaced and statements added."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np
from jinja2.sandbox import SandboxedEnvironment

from postproc.arrays import blocks
from postproc.compensation.text.insertions import CARRIED
from postproc.compensation.text.laws import SLOPE_DECIMALS, OffsetLaw
from postproc.compensation.text.slots import amounts_of
from postproc.compensation.text.values import Change, Insertion, TargetValue
from postproc.diagnostics import Source
from postproc.grouping import grouped
from postproc.rapid.evaluation.declared import numbers_of
from postproc.rapid.program.program import Program
from postproc.rapid.syntax.expressions import read_full_expression
from postproc.rapid.syntax.spans import Edit, edited, literal
from postproc.rapid.syntax.trees import Number
from postproc.render.templates import fill, load_template
from postproc.render.text import (
    MM_DECIMALS,
    POWERS_OF_TEN,
    QUATERNION_DECIMALS,
    broken,
    line_style,
    number_like,
    rapid_number,
    written_decimals,
    written_like,
)

# What a plain move keeps of the statement it is derived from (no signals, seam data).
_PLAIN_ROLES = frozenset({"to", "via", "speed", "zone", "tool", "\\v", "\\wobj", "\\tload"})

_DECIMALS = (MM_DECIMALS,) * 3 + (QUATERNION_DECIMALS,) * 4 + (0,) * 4  # of a target's numbers


def change_edits(env: SandboxedEnvironment, changes: Iterable[Change]) -> Iterator[tuple[Source, Edit]]:
    """Edits, with the file of each, that write corrected targets into a program.

    A target of numbers gets new numbers, ``Offs`` and ``RelTool`` new amounts; around any other expression a
    displacement is put.
    """
    changes = tuple(changes)
    numbers = [change for change in changes if change.form == "numbers"]
    for part in blocks(len(numbers)):  # a match of a target takes kilobytes
        yield from _number_edits(numbers[part])
    for change in (change for change in changes if change.form != "numbers"):
        if change.form == "amounts":
            for edit in _amount_edits(change):
                yield change.source, edit
        elif (around := _around(env, change)) is not None:
            yield change.source, around


def _around(env: SandboxedEnvironment, change: Change) -> Edit | None:
    """Edit that replaces a target expression by ``Offs`` around it, by an aggregate, or by a point on a line or arc.

    None for an offset that rounds to zero. The aggregate holds the components of a named target.
    """
    source, span = change.source, change.span
    written = source.data[slice(*span)].decode("latin-1")
    sums = _sums(change.law, written)
    if change.form == "point":
        text = fill(load_template(env, "path_point.j2"), {"target": change.value})
    elif sums == ["0"] * 3:
        return None
    else:
        template, name = ("displaced.j2", "text") if change.form == "offset" else ("components.j2", "name")
        text = fill(load_template(env, template), {name: written, "displacement": sums})
    lead, newline = line_style(source.data, span[0])
    text = broken(text, lead.decode("latin-1"), newline.decode())
    glued = source.data[span[0] - 1 : span[0]].isalnum() and text[:1].isalpha()
    return Edit(*span, (" " * glued + text).encode("latin-1", "replace"))


def _amount_edits(change: Change) -> Iterator[Edit]:
    """Edits of the amounts in ``Offs`` or ``RelTool``: a new number for a number, a sum for any other expression."""
    data = change.source.data
    tree = read_full_expression(data, *change.span)
    written = data[slice(*change.span)].decode("latin-1")
    for axis, part in enumerate(amounts_of(tree)):
        text, law = data[slice(*part.span)].decode("latin-1"), change.law
        if isinstance(part, Number):
            text = number_like(text, part.value, part.value + law.constant[axis], MM_DECIMALS)
            law = replace(law, constant=(0.0, 0.0, 0.0))
        sums = _sums(law, written)[axis]
        text = text if sums == "0" else f"{text}+{sums}".replace("+-", "-")
        if text.encode("latin-1") != data[slice(*part.span)]:
            yield Edit(*part.span, text.encode("latin-1", "replace"))


def _sums(law: OffsetLaw, text: str) -> list[str]:
    """An offset along x, y and z as three RAPID expressions.

    Args:
        law: the offset: constants [mm] and factors of RAPID variables.
        text: RAPID text from which the spelling of these names is taken.
    """
    terms = []
    for axis in range(3):
        parts = [rapid_number(law.constant[axis], MM_DECIMALS)]
        for name, slope in law.coefficients:
            spelled = re.search(rf"(?<!\w){re.escape(name)}(?!\w)", text, re.IGNORECASE)
            number = rapid_number(slope[axis], SLOPE_DECIMALS)
            factor = "" if number == "1" else "-" if number == "-1" else f"{number}*"
            parts += [f"{factor}{spelled[0] if spelled else name}"] if number != "0" else []
        shown = [part for part in parts if part != "0"] or ["0"]
        terms.append("+".join(shown).replace("+-", "-"))
    return terms


def _number_edits(changes: Sequence[Change]) -> Iterator[tuple[Source, Edit]]:
    """One edit, with its file, for each target of numbers, from the first number that changes to the last.

    None for a target of which no number changes when it is rounded. A quaternion that is equal once it is normalised
    stays as it is written.
    """
    matches = (literal(change.source.data, *change.span) for change in changes)
    literals = [match for match in matches if match is not None]
    before = np.array([numbers_of(match)[:11] for match in literals])
    after = np.array([(*v.pose.trans, *v.pose.rot, *v.robconf) for v in (change.value for change in changes)])
    size = np.array([math.hypot(*row) for row in before[:, 3:7].tolist()])[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        turn = np.abs(before[:, 3:7] / size - after[:, 3:7]).max(axis=1)
    changed = before != after
    changed[turn < 0.5 * 10.0**-QUATERNION_DECIMALS, 3:7] = False  # never for a size of zero, whose turn is no number
    written = written_decimals(np.array([match.groups()[:11] for match in literals]))
    decimals = np.maximum(written, _DECIMALS)
    changed &= np.abs((before - after) * POWERS_OF_TEN[np.minimum(decimals, 308)]) >= 0.5
    rows = np.flatnonzero(changed.any(axis=1)).tolist()
    tables = (x[rows].tolist() for x in (changed, after, written, decimals))
    for row, *numbers in zip(rows, *tables, strict=True):
        source, match = changes[row].source, literals[row]
        start = match.start()
        old = match[0].decode("latin-1")
        begin, end, text = -1, 0, ""
        for (first, last), differs, value, least, most in zip(match.regs[1:12], *numbers, strict=True):
            if differs and (new := written_like(value, least, most)) != old[first - start : last - start]:
                text += new if begin < 0 else old[end - start : first - start] + new
                begin, end = first if begin < 0 else begin, last
        if text:
            yield source, Edit(begin, end, text.encode("latin-1"))


def insertion_edits(env: SandboxedEnvironment, insertions: Iterable[Insertion]) -> list[tuple[Source, Edit]]:
    """Edits, with the file of each, that add statements before the statement that each is derived from.

    An added statement has a line of its own, indented and ended like the line of that statement; on a line with other
    code before that statement it stands between the two, so that no line is broken.
    """
    template = load_template(env, "statement.j2")

    def target(value: TargetValue) -> str:
        """RAPID text of an added target: numbers, or the call of a function."""
        return fill(load_template(env, "path_point.j2" if value.point else "target.j2"), {"target": value})

    edits = []
    for group in grouped((insertion.statement.key, insertion) for insertion in insertions).values():
        statement = group[0].statement
        data, start = statement.source.data, statement.span[0]
        lead, newline = line_style(data, start)
        shared = data[data.rfind(b"\n", 0, start) + 1 : start].strip()
        behind = b" " if shared else newline + lead
        lines = []
        for insertion in group:
            replaced = {"to": target(insertion.to), "zone": insertion.zone}
            if insertion.via is not None:
                replaced["via"] = target(insertion.via)
            values = {"instruction": insertion.instruction, "arguments": _arguments(insertion, replaced)}
            text = fill(template, {"statement": values})
            if insertion.to.point is not None:
                text = broken(text, lead.decode("latin-1"), newline.decode())
            lines.append(text.encode("latin-1", "replace") + behind)
        edits.append((statement.source, Edit(start, start, b"".join(lines))))
    return edits


def function_edits(
    env: SandboxedEnvironment, program: Program, insertions: Sequence[Insertion]
) -> Iterator[tuple[Source, Edit]]:
    """Edits that add the functions for points on lines and arcs to the modules that call them, before ENDMODULE."""
    for module in program.modules:
        place = module.source.path, module.name.lower()
        added = (i for i in insertions if (i.statement.source.path, i.statement.module.lower()) == place)
        functions = {(i.to.point.function, i.to.point.on_arc) for i in added if i.to.point is not None}
        if not functions:
            continue
        data = module.source.data
        end = module.span[1] - len("ENDMODULE")
        _, newline = line_style(data, max(0, end - 1))
        start = data.rfind(b"\n", 0, end) + 1
        at = start if not data[start:end].strip() else end
        text = ""
        for name, on_arc in sorted(functions):
            text += fill(load_template(env, "arc_point.j2" if on_arc else "line_point.j2"), {"name": name})
            text += "" if text.endswith("\n") else "\n"
        yield module.source, Edit(at, at, text.replace("\n", newline.decode()).encode("latin-1"))


def _arguments(insertion: Insertion, replaced: Mapping[str, str]) -> list[dict[str, str]]:
    """The arguments of an added statement, as dictionaries with ``lead`` (text before it), ``text`` and ``role``.

    Options of the original that act at its target, and arguments that a plain move does not have, are left out.

    Args:
        replaced: new text of arguments, by role.
    """
    statement = insertion.statement
    data = statement.source.data
    plain = insertion.instruction.startswith("Move")
    kept: list[dict[str, str]] = []
    previous_end = statement.span[0] + len(statement.instruction)
    for argument in statement.arguments:
        lead = data[previous_end : argument.full_span[0]].decode("latin-1")
        previous_end = argument.full_span[1]
        optional = argument.role.startswith("\\")
        if (optional and argument.role not in CARRIED) or (plain and argument.role not in _PLAIN_ROLES):
            continue
        text = replaced.get(argument.role, data[slice(*argument.full_span)].decode("latin-1"))
        if not kept:
            lead = lead if lead.strip() == "" and lead else " "
        elif "," not in lead and not optional:
            lead = ","  # what stood between them was left out
        kept.append({"lead": lead, "text": text, "role": argument.role})
    return kept


def render_text(env: SandboxedEnvironment, data: bytes, edits: Sequence[Edit]) -> bytes:
    """The file's bytes after edits, put together by the template ``module.j2`` from unchanged and replaced parts."""
    parts = [part.decode("latin-1") for part in edited(data, edits)]
    return fill(load_template(env, "module.j2"), {"parts": parts}).encode("latin-1", "replace")
