"""The judge of shops without a tracker: ``python -m tests.bench.shop [--only KIND] [--seeds N] [--clean N] [--hidden N] [--real]``."""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(name, "1")

import numpy as np  # noqa: E402

from tests.bench.shop.arms import ROBOTS  # noqa: E402
from tests.bench.shop.judge import GEOMETRY, HIDDEN, INSIDE, NEAR, diagnosed, faults, judge  # noqa: E402
from tests.bench.shop.sets import KINDS, LARGE, MIXTURES  # noqa: E402

SAMPLES = Path(__file__).parents[3] / "samples" / "measurements"
HEAD = f"{'':44s}   TCP mm: own   refit   usual  stated | change: own   refit  stated | inside: TCP, change"


def main(argv: list[str] | None = None) -> int:
    o = argparse.ArgumentParser(description=__doc__)
    o.add_argument("--only", default="", help="kinds, joined by commas")
    o.add_argument("--robots", default=",".join(ROBOTS))
    o.add_argument("--seeds", type=int, default=1, help="arms of each robot")
    o.add_argument("--start", type=int, default=0, help="first of them")
    o.add_argument("--effects", default=GEOMETRY, help="effects that are fitted")
    o.add_argument("--no-sigma", action="store_true", help="the tables do not state the noise of their readings")
    o.add_argument("--clean", type=int, default=0, help="so many tables in which nothing is hidden are diagnosed, too")
    o.add_argument("--hidden", type=int, default=0, help="so many arms for each hidden effect, table and robot")
    o.add_argument("--real", action="store_true", help="readings derived from the measured tables of real arms alone")
    o.add_argument("--data", type=Path, default=SAMPLES, help="folder of these")
    o.add_argument("--refit", action="store_true", help="with --real: the refit by numpy, too")
    o.add_argument("--folder", type=Path, default=Path("shop"), help="where the tables and models are written")
    o.add_argument("--json", type=Path, help="file for all figures")
    a = o.parse_args(argv)
    a.folder.mkdir(parents=True, exist_ok=True)
    results: list[dict[str, Any]] = []
    if a.real:
        from tests.bench.shop.real import report

        results, bad = report(a.data, a.folder, a.only, a.effects, a.refit)
    else:
        results, bad = fitted(a)
        if a.clean or a.hidden:
            some, worse = asked(a)
            results, bad = results + some, bad + worse
    if a.json:
        a.json.write_text(json.dumps(results, indent=1))
    print(f"Not as it must be ({len(bad)}):", *bad, sep="\n", flush=True)
    return int(bool(bad))


def chosen(only: str, every: Sequence[str]) -> list[str]:
    """Kinds of a list joined by commas, all where it is empty."""
    return [x for x in every if not only or x in only.split(",")]


def fitted(a: argparse.Namespace) -> tuple[list[dict[str, Any]], list[str]]:
    """Fits of every kind, robot and arm: a line each, then the means of a kind."""
    kinds, results = chosen(a.only, [*KINDS, *MIXTURES]), []
    print(HEAD, flush=True)
    for kind in kinds:
        some = []
        for seed in range(a.start, a.start + a.seeds):
            for robot in a.robots.split(","):
                some.append(judge(kind, robot, seed, a.folder, a.effects, not a.no_sigma))
                print(line(some[-1]), flush=True)
        results += some
    bad = [fault for x in results for fault in faults(x)]
    print("\nMeans over the arms", HEAD[19:])
    mean = {kind: average([x for x in results if x["kind"] == kind]) for kind in kinds}
    for kind, x in mean.items():
        print(line(x | {"set": kind}) if x else f"{kind}: no model")
    return results, bad + together(mean)


def average(some: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Means of all figures of sets that have a model."""
    good = [x for x in some if "failed" not in x]
    if not good:
        return {}
    return {
        k: {f: float(np.mean([x[k].get(f, np.nan) for x in good])) for f in good[0][k]}
        for k in ("own", "best", "usual", "nominal")
    }


def together(mean: dict[str, dict[str, Any]]) -> list[str]:
    """What is not as it must be on the average: mixtures against their parts, and the share of intervals that hold."""
    bad = []
    for kind, x in mean.items():
        if not x:
            continue
        parts = [mean[p]["own"] for p in kind.split("+") if kind in MIXTURES and mean.get(p)]
        for figure in ("pose", "change"):
            if parts and x["own"][figure] > 1.05 * min(p[figure] for p in parts):
                bad.append(
                    f"{kind}: {figure} {x['own'][figure]:.3f}, parts {', '.join(f'{p[figure]:.3f}' for p in parts)}"
                )
        if kind not in ("gauge", "gauge 0.001") and x["own"]["pose"] > NEAR * x["best"]["pose"]:
            bad.append(f"{kind}: TCP off by {x['own']['pose']:.3f} mm, refit {x['best']['pose']:.3f}")
        for figure in ("inside", "change_inside"):
            if not INSIDE[0] <= x["own"].get(figure, 0) <= INSIDE[1]:
                bad.append(f"{kind}: {x['own'].get(figure, np.nan):.3f} of the 95 % intervals hold ({figure})")
    return bad


def line(x: dict[str, Any]) -> str:
    """One line of the table."""
    own, best, nominal = x.get("own", {}), x["best"], x["nominal"]
    n = float("nan")
    text = f"{x['set']:44s} {own.get('pose', n):14.3f} {best['pose']:7.3f} {x['usual']['pose']:7.3f} {nominal['pose']:7.3f}"
    text += f" | {own.get('change', n):11.3f} {best['change']:7.3f} {nominal['change']:7.3f}"
    return f"{text} | {own.get('inside', n):6.2f} {own.get('change_inside', n):6.2f}  {x.get('failed', '')}"


def asked(a: argparse.Namespace) -> tuple[list[dict[str, Any]], list[str]]:
    """Diagnoses: of tables in which nothing is hidden, kinds and robots in turn, and of large ones with one effect each."""
    kinds, robots = chosen(a.only, [*KINDS, *MIXTURES]), a.robots.split(",")
    jobs = [(kinds[i % len(kinds)], "", robots[i // len(kinds) % len(robots)], a.start + i) for i in range(a.clean)]
    jobs += [
        (k, h, r, a.start + i)
        for i in range(a.hidden)
        for h in HIDDEN
        for k in chosen(a.only, list(LARGE))
        for r in robots
    ]
    results = []
    for job in jobs:
        results.append(x := diagnosed(*job, a.folder))
        words = x.get("failed", f"{x.get('verdict')} {'+'.join(x.get('named', []))}")
        print(
            f"{x['set']:52s} {'right' if x['right'] else 'WRONG'}  {words}  {' '.join(x['notes'])} {x['cpu_s']:.0f} s",
            flush=True,
        )
    for hidden in dict.fromkeys(x["hidden"] for x in results):
        some = [x["right"] for x in results if x["hidden"] == hidden]
        print(f"{hidden or 'nothing hidden'}: {sum(some)} of {len(some)} right")
    return results, [f"{x['set']}: {x.get('failed', x.get('named'))}, {x['folder']}" for x in results if not x["right"]]


if __name__ == "__main__":
    sys.exit(main())
