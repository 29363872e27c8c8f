"""What several may share: texts that serve only for targets of motions, one correction for several runs."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence, Set
from dataclasses import dataclass

import numpy as np

from postproc.arrays import Array
from postproc.compensate.values import Displacement
from postproc.rapid.execution.calls import MAX_CALLS
from postproc.rapid.program.events import MotionEvent, StatementKey
from postproc.rapid.program.program import Program
from postproc.rapid.program.references import Use, declaration_uses

APART = 0.03
"""Share of their spread by which numbers must differ from one another to be told apart: a coordinate that is a rounded
multiple of a loop's index differs from it by its rounding, and what goes with that is chance."""

CANCELLING = 2.0
"""How much more than what the shifts differ by one number may do: what takes that back again is other numbers, and with
nearly as many of them as runs that is chance, by which a target that is taught anew would go far off."""


@dataclass(frozen=True, slots=True)
class Users:
    """Motion statements that use a declaration: as a target by itself, or inside Offs, RelTool and the like."""

    plain: frozenset[StatementKey]
    derived: frozenset[StatementKey]


def target_users(program: Program) -> Mapping[str, Users]:
    """Users of each declaration and parameter that serves for nothing but targets; what serves for more is missing.

    What a call hands over to a parameter is used by those who use the parameter.
    """
    uses = declaration_uses(program)
    found: dict[str, Users | None] = {}

    def users(key: str, depth: int) -> Users | None:
        if key not in found:
            found[key] = None  # of a routine that calls itself
            found[key] = joined(uses.get(key, ()), depth) if depth <= MAX_CALLS else None
        return found[key]

    def joined(parts: Iterable[Use], depth: int) -> Users | None:
        plain: set[StatementKey] = set()
        derived: set[StatementKey] = set()
        for use in parts:
            if use.handed and use.kind == "argument":
                more = users(use.handed, depth + 1)
                if more is None:
                    return None
                plain |= more.plain
                derived |= more.derived
            elif use.statement is None or use.kind not in ("motion", "expression") or use.role not in ("to", "via"):
                return None
            else:
                (plain if use.kind == "motion" else derived).add(use.statement.key)
        return Users(frozenset(plain), frozenset(derived))

    return {key: known for key in uses if (known := users(key, 0)) is not None}


def possible_runs(events: Sequence[MotionEvent], rows: Set[int]) -> dict[int, MotionEvent]:
    """Executions by row but for those that the arm cannot make: the controller stops there, nothing is lost by them.

    Args:
        rows: of the events that are moves of the arm.
    """
    return {
        row: e
        for row, e in enumerate(events)
        if e.again is None and (row in rows or e.reason is not None or e.statement.interpolation == "none")
    }


def fully_wished(runs: Mapping[int, MotionEvent], wished: Set[int]) -> frozenset[StatementKey]:
    """Statements of which every execution, by its row among the events, has a corrected value."""
    lacking = {e.statement.key for row, e in runs.items() if row not in wished}
    return frozenset({e.statement.key for e in runs.values()} - lacking)


def led_elsewhere(runs: Mapping[int, MotionEvent], wished: Set[int]) -> frozenset[StatementKey]:
    """Statements that also run to a place that is not known, or to another one for which no value is asked."""
    places = {(e.statement.key, e.target, e.via) for row, e in runs.items() if row in wished}
    return frozenset(
        e.statement.key
        for row, e in runs.items()
        if row not in wished and (e.statement.key, e.target, e.via) not in places
    )


def straight(numbers: Sequence[Mapping[str, float]], shifts: Array, least: float) -> Displacement:
    """The displacement nearest to what n runs ask for, straight in as few of the numbers that they name as will do.

    Args:
        numbers: named in each run; shifts: (n, 3) what the runs ask for.
        least: what may be left over to do with a number less; unit of the shifts.
    """
    names = sorted(set(numbers[0]).intersection(*numbers[1:]), key=lambda name: (-len(name), name))
    best, off, part = _fitted(names, numbers, shifts)
    while part > CANCELLING:
        fewer = [[other for other in names if other != name] for name in names]
        best, off, part = min((_fitted(chosen, numbers, shifts) for chosen in fewer), key=lambda found: found[1])
        names = [name for name, _ in best.slopes]
    for name in tuple(names):
        without = [other for other in names if other != name]
        simpler, left, part = _fitted(without, numbers, shifts)
        if left <= max(1.01 * off, least) and part <= CANCELLING:
            names, best = without, simpler
    return best


def _fitted(
    names: Sequence[str], numbers: Sequence[Mapping[str, float]], shifts: Array
) -> tuple[Displacement, float, float]:
    """Least squares, the constant in the middle of what is left; the largest distance (along an axis) from it; and how
    much the most that a number does is of the spread of the shifts.
    """
    values = np.array([[run[name] for name in names] for run in numbers]).reshape(len(numbers), len(names))
    size = np.ptp(values, axis=0)
    size[size == 0.0] = np.inf  # it tells the runs apart in nothing
    scaled = (values - values.mean(axis=0)) / size
    slopes = np.linalg.lstsq(scaled, shifts - shifts.mean(axis=0), rcond=APART)[0] / size[:, None]
    rest = shifts - values @ slopes
    x, y, z = ((rest.min(axis=0) + rest.max(axis=0)) / 2).tolist()
    by_name = tuple((name, (a, b, c)) for name, (a, b, c) in zip(names, slopes.tolist(), strict=True))
    size[np.isinf(size)] = 0.0
    part = np.abs(slopes * size[:, None]).max(initial=0.0) / max(np.ptp(shifts, axis=0).max(), 1e-9)
    return Displacement((x, y, z), by_name), float(np.ptp(rest, axis=0).max()) / 2, float(part)


def shared_shifts(
    counts: Sequence[int], shifts: Array, numbers: Sequence[Mapping[str, float]], least: float
) -> dict[int, Array]:
    """The correction (6,) that runs of a statement can share, by row, where one can serve them all.

    That is where it takes more than half of the smallest correction off (runs that arrive at another speed or from
    another side, layers of a weld, displaced work): left alone, each would keep all of it.

    Args:
        counts: runs of each statement; shifts: (n, 6) what they ask for, one statement after the other, in the axes in
            which they share it.
        numbers: by which each run may be displaced otherwise; least: see ``straight``.
    """
    found: dict[int, Array] = {}
    end = 0
    for count in counts:
        begin, end = end, end + count
        shift = shifts[begin:end]
        shared = np.tile((shift.min(axis=0) + shift.max(axis=0)) / 2, (count, 1))
        way = straight(numbers[begin:end], shift[:, :3], least)
        shared[:, :3] = [way.at(run) for run in numbers[begin:end]]
        stays = np.linalg.norm((shift - shared)[:, :3], axis=1).max()
        if stays < np.linalg.norm(shift[:, :3], axis=1).min() / 2:
            found |= dict(zip(range(begin, end), shared, strict=True))
    return found
