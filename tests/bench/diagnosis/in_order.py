"""Tables in the order of time: memory, slips and power cycles, lost motion whose sides no column tells.

One history of visits is drawn; some of them are the table, with repeats, and 150 others are asked. These lie between
the rows of the table or after them. All visits are predicted together, as one who keeps a record of them would.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from postproc.diagnostics import Source
from postproc.measure.measurements import Measurements
from postproc.measure.read.table import read_measurements
from postproc.measure.read.terms import Reading
from postproc.robot.catalogue import load_robot
from tests.bench.diagnosis.sets import MAIN, NOISES, Set, Truth
from tests.independent import arm as A
from tests.independent import history as H
from tests.independent import unknown_effects as U
from tests.independent.cells import States, draw_cell, draw_states, measure
from tests.independent.hidden_effects import Kind, write_table

SEED = 71_000_000
"""Of the first set; seeds are far from those of all other kinds, and 100,000 from kind to kind."""
ASKED, REPEATED = 150, 12
KINDS = {"memory": 28, "slips and cycles": 28, "directions missing": 28}
"""How many different sets there are of each kind; the last four hide nothing."""
SENSOR = 0.1
"""Standard deviation of a recorded temperature [K]."""


@dataclass(frozen=True)
class Recipe:
    """How a history is drawn.

    Args:
        law: what is hidden, if anything. after: what is asked lies after the table, not between its rows. later: repeats are visits
            of other times, not one after another. without: columns that the table does not have. cycle: whether a
            column tells the power cycle.
    """

    law: Kind | None
    after: bool
    later: bool
    without: tuple[str, ...] = ()
    cycle: bool = False


MEMORY = (H.lagged_growth, H.creep, H.lagged_growth_of_two, H.play, H.lagged_drift, H.preisach, U.warm_up, H.restart)
SLIPS = (H.slip, H.slip_twice, H.bumped_tool, H.moved_tracker, H.cycles, H.cycles)
SIDED = (H.lost_motion_of_one, H.lost_motion_of_two, U.friction_load, H.lost_motion_of_one, H.lost_motion_of_two, U.gap_by_angle)  # fmt: skip
SIDES = tuple(f"dir{j}" for j in range(1, 7))


def recipe_of(kind: str, index: int) -> Recipe:
    """24 different sets of a kind; what follows earlier rows is asked after the table, which then knows them all."""
    sides = SIDES if kind == "directions missing" else ()
    if index >= 24:
        return Recipe(None, index % 2 == 1, index % 4 > 1, sides)
    if kind == "memory":
        law, turn = MEMORY[index % 8], index // 8
        memory = law in (H.creep, H.play, H.preisach)
        return Recipe(law, memory or turn % 2 == 1, (turn + index) % 2 == 1)
    law, turn = (SLIPS if kind == "slips and cycles" else SIDED)[index % 6], index // 6
    if kind == "slips and cycles":
        return Recipe(law, law is not H.cycles and turn % 2 == 1, turn % 4 > 1, cycle=index % 6 == 4)
    return Recipe(law, True, turn % 4 > 1, (*sides, *(("time_s",) if turn % 2 else ())))


def history(g: np.random.Generator, poses: np.ndarray, arm: A.Arm, paused: float, at: int) -> States:
    """States of visits to some poses (numbers, (n,)) one after another, a pause [s] before the ``at``-th.

    The air swings smoothly, payloads are changed every 20 to 40 visits, and joints come from where they were before.
    """
    n = len(poses)
    s = draw_states(g, int(poses.max()) + 1, arm, moving=False, session=False).take(poses)
    time = np.cumsum(g.uniform(40, 120, n))
    time[at:] += paused
    air = 22 + g.uniform(4, 8) * np.sin(2 * np.pi * time / g.uniform(7000, 18000) + g.uniform(0, 2 * np.pi))
    block = np.cumsum(np.isin(np.arange(n), np.cumsum(g.integers(20, 41, n // 20 + 1))))
    mass = g.choice(np.unique(s.mass), block[-1] + 1)[block]
    side = np.sign(np.diff(s.q, axis=0, prepend=s.q[:1]))
    side[0] = g.choice([-1.0, 1.0], 6)
    for i in range(1, n):
        side[i] = np.where(side[i] == 0, side[i - 1], side[i])
    session = (np.arange(n) >= at).astype(int) if paused else None
    return replace(s, time=np.round(time, 1), temperature=air, mass=mass, approach=side, session=session)


def visits(g: np.random.Generator, count: int, recipe: Recipe) -> tuple[np.ndarray, np.ndarray]:
    """Numbers of the poses in the order of visits, (n,), and which visits are asked; others are the table's."""
    table = list(range(count))
    for pose in range(0, count, count // REPEATED)[:REPEATED]:
        for _ in range(2):
            at = int(g.integers(table.index(pose) + 1, len(table) + 1)) if recipe.later else table.index(pose) + 1
            table.insert(at, pose)
    size = len(table) + ASKED
    asked = np.arange(size) >= len(table)
    if not recipe.after:
        # Repeats of one visit stay together.
        first = np.flatnonzero(np.diff(table, prepend=-1) != 0)[1:]
        asked = np.zeros(size, dtype=bool)
        asked[np.sort(g.choice(first, ASKED)) + np.arange(ASKED)] = True
    poses = np.empty(size, dtype=int)
    poses[~asked], poses[asked] = table, np.arange(count, count + ASKED)
    return poses, asked


def ordered_set(kind: str, index: int) -> Set:
    """The set of a kind and a number."""
    recipe = recipe_of(kind, index)
    g = np.random.default_rng(SEED + 100_000 * list(KINDS).index(kind) + index)
    arm = A.ARMS[MAIN]()
    hidden = () if recipe.law is None else (recipe.law(g, arm),)
    noise, n = float(g.choice(NOISES)), int(g.choice([120, 150, 180]))
    cell = draw_cell(g, arm, hidden)
    poses, asked = visits(g, n, recipe)
    rows = np.flatnonzero(~asked)
    pause = g.uniform(3000, 9000) if any(h.needs == "session" for h in hidden) else 0.0
    s = history(g, poses, arm, pause, rows[len(rows) // 2])
    places = measure(cell, s)
    told = replace(s, temperature=s.temperature + g.normal(0, SENSOR, len(s)))
    ids = [f"P{pose:03d}" for pose in poses]
    more = {"cycle": [str(c) for c in H.power_cycle(s)]} if recipe.cycle else {}
    whole = _read(told, places, ids, 6, recipe.without, more)
    seen = places[rows] + g.normal(0, 1e-3 * noise, (len(rows), 3))
    more = {name: [values[i] for i in rows] for name, values in more.items()}
    data = _read(told.take(rows), seen, [ids[i] for i in rows], 4, recipe.without, more)
    words = ["asked after" if recipe.after else "asked between", "repeated later" if recipe.later else ""]
    words += [f"with {name}" for name in more] + (["rows in order"] if "time_s" in recipe.without else [])
    name = f"{recipe.law.__name__ if recipe.law else 'nothing'}, {', '.join(filter(None, words))} #{index}"
    return Set(kind, name, MAIN, data, whole, Truth.of(hidden), 1e-3 * noise, asked={"unseen": asked})


def _read(
    s: States,
    places: np.ndarray,
    ids: list[str],
    digits: int,
    without: tuple[str, ...],
    more: Mapping[str, Sequence[str]],
) -> Measurements:
    """Rows as a user's table holds them. Args: without: columns left out; more: columns beside those of `write_table`."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "rows.csv"
        write_table(path, s, places, ids, digits)
        head, *rows = csv.reader(path.read_text().splitlines())
    kept = [k for k, name in enumerate(head) if name not in without]
    out = io.StringIO()
    w = csv.writer(out, lineterminator="\n")
    w.writerow([*(head[k] for k in kept), *more])
    for i, row in enumerate(rows):
        w.writerow([*(row[k] for k in kept), *(values[i] for values in more.values())])
    terms = Reading(rows_in_order="time_s" in without)
    return read_measurements(Source("rows.csv", out.getvalue().encode()), load_robot(MAIN), terms=terms)
