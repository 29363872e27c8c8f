"""What a misread reading does to the promise of a fit to planned set-ups: ``python -m tests.bench.shop.slips [SHOPS]``.

Of shops of each robot a plan is read, once or twice, with a slip of the pen in one reading under load or with none. The
share of the deflection by loads that remains at postures that were not measured stands beside the upper end of the
interval that the fit promises.
"""

from __future__ import annotations

import csv
import io
import os
import sys
from dataclasses import dataclass
from itertools import product

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(name, "1")

import numpy as np  # noqa: E402

from postproc.diagnostics import Source  # noqa: E402
from postproc.effects.registry import effect_library  # noqa: E402
from postproc.estimation.recorded import known_errors, recorded_model  # noqa: E402
from postproc.identification.add import fit_effects  # noqa: E402
from postproc.identification.planning.setups import Request, plan_setups  # noqa: E402
from postproc.identification.planning.standing import can_work, random_postures, working_box  # noqa: E402
from postproc.identification.planning.table import setups_csv  # noqa: E402
from postproc.measure.read.table import read_measurements  # noqa: E402
from postproc.measure.read.terms import Reading  # noqa: E402
from postproc.model.arm import Model  # noqa: E402
from postproc.model.uncertainty.scatter import scatter_covariance, scatter_of, spring_covariance  # noqa: E402
from postproc.robot.catalogue import load_robot  # noqa: E402
from tests.independent.arm import ARMS, Load, equilibrium, joint_springs, shift  # noqa: E402

ROBOTS = {"irb4600_60_205": 2.2, "irb4600_40_255": 3.0}
"""Robots, and the factor within which 95 % of their springs are about those of the type."""
TOOL, PULL, SIDE, DIAL = shift(z=0.3), 150.0, 50.0, 0.01
"""TCP, pull of a set-up and force at unseen postures [N], standard deviation of a reading [mm]."""
Row = dict[str, str]


@dataclass(frozen=True)
class Found:
    """Args: share, promised: of the deflection that remains. named: whether a finding has the misread set-up."""

    share: float
    promised: float
    named: bool


def tcp(rows: list[Row], compliance: np.ndarray, robot: str) -> np.ndarray:
    """(n, 3) TCP of the independent arm [mm]."""

    def columns(*names: str) -> np.ndarray:
        return np.array([[float(row.get(name) or 0) for name in names] for row in rows])

    center, force = columns(*(f"payload_{a}_mm" for a in "xyz")) / 1e3, columns("fx_N", "fy_N", "fz_N")
    load = Load(mass=columns("payload_kg")[:, 0], center=center, force=force)
    q = np.radians(columns(*(f"q{j}_deg" for j in range(1, 7))))
    return 1e3 * equilibrium(ARMS[robot](), q, TOOL, load, joint_springs(compliance)).frames.tcp[:, :3, 3]


def misread(reading: float, g: np.random.Generator) -> float:
    """A reading [mm] whose tenths are off by one to five, or stand where its hundredths should."""
    whole, hundredths = divmod(round(100 * abs(reading)), 100)
    swapped = whole + (hundredths % 10) / 10 + (hundredths // 10) / 100
    wrong = [reading + sign * k / 10 for sign in (-1, 1) for k in range(1, 6)] + [
        float(np.copysign(swapped, reading))
    ] * 5
    return round(float(g.choice([x for x in wrong if abs(x - reading) > 0.08 and x * reading > 0])), 2)


def shops(robot: str, count: int, times: int, slip: bool, number: int) -> list[Found]:
    """What a fit says in so many shops, by the rows of one plan, each set-up read so many times."""
    arm = Model(load_robot(robot), T_flange_tcp=TOOL, robot_name=robot)
    load = round(0.8 * (arm.robot.payload or 0.0))
    rows = list(csv.DictReader(io.StringIO(setups_csv(plan_setups(arm, Request("gauge", load, PULL), count)))))
    normal = np.array([[float(row[f"n{a}"]) for a in "xyz"] for row in rows])
    anywhere = random_postures(arm.robot, 4000, np.random.default_rng(5))
    q = anywhere[can_work(arm, working_box(arm.robot), anywhere)][:20]
    loaded = {"payload_kg": str(load), "payload_z_mm": "300", "fy_N": str(SIDE)}
    unseen = [{f"q{j}_deg": str(x) for j, x in enumerate(np.degrees(p), 1)} | on for p in q for on in ({}, loaded)]
    each = np.ones(len(q))
    state = arm.state(
        q,
        payload_mass=load * each,
        payload_center=np.outer(each, TOOL[:3, 3]),
        wrench=np.outer(each, [0, SIDE, 0, 0, 0, 0]),
    )
    found, usual = [], np.asarray(arm.robot.joint_compliance)
    for k in range(number):
        g = np.random.default_rng([61, k])
        real = usual * np.exp(g.normal(size=6) * np.log(ROBOTS[robot]) / 1.96)
        reading = np.sum(normal * tcp(rows, real, robot), axis=1).reshape(count, -1, 2)
        reading = (reading - reading[:, :1, :1])[:, :times]
        reading = np.round(reading + g.normal(0, DIAL, reading.shape), 2)
        i = int(g.integers(count))
        if slip:
            j = int(g.integers(times))
            reading[i, j, 1] = misread(float(reading[i, j, 1]), g)
        kept = [row for n, row in enumerate(rows) if n % (len(rows) // count) < 2 * times]
        written = [row | {"reading_mm": f"{x:.2f}"} for row, x in zip(kept, reading.ravel(), strict=True)]
        text = "\n".join([",".join(written[0]), *(",".join(row.values()) for row in written)])
        data = read_measurements(Source("t.csv", text.encode()), arm.robot, terms=Reading(tool=TOOL))
        fit = fit_effects(arm, data, [effect_library()["joint_compliance"]])
        springs = fit.model.effect("joint_compliance")
        assert springs is not None
        true, own = (np.diff(tcp(unseen, c, robot).reshape(-1, 2, 3), axis=1) for c in (real, springs.vector()))
        known = scatter_covariance(fit.model, spring_covariance(fit.model, known_errors(fit)))
        promised = scatter_of(recorded_model(fit), state, known, False).remaining[1]
        share = float(np.sqrt(np.sum((own - true) ** 2) / np.sum(true**2)))
        said = [d.message for d in data.diagnostics if d.code == "DAT041"]
        found.append(Found(share, promised, any(f"G{i + 1:02d}" in text for text in said)))
    return found


def main(number: int) -> None:
    print(
        f"{number} shops each: robot, set-ups, times read, slip | inside, named | share that remains, promised (median)"
    )
    for robot, (count, times), slip in product(ROBOTS, ((6, 1), (8, 1), (12, 1), (6, 2)), (False, True)):
        found = shops(robot, count, times, slip, number)
        inside, named = (np.mean([x.share <= x.promised for x in found]), np.mean([x.named for x in found]))
        share, promised = np.median([[x.share, x.promised] for x in found], axis=0)
        print(
            f"{robot:16s} {count:3d} {times} {slip:d} | {inside:.2f} {named:.2f} | {share:.3f} {promised:.3f}",
            flush=True,
        )


if __name__ == "__main__":
    main(int(sys.argv[1]) if sys.argv[1:] else 60)
