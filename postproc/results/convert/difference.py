"""Two programs, and two folders of them, compared by meaning."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import asdict

from postproc.numbers import fixed
from postproc.rapid.diff.difference import FileDiff, ProgramDiff
from postproc.rapid.program.program import Program
from postproc.report.blocks import DataTable, Document, Figure, Scene, Section, Values, attributes
from postproc.report.drawing.differences import differences_data

DIFFERENCE_COLUMNS = ("what", "where", "line before", "line after", "name")
AMOUNT_COLUMNS = ("dx [mm]", "dy [mm]", "dz [mm]", "distance [mm]", "angle [deg]", "speed [mm/s]", "was [mm/s]", "else")
FILES = ("file", "result", "changed", "added", "removed", "compared", "distance [mm]", "angle [deg]", "note")
ROLES = {"\\wobj": "work object", "\\tload": "load", "\\v": "speed", "\\t": "duration", "\\z": "zone"}
"""Words for arguments of motion statements; others are named as in the table."""
LONGEST_NAME = 24  # letters of a name that leave room for the amounts beside it
FEW_DIFFERENCES = 3  # differences of a file that a terminal prints where not all are asked for
WITHIN = "other bytes, within the tolerance"
NOTE = "Targets in the axes of their work object, from the first program to the second; beyond the tolerance."
IN_BOTH = "Files by their path in both folders; added stands in the second alone, removed in the first."


def difference_rows(difference: ProgramDiff) -> list[Values]:
    """Return the entries of ``differences``, one for each statement that differs."""
    return [
        {**asdict(d), "arguments": [{"role": role, "a": a, "b": b} for role, a, b in d.arguments]}
        for d in difference.differences
    ]


def difference_document(
    first: str, second: str, difference: ProgramDiff, programs: tuple[Program, Program] | None = None
) -> Document:
    """Describe a comparison of two programs, for terminal and page.

    Args:
        first, second: their names. programs: whose paths the page draws, None for no picture.
    """
    entries = difference_rows(difference)
    rows, lines = [_row(d) for d in entries], [(d.line_a, d.line_b) for d in difference.differences]
    table = DataTable("differences", (*DIFFERENCE_COLUMNS, *AMOUNT_COLUMNS), rows, view="table")
    stage = "stage" if programs is not None and any(d.what == "motion" for d in difference.differences) else ""
    return Document(
        title=f"postproc diff {first} {second}",
        values={
            "schema": "postproc/diff/1",
            **attributes(difference, "equal", "tolerance_mm", "tolerance_deg", "compared"),
            **attributes(difference, "max_distance_mm", "max_angle_deg"),
            "differences": entries,
        },
        sentence=f"{statements_text(difference)}.",
        figures=[
            Figure("largest distance", difference.max_distance_mm),
            Figure("largest angle", difference.max_angle_deg, unit="deg"),
            Figure("statements that differ", len(rows)),
        ],
        basis=_tolerance(difference.tolerance_mm, difference.tolerance_deg),
        sections=[Section("What differs", [table], NOTE)],
        scene=Scene(
            "differences", lambda: differences_data(*programs, lines) if programs and stage else {}, stage=stage
        ),
    )


def folders_document(first: str, second: str, files: Sequence[FileDiff], near: tuple[float, float]) -> Document:
    """Describe a comparison of two folders, for terminal and page.

    Args:
        first, second: their names. near: tolerances [mm], [deg].
    """
    counts = Counter(dict.fromkeys(("equal", "changed", "added", "removed", "unreadable"), 0))
    counts.update(f.status for f in files)
    order = sorted(files, key=lambda f: (f.status == "equal", f.path))
    unequal = [i for i, f in enumerate(order) if f.status != "equal"]
    overview: list[Sequence[object]] = []
    rows: list[Sequence[object]] = []
    brief: list[int] = []
    for f in order:
        counted = [*f.difference.counts.values(), f.difference.compared]
        largest = (f.difference.max_distance_mm, f.difference.max_angle_deg)
        amounts = [round(x, 4) if f.difference.compared else None for x in largest]
        note = WITHIN if f.compared and f.status == "equal" else f.reason
        overview.append([f.path, f.status, *(counted if f.compared else [None] * 4), *amounts, note])
        differences = [(f.path, *_row(d)) for d in difference_rows(f.difference)]
        brief += range(len(rows), len(rows) + len(differences[:FEW_DIFFERENCES]))
        rows += differences
    of_files = DataTable("files", FILES, overview, unequal)
    table = DataTable("differences", ("file", *DIFFERENCE_COLUMNS, *AMOUNT_COLUMNS), rows, brief, view="table")
    different = {status: n for status, n in counts.items() if status != "equal"}
    return Document(
        title=f"postproc diff {first} {second}",
        values={
            "schema": "postproc/diff-folders/1",
            "equal": not different,
            "tolerance_mm": near[0],
            "tolerance_deg": near[1],
            "counts": counts,
            "files": [_file_values(f) for f in files],
        },
        sentence=f"Of {len(files)} file{'s' * (len(files) != 1)}: {_counted(different)}{_within(files)}.",
        figures=[
            Figure("largest distance", max((f.difference.max_distance_mm for f in files), default=0.0)),
            Figure("files that differ", len(files) - counts["equal"]),
            Figure("statements that differ", len(rows)),
        ],
        basis=_tolerance(*near),
        sections=[Section("Every file", [of_files], IN_BOTH), Section("What differs", [table], NOTE)],
        scene=Scene("differences", dict),
    )


def change_lines(files: Sequence[FileDiff]) -> list[str]:
    """Say of each file whether it would change, in how many motion statements, and by how much.

    Args:
        files: as it is, and as it would be written; ``added`` where it is not there yet.
    """
    return [_change_line(f) for f in files]


def _change_line(f: FileDiff) -> str:
    """Return one line on a file that would be written."""
    if f.status == "added":
        return f"`{f.path}` is not there and would be written"
    if f.status == "removed":
        return f"`{f.path}` comes of no program any more: delete it, or put its program back"
    if f.status == "equal":
        return f"`{f.path}` would not change"
    if not f.difference.differences:
        return f"`{f.path}` would change, and no motion in it"
    return f"`{f.path}` would change: {statements_text(f.difference)}"


def statements_text(difference: ProgramDiff) -> str:
    """Return what differs: ``8 of 9 motion statements differ, by up to 0.46 mm, 2 added``; then all other statements.

    Behind the distance stands of how many statements tool, zone or another argument differs: ``the tool of 8``. The
    largest distance is that of targets; where that of a circle point is larger, it is said to be one.
    """
    moved = [d for d in difference.differences if d.what == "motion"]
    others = Counter(d.kind for d in difference.differences if d.what != "motion")
    kinds = Counter(d.kind for d in moved)
    parts = [f"{kinds['changed']} of {difference.compared} motion statement{'s' * (difference.compared != 1)} differ"]
    farthest = max(moved, key=lambda d: d.distance_mm or 0.0, default=None)
    if farthest is not None and farthest.distance_mm:
        at = " at a circle point" * farthest.at_circle_point
        parts.append(f"by up to {fixed(farthest.distance_mm, 3)} mm{at}")
    # What stands beside the target counts as much: a tool of another length moves the arm where no target moves.
    roles = Counter(role for d in moved if d.kind == "changed" for role in dict.fromkeys(r for r, _, _ in d.arguments))
    parts += [f"the {ROLES.get(role, role)} of {count}" for role, count in roles.items()]
    parts += [f"{kinds[kind]} {kind}" for kind in ("added", "removed") if kinds[kind]]
    further = ", ".join(f"{others[kind]} {kind}" for kind in ("changed", "added", "removed") if others[kind])
    return ", ".join(parts) + (f"; other statements and declarations: {further}" if further else "")


def _tolerance(mm: float, deg: float) -> str:
    """Return the sentence that states the tolerances."""
    return f"Tolerance {mm:g} mm and {deg:g} deg."


def _within(files: Sequence[FileDiff]) -> str:
    """Return a clause on files that are equal by meaning alone, empty without any: a check by bytes is red of them."""
    count = sum(f.compared and f.status == "equal" for f in files)
    have = "1 other file has" if count == 1 else f"{count} other files have"
    return f"; {have} {WITHIN}" if count else ""


def _counted(counts: Mapping[str, int]) -> str:
    """Return the counts that are not zero with their names, or "nothing differs"."""
    return ", ".join(f"{n} {kind}" for kind, n in counts.items() if n) or "nothing differs"


def _file_values(f: FileDiff) -> Values:
    """Return an entry of ``files`` of the document of folders."""
    return {
        **attributes(f, "path", "status", "reason"),
        "compared": f.difference.compared,
        **f.difference.counts,
        **attributes(f.difference, "max_distance_mm", "max_angle_deg"),
        "differences": difference_rows(f.difference),
    }


def _row(d: Values) -> Sequence[object]:
    """Return the row of a difference in the table.

    Args:
        d: its entry in ``differences`` of the document.
    """
    arc = ["at the circle point"] if d["at_circle_point"] else []
    conf = [f"conf {list(d['conf'][0])} -> {list(d['conf'][1])}"] if d["conf"] else []
    others = [*arc, *conf, *(f"{a['role']}: {a['a'] or '-'} -> {a['b'] or '-'}" for a in d["arguments"])]
    shift = d["shift_mm"] or (None, None, None)
    kind = d["kind"] if d["what"] == "motion" else f"{d['kind']} {d['what']}"
    amounts = [None if x is None else round(x, 4) for x in (*shift, d["distance_mm"], d["angle_deg"])]
    was, now = d["speed_mm_s"] or (None, None)
    name = f"{d['name']} {d['target']}".rstrip()
    if len(name) > LONGEST_NAME and d["what"] == "motion":
        name = f"{name[: LONGEST_NAME - 1]}\N{HORIZONTAL ELLIPSIS}"
    elif len(name) > LONGEST_NAME:  # a whole statement
        name, others = f"{name[:LONGEST_NAME]} ..", [name, *others]
    return [kind, d["place"], d["line_a"], d["line_b"], name, *amounts, now, was, "; ".join(others)]
