"""How a program came to be: targets that were jogged onto the work with the real arm hold its error already."""

from __future__ import annotations

from collections.abc import Sequence

from postproc.compensation.correction.rigid_shift import RigidShift
from postproc.compensation.options import Options
from postproc.diagnostics import Diagnostic, joined
from postproc.motion.findings import place
from postproc.motion.values import Move
from postproc.rapid.syntax.spans import TargetSpans, literal

PENDANT = 2  # decimals [mm] with which a pendant stores a position; zeros at the end are left out
FEWEST_TARGETS = 3  # different targets: of one or two that is chance


def doubt_drawn(shifts: Sequence[RigidShift], moves: Sequence[Move], options: Options) -> list[Diagnostic]:
    """CMP024, a warning, where all targets of work objects are written with two decimals, as a pendant stores them.

    Work objects whose rigid shift is left out, or that calibration routines set, are known to be taught.

    Args:
        shifts: of the work objects, with their moves.
    """
    stated = {name.lower() for name in options.taught}
    jogged: dict[str, list[Move]] = {}
    for shift in shifts:
        of_shift = [moves[i] for i in shift.moves.tolist()]
        if not shift.left_out and shift.wobj.lower() not in stated and _as_stored(of_shift):
            jogged.setdefault(shift.wobj, of_shift)
    if not jogged:
        return []
    names, first = list(jogged), next(iter(jogged.values()))[0]
    text = (
        f"all targets in {joined([f'`{name}`' for name in names])} have the two decimals of a pendant: if they were"
        " jogged onto the work with this arm, they hold its error already, and are corrected twice"
    )
    help_ = f"if so, leave it out: `--wobj-taught {','.join(names)}`; if they were drawn, all is well"
    return [Diagnostic("CMP024", "warning", text, *place(first.event), help_)]


def _as_stored(moves: Sequence[Move]) -> bool:
    """Whether the targets of moves are numbers with two decimals, and at least ``FEWEST_TARGETS`` of them."""
    written = set[tuple[str, tuple[int, int]]]()
    for move in moves:
        spans = move.event.target_origin.base.spans
        if spans is None or _decimals(spans) != PENDANT:
            return False
        written.add((spans.source.path, spans.whole))
    return len(written) >= FEWEST_TARGETS


def _decimals(spans: TargetSpans) -> int:
    """The most decimals of x, y and z of a target as it is written, without zeros at the end."""
    match = literal(spans.source.data, *spans.whole)
    numbers = () if match is None else (match[1], match[2], match[3])
    fractions = [n.partition(b".")[2] for n in numbers]
    return max((len(f.rstrip(b"0")) for f in fractions if f.isdigit()), default=0)
