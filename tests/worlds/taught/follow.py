"""Both programs in one world, posture by posture: an inverse in plain numpy, and the real arm on the way.

A controller solves the goal of a joint move in the confdata that it states, goes along lines and arcs without a break, and
stops where the confdata of their goal is not what it has reached.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from tests.cells import world as W
from tests.independent import inverse as I
from tests.independent import paths as P
from tests.independent import rapid as R
from tests.worlds.alignment import identities
from tests.worlds.interpreter import Interpreter
from tests.worlds.product import FORCE
from tests.worlds.syntax import Module
from tests.worlds.task import Event
from tests.worlds.taught.programs import ARM, Cell
from tests.worlds.world import World

QUADRANT = np.pi / 2  # that a joint may stand outside the one that a target states (RobotStudio: compliant)
OTHER = np.radians(5.0)  # a correction moves no joint by more, away from a straight wrist
TURNED = np.radians(0.5)
MOVED = 0.5  # mm or degrees of an external axis
WORSE_MM = 0.03  # than without a correction: rounding, and samples of the way
SAMPLES = 15


@dataclass(frozen=True)
class Leg:
    """One motion: joints at its goal (None where it has no solution), and along its way; the work's pose and the axes there.

    Args:
        stops: why a controller would stop at its goal, in words; empty where it goes on.
        real: (n, 3) where the TCP of the elastic arm is on the work [m], (1, 3) of a joint move.
    """

    motion: R.Motion
    inserted: bool
    q: np.ndarray | None
    stops: str = ""
    T: np.ndarray | None = None
    axes: np.ndarray | None = None
    path: np.ndarray | None = None
    real: np.ndarray | None = None


def followed(cell: Cell, events: list[Event]) -> list[Leg]:
    legs: list[Leg] = []
    for e in events:
        if not e.motion:
            continue
        m = R.motion_of(e)
        before = legs[-1] if legs else None
        legs.append(_leg(cell, m, e.inserted, before))
    return legs


def _leg(cell: Cell, m: R.Motion, inserted: bool, before: Leg | None) -> Leg:
    force = np.array(FORCE)
    goal = cell.world.work(m.axes[None], m.unit) @ m.goal @ np.linalg.inv(m.tool)
    if m.kind not in "LC" or before is None or before.q is None or before.motion.unit != m.unit:
        q = I.solve_target(ARM, goal[0], m.conf)
        if q is None:
            return Leg(m, inserted, None, f"no joints have the confdata {m.conf}")
        return Leg(m, inserted, q, real=W.bent(cell.world, ARM, m, q[None], m.axes[None], force))
    u, T, axes = W.on_the_way(before.motion, m)
    path = I.follow(ARM, cell.world.work(axes, m.unit) @ T @ np.linalg.inv(m.tool), before.q)
    if path is None or np.abs(np.diff(path, axis=0)).max() > 0.3:
        return Leg(m, inserted, None, "the way cannot be gone")
    some = np.unique(np.linspace(0, len(u) - 1, SAMPLES).astype(int))
    real = W.bent(cell.world, ARM, m, path[some], axes[some], force)
    return Leg(m, inserted, path[-1], _outside(path[-1], m.conf), T, axes, path, real)


def _outside(q: np.ndarray, conf: tuple[int, ...]) -> str:
    """Why a controller stops at joints (6,) where a target states this confdata: it accepts one quadrant beside its own."""
    reached = I.confdata(ARM, q)[0]
    out = np.abs(q[[0, 3, 5]] - (np.array(conf[:3]) + 0.5) * np.pi / 2) - np.pi / 4
    if (out <= QUADRANT).all() and reached[3] == conf[3]:
        return ""
    return f"the arm is in {tuple(reached.tolist())}, the target says {conf}"


@dataclass
class Judged:
    """What was judged in one world: motions, added targets, what is wrong, largest deviations [mm] before and after."""

    motions: int = 0
    added: int = 0
    faults: list[str] = field(default_factory=list)
    before_mm: float = 0.0
    after_mm: float = 0.0


def judge(cell: Cell, original: list[Module], corrected: list[Module], world: World) -> Judged:
    """Every motion of the original that the arm can make must be made in the same posture, nearer to its way."""
    first, second = Interpreter(original, world), Interpreter(corrected, world, identities(original, corrected))
    legs = followed(cell, first.run()), followed(cell, second.run())
    found = Judged()
    if first.stopped != second.stopped:
        found.faults.append(f"stopped: `{first.stopped}` and `{second.stopped}`")
    waiting: list[Leg] = []
    at, start = 0, None
    for leg in legs[1]:
        if leg.inserted:
            waiting.append(leg)
            continue
        if at == len(legs[0]):
            found.faults.append("more motions than in the original")
            break
        own = legs[0][at]
        at += 1
        if own.q is not None and not own.stops:
            _compare(found, own, leg, waiting, start)
        waiting, start = [], own
    if at < len(legs[0]):
        found.faults.append("fewer motions than in the original")
    return found


def _compare(found: Judged, own: Leg, leg: Leg, added: list[Leg], start: Leg | None) -> None:
    assert own.q is not None
    line = f"line {own.motion.line} {own.motion.name}"
    found.motions += 1
    found.added += len(added)
    for part in (*added, leg):
        what = line if part is leg else f"{line}, added target"
        if part.q is None or part.stops:
            found.faults.append(f"posture: {what}: {part.stops}")
            return
    assert leg.q is not None
    if np.abs(leg.q - own.q).max() > OTHER:
        k = int(np.abs(leg.q - own.q).argmax())
        found.faults.append(
            f"posture: {line}: axis {k + 1} at {np.degrees(leg.q[k]):.0f}, not {np.degrees(own.q[k]):.0f}"
        )
        return
    if np.abs(leg.motion.axes - own.motion.axes).max() > 1e-3:
        found.faults.append(f"axes: {line}: {leg.motion.axes[:2]}, not {own.motion.axes[:2]}")
    for part in added:
        _beside(found, f"{line}, added target", own, part)
    before, after = _deviation(own, [own], start), _deviation(own, [*added, leg], start)
    found.before_mm, found.after_mm = max(found.before_mm, before), max(found.after_mm, after)
    if after > before + WORSE_MM:
        found.faults.append(f"worse: {line}: {before:.3f} mm before, {after:.3f} mm after")


def _beside(found: Judged, what: str, own: Leg, part: Leg) -> None:
    """Whether an added target has orientation, external axes and posture of the original's way there."""
    if own.T is None or own.axes is None or own.path is None or part.q is None:
        return
    k = int(np.linalg.norm(own.T[:, :3, 3] - part.motion.goal[:3, 3], axis=1).argmin())
    turn = float(np.linalg.norm(P.log_rotation(own.T[k, :3, :3].T @ part.motion.goal[:3, :3])))
    step = max(
        (
            float(np.linalg.norm(P.log_rotation(a.T @ b)))
            for a, b in zip(own.T[:-1, :3, :3], own.T[1:, :3, :3], strict=True)
        ),
        default=0.0,
    )
    if turn > TURNED + step:
        found.faults.append(f"turned: {what}: {np.degrees(turn):.2f} degrees beside the way")
    steps = np.abs(np.diff(own.axes, axis=0)).max(initial=0.0)
    off = float(np.abs(own.axes[k] - part.motion.axes).max())
    if off > MOVED + steps:
        found.faults.append(f"axes: {what}: {off:.1f} beside the way")
    apart = np.abs(own.path[k] - part.q)
    if apart.max() > OTHER:
        found.faults.append(
            f"posture: {what}: axis {int(apart.argmax()) + 1} {np.degrees(apart.max()):.0f} degrees beside the way"
        )


def _deviation(own: Leg, parts: list[Leg], start: Leg | None) -> float:
    """Largest distance [mm] of the real TCP from the original's way; of a joint move at its goal."""
    if own.T is None:
        real = parts[-1].real
        assert real is not None
        return 1e3 * float(np.linalg.norm(real[-1] - own.motion.goal[:3, 3]))
    points = [real for part in parts if (real := part.real) is not None]
    if own.motion.kind == "C" and own.motion.via is not None:
        assert start is not None
        ring = P.circle(start.motion.goal[:3, 3], own.motion.via[:3, 3], own.motion.goal[:3, 3])
        return 1e3 * float(max(ring.distance(p).max() for p in points))
    return 1e3 * float(max(P.polyline_distance(p, own.T[[0, -1], :3, 3]).max() for p in points))
