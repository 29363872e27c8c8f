"""The figures of a conversion: how far the torch is off before and after, where it welds, in the air, at speed changes.

Terminal, header, page, certificate, batch and documents show these figures and measure none of their own.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from postproc.compensation.correction.curve import BEFORE_TARGET, FROM_START, Transition
from postproc.compensation.correction.deviation import Deviation
from postproc.compensation.plan import CorrectionPlan
from postproc.compensation.text.values import UNCHANGED_MM
from postproc.diagnostics import Diagnostic, Matter, Severity, Source
from postproc.motion.values import Flags
from postproc.rapid.data.events import MotionStatement, StatementKey

WORSE_RATIO = 2.0  # between targets that are corrected and others that cannot be, a line may end a little farther off


Place = Literal["weld", "air", "path", "speed_changes", "correction_jumps"]
"""Where a figure was measured: ``path`` is that of a program that welds nowhere."""
LABELS: Mapping[Place, str] = {
    "weld": "weld",
    "air": "air",
    "path": "lines and arcs",
    "speed_changes": "speed changes",
    "correction_jumps": "correction jumps",
}
"""Names of places in tables."""
CLAUSES: Mapping[Place, str] = {
    "weld": "while the arc burns",
    "air": "in the air",
    "path": "along lines and arcs",
    "speed_changes": "while the speed changes",
    "correction_jumps": "where the correction jumps",
}
"""The same in sentences."""
UNJUDGED: Mapping[Place, str] = {
    "speed_changes": "the arm speeds up or slows down, its inertia bends it, and no target undoes that",
    "correction_jumps": "a load changes or a joint turns back, without the arc",
}
"""What happens in places that have no tolerance."""
COLUMNS = ("deviation [mm]", "before", "after, in the model", "tolerance", "expected on the arm")
"""Of the table of figures."""


@dataclass(frozen=True, slots=True)
class PlaceFigures:
    """Largest deviations across lines and arcs in one place [m]: sideways and along the stick-out together.

    Args:
        tolerance: that is asked for there, None for none.
        line: of the statement with the largest one after correction.
    """

    place: Place
    before: float
    after: float
    tolerance: float | None = None
    line: int | None = None


def shown_figures(figures: Sequence[Mapping[str, Any]]) -> list[Mapping[str, Any]]:
    """The entries of ``figures`` that tables show: all with a tolerance, and others that are beyond the first of these.

    Args:
        figures: of the ``postproc/compensate/1`` document, the place that counts most first.
    """
    tolerance = next((row["tolerance_mm"] for row in figures if row["tolerance_mm"] is not None), 0.0)
    return [row for row in figures if row["tolerance_mm"] is not None or row["after_mm"] > tolerance]


def legend(figures: Sequence[Mapping[str, Any]]) -> str:
    """What happens in the rows without a tolerance that tables show, empty without any.

    Args:
        figures: as of `shown_figures`.
    """
    places = [row["place"] for row in shown_figures(figures) if row["place"] in UNJUDGED]
    rows = [f"{LABELS[place]}: {UNJUDGED[place]}" for place in places]
    return f"{'; '.join(rows)}. No tolerance holds there." if rows else ""


@dataclass(frozen=True, slots=True)
class PathFigures:
    """Largest deviations [m] along the motions of the files that may change.

    Args:
        places: deviations that are shown, the place that counts most first; none where nothing could be measured.
            All others are whole distances, also along the path, by which corrections are judged.
        before, after: along lines and arcs at steady speed.
        arc_before, arc: where the welding arc burns, before and after; None where it never does.
        transient: while the speed changes.
        transition: where the correction jumps.
        joint_move: of joint moves.
    """

    places: tuple[PlaceFigures, ...] = ()
    before: float = 0.0
    after: float = 0.0
    arc_before: float | None = None
    arc: float | None = None
    transient: float = 0.0
    transition: float = 0.0
    joint_move: float = 0.0

    @property
    def counting(self) -> tuple[float, float]:
        """The deviations before and after in the place that counts most: welds, or else lines and arcs."""
        return (self.places[0].before, self.places[0].after) if self.places else (0.0, 0.0)


def figures_of(plan: CorrectionPlan, before: Deviation, after: Deviation) -> PathFigures:
    """The largest deviations along a program, before and after its correction."""
    changing = changing_files(plan)
    of_owner, passing = changing[after.owner], in_transition(plan, after, plan.transitions)
    (path_before, arc_before), (path_after, arc_after) = (
        _at_steady_speed(plan, before, ()),
        _at_steady_speed(plan, after, _idle(plan)),
    )
    return PathFigures(
        _places(plan, before, after, changing),
        path_before,
        path_after,
        arc_before,
        arc_after,
        after.largest(after.space & of_owner & ~after.steady & ~passing),
        after.largest(passing & of_owner),
        after.largest(~after.space & of_owner),
    )


def _at_steady_speed(
    plan: CorrectionPlan, deviation: Deviation, jumps: Iterable[Transition]
) -> tuple[float, float | None]:
    """The largest deviation [m] along lines and arcs, and where the arc burns, None where it never does.

    Args:
        jumps: transitions of the plan whose samples do not count.
    """
    changing = changing_files(plan)
    space = deviation.space & changing[deviation.owner] & ~in_transition(plan, deviation, jumps)
    burning = space & np.array([move.welding for move in plan.motion.moves])[deviation.owner]
    arc = deviation.largest(_counted(burning, deviation.steady)) if burning.any() else None
    return deviation.largest(_counted(space, deviation.steady)), arc


def _places(plan: CorrectionPlan, before: Deviation, after: Deviation, changing: Flags) -> tuple[PlaceFigures, ...]:
    """Deviations across the path where it welds, in the air, while the speed changes, and at jumps of the correction.

    A jump inside a weld is part of the weld, whatever makes it (`at_work`).

    Args:
        changing: (m,) moves of files that may change.
    """
    both, welding = (before, after), np.array([move.welding for move in plan.motion.moves])
    space = [d.space & changing[d.owner] for d in both]
    burning = [welding[d.owner] for d in both]
    passing = [rows & in_transition(plan, d, _idle(plan)) for rows, d in zip(space, both, strict=True)]
    space[1] = space[1] & ~passing[1]
    welds = [_counted(rows & lit, d.steady) for rows, lit, d in zip(space, burning, both, strict=True)]
    air = [_counted(rows & ~lit, d.steady) for rows, lit, d in zip(space, burning, both, strict=True)]
    unsteady = [rows & ~d.steady for rows, d in zip(space, both, strict=True)]
    masks: dict[Place, list[Flags]] = {"weld": welds, "air" if welds[1].any() else "path": air}
    masks |= {"speed_changes": unsteady, "correction_jumps": passing}
    places = []
    for place, rows in masks.items():
        chosen = np.flatnonzero(rows[1])
        if not len(chosen):
            continue
        sizes = [float(np.max(d.across[mask], initial=0.0)) for mask, d in zip(rows, both, strict=True)]
        tolerance = None if place in ("speed_changes", "correction_jumps") else plan.path_tolerance[after.owner[chosen]]
        worst = int(after.owner[chosen[np.argmax(after.across[chosen])]])
        line = plan.motion.moves[worst].event.statement.line
        places.append(
            PlaceFigures(place, sizes[0], sizes[1], None if tolerance is None else float(tolerance.max()), line)
        )
    return tuple(places)


def _counted(space: Flags, steady: Flags) -> Flags:
    """(n,) samples whose deviation is reported: those at steady speed, or all in ``space`` if there are none."""
    return space & steady if (space & steady).any() else space


def worsened(plan: CorrectionPlan, before: Deviation, after: Deviation, source: Source) -> list[Diagnostic]:
    """CMP013, an error, if the corrected program deviates by more than the tolerance and twice the original.

    Jumps do not count: a gap that a joint crosses was half as large on either side of it.
    """
    sizes = zip(_at_steady_speed(plan, before, ()), _at_steady_speed(plan, after, plan.transitions), strict=True)
    tolerances = float(plan.path_tolerance.max()), plan.motion.options.tolerance_m
    findings = []
    for (was, stays), tolerance in zip(sizes, tolerances, strict=True):
        if was is not None and stays is not None and stays > max(tolerance, WORSE_RATIO * was):
            text = f"the corrected program would be {1e3 * stays:.5g} mm off, the original is {1e3 * was:.5g} mm"
            help_ = "nothing is written; please report this program"
            findings.append(Diagnostic("CMP013", "error", text, source, help=help_))
    return findings


def changing_files(plan: CorrectionPlan) -> Flags:
    """(m,) moves of files that may change, and moves of other files whose start and goal are both corrected."""
    moves = plan.motion.moves
    changing = np.array([not move.event.statement.source.read_only for move in moves])
    known = changing | [move.event.statement.key in plan.places for move in moves]
    first = np.array([move.starts_chain for move in moves])
    return changing | (known & np.append(False, known[:-1]) & ~first)


def at_work(plan: CorrectionPlan, t: Transition) -> bool:
    """Whether what the correction leaves at a jump counts as all other deviations of its move do.

    It does while the arc burns. In a program that welds nowhere, so does a joint that turns back along a line or arc;
    there a load changes where the arm stops, and the correction passes over on purpose.
    """
    if any(move.welding for move in plan.motion.moves):
        return plan.motion.moves[t.move].welding
    return t.where not in (BEFORE_TARGET, FROM_START)


def _idle(plan: CorrectionPlan) -> list[Transition]:
    """The transitions that do not count as all other deviations of their move do."""
    return [t for t in plan.transitions if not at_work(plan, t)]


def in_transition(plan: CorrectionPlan, after: Deviation, transitions: Iterable[Transition]) -> Flags:
    """(n,) samples at which the correction passes from one state to another since the load or lost motion jumps.

    Args:
        after: deviation at the n samples of the written program. transitions: those of the plan to look at.
    """
    samples = plan.motion.samples
    inside = np.zeros(len(after.distance), dtype=bool)
    of_load = [t for t in transitions if t.of_load]
    if not of_load:
        return inside
    order = np.argsort(after.owner, kind="stable")
    first = np.searchsorted(after.owner[order], np.arange(len(samples.goal) + 1))
    for t in of_load:
        low, high = samples.u[t.samples[0]], samples.u[t.samples[1]]
        margin = 1.0 / max(1, int(samples.goal[t.move] - samples.start[t.move]))
        rows = order[first[t.move] : first[t.move + 1]]
        inside[rows] |= (after.u[rows] >= low - margin) & (after.u[rows] <= high + margin)
    return inside


def transition_findings(plan: CorrectionPlan, after: Deviation) -> list[Diagnostic]:
    """The largest jump of the correction per statement: CMP008 (warning) where it counts, else CMP007 (info).

    It counts while the arc burns, and along other lines and arcs (`at_work`) where it leaves more than the tolerance.

    Args:
        after: deviation at the n samples of the written program.
    """
    counted = in_transition(plan, after, [t for t in plan.transitions if at_work(plan, t)])
    off = after.largest_of_moves(counted & after.space & after.steady)
    largest: dict[StatementKey, Transition] = {}
    changing = changing_files(plan)
    for t in plan.transitions:
        key = plan.motion.moves[t.move].event.statement.key
        if changing[t.move] and t.of_load and (key not in largest or largest[key].size_m < t.size_m):
            largest[key] = t
    findings = []
    for t in largest.values():
        if 1e3 * t.size_m < UNCHANGED_MM:
            continue
        move = plan.motion.moves[t.move]
        text = f"the correction changes by {1e3 * t.size_m:.3f} mm {t.where}, within {t.duration:.2f} s"
        beyond = bool(off[t.move] > plan.path_tolerance[t.move])
        if move.welding or beyond:
            action = "start and end the seam with a stop"
            if plan.motion.sides is not None:
                action = "no target undoes lost motion: turn the torch or the work so that the joint goes on one way"
            elif plan.motion.options.force_on == "arc":
                action += ", or let the force act on the whole program"
            text += ", while the arc burns" * move.welding
            remaining, tolerance = (1e3 * float(x[t.move]) for x in (off, plan.path_tolerance))
            text += f": the path stays {remaining:.3f} mm off there, tolerance {tolerance:g} mm" * beyond
            matter, size = Matter.OFF if beyond else None, remaining if beyond else 1e3 * t.size_m
            findings.append(finding("CMP008", "warning", move.event.statement, text, action, matter=matter, size=size))
        else:
            findings.append(finding("CMP007", "info", move.event.statement, text))
    return findings


def transient_finding(plan: CorrectionPlan, after: Deviation, counted: Flags) -> list[Diagnostic]:
    """CMP009 (info) with the largest deviation while the arm speeds up or slows down, if it is above the tolerance.

    Args:
        after: deviation at the n samples of the written program.
        counted: (n,) samples to look at.
    """
    rows = np.flatnonzero(counted & after.space & ~after.steady)
    if not len(rows) or after.distance[rows].max() <= plan.motion.options.tolerance_m:
        return []
    worst = rows[int(np.argmax(after.distance[rows]))]
    move = plan.motion.moves[int(after.owner[worst])]
    off = 1e3 * after.distance[worst]
    text = f"while the arm speeds up or slows down it is up to {off:.3f} mm off, most on the way to here"
    return [finding("CMP009", "info", move.event.statement, text)]


def finding(
    code: str,
    severity: Severity,
    statement: MotionStatement,
    text: str,
    help_: str = "",
    *,
    matter: Matter | None = None,
    size: float = 0.0,
) -> Diagnostic:
    """A diagnostic placed at a whole motion statement; ``help_`` says what the user can do."""
    source, span = statement.source, statement.span
    return Diagnostic(code, severity, text, source, span, help_, matter, size=size)
