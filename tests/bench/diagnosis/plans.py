"""Are promises of plans kept? ``python -m tests.bench.diagnosis.plans [--circles N] [--kinds all|tellable] [--start I] [--results FILE] [--summary]``.

A circle: a small table of the independent arm on which `diagnose` cannot tell two effects apart, one of which is
hidden; `plan --between` these two, with its promise; the planned poses measured on the same arm; `diagnose` again.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(name, "1")

import numpy as np  # noqa: E402

from postproc.diagnostics import Source  # noqa: E402
from postproc.effects.registry import effect_library  # noqa: E402
from postproc.estimation.least_squares import fit_model  # noqa: E402
from postproc.identification.diagnose import diagnose  # noqa: E402
from postproc.identification.planning.design import Room  # noqa: E402
from postproc.identification.planning.plan import MeasuringPlan, plan_poses  # noqa: E402
from postproc.measure.read.together import read_tables  # noqa: E402
from postproc.model.arm import Model  # noqa: E402
from postproc.robot.catalogue import load_robot  # noqa: E402
from tests.bench.diagnosis.sets import MAIN, NOISES, Set  # noqa: E402
from tests.independent import arm as A  # noqa: E402
from tests.independent import library_effects as K  # noqa: E402
from tests.independent.cells import DEG, Cell, States, draw_cell, draw_states, measure  # noqa: E402
from tests.independent.hidden_effects import Kind, write_table  # noqa: E402

KINDS: list[Kind] = [
    K.gravity_compensator, K.arm_load, K.payload_error, K.base_compliance, K.bearing_tilt, K.link_compliance, K.joint_error_map, K.thermal_growth,
    K.thermal_joint_drift, K.link_geometry, K.nonlinear_tanh, K.wrist_coupling, K.dress_pack, K.backlash, K.transmission_error,
]  # fmt: skip
TELLABLE: list[Kind] = [
    K.link_compliance,
    K.thermal_growth,
    K.link_geometry,
    K.bearing_tilt,
    K.arm_load,
    K.thermal_joint_drift,
]
"""Those whose rivals some poses tell from them: without these most promises are 0 and kept."""
SETS = {"all": KINDS, "tellable": TELLABLE}
POSES, PLANNED = (22, 28, 36, 48, 70), (4, 8, 15, 25)
"""Poses of the first table, and of a plan."""
LIGHT = (2.0, 5.0)
"""Payloads [kg] of every third table; the others have up to the rated 60 kg."""
AGAIN = 2
"""Times that a plan is measured, with other noise."""
SEED = 86_000_000
RESULTS = Path(__file__).parent / "plans.jsonl"
FORMER_SIGMAS = 5.0
"""Standard deviations of distance that were called enough before tables were simulated."""
BANDS = ((0.0, 0.1), (0.1, 0.5), (0.5, 0.9), (0.9, 1.01))


@dataclass(frozen=True)
class Measured:
    """A cell and its first table. Args: noise: per axis [m]; states, seen, ids: the rows; key: of the hidden effect."""

    cell: Cell
    noise: float
    states: States
    seen: np.ndarray
    ids: list[str]
    key: str

    @property
    def table(self) -> Source:
        return table("first.csv", self.states, self.seen, self.ids)

    def planned(self, plan: MeasuringPlan, g: np.random.Generator) -> Source:
        """The table of a plan: its poses as they stand in its file, measured in an hour after the first table."""
        s, n = plan.state, len(plan.state)
        mass, center = (
            np.zeros(shape) if x is None else x for x, shape in ((s.payload_mass, n), (s.payload_center, (n, 3)))
        )
        states = States(
            np.round(s.q / DEG, 4) * DEG, s.approach, np.full(n, np.median(self.states.temperature)), 60.0 * np.arange(1, n + 1), mass, center,
            force=None if s.wrench is None else s.wrench[:, :3],
        )  # fmt: skip
        later = replace(states, time=states.time + self.states.time.max())
        seen = measure(self.cell, later) + g.normal(0, self.noise, (n, 3))
        return table("planned.csv", states, seen, [f"N{k + 1:03d}" for k in range(n)])


def table(name: str, s: States, seen: np.ndarray, ids: list[str]) -> Source:
    """Rows as a user's file."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / name
        write_table(path, s, seen, ids, 4)
        lines = path.read_text().splitlines()
    if s.force is not None:
        forces = [",".join(f"{x:.8g}" for x in row) for row in s.force]
        lines = [",".join(pair) for pair in zip(lines, ["fx_N,fy_N,fz_N", *forces], strict=True)]
    return Source(name, ("\n".join(lines) + "\n").encode())


def first_table(index: int, kinds: str = "all") -> tuple[Measured, int]:
    """The cell and first table of a circle, and how many poses are to be planned."""
    some = SETS[kinds]
    g, arm = np.random.default_rng(SEED + 100_000 * (some is TELLABLE) + index), A.ARMS[MAIN]()
    hidden = some[index % len(some)](g, arm)
    noise, n, count = 1e-3 * float(g.choice(NOISES)), int(g.choice(POSES)), int(g.choice(PLANNED))
    cell, s = draw_cell(g, arm, (hidden,)), draw_states(g, n, arm, False, False)
    if index // len(some) % 3 == 2:
        s = replace(s, mass=g.choice(LIGHT, n))
    again = np.concatenate([np.arange(n), *[np.arange(0, n, max(n // 12, 1))] * 2])
    s = s.take(again)
    seen = measure(cell, s) + g.normal(0, noise, (len(again), 3))
    return Measured(cell, noise, s, seen, [f"P{k + 1:03d}" for k in again], hidden.answer), count


def circle(index: int, kinds: str = "all") -> dict[str, Any] | None:
    """The figures of a circle; None where the first table tells the hidden effect from all others, or does not show it."""
    begin, robot, library = time.process_time(), load_robot(MAIN), effect_library()
    first, count = first_table(index, kinds)
    data = read_tables([first.table], robot)
    base = fit_model(Model(robot, robot_name=MAIN), data, [library[key].null() for key in Set.base]).model
    missing = {m.key: m.not_separable for m in diagnose(base, data).missing}
    other = next(iter(missing.get(first.key, ())), None) or next(
        (k for k, some in missing.items() if first.key in some), None
    )
    if other is None:
        return None
    pair = (first.key, other)
    planning = time.process_time()
    plan = plan_poses(base, data, count, pair)
    planned = time.process_time() - planning
    assert plan.promise is not None
    g = np.random.default_rng(SEED - 1 - index)

    def kept(measured: MeasuringPlan) -> list[bool]:
        """Whether `diagnose` names the hidden effect and rules the other out, each time that a plan is measured."""
        found = []
        for _ in range(AGAIN):
            both = read_tables([first.table, first.planned(measured, g)], robot)
            named = {m.key: m.not_separable for m in diagnose(base, both).missing}
            found.append(first.key in named and other not in named and other not in named[first.key])
        return found

    result = {
        "kinds": kinds, "index": index, "pair": pair, "rows": len(data), "poses": count, "noise": first.noise, "sigmas": plan.after,
        "tables": plan.promise.tables, "told_apart": plan.promise.told_apart, "kept": kept(plan), "plan_s": planned,
    }  # fmt: skip
    if plan.alternatives and (last := plan.alternatives[-1]).promise.enough:
        room = Room(payloads=last.payloads, force=last.force)
        advised = plan_poses(base, data, last.poses, pair, room=room)
        assert advised.promise is not None
        result |= {
            "advice": [last.poses, list(last.payloads), last.force],
            "advice_tables": advised.promise.tables, "advice_told_apart": advised.promise.told_apart, "advice_kept": kept(advised),
        }  # fmt: skip
    return result | {"cpu_s": time.process_time() - begin}


def promises(results: Sequence[dict[str, Any]], prefix: str = "") -> Iterator[tuple[float, float]]:
    """The promised share and the share that was kept, of each circle."""
    for x in results:
        if f"{prefix}kept" in x:
            yield x[f"{prefix}told_apart"] / x[f"{prefix}tables"], float(np.mean(x[f"{prefix}kept"]))


def summary(results: Sequence[dict[str, Any]]) -> str:
    """The table of the scorecard: promised and kept, by what was promised; then what a distance would have promised."""
    every, lines = (
        np.array(list(promises(results))),
        ["| promised | circles | promised, mean | kept, mean |", "|---|---|---|---|"],
    )
    for low, high in BANDS:
        some = every[(every[:, 0] >= low) & (every[:, 0] < high)]
        if len(some):
            lines.append(
                f"| {low:.1f} to {min(high, 1.0):.1f} | {len(some)} | {some[:, 0].mean():.2f} | {some[:, 1].mean():.2f} |"
            )
    lines.append(f"| all | {len(every)} | {every[:, 0].mean():.3f} | {every[:, 1].mean():.3f} |")
    spread = (every[:, 0] - every[:, 1]).std(ddof=1) / np.sqrt(len(every))
    lines += ["", f"calibration {every[:, 0].mean() - every[:, 1].mean():+.3f}, standard error {spread:.3f}"]
    far = np.array([x["sigmas"] >= FORMER_SIGMAS for x in results])
    kept = every[:, 1]
    lines.append(
        f"distance of {FORMER_SIGMAS:.0f} standard deviations: {far.sum()} circles, kept {kept[far].sum():.1f}; below: {(~far).sum()}, kept {kept[~far].sum():.1f}"
    )
    advised = np.array(list(promises(results, "advice_")))
    if len(advised):
        lines.append(
            f"advice: {len(advised)} circles, promised {advised[:, 0].mean():.3f}, kept {advised[:, 1].mean():.3f}"
        )
    lines.append(
        f"plan: {np.mean([x['plan_s'] for x in results]):.1f} s of the processor on average, {max(x['plan_s'] for x in results):.1f} s at most"
    )
    return "\n".join(lines)


def main(argv: list[str] | None = None) -> int:
    o = argparse.ArgumentParser(description=__doc__)
    o.add_argument(
        "--circles", type=int, default=24, help="circles in all; tables that tell the effects apart count for none"
    )
    o.add_argument("--kinds", default="all", choices=list(SETS), help="which effects are hidden in turn")
    o.add_argument("--start", type=int, default=0, help="number of the first table")
    o.add_argument("--results", type=Path, default=RESULTS)
    o.add_argument("--summary", action="store_true", help="only print the table from the results")
    a = o.parse_args(argv)
    results = [json.loads(line) for line in a.results.read_text().splitlines()] if a.results.exists() else []
    own = [x for x in results if x["kinds"] == a.kinds]
    index = max([a.start, *(x["index"] + 1 for x in own)])
    while not a.summary and len(own) < a.circles:
        if found := circle(index, a.kinds):
            own.append(found)
            with a.results.open("a") as out:
                out.write(json.dumps(found) + "\n")
            print(json.dumps(found), flush=True)
        index += 1
    print(summary(own))
    return 0


if __name__ == "__main__":
    sys.exit(main())
