"""An independent cell in plain numpy: where base, work and gravity are at positions of the external axes.

Axes are (n, 6) as RAPID states them, mm and degrees. Frames are written as functions by hand; nothing is shared with the
package but the program text.
"""

from __future__ import annotations

from ast import literal_eval
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from tests.independent import arm as A
from tests.independent import inverse as I
from tests.independent import paths as P
from tests.independent import rapid as R
from tests.independent.verify import align

Place = Callable[[np.ndarray], np.ndarray]  # axes (n, 6) -> (n, 4, 4)
STEP = 0.005  # [m] between samples, and 5 mm or a third of a degree of any axis
COARSE = 4  # of these samples one in so many where a cell strays from what the controller believes: that is smooth
DEGREES = np.array([0.0, 0.0, -9.81])


def still(axes: np.ndarray) -> np.ndarray:
    return np.tile(np.eye(4), (len(axes), 1, 1))


def slide(axis: int, direction: tuple[float, float, float]) -> Place:
    """Along a direction of the world, by mm."""
    return lambda axes: A.transform(np.eye(3), axes[:, axis, None] * np.array(direction) / 1000)


def turn(axis: int, about: tuple[float, float, float], at: np.ndarray) -> Place:
    """About a direction in the frame ``at`` (4, 4), by degrees; that frame goes along."""
    return lambda axes: at @ A.transform(A.rotation(np.array(about), np.radians(axes[:, axis])), np.zeros(3))


def after(first: Place, second: Place) -> Place:
    return lambda axes: first(axes) @ second(axes)


@dataclass(frozen=True)
class World:
    """A cell.

    Args:
        base: T_world_base; units: T_world_end of what moves work, by name; down: (3,) gravity in the world.
        real: the cell as it is, where that is not what the controller believes; leans: where a base (n, 4, 4) goes under
            the load of the arm, by axes, base without load, base so far, frames in it and load.
    """

    base: Place = still
    units: dict[str, Place] = field(default_factory=dict)
    down: np.ndarray = field(default_factory=lambda: DEGREES)
    real: World | None = None
    leans: Callable[[np.ndarray, np.ndarray, np.ndarray, A.Frames, A.Load], np.ndarray] | None = None

    def work(self, axes: np.ndarray, unit: str) -> np.ndarray:
        """(n, 4, 4) T_base_work."""
        frame = self.units[unit](axes) if unit else still(axes)
        return np.linalg.inv(self.base(axes)) @ frame

    def gravity(self, axes: np.ndarray) -> np.ndarray:
        """(n, 3) in base axes."""
        return np.swapaxes(self.base(axes)[:, :3, :3], 1, 2) @ self.down


@dataclass(frozen=True)
class Found:
    """Largest distances [mm] over all lines and arcs on the moving work, and what is wrong with the output."""

    before: float
    after: float
    added: int
    problems: tuple[str, ...]


def on_the_way(start: R.Motion, m: R.Motion) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Shares (n,), commanded poses on the work (n, 4, 4), external axes (n, 6) along a line or an arc."""
    moved = np.abs(np.where(m.axes < 9e9, m.axes - start.axes, 0.0)).max()
    u, _ = P.shape(start.goal, m, STEP)
    u = np.linspace(0, 1, max(len(u), int(3 * min(moved, 4000)) + 1))
    T = P.arc(start.goal, m.via, m.goal, u) if m.kind == "C" and m.via is not None else P.line(start.goal, m.goal, u)
    axes = start.axes + u[:, None] * np.where(m.axes < 9e9, m.axes - start.axes, 0.0)
    return u, T, axes


def bent(world: World, arm: A.Arm, m: R.Motion, q: np.ndarray, axes: np.ndarray, force: np.ndarray) -> np.ndarray:
    """(n, 3) where the TCP of the elastic arm is on the work."""
    real = world.real or world
    base, work = real.base(axes), real.units[m.unit](axes) if m.unit else still(axes)
    now = base
    for _ in range(1 if real.leans is None else 5):
        # Gravity and the force keep their directions in space while the base leans.
        to_now = np.swapaxes(now[:, :3, :3], 1, 2)
        push = (to_now @ base[:, :3, :3] @ force[:, None])[:, :, 0]
        load = A.Load(m.mass, m.center, push, gravity=to_now @ real.down)
        frames = A.equilibrium(arm, q, m.tool, load, A.joint_springs(A.TABLE_2)).frames
        if real.leans is not None:
            now = real.leans(axes, base, now, frames, load)
    return (np.linalg.inv(work) @ now @ frames.tcp)[:, :3, 3]


def ways(world: World, arm: A.Arm, moves: list[R.Motion], force: np.ndarray) -> list[np.ndarray | None]:
    """(n, 3) where the TCP really goes on the work during each move; None for joint moves and what cannot be run."""
    found: list[np.ndarray | None] = []
    q: np.ndarray | None = None
    for k, m in enumerate(moves):
        goal = world.work(m.axes[None], m.unit) @ m.goal @ np.linalg.inv(m.tool)
        if m.kind not in "LC" or q is None or moves[k - 1].unit != m.unit:
            q = m.q if m.kind == "A" else I.solve_target(arm, goal[0], m.conf)
            found.append(None)
            continue
        _, T, axes = on_the_way(moves[k - 1], m)
        path = I.follow(arm, world.work(axes, m.unit) @ T @ np.linalg.inv(m.tool), q)
        if path is None or (I.confdata(arm, path[-1])[0] != np.array(m.conf)).any():
            found.append(None)
            q = None
            continue
        q = path[-1]
        some = slice(None, None, 1 if world.real is None else COARSE)
        found.append(bent(world, arm, m, path[some], axes[some], force))
    return found


def check(original: str, output: str, world: World, arm: A.Arm, force: np.ndarray) -> Found:
    """Distance of the real arm from the programmed lines and arcs on the work, before and after.

    Args:
        world: as it really is; force: on the TCP, base axes [N].
    """
    old, _ = R.motions(original)
    new, lost = R.motions(output)
    match = align(old, new, arm)
    if match is None or lost:
        return Found(np.inf, np.inf, 0, (f"moves are missing: {len(old)}, {len(new)}, {lost}",))
    went, goes = ways(world, arm, old, force), ways(world, arm, new, force)
    before, now, previous = [0.0], [0.0], match[0]
    problems = [f"extax of move {i} changed" for i, k in enumerate(match) if (old[i].axes != new[k].axes).any()]
    for i, m in enumerate(old[1:], 1):
        first, previous = previous + 1, match[i]
        if m.kind not in "LC":
            continue
        if went[i] is None:
            problems.append(f"line {m.line} of the original cannot be run")
            continue
        for k in range(first, previous + 1):
            if goes[k] is None:
                problems.append(f"line {new[k].line} cannot be run")
                continue
            now.append(float(_distance(old[i - 1], m, goes[k]).max()))
        before.append(float(_distance(old[i - 1], m, went[i]).max()))
    return Found(1e3 * max(before), 1e3 * max(now), len(new) - len(old), tuple(problems))


def _distance(start: R.Motion, m: R.Motion, p: np.ndarray) -> np.ndarray:
    if m.kind == "C" and m.via is not None:
        return P.circle(start.goal[:3, 3], m.via[:3, 3], m.goal[:3, 3]).distance(p)
    return P.polyline_distance(p, np.stack([start.goal[:3, 3], m.goal[:3, 3]]))


TORCH = A.transform(A.rotation(np.array([0, 1.0, 0]), np.radians(35.0)), np.array([0.05, 0.0, 0.35]))
HEAD = """MODULE Seam
  PERS tooldata tTorch:=[TRUE,[[{place}],[{turn}]],[6,[20,0,140],[1,0,0,0],0,0,0]];
  PERS seamdata sm:=[0];
  PERS welddata wd:=[10];
{data}
  PROC main()
"""


@dataclass(frozen=True)
class Goal:
    """A target on the work: place [mm], quaternion, external axes as RAPID text has them; how the arm gets there."""

    place: tuple[float, float, float]
    turn: np.ndarray
    axes: dict[int, float] = field(default_factory=dict)
    move: str = "MoveL"
    via: tuple[float, float, float] | None = None


def _numbers(values: object, digits: int) -> str:
    return ",".join(f"{v:.{digits}f}" for v in np.asarray(values, float))


def _aggregate(arm: A.Arm, q: np.ndarray, goal: Goal, place: tuple[float, float, float]) -> str:
    """A robtarget with the confdata of joint angles (6,)."""
    axes = _axes(goal)
    conf = I.confdata(arm, q)[0]
    extax = ",".join("9E9" if v >= 9e9 else f"{v:g}" for v in axes)
    return f"[[{_numbers(place, 3)}],[{_numbers(goal.turn, 9)}],[{','.join(map(str, conf))}],[{extax}]]"


def _axes(goal: Goal) -> np.ndarray:
    axes = np.full(6, 9e9)
    for k, value in goal.axes.items():
        axes[k] = value
    return axes


def _joints(arm: A.Arm, world: World, goal: Goal, unit: str, at: np.ndarray, before: np.ndarray | None) -> np.ndarray:
    """(6,) joint angles at a goal, on from those before."""
    # Where the controller has the arm: on the work's object frame, as the text rounds it.
    T = A.transform(R.quaternion_matrix(np.round(goal.turn, 9)), np.round(goal.place, 3) / 1000)
    q = I.inverse(arm, world.work(_axes(goal)[None], unit) @ at @ T @ np.linalg.inv(TORCH))[0]
    good = [x for x in q[:4] if np.isfinite(x).all() and (x > arm.lower).all() and (x < arm.upper).all()]
    if before is None:
        return good[0]
    near = min(good, key=lambda x: np.abs(I.wrap(x - before)).max())
    return before + I.wrap(near - before)


def program(
    arm: A.Arm, world: World, goals: list[Goal], unit: str = "", oframe: str = "[[0,0,0],[1,0,0,0]]", uframe: str = ""
) -> str:
    """A program that welds from goal to goal on the work.

    Args:
        unit: that moves the work object; uframe: of one that stands still.
    """
    frame = uframe or "[[0,0,0],[1,0,0,0]]"
    fixed = "FALSE" if unit else "TRUE"
    wobj = f'  PERS wobjdata wWork:=[FALSE,{fixed},"{unit}",{frame},{oframe}];'
    text = HEAD.format(
        place=_numbers(TORCH[:3, 3] * 1000, 3), turn=_numbers(R.matrix_quaternion(TORCH[:3, :3]), 9), data=wobj
    )
    o, u = (R.pose(literal_eval(x)) for x in (oframe, frame))
    at = o if unit else u @ o
    q: np.ndarray | None = None
    for goal in goals:
        q = _joints(arm, world, goal, unit, at, q)
        to = _aggregate(arm, q, goal, goal.place)
        via = "" if goal.via is None else _aggregate(arm, q, goal, goal.via) + ","
        speed = "v20,sm,wd,fine" if goal.move.startswith("Arc") else "v100,fine"
        text += f"    {goal.move} {via}{to},{speed},tTorch\\WObj:=wWork;\n"
    return text + "  ENDPROC\nENDMODULE\n"
