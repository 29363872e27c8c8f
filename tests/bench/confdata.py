"""Confdata of corrected and added targets, judged by an inverse in plain numpy: ``python -m tests.bench.confdata [N]``.

Programs are drawn at random around places where axis 1, 4 or 6 crosses a quadrant's edge or the wrist is nearly straight,
with and without moving external axes. The written program is followed in steps of half a millimetre; at every target its
confdata must be that of the joints there. Of the package only the conversion is called.
"""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product

import numpy as np

from tests.cells import world as W
from tests.independent import arm as A
from tests.independent import inverse as I
from tests.independent import paths as P
from tests.independent import rapid as R

ARM = A.irb4600()
FORCE = (200.0, -200.0, -200.0)
QUARTER = np.pi / 2
EDGE = 1e-4  # so near the edge of a quadrant [rad] both sides are right: text has three decimals of a millimetre
STRAIGHT = 1e-4  # |q5| [rad] below which both signs are the same wrist
KINDS = (
    "axis 1", "axis 4", "axis 6", "arc", "track", "gantry", "positioner", "near a straight wrist", "through a straight wrist",
    "joint moves to a straight wrist", "reorientation",
)  # fmt: skip
FORMS = ("numbers", "names", "operator's names")
ASIDE, FAR = np.radians(0.5), 0.02  # that a correction may turn [rad] or shift [m] a target away from its way


class Retry(Exception):
    """The draw leads where the arm cannot go."""


@dataclass(frozen=True)
class Case:
    """A program, the independent cell that it runs in, and the external axes of the model file."""

    kind: str
    form: str
    text: str
    world: W.World
    axes: str = ""


@dataclass(frozen=True)
class Target:
    """One target of the written program.

    Args:
        quarters: how far its confdata is from the joints, in quarter turns; branch: cfx is theirs.
        changed: its confdata is not what the programmer wrote; aside: it is beside the programmed way, or the arm comes to
            it with another shoulder or elbow than in the original.
    """

    line: int
    added: bool
    quarters: int
    branch: bool
    changed: bool = False
    aside: bool = False

    @property
    def exact(self) -> bool:
        return self.quarters == 0 and self.branch

    @property
    def valid(self) -> bool:
        return self.quarters <= 1 and self.branch and not self.aside


def follow(flange: np.ndarray, start: np.ndarray) -> np.ndarray:
    """(n, 6) joint angles along n poses that lie close together, each the solution nearest to the one before it."""
    solutions, q, out = I.inverse(ARM, flange), np.array(start), np.empty((len(flange), 6))
    arms = solutions[:, :, :3]
    for k in range(len(flange)):
        near = q + I.wrap(solutions[k] - q)
        # Shoulder and elbow move slowly: the wrist alone may turn fast, and must not be bought by another elbow.
        cost = np.abs(near - q).max(axis=1) + 100.0 * np.abs(I.wrap(arms[k] - q[:3])).max(axis=1)
        if not np.isfinite(cost).any():
            raise Retry
        q = near[int(np.nanargmin(cost))]
        if abs(np.sin(q[4])) < 1e-7:  # only the sum of axes 4 and 6 is defined
            before = out[k - 1] if k else np.array(start)
            q = np.array([*q[:3], before[3], q[4], q[5] + np.sign(np.cos(q[4])) * (q[3] - before[3])])
        out[k] = q
    return out


def misfit(q: np.ndarray, conf: tuple[int, ...]) -> tuple[int, bool]:
    """Quarter turns between confdata and joint angles (6,) in axes 1, 4 and 6, and whether cfx is theirs."""
    low, high = (np.floor((q[[0, 3, 5]] + side) / QUARTER) for side in (-EDGE, EDGE))
    stated = np.array(conf[:3])
    off = int(np.maximum(np.maximum(low - stated, stated - high), 0).max())
    bits = I.confdata(ARM, q)[0, 3] ^ conf[3]
    return off, bool(bits == 0 or (bits == 1 and abs(np.sin(q[4])) < STRAIGHT))


def joints_of(world: W.World, moves: list[R.Motion]) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """For each move the joint angles (6,) at its goal, and those along it (n, 6).

    Raises:
        Retry: the arm cannot follow it.
    """
    q: np.ndarray | None = None
    for k, m in enumerate(moves):
        goal = world.work(m.axes[None], m.unit) @ m.goal @ np.linalg.inv(m.tool)
        if m.kind not in "LC" or q is None:
            q = m.q if m.kind == "A" else solved(goal[0], m.conf)
            if q is None:
                raise Retry
            yield q, q[None]
            continue
        _, T, axes = on_the_way(moves[k - 1], m)
        path = follow(world.work(axes, m.unit) @ T @ np.linalg.inv(m.tool), q)
        q = path[-1]
        yield q, path


def on_the_way(start: R.Motion, m: R.Motion) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Shares (n,), poses on the work (n, 4, 4) and external axes (n, 6), half a millimetre or a tenth of a degree apart."""
    moved = np.where(m.axes < 9e9, m.axes - np.where(start.axes < 9e9, start.axes, m.axes), 0.0)
    u, _ = P.shape(start.goal, m, 0.0005)
    turn = np.linalg.norm(P.log_rotation(start.goal[:3, :3].T @ m.goal[:3, :3]))
    u = np.linspace(0, 1, max(len(u), int(2 * np.abs(moved).max()) + 1, int(turn / np.radians(0.1)) + 1))
    T = P.arc(start.goal, m.via, m.goal, u) if m.kind == "C" and m.via is not None else P.line(start.goal, m.goal, u)
    return u, T, np.where(start.axes < 9e9, start.axes, 0.0) + u[:, None] * moved


def solved(flange: np.ndarray, conf: tuple[int, ...]) -> np.ndarray | None:
    """(6,) joint angles of a pose in a configuration, which may be one quadrant off; None where there are none."""
    best, least = None, 1.0 + 1e-9
    for q in I.inverse(ARM, flange[None])[0]:
        if not np.isfinite(q).all():
            continue
        middle = (np.array(conf[:3]) + 0.5) * QUARTER
        q[[0, 3, 5]] += 2 * np.pi * np.round((middle - q[[0, 3, 5]]) / (2 * np.pi))
        off = max(0.0, float(np.abs(q[[0, 3, 5]] - middle).max()) / QUARTER - 0.5)
        bits = I.confdata(ARM, q)[0, 3] ^ conf[3]
        if off < least and bits == 0 and (q > ARM.lower - 1e-6).all() and (q < ARM.upper + 1e-6).all():
            best, least = q, off
    return best


def convert(case: Case) -> str | None:
    """The corrected program, None where nothing was written."""
    return converted(case)[0]


def converted(case: Case) -> tuple[str | None, list[tuple[str, str]]]:
    """The corrected program, None where nothing was written, and code and message of each error."""
    from postproc.compensation.options import Options
    from postproc.diagnostics import Source
    from postproc.model.file import parse_model
    from postproc.runtime.passes import correct_program

    compliance = ",".join(f"{c:.12g}" for c in A.TABLE_2)
    # Keys of the file before its tables: a mounting stands among the axes.
    model = (
        'robot = "irb4600_60_205"\n[effects.joint_compliance]\n'
        + f"compliance_rad_per_Nm = [{compliance}]\n{case.axes}"
    )
    arm = parse_model(Source("m.toml", model.encode()))
    options = Options(force=FORCE, inertia=False, tolerance_m=1e-5)
    result = correct_program(Source("p.mod", case.text.encode()), arm, options)
    errors = [(d.code, d.message) for d in result.diagnostics if d.severity == "error"]
    return None if result.output is None else result.output.decode(), errors


def matched(old: list[R.Motion], new: list[R.Motion]) -> list[int]:
    """Index in ``new`` of each motion of ``old``, in order, so that place and orientation of the goals are nearest."""
    gap = np.array([
        [np.linalg.norm((a.goal - b.goal)[:3]) + 9.0 * (a.name != b.name) for b in new] for a in old
    ])  # fmt: skip
    cost, back = gap[0], list[list[int]]()
    for row in gap[1:]:
        least = [int(np.argmin(cost[:k])) if k else -1 for k in range(len(new))]
        back.append(least)
        cost = np.array([cost[j] + row[k] if j >= 0 else np.inf for k, j in enumerate(least)])
    found = [len(new) - 1]  # nothing is added behind the last motion
    for least in reversed(back):
        found.insert(0, least[found[0]])
    return found


def judge(case: Case, output: str) -> list[Target]:
    """Every target of the written program against the joints in which the arm comes to it."""
    old, _ = R.motions(case.text)
    new, lost = R.motions(output)
    assert not lost, lost
    own, found = {k: i for i, k in enumerate(matched(old, new))}, []
    before = [q for q, _ in joints_of(case.world, old)]
    for k, (m, (q, _)) in enumerate(zip(new, joints_of(case.world, new), strict=True)):
        i = next(own[j] for j in range(k, len(new)) if j in own)
        _, way, _ = on_the_way(old[i - 1], old[i]) if k not in own else (0, old[i].goal[None], 0)
        turned = np.linalg.norm(P.log_rotation(np.swapaxes(way[:, :3, :3], 1, 2) @ m.goal[:3, :3]), axis=1)
        far = np.linalg.norm(way[:, :3, 3] - m.goal[:3, 3], axis=1)
        elbow = k in own and np.abs(I.wrap(q - before[i]))[:3].max() > np.radians(3.0)
        aside = bool(((turned > ASIDE) | (far > FAR)).all() or elbow)
        found.append(Target(m.line, k not in own, *misfit(q, m.conf), k in own and old[i].conf != m.conf, aside))
    return found


# Drawing of programs.


def _cell(kind: str, g: np.random.Generator) -> tuple[W.World, str, str, list[dict[int, float]]]:
    """A cell, its axes in a model file, the unit that moves the work, and the external axes at four targets."""
    if kind == "track":
        a = float(np.round(g.uniform(200, 2000)))
        to = a + float(np.round(g.uniform(200, 900))) * g.choice([-1, 1])
        axes = '[[external_axes]]\naxis = "a"\nkind = "linear"\ncarries = "robot"\nunit = "TRACK_1"\n'
        return W.World(base=W.slide(0, (1.0, 0, 0))), axes, "", [{0: a}, {0: a}, {0: to}, {0: to + 100}]
    if kind == "gantry":
        world = W.World(base=W.after(W.slide(0, (1.0, 0, 0)), W.slide(1, (0, 1.0, 0))), down=np.array([0, 0, 9.81]))
        axes = "[mounting]\nrpy_deg = [180, 0, 0]\n"
        for letter, extra in (("a", ""), ("b", "xyz_mm = [0, 0, 0]\nquat = [0.707106781, 0, 0, 0.707106781]\n")):
            axes += (
                f'[[external_axes]]\naxis = "{letter}"\nkind = "linear"\ncarries = "robot"\nunit = "GANTRY"\n{extra}'
            )
        a, b = (float(np.round(v)) for v in g.uniform(300, 900, 2))
        da, db = (float(np.round(v)) for v in g.uniform(-400, 400, 2))
        return world, axes, "", [{0: a, 1: b}, {0: a, 1: b}, {0: a + da, 1: b + db}, {0: a + da, 1: b + db}]
    if kind == "positioner":
        tilt = np.round(R.matrix_quaternion(A.rotation(np.array([1.0, 0, 0]), np.radians(20))), 9)
        frame = A.transform(R.quaternion_matrix(tilt), np.array([1.15, 0.15, 0.45]))
        axes = '[[external_axes]]\naxis = "b"\nkind = "rotary"\ncarries = "work"\nunit = "STN1"\nspeed = 90\n'
        axes += f"xyz_mm = [1150, 150, 450]\nquat = {tilt.tolist()}\n"
        b, to = (float(np.round(v)) for v in g.uniform(-50, 50, 2))
        return W.World(units={"STN1": W.turn(1, (0, 0, 1.0), frame)}), axes, "STN1", [{1: b}, {1: b}, {1: to}, {1: to}]
    return W.World(), "", "", [{}, {}, {}, {}]


def _crossing(kind: str, g: np.random.Generator) -> tuple[int, float]:
    """Which joint crosses which angle [rad] in the middle of the seam."""
    joint = {"axis 1": 0, "axis 4": 3, "axis 6": 5}.get(kind, int(g.choice([0, 3, 5])))
    if kind == "near a straight wrist":
        return 4, float(np.radians(g.uniform(0.3, 4.0)) * g.choice([-1, 1]))
    if kind == "through a straight wrist":
        return 4, 0.0
    edges = {0: [-90, 0, 90], 3: [-90, 0, 90, 180, -180], 5: [-180, -90, 0, 90, 180]}[joint]
    return joint, float(np.radians(g.choice(edges)))


def draw(kind: str, form: str, seed: int) -> Case:
    """A program of one kind; targets have the confdata of the arm that follows it from target to target."""
    for k in range(4000):
        try:
            return _draw(kind, form, np.random.default_rng([seed, k, KINDS.index(kind)]))
        except Retry:
            continue
    raise AssertionError(kind)


def _draw(kind: str, form: str, g: np.random.Generator) -> Case:
    world, axes, unit, extax = _cell(kind, g)
    joint, angle = _crossing(kind, g)
    q = np.radians(g.uniform([-120, -20, -40, -150, 25, -170], [120, 50, 30, 150, 100, 170]))
    q[4] *= g.choice([-1, 1])
    q[joint] = angle
    if kind == "joint moves to a straight wrist":
        return _joint_moves(kind, form, g, q)
    if kind == "through a straight wrist":
        q[3] = g.choice([0.0, np.pi])
    middle = ARM.forward(q[None], np.eye(4)).flange[0] @ W.TORCH
    direction = g.normal(size=3)
    half, tilt = g.uniform(0.15, 0.4), np.radians(g.uniform(0, 30))
    about = g.normal(size=3)
    if (
        kind == "through a straight wrist"
    ):  # arm and line stay in one vertical plane, in which axis 5 alone turns the tool
        about = np.array([-np.sin(q[0]), np.cos(q[0]), 0.0])
        direction -= about * (direction @ about)
    direction /= np.linalg.norm(direction)
    if kind == "reorientation":
        half, tilt = 0.0, np.radians(g.uniform(15, 50))
    turn = A.rotation_vector(np.outer([-0.5, -0.5, 0.5], about / np.linalg.norm(about) * tilt))
    places = [middle[:3, 3] + s * half * direction for s in (-1, -1, 1)]
    poses = [A.transform(turn[i] @ middle[:3, :3], places[i]) for i in range(3)]
    last = poses[2] @ A.transform(np.eye(3), g.normal(size=3) * 0.15)
    poses = [poses[0] @ A.shift(0, 0, -0.05), poses[1], poses[2], last]
    units = [np.array([[e.get(i, 9e9) for i in range(6)]]) for e in extax]
    on_work = [np.linalg.inv(world.work(e, unit))[0] @ T for e, T in zip(units, poses, strict=True)]
    goals = [rounded(T) for T in on_work]
    side = np.cross(direction, g.normal(size=3))
    via = None
    if kind == "arc":
        via = rounded(A.transform(middle[:3, :3], middle[:3, 3] + side / np.linalg.norm(side) * g.uniform(0.06, half)))
    names = [("MoveJ", None), ("MoveL" if kind == "reorientation" else "ArcLStart", None)]
    seam = "MoveL" if kind == "reorientation" else "ArcC" if via is not None else "ArcL"
    names += [(seam, via), ("MoveL" if kind == "reorientation" else "ArcLEnd", None)]
    confs = [(0, 0, 0, 0)] * 4
    start = q
    text = _text(names, goals, confs, units, unit, form)
    moves, lost = R.motions(text)
    assert not lost
    # The arm stands in the middle of the seam; the posture of the first target is that in which it comes there.
    u, T, e = on_the_way(moves[1], moves[2])
    flange = world.work(e, unit) @ T @ np.linalg.inv(moves[2].tool)
    mid = len(u) // 2
    back = follow(flange[: mid + 1][::-1], start)
    if np.abs(I.wrap(back[0] - start)).max() > np.radians(40):
        raise Retry
    goal0 = world.work(units[0], unit) @ moves[0].goal @ np.linalg.inv(moves[0].tool)
    first = follow(np.array([P.line(flange[0], goal0[0], np.linspace(0, 1, 120))]).reshape(-1, 4, 4), back[-1])[-1]
    confs[0] = tuple(int(c) for c in I.confdata(ARM, first)[0])
    text = _text(names, goals, confs, units, unit, form)
    moves, _ = R.motions(text)
    chain = list(joints_of(world, moves))
    if np.abs(chain[0][0] - first).max() > 1e-6:
        raise Retry
    ways = np.concatenate([path for _, path in chain])
    if (ways < ARM.lower + np.radians(2)).any() or (ways > ARM.upper - np.radians(2)).any():
        raise Retry
    if (
        max(np.abs(np.diff(path, axis=0)).max(initial=0) for _, path in chain) > np.radians(3)
        and kind != "through a straight wrist"
    ):
        raise Retry
    seam_way = chain[2][1][:, joint] - angle
    if kind == "through a straight wrist" and (np.abs(chain[1][0][4]) < 0.02 or np.abs(chain[2][0][4]) < 0.02):
        raise Retry
    if kind not in ("near a straight wrist", "reorientation") and seam_way[0] * seam_way[-1] > -(np.radians(2) ** 2):
        raise Retry
    if "straight" not in kind and np.abs(ways[:, 4]).min() < np.radians(4):
        raise Retry
    confs = [tuple(map(int, I.confdata(ARM, p)[0])) for p, _ in chain]
    if g.random() < 0.3:  # taught where an axis was a little beyond the quadrant's edge: within one quadrant
        for k, (p, _) in enumerate(chain):
            cf = list(confs[k])
            for c, j in ((0, 0), (1, 3), (2, 5)):
                low = p[j] / QUARTER - cf[c]
                cf[c] += -1 if low < 0.3 else 1 if low > 0.7 else 0
            confs[k] = tuple(cf)
    return Case(kind, form, _text(names, goals, confs, units, unit, form), world, axes)


def _joint_moves(kind: str, form: str, g: np.random.Generator, q: np.ndarray) -> Case:
    """Joint moves to four postures near (6,), in the two of them between with a nearly straight wrist."""
    postures = q + np.radians(g.uniform(-15, 15, (4, 6)))
    postures[1:3, 4] = np.radians(10 ** g.uniform(-2, 0, 2) * g.choice([-1, 1], 2))
    goals = [rounded(ARM.forward(p[None], np.eye(4)).flange[0] @ W.TORCH) for p in postures]
    confs = [tuple(map(int, I.confdata(ARM, p)[0])) for p in postures]
    if any((p < ARM.lower).any() or (p > ARM.upper).any() for p in postures):
        raise Retry
    text = _text([("MoveJ", None)] * 4, goals, confs, [np.full((1, 6), 9e9)] * 4, "", form)
    return Case(kind, form, text, W.World())


def rounded(T: np.ndarray) -> np.ndarray:
    """A pose as a program states it: three decimals of a millimetre, seven of a quaternion."""
    quat = np.round(R.matrix_quaternion(T[:3, :3]), 7)
    return A.transform(R.quaternion_matrix(quat), np.round(T[:3, 3], 6))


def _target(T: np.ndarray, conf: tuple[int, ...], axes: np.ndarray) -> str:
    place = ",".join(f"{1000 * v:.3f}" for v in T[:3, 3])
    quat = ",".join(f"{v:.7f}" for v in R.matrix_quaternion(T[:3, :3]))
    extax = ",".join("9E9" if v >= 9e9 else f"{v:g}" for v in axes)
    return f"[[{place}],[{quat}],[{','.join(map(str, conf))}],[{extax}]]"


def _text(
    names: list[tuple[str, np.ndarray | None]],
    goals: list[np.ndarray],
    confs: list[tuple[int, ...]],
    axes: list[np.ndarray],
    unit: str,
    form: str,
) -> str:
    fixed = "FALSE" if unit else "TRUE"
    data = f'  PERS wobjdata wWork:=[FALSE,{fixed},"{unit}",[[0,0,0],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];\n'
    body = ""
    for k, ((name, via), T, conf, e) in enumerate(zip(names, goals, confs, axes, strict=True)):
        points = [] if via is None else [("c", _target(via, conf, e[0]))]
        points.append(("p", _target(T, conf, e[0])))
        if form != "numbers":
            kind = "CONST" if form == "names" else "PERS"
            data += "".join(f"  {kind} robtarget {n}{10 * k + 10}:={text};\n" for n, text in points)
            points = [(n, f"{n}{10 * k + 10}") for n, _ in points]
        speed = "v20,sm,wd,fine" if name.startswith("Arc") else "v100,fine"
        if form == "operator's names" and k == 2:
            speed = speed.replace("fine", "z1")
        body += f"    {name} {','.join(text for _, text in points)},{speed},tTorch\\WObj:=wWork;\n"
    head = W.HEAD.format(
        place=",".join(f"{1000 * v:.3f}" for v in W.TORCH[:3, 3]),
        turn=",".join(f"{v:.9f}" for v in R.matrix_quaternion(W.TORCH[:3, :3])),
        data=data.rstrip("\n"),
    )
    return head + body + "  ENDPROC\nENDMODULE\n"


def main(count: int) -> int:
    """Exit code 1 where a target does not fit."""
    rows: dict[str, Counter[str]] = {kind: Counter() for kind in KINDS}
    for seed, (kind, form) in zip(range(count), _endless(), strict=False):
        case, row = draw(kind, form, seed), rows[kind]
        row["programs"] += 1
        output, errors = converted(case)
        if output is None:
            row["not written"] += 1
            print(f"{kind}, {form}, {seed}: {errors[0][1] if errors else ''}")
            continue
        for target in judge(case, output):
            group = "added" if target.added else "corrected"
            row[group] += 1
            row[f"{group} off"] += not target.exact
            row[f"{group} wrong"] += not target.valid
            row["changed"] += target.changed
            row["aside"] += target.aside
            if "-v" in sys.argv and (not target.valid or (target.added and not target.exact)):
                print(kind, form, seed, target)
    columns = (
        "programs",
        "not written",
        "corrected",
        "changed",
        "corrected off",
        "corrected wrong",
        "added",
        "added off",
        "added wrong",
        "aside",
    )
    print(f"{'kind':32}" + "".join(f"{c:>17}" for c in columns))
    total: Counter[str] = Counter()
    for kind, row in rows.items():
        total += row
        print(f"{kind:32}" + "".join(f"{row[c]:17}" for c in columns))
    print(f"{'all':32}" + "".join(f"{total[c]:17}" for c in columns))
    return int(total["corrected wrong"] + total["added off"] > 0)


def _endless() -> Iterator[tuple[str, str]]:
    while True:
        yield from ((kind, form) for form, kind in product(FORMS, KINDS))


if __name__ == "__main__":
    sys.exit(main(int(next((a for a in sys.argv[1:] if a.isdigit()), "81"))))
