"""The commands of the README with a force in the last one: what the fitted model says, beside the arm that was measured.

``samples/measurements/simulated_backlash.csv`` is the table of `make_set` with the seed and the plan that stand here
(`same_table` says so), so that its arm is known: zeros, compliances, lost motion. Here it follows the program's lines by
the code of ``tests/independent``.
"""

from __future__ import annotations

import json
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from tests.bench.loads.judge import command
from tests.independent import arm as A
from tests.independent import library_effects as K
from tests.independent import paths as P
from tests.independent import rapid as R
from tests.independent.cells import DEG, Cell, draw_cell
from tests.independent.hidden_effects import Plan, draw_plan, make_set
from tests.independent.verify import _distance

SAMPLES = Path(__file__).parents[3] / "samples"
TABLE, PROGRAM = SAMPLES / "measurements" / "simulated_backlash.csv", SAMPLES / "hull_seam.mod"
SEED, POSES, NOISE_MM = 211, 120, 0.03
FORCE = (200.0, -200.0, -200.0)


def same_table() -> bool:
    """Whether the sample is the table of the seed, line by line."""
    with TemporaryDirectory() as folder:
        make_set(Path(folder), SEED, Plan([K.backlash]), NOISE_MM, POSES)
        return (Path(folder) / "fit.csv").read_text().splitlines() == TABLE.read_text().splitlines()


def true_cell() -> Cell:
    """The arm of the sample table, drawn as `make_set` draws it."""
    g, arm = np.random.default_rng(SEED), A.irb4600()
    draw_plan(g)
    return draw_cell(g, arm, (K.backlash(g, arm),))


def gaps() -> np.ndarray:
    """(6,) half of the lost motion of each joint of that arm [rad]."""
    words = true_cell().hidden[0].note
    return DEG * np.array(json.loads(words.removeprefix("half gap deg ")))


def deviation(
    compliance: np.ndarray, offset: np.ndarray, gap: np.ndarray, force: tuple[float, ...]
) -> dict[str, float]:
    """Largest distances [mm] from the programmed lines, while the arc burns and on all lines, of an arm that runs the program."""
    arm, moves = A.irb4600(), R.motions(PROGRAM.read_text("latin-1"))[0]
    side, largest = np.zeros(6), {"arc_mm": 0.0, "all_mm": 0.0}
    for leg in P.play(arm, moves, 0.002):
        if not len(leg.q):
            continue
        # A joint that stands keeps the side from which it came.
        sides, steps = np.zeros_like(leg.q), np.diff(leg.q, axis=0, prepend=leg.q[:1])
        for i, step in enumerate(steps if len(steps) > 1 else [leg.q[0] * 0]):
            side = np.where(np.abs(step) > 1e-9, np.sign(step), side)
            sides[i] = side
        sides[0] = sides[min(1, len(sides) - 1)]

        def displace(
            f: A.Frames, tau: np.ndarray, wrench: np.ndarray, s: np.ndarray = sides
        ) -> tuple[np.ndarray, np.ndarray]:
            return offset + tau * compliance - gap * s, np.zeros((len(tau), 7, 6))

        if leg.problem or leg.motion.kind not in "LC":
            continue
        bent = P.real(arm, leg.q, leg.motion, displace, np.array(force), np.zeros(3))
        off = 1e3 * float(_distance(leg.command[0], leg.motion, bent).max())
        largest["all_mm"] = max(largest["all_mm"], off)
        if leg.motion.weld:
            largest["arc_mm"] = max(largest["arc_mm"], off)
    return largest


def said(*words: str | Path) -> dict[str, Any]:
    """What the conversion of the program with the force says before it corrects."""
    with TemporaryDirectory() as folder:
        force = ",".join(f"{x:g}" for x in FORCE)
        text = command("compensate", PROGRAM, *words, "--force", force, "-o", Path(folder) / "out.mod", "--json")
    document = json.loads(text)
    sure = document["expected_accuracy"] or {}
    found = {"arc_mm": document["max_arc_error_before_mm"], "all_mm": document["max_error_before_mm"]}
    return (
        found | {k: document[k] for k in ("undetermined_under_load_mm", "expected_on_arm_mm") if k in document} | sure
    )


def walk() -> dict[str, Any]:
    """Deviation of the program under the force: of the true arm, and as the shipped, fitted and added models say."""
    cell = true_cell()
    found: dict[str, Any] = {
        "same_table": same_table(),
        "true": deviation(cell.compliance, cell.offset, gaps(), FORCE),
        "true_without_force": deviation(cell.compliance, cell.offset, gaps(), (0.0, 0.0, 0.0)),
        "table_2": deviation(A.TABLE_2, np.zeros(6), np.zeros(6), FORCE),
        "shipped": said("--robot", "irb4600_60_205"),
    }
    with TemporaryDirectory() as folder:
        model, better = Path(folder) / "cell.toml", Path(folder) / "better.toml"
        command("fit", TABLE, "--robot", "irb4600_60_205", "-o", model)
        command("add", model, "backlash", "--data", TABLE, "-o", better)
        found |= {"fitted": said("-m", model), "added": said("-m", better)}
    return found | {"faults": faults(found)}


def faults(found: dict[str, Any]) -> list[str]:
    """What is not as it must be: the deviation while the arc burns is the true arm's within the interval that is stated.

    In the air the product counts the path with its corners cut and the inertia, the line here goes from end to end.
    """
    some = [] if found["same_table"] else ["the sample is not the table of the seed"]
    true = found["true"]["arc_mm"]
    for name in ("fitted", "added"):
        own, sure = found[name]["arc_mm"], found[name]["within_95_percent_mm"]
        if abs(own - true) > sure:
            some.append(
                f"{name}: {own:.3f} mm before correction, {true:.3f} on the true arm, said to be sure to {sure:.3f}"
            )
    return some


def judge_walk() -> list[str]:
    """What of the walk is not as it must be, in some seconds; empty where all is well."""
    return list(walk()["faults"])
