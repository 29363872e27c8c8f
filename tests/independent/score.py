"""Counts how often the product names the hidden effect: ``python -m tests.independent.score FOLDER [--limit N]``.

Talks to the product through its command line alone; reads ``answers.json`` beside the sets.
"""

from __future__ import annotations

import argparse
import csv
import json
import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

BASE = "instrument_frame,tool_frame,joint_offset,joint_compliance"
ABOUT_DATA = {"session", "outlier"}


def call(*args: str, timeout: float = 300) -> tuple[int, str, str]:
    env = {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    try:
        r = subprocess.run(
            [sys.executable, "-m", "postproc", *args], capture_output=True, text=True, timeout=timeout, env=env
        )
    except subprocess.TimeoutExpired:
        return 124, "", "timeout"
    return r.returncode, r.stdout, r.stderr


def places(path: Path) -> np.ndarray:
    with path.open() as f:
        return np.array([[float(r[k]) for k in ("x_mm", "y_mm", "z_mm")] for r in csv.DictReader(f)])


def held_out(model: Path, folder: Path) -> float | None:
    """Rms per axis [mm] of the prediction at the true poses."""
    out = model.with_suffix(".csv")
    code, _, err = call("predict", str(model), str(folder / "validate_true.csv"), "-o", str(out))
    if code not in (0, 1) or not out.exists():
        print("   predict:", err.strip()[-300:])
        return None
    return float(np.sqrt(((places(out) - places(folder / "validate_true.csv")) ** 2).mean()))


def run_set(folder: Path, answer: dict[str, Any], work: Path) -> dict[str, Any]:
    work.mkdir(parents=True, exist_ok=True)
    base, better = work / f"{folder.name}.toml", work / f"{folder.name}_2.toml"
    fit = str(folder / "fit.csv")
    result: dict[str, Any] = {**answer, "named": [], "said": None, "error": None}
    robot = {"irb4600_20_250": "irb4600_20_250", "irb4600_40_255": "irb4600_40_255"}.get(
        answer["robot"], answer["robot"]
    )
    code, out, err = call("fit", fit, "--robot", robot, "--effects", BASE, "-o", str(base), "--json")
    if code not in (0, 1) or not base.exists():
        return {**result, "error": f"fit {code}: {err.strip()[-400:]}"}
    start = time.perf_counter()
    code, out, err = call("diagnose", str(base), fit, "--json")
    result["seconds"] = round(time.perf_counter() - start, 1)
    try:
        d = json.loads(out)
    except ValueError:
        return {**result, "error": f"diagnose {code}: {err.strip()[-400:]}"}
    result["said"] = d["verdict"]
    result["named"] = [m["effect"] for m in d["missing"]]
    result["p"] = [m.get("p_value") for m in d["missing"]]
    result["inseparable"] = [m.get("not_separable_from", []) for m in d["missing"]]
    result["suspects"] = [s["channel"] for s in d["suspects"]]
    result["estimated_noise_mm"] = d.get("noise_mm")
    result["blind"] = [b["effect"] for b in d.get("blind_to", [])]
    result["held_out_before"] = held_out(base, folder)
    real = [e for e in result["named"] if e not in ABOUT_DATA or e == "session"]
    if real:
        code, out, err = call("add", str(base), *real, "--data", fit, "-o", str(better), "--json")
        if code in (0, 1) and better.exists():
            result["held_out_after"] = held_out(better, folder)
        else:
            result["error"] = f"add {code}: {err.strip()[-400:]}"
    else:
        result["held_out_after"] = result["held_out_before"]
    return result


def judge(r: dict[str, Any]) -> str:
    """right, right+extra, inseparable, wrong, missed, false alarm, abstained, or error."""
    if r["error"] and r["said"] is None:
        return "error"
    named = [e for e in r["named"] if e not in ABOUT_DATA or "session" in r["effects"]]
    if not r["accept"]:
        return "right" if r["said"] == "complete" and not named else "false alarm"
    if r["verdict"] == "unknown":
        first = r["suspects"][:3]
        if r["said"] == "unknown" and (not r["channels"] or set(first) & set(r["channels"])):
            return "right"
        tolerated = {x for a in r["accept"] for x in a}
        if named and set(named) <= tolerated:
            return "right"
        return "wrong channel" if r["said"] == "unknown" else "missed" if not named else "wrong"
    if not named:
        return "abstained" if r["said"] == "unknown" else "missed"
    left = [set(a) for a in r["accept"]]
    primary = [a[0] for a in r["accept"]]
    extra, exact = [], True
    for e, alike in zip(named, r["inseparable"] + [[]] * len(named), strict=False):
        hit = next((a for a, k in zip(left, primary, strict=False) if e == k), None) or next(
            (a for a in left if e in a), None
        )
        if hit is None:
            hit = next((a for a in left if a & set(alike)), None)
            exact = False
        if hit is None:
            extra.append(e)
        else:
            left.remove(hit)
    if named[0] in extra:
        return "wrong"
    if left:
        return "part"
    if extra:
        return "right+extra"
    return "right" if exact else "inseparable"


def main(argv: list[str] | None = None) -> int:
    o = argparse.ArgumentParser()
    o.add_argument("folder", type=Path)
    o.add_argument("--limit", type=int)
    o.add_argument("--only", help="sets whose kinds hold this word")
    o.add_argument("--work", type=Path)
    a = o.parse_args(argv)
    answers = json.loads((a.folder / "answers.json").read_text())
    if a.only:
        answers = [x for x in answers if a.only in x["kinds"] or (a.only == "none" and not x["kinds"])]
    work = a.work or a.folder / "results"
    table: list[dict[str, Any]] = []
    for answer in answers[: a.limit]:
        r = run_set(a.folder / answer["set"], answer, work)
        r["judged"] = judge(r)
        after = r.get("held_out_after")
        r["ratio"] = round(after / r["noise_mm"], 2) if after is not None else None
        table.append(r)
        print(
            f"{r['set']} {'+'.join(r['kinds']) or 'none':32s} n {r['poses']:3d} {r['structure_over_noise']:5.1f}x -> {r['judged']:13s} "
            f"{r['said']} {r['named']} suspects {r.get('suspects', [])[:3]} held-out/noise {r['ratio']} {r.get('seconds')} s {r['error'] or ''}",
            flush=True,
        )
    work.mkdir(parents=True, exist_ok=True)
    (work / "results.json").write_text(json.dumps(table, indent=1))
    sum_up(table)
    return 0


def sum_up(table: list[dict[str, Any]]) -> None:
    groups = {
        "clean": [r for r in table if not r["accept"]],
        "library, strong (structure above noise)": [
            r for r in table if r["verdict"] == "missing" and r["structure_over_noise"] >= 1
        ],
        "library, weak": [r for r in table if r["verdict"] == "missing" and r["structure_over_noise"] < 1],
        "outside the library": [r for r in table if r["verdict"] == "unknown"],
    }
    for name, rows in groups.items():
        if not rows:
            continue
        counts: dict[str, int] = {}
        for r in rows:
            counts[r["judged"]] = counts.get(r["judged"], 0) + 1
        ratios = [r["ratio"] for r in rows if r["ratio"] is not None]
        floor = sum(x < 0.6 for x in ratios)
        print(f"{name}: {len(rows)} sets, {counts}; held-out below 0.6 of the noise in {floor} of {len(ratios)}")


if __name__ == "__main__":
    raise SystemExit(main())
