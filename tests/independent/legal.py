"""What a converted program may change, and what an added statement may be."""

from __future__ import annotations

import re
from decimal import Decimal

import numpy as np

from tests.independent import arm as A
from tests.independent import paths as P
from tests.independent import rapid_text as R
from tests.independent.rapid import Motion

_NUMBER = re.compile(r"(?<![\w.])[+-]?\d+\.?\d*(?:[eE][+-]?\d+)?")


def _skeleton(s: R.Statement) -> str:
    """What may not change: everything but the numbers of robtargets and the target arguments of moves."""
    m = R.DECLARATION.match(s.code)
    if m and m[1].lower() == "robtarget":
        return re.sub(r"\s+", " ", _NUMBER.sub("#", s.code))
    move = R.MOVES.match(s.code)
    if move and not move[1].lower().startswith("moveabsj"):
        positional, optional = R.split_arguments(s.code[move.end() :].rstrip(";"))
        drop = 2 if re.match(r"movec|arcc", move[1], re.I) else 1
        optional |= dict.fromkeys({"t"} & optional.keys(), "<S>")  # the durations are summed up in check_added
        return f"{move[1]} <T> {positional[drop:]} {sorted(optional.items())}"
    return s.code


def check_text(original: str, output: str) -> list[str]:
    """Only numbers, target arguments, added moves or declarations, comments may differ; names legal."""
    found = []
    a, b = R.statements(original), R.statements(output)
    k, extra = 0, []
    for s in a:
        want, mark = _skeleton(s), k
        while k < len(b) and _skeleton(b[k]) != want:
            k += 1
        if k == len(b):
            found.append(f"line {s.line}: not in the output any more: {s.code[:90]!r}")
            k = mark
            continue
        extra += b[mark:k]
        k += 1
    extra += b[k:]
    outside, wrong = _without_functions(extra, original)
    found += wrong
    for s in outside:
        declared = R.DECLARATION.match(s.code)
        if not (R.MOVES.match(s.code) or (declared and declared[1].lower() == "robtarget")):
            found.append(f"output line {s.line}: added what is neither a move nor a target: {s.code[:90]!r}")
    names_a = [m[2] for s in a if (m := R.DECLARATION.match(s.code))]
    local = {*extra} - {*outside}
    names_b = [m[2] for s in b if s not in local and (m := R.DECLARATION.match(s.code))]
    fresh = list(names_b)
    for n in names_a:
        if n in fresh:
            fresh.remove(n)
    for n in fresh:
        if len(n) > 32:
            found.append(f"name longer than 32 characters: {n}")
        if [x.lower() for x in names_b].count(n.lower()) > 1:
            found.append(f"name declared twice: {n}")
    kept = [c for _, c in R.comments(output)]
    k = 0
    for _, c in R.comments(original):
        try:
            k = kept.index(c, k) + 1
        except ValueError:
            found.append(f"comment lost or changed: {c[:60]!r}")
    for crlf, lf in (("\r\n", "\n"),):
        if crlf in original and original.count(crlf) == original.count(lf) and output.count(crlf) != output.count(lf):
            found.append("bare line feeds in a CRLF file")
        if crlf not in original and crlf in output:
            found.append("carriage returns in an LF file")
    return found


def _without_functions(extra: list[R.Statement], original: str) -> tuple[list[R.Statement], list[str]]:
    """The added statements outside of added functions; what is wrong with these: a name that is in use, a statement that
    writes to anything but the function's own variables.
    """
    rest, wrong = [], []
    own: set[str] | None = None
    for s in extra:
        if head := re.match(r"LOCAL\s+FUNC\s+\w+\s+(\w+)", s.code, re.I):
            own = set()
            if re.search(rf"(?i)\b{head[1]}\b", original) or len(head[1]) > 32:
                wrong.append(f"output line {s.line}: an added function has a name that is in use: {head[1]}")
        elif own is None:
            rest.append(s)
        elif re.match(r"ENDFUNC\b", s.code, re.I):
            own = None
        elif declared := R.DECLARATION.match(s.code):
            own.add(declared[2].lower())
        elif not s.block and not re.match(r"RETURN\b", s.code, re.I):
            written = re.match(r"(\w+)\s*:=", s.code)
            if written is None or written[1].lower() not in own:
                wrong.append(f"output line {s.line}: an added function does more than compute: {s.code[:90]!r}")
    return rest, wrong


def check_added(old: list[Motion], new: list[Motion], match: list[int], arm: A.Arm) -> list[str]:
    """Added moves go with the move they split: same process data, tool and speed, never a stop, legal circles."""
    found = []
    previous = -1
    for i, last in enumerate(match):
        m = old[i]
        arc_like = m.name.lower().startswith("arc")
        for k in range(previous + 1, last):
            x = new[k]
            where = f"output line {x.line}: added {x.name} before {m.name}"
            if m.kind in "JA" and x.kind != "J":
                found.append(f"{where}: inside a joint move")
                continue
            if x.kind != m.kind:
                found.append(f"{where}: another kind of path")
            if x.fine:
                found.append(f"{where}: stops")
            if m.weld != x.weld or re.search(r"start|end", x.name, re.I):
                found.append(f"{where}: welds or not otherwise than the move it splits")
            drop = 2 if m.kind == "C" else 1
            mine, theirs = list(x.positional[drop:]), list(m.positional[drop:])
            if arc_like and x.name.lower().startswith("arc"):
                pairs = [0, 1, 2, 4]
            elif arc_like:
                mine, theirs, pairs = [mine[0], mine[2]], [theirs[0], theirs[4]], [0, 1]
            else:
                pairs = [0, 2]
            if any(mine[p].lower() != theirs[p].lower() for p in pairs):
                found.append(f"{where}: other data {mine} than {theirs}")
            keep = {"wobj", "weave", "track", "seamname", "corr", "tload"} if x.weld else {"wobj", "tload"}
            for name in keep:
                if x.optional.get(name, "").lower() != m.optional.get(name, "").lower() or (name in x.optional) != (
                    name in m.optional
                ):
                    found.append(f"{where}: \\{name} differs")
            if not np.allclose(x.tool, m.tool):
                found.append(f"{where}: other tool")
        parts = [Decimal(x.optional["t"]) for x in new[previous + 1 : last + 1] if "t" in x.optional]
        if "t" in m.optional and (len(parts) != last - previous or sum(parts) != Decimal(m.optional["t"])):
            found.append(f"output line {new[last].line}: the durations {parts} do not sum up to {m.optional['t']} s")
        for k in range(max(previous + 1, 1), last + 1):
            if new[k].kind == "C":
                found += _circle_legal(new[k - 1], new[k], arm)
        previous = last
    return found


def _circle_legal(before: Motion, m: Motion, arm: A.Arm) -> list[str]:
    start = before.goal[:3, 3]
    if before.q is not None:
        start = P.on_work(arm.forward(before.q[None], np.eye(4)).flange, before)[0, :3, 3]
    assert m.via is not None
    u, v = m.via[:3, 3] - start, m.goal[:3, 3] - start
    where = f"output line {m.line}: {m.name}"
    if min(np.linalg.norm(u), np.linalg.norm(v)) < 1e-4:
        return [f"{where}: circle points closer than 0.1 mm"]
    if np.degrees(np.arctan2(np.linalg.norm(np.cross(u, v)), u @ v)) < 1.0:
        return [f"{where}: circle points less than 1 degree apart seen from the start"]
    c = P.circle(start, m.via[:3, 3], m.goal[:3, 3])
    if c.sweep > np.radians(240) + 1e-6:
        return [f"{where}: arc of {np.degrees(c.sweep):.0f} degrees"]
    return []
