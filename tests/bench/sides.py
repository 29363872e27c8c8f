"""Static tables without sides of approach, in and out of their order: ``python -m tests.bench.sides [--sets N] [--only ..]``."""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from postproc import diagnose
from postproc.diagnostics import Source
from postproc.effects.registry import effect_library
from postproc.estimation.least_squares import fit_model
from postproc.identification.diagnosis import Diagnosis
from postproc.measure.read.table import read_measurements
from postproc.measure.read.terms import Reading
from postproc.model.arm import Model
from postproc.robot.catalogue import load_robot
from tests.independent import arm as A
from tests.independent import library_effects as K
from tests.independent import unknown_effects as U
from tests.independent.cells import DEG, Hidden, States, draw_cell, draw_states, measure

ROBOT = "irb4600_60_205"
BASE = ("instrument_frame", "tool_frame", "joint_offset", "joint_compliance")
NOISE_MM = (0.01, 0.02, 0.03, 0.045)
Kind = Callable[[np.random.Generator, A.Arm], Hidden]
ORDERS: dict[str, Callable[[np.random.Generator, np.ndarray], np.ndarray]] = {
    "measured": lambda g, q: np.arange(len(q)),
    "shuffled": lambda g, q: g.permutation(len(q)),
    "sorted": lambda g, q: np.lexsort(np.round(q[:, ::-1] / DEG / 20).T),
}
"""How the rows of a file stand: as they were measured, by chance, or sorted by their angles as a grid is."""


@dataclass(frozen=True)
class Recipe:
    """Args: kinds of hidden effects; order: of the rows, a key of `ORDERS`; told: what tells their order, `user`, `times` or
    `names` that count up; other rows than those in order are told by their names, or by a user who is wrong."""

    kinds: tuple[Kind, ...] = ()
    order: str = "measured"
    told: str = "user"


TOLD = ("user", "names", "times")
LAWS = (U.angle_step, U.kink, K.transmission_error, U.joint_product)
GROUPS: dict[str, Sequence[Recipe]] = {
    "lost motion": [Recipe(k, told=t) for t in TOLD for k in ((K.backlash,), (K.backlash, K.arm_load))],
    "clean": [Recipe(told=t) for t in TOLD],
    "clean, other order": [Recipe((), o, t) for o in ("shuffled", "sorted") for t in ("user", "names")],
    "lost motion, other order": [
        Recipe((K.backlash,), o, t) for o in ("shuffled", "sorted") for t in ("user", "names")
    ],
    "a law of angles": [Recipe((k,), o, "names") for k in LAWS for o in ORDERS],
}


def table(recipe: Recipe, seed: int, poses: int = 120) -> tuple[str, tuple[Hidden, ...]]:
    """The file, and what is hidden in it: the arm goes from pose to pose, and comes back to twelve of them at the end."""
    g = np.random.default_rng(seed)
    arm = A.ARMS[ROBOT]()
    hidden = tuple(kind(g, arm) for kind in recipe.kinds)
    cell, noise = draw_cell(g, arm, hidden), float(g.choice(NOISE_MM)) * 1e-3
    s = draw_states(g, poses, arm, False, False)
    index = np.concatenate([np.arange(poses), *(g.permutation(np.arange(0, poses, poses // 12)) for _ in range(2))])
    s = replace(s.take(index), time=60.0 * np.arange(len(index)))
    first = g.choice([-1.0, 1.0], 6)
    s = replace(s, approach=np.vstack([first, np.sign(np.diff(s.q, axis=0))]))
    seen = measure(cell, s) + g.normal(0, noise, (len(s), 3))
    rows = ORDERS[recipe.order](g, s.q)
    labels = [f"P{i}" for i in (np.arange(len(rows)) if recipe.told == "names" else index[rows])]
    return _csv(s.take(rows), seen[rows], labels, recipe.told == "times"), hidden


def _csv(s: States, seen: np.ndarray, labels: Sequence[str], timed: bool) -> str:
    joints = [f"q{j}_deg" for j in range(1, 7)]
    load = ["payload_kg", "payload_x_mm", "payload_y_mm", "payload_z_mm"]
    lines = [",".join(["pose_id", *joints, "x_mm", "y_mm", "z_mm", *load, *(["time_s"] if timed else [])])]
    for i, label in enumerate(labels):
        cells = [label, *(f"{x:.5f}" for x in s.q[i] / DEG), *(f"{x:.4f}" for x in 1e3 * seen[i]), f"{s.mass[i]:g}"]
        cells += [f"{1e3 * x:g}" for x in s.center[i]] + ([f"{s.time[i]:.1f}"] if timed else [])
        lines.append(",".join(cells))
    return "\n".join(lines)


def diagnosed(recipe: Recipe, seed: int) -> tuple[Diagnosis, tuple[Hidden, ...]]:
    """The diagnosis of a table beside the usual base, and what is hidden in it."""
    text, hidden = table(recipe, seed)
    robot, library = load_robot(ROBOT), effect_library()
    data = read_measurements(
        Source("rows.csv", text.encode()), robot, terms=Reading(rows_in_order=recipe.told == "user")
    )
    start = Model(robot, robot_name=ROBOT, effects=tuple(library[key].null() for key in BASE))
    return diagnose(fit_model(start, data).model, data), hidden


def main(argv: list[str] | None = None) -> None:
    o = argparse.ArgumentParser(description=__doc__)
    o.add_argument("--sets", type=int, default=12)
    o.add_argument("--only", default="", help="groups whose name begins so")
    a = o.parse_args(argv)
    for number, (group, recipes) in enumerate(GROUPS.items()):
        named = 0
        for i in range(a.sets if group.startswith(a.only) else 0):
            recipe = recipes[i % len(recipes)]
            began = time.process_time()
            d, hidden = diagnosed(recipe, 1000 * number + i)
            found = [m.key for m in d.missing]
            named += "backlash" in found
            errors = f"{1e3 * d.base.held_out_rms:.3f} to {1e3 * d.final.held_out_rms:.3f} mm"
            true = "+".join(h.kind for h in hidden) or "nothing"
            print(
                f"{group} {i}, {recipe.order} by {recipe.told}: {true}; {d.verdict} {'+'.join(found)}, {errors}, {time.process_time() - began:.1f} s",
                flush=True,
            )
        print(f"{group}: lost motion is named in {named} of {a.sets}", flush=True)


if __name__ == "__main__":
    main()
