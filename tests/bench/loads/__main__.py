"""The judge of loads: ``python -m tests.bench.loads [--sets N] [--seed S] [--only NAME] [--workers W] [--json FILE] [--walk]``."""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(name, "1")

import numpy as np  # noqa: E402

from tests.bench.loads.judge import GROUPS, INSIDE, MOST_REPORTED, WORSE, drawn, faults, inside  # noqa: E402

HEAD = f"{'':34s} {'sets':>4s} {'change':>7s} {'shipped':>7s} {'best':>7s} {'base':>7s} {'model':>7s} {'said':>7s} {'ratio':>6s} {'worst':>6s} {'>1.1':>4s} {'inside':>6s} {'pose':>6s} {'fail':>4s}"


def main(argv: list[str] | None = None) -> int:
    o = argparse.ArgumentParser(description=__doc__)
    o.add_argument("--sets", type=int, default=48)
    o.add_argument("--start", type=int, default=0, help="number of the first set")
    o.add_argument("--seed", type=int, default=0)
    o.add_argument("--only", default="", help="sets whose name holds this text, as `pulled`, `irb1200` or `backlash`")
    o.add_argument("--workers", type=int, default=1)
    o.add_argument("--json", type=Path, help="file for all figures")
    o.add_argument(
        "--masses", action="store_true", help="the links weigh otherwise than the arm's file says, by its factors"
    )
    o.add_argument("--walk", action="store_true", help="the commands of the README instead of the sets")
    a = o.parse_args(argv)
    if a.walk:
        from tests.bench.loads.walk import walk

        print(json.dumps(walk(), indent=1))
        return 0
    from tests.bench.loads.sets import title

    numbers = [i for i in range(a.start, a.start + a.sets) if a.only in title(i)]
    with ProcessPoolExecutor(a.workers, get_context("spawn")) as pool:
        results = list(pool.map(drawn, numbers, [a.seed] * len(numbers), [a.masses] * len(numbers)))
    print(summary(results))
    if a.json:
        a.json.write_text(json.dumps({"sets": results, "inside": inside(results)}, indent=1))
    return int(any(faults(x) for x in results))


def summary(results: Sequence[dict[str, Any]]) -> str:
    """The table by kind, the joints, and what is not as it must be."""
    lines = [
        "Change of the TCP under loads at unseen poses, mm (root mean square); ratio: error over the shipped model's.",
        "best, base: perfect fits with priors, which know what is hidden and which do not; said: standard deviation; inside: 95 % intervals of the change, of the pose",
        HEAD,
    ]
    plain = [x for x in results if not x["hidden"]]
    hiding = [x for x in results if x["hidden"]]
    groups: list[tuple[str, str, Sequence[dict[str, Any]]]] = []
    for key, label in (("table", "{}"), ("arm", "{}"), ("poses", "{} poses"), ("rounded", "rounded {}")):
        for value in dict.fromkeys(x[key] for x in plain):
            groups.append((f"fit: {label.format(value)}", "fitted", [x for x in plain if x[key] == value]))
    groups.append(("fit: nothing hidden", "fitted", plain))
    groups.append(("fit: something hidden", "fitted", hiding))
    for value in dict.fromkeys(x["table"] for x in hiding):
        groups.append((f"add: {value}", "added", [x for x in hiding if x["table"] == value]))
    for value in dict.fromkeys(x["hidden"] for x in hiding):
        groups.append((f"add: {value}", "added", [x for x in hiding if x["hidden"] == value]))
    groups.append(("add: all", "added", hiding))
    lines += [row(label, step, some) for label, step, some in groups if some]
    lines += ["", *each_load(results), "", *joints(results)]
    every = [fault for x in results for fault in faults(x)]
    lines += ["", f"Not as it must be ({len(every)}):", *every]
    low, high = INSIDE
    for step, share in inside(results).items():
        lines.append(
            f"{step}: {share:.3f} of the 95 % intervals hold, {'as' if low <= share <= high else 'not as'} they must ({low} to {high})"
        )
    for key, word in (("best", "knows what is hidden"), ("base", "does not know it")):
        ratio = [x[f"{key}_mm"] / x["shipped_mm"] for x in results]
        held = float(np.mean([x[f"{key}_inside"] for x in results]))
        above = ", ".join(f"{x['set'][:2]} {r:.2f}" for x, r in zip(results, ratio, strict=True) if r > WORSE)
        lines.append(
            f"A perfect fit that {word}: {held:.3f} of its intervals hold, worst ratio {max(ratio):.2f}, above {WORSE}: {above or 'none'}"
        )
    lines.append(f"{sum(x['cpu_s'] for x in results):.0f} s of the processor")
    return "\n".join(lines)


def row(label: str, step: str, some: Sequence[dict[str, Any]]) -> str:
    """One line of the table: means over its sets, the median and the worst ratio."""
    good = [x for x in some if step in x and "failed" not in x[step]]
    if not good:
        return f"{label:34s} {len(some):4d}  no model"

    def mean(value: Callable[[dict[str, Any]], float]) -> float:
        return float(np.mean([value(x) for x in good]))

    ratios = [x[step]["ratio"] for x in good]
    figures = [
        mean(lambda x: x["change_mm"]),
        mean(lambda x: x["shipped_mm"]),
        mean(lambda x: x["best_mm"]),
        mean(lambda x: x["base_mm"]),
        mean(lambda x: x[step]["error_mm"]),
        mean(lambda x: x[step]["said_mm"]),
    ]
    text = (
        " ".join(f"{x:7.3f}" for x in figures)
        + f" {np.median(ratios):6.2f} {max(ratios):6.2f} {sum(x > WORSE for x in ratios):4d}"
    )
    text += f" {mean(lambda x: x[step]['inside']):6.2f} {mean(lambda x: x[step]['pose_inside']):6.2f}"
    return f"{label:34s} {len(some):4d} {text} {len(some) - len(good):4d}"


def each_load(results: Sequence[dict[str, Any]]) -> list[str]:
    """Error over the shipped model's, by load, of all sets together, and the share of its intervals that hold."""
    words = [*"xyz", "x-y-z", "xy-z", "-xy-z", "-x-y-z", *(f"about {c}" for c in "xyz"), "y, about x", "x, about y"]
    lines = [f"By load (forces along, moments about): {'; '.join(words)}"]
    for name, pick in GROUPS.items():
        some = [(x, pick(x)) for x in results if "inside" in pick(x)]
        if some:
            scale = np.array([x["change_mm"] for x, _ in some])[:, None]
            own = np.array([y["error_each_load_mm"] for _, y in some]) / scale
            shipped = np.array([x["shipped_each_load_mm"] for x, _ in some]) / scale
            ratio = np.sqrt((own**2).mean(axis=0) / (shipped**2).mean(axis=0))
            share = np.mean([y["inside_each_load"] for _, y in some], axis=0)
            lines.append(f"  {name:22s} ratio  " + " ".join(f"{r:5.2f}" for r in ratio))
            lines.append(f"  {'':22s} inside " + " ".join(f"{r:5.2f}" for r in share))
    return lines


def joints(results: Sequence[dict[str, Any]]) -> list[str]:
    """Compliances by joint, where nothing is hidden: of joints that the tables tell, and of the others."""
    plain = [x for x in results if not x["hidden"] and "failed" not in x["fitted"]]
    lines = [
        f"Compliance by joint, nothing hidden: error in %, shipped and fitted (median of the size); told: the table narrows it to {MOST_REPORTED} at least"
    ]
    for j in range(6):
        text = f"  joint {j + 1}"
        for word, some in (
            ("told", [x for x in plain if x["told"][j] < MOST_REPORTED]),
            ("not told", [x for x in plain if x["told"][j] >= MOST_REPORTED]),
        ):
            text += f"   {word:8s} {len(some):3d}"
            if some:
                shipped, own = (
                    100 * np.median(np.abs([e(x)[j] for x in some]))
                    for e in (lambda x: x["shipped_compliance_error"], lambda x: x["fitted"]["compliance_error"])
                )
                pulls = np.abs([x["fitted"]["compliance_pull"][j] for x in some])
                text += f": {shipped:5.1f} {own:6.1f}  over the least error {np.median(pulls):8.2g}, most {pulls.max():8.2g}"
        lines.append(text)
    return lines


if __name__ == "__main__":
    sys.exit(main())
