"""Readings of a shop derived from the measured positions of real arms: do they give the positions that were held out?

Forms, all from the rows that are fitted:

- `pairs`: distances between two rows, three for each row.
- `planes`: rows whose measured position lies within 5 mm of a plane are jogged onto it, as a person who touches a plate
  does: the nominal arm turns the joints by what is missing (to about 0.02 mm, as errors of the arm change little on the way).
- `anchors`: distances from three fixed points, one of each for each row.
- `planes+wire`: planes, and the three distances of every twentieth row.

A plane that is nowhere known stays one when everything is scaled: planes leave the size of the arm to what was known
before. So the error is stated after a placement with a scale of its own, too.

The stated TCP is that of the nominal arm fitted to the positions, to 0.1 mm: a shop knows its tool.
"""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import numpy as np

from tests.bench.loads.judge import command
from tests.bench.shop.arms import UR10_COMPLIANCE, Shop
from tests.bench.shop.judge import GEOMETRY, numbers
from tests.bench.shop.refit import placed, refit, rms, tcp
from tests.bench.shop.sets import Rows, csv_of, joined, rows_of
from tests.independent import arm as A
from tests.independent.cells import Cell

TABLES = {"ur10_iso_b": "ur10", "ur5_grid": "ur5"}
BETTER = 1.3
"""Error of held-out positions over that which positions give, which derived readings may have."""
SLAB, FEWEST, PLANES, TURN = 5e-3, 8, 150, 0.02
NOISE = 0.1e-3
"""Weight of a reading for the refit [m]: what the true arm has and no effect of the refit explains is far above the noise."""
PRIOR = np.array([3e-3] * 6 + [0.7] * 6 + [2e-3] * 3 + [1e-3] * 30)
"""What the refit knows before, as in `refit.PRIOR`: little."""
BAD = 6.0
"""Medians beyond which a row is a bad reading: that of the fit to positions counts, for all kinds."""


def read(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Joints (n, 6) [rad], positions (n, 3) [m]."""
    rows = list(csv.DictReader(path.read_text("utf-8").splitlines()))
    q = np.radians([[float(x[f"q{j}_deg"]) for j in range(1, 7)] for x in rows])
    return q, 1e-3 * np.array([[float(x[f"{c}_mm"]) for c in "xyz"] for x in rows])


def nominal(arm: A.Arm, q: np.ndarray, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """TCP in tool0 (3,) and the positions in the base frame (n, 3), by the nominal arm."""
    f = arm.forward(q, np.eye(4)).flange
    tool, own = np.zeros(3), p
    for _ in range(200):
        own = placed(p, f[:, :3, 3] + f[:, :3, :3] @ tool)
        off = own - f[:, :3, 3] - f[:, :3, :3] @ tool
        slope = f[:, :3, :3] - f[:, :3, :3].mean(axis=0)
        tool = tool + np.linalg.lstsq(slope.reshape(-1, 3), (off - off.mean(axis=0)).ravel(), rcond=None)[0]
    return np.round(tool, 4), own


def labels(n: int, copy: int, letter: str = "P") -> np.ndarray:
    return np.array([f"{letter}{i}_{copy}" for i in range(n)], object)


def pairs(s: Shop, q: np.ndarray, p: np.ndarray) -> Rows:
    """Every row three times, with another partner each time."""
    g, parts = np.random.default_rng(43), []
    for copy in range(3):
        k = (np.arange(len(q)) + g.permutation(np.arange(1, len(q)))[0]) % len(q)
        k[:] = g.permutation(k)
        alone = k == np.arange(len(q))
        name = np.where(alone, "", labels(len(q), 0)[k])
        far = np.where(alone, np.nan, np.linalg.norm(p - p[k], axis=1))
        parts.append(
            rows_of(s.states(q, 0.0), "between", list(name), NOISE, {}, reading=far, label=labels(len(q), copy))
        )
    return joined(parts)


def anchors(s: Shop, q: np.ndarray, p: np.ndarray) -> Rows:
    """Every row from three fixed points about a metre away."""
    size, parts = np.linalg.norm(p.std(axis=0)), []
    for k, way in enumerate(np.array([[2.0, 0.5, -1], [-1, 2, -1], [0.5, -1, 2]])):
        c = p.mean(axis=0) + size * way
        more = {"reading": np.linalg.norm(p - c, axis=1), "label": labels(len(q), k, "W")}
        parts.append(
            rows_of(s.states(q, 0.0), "distance", [f"A{k}"] * len(q), NOISE, {f"A{k}": np.append(c, 0)}, **more)
        )
    return joined(parts)


def planes(s: Shop, q: np.ndarray, p: np.ndarray) -> Rows:
    """Planes at random, each touched by the rows that are near it."""
    g, parts = np.random.default_rng(43), []
    f = s.nominal.arm.forward(q, s.nominal.tool)
    at = f.tcp[:, :3, 3]
    back = np.linalg.pinv(np.stack([np.cross(a, at - b) for a, b in zip(f.axis, f.pivot, strict=True)], axis=2))
    while len(parts) < PLANES:
        normal = g.normal(size=3)
        normal /= np.linalg.norm(normal)
        d = normal @ p[g.integers(len(p))]
        turn = (back @ normal) * (d - p @ normal)[:, None]
        near = np.flatnonzero((np.abs(p @ normal - d) < SLAB) & (np.abs(turn).max(axis=1) < TURN))
        if len(near) >= FEWEST:
            name = f"F{len(parts)}"
            states, label = s.states((q + turn)[near], 0.0), labels(len(q), len(parts))[near]
            parts.append(rows_of(states, "plane", [name] * len(near), NOISE, {name: np.append(normal, d)}, label=label))
    return joined(parts)


def planes_and_wire(s: Shop, q: np.ndarray, p: np.ndarray) -> Rows:
    """Planes, and a few distances, which tell the size of the arm."""
    return joined([planes(s, q, p), anchors(s, q[::20], p[::20])])


MAKERS = {"pairs": pairs, "planes": planes, "anchors": anchors, "planes+wire": planes_and_wire}


def one(
    name: str, data: Path, folder: Path, only: str = "", effects: str = GEOMETRY, reference: bool = False
) -> list[dict[str, Any]]:
    """Figures of one real table: error of the positions held out [mm], after the best rigid placement, by kind of reading."""
    q, p = read(next(x for x in (data / f"{name}.csv", data / f"{name}_thinned.csv") if x.exists()))
    held, robot = np.arange(len(q)) * 25 // len(q) % 5 == 0, TABLES[name]
    arm = A.ARMS[robot]()
    tool, own = nominal(arm, q[~held], p[~held])
    cell = Cell(arm, np.zeros(6), UR10_COMPLIANCE, A.shift(*tool), np.eye(4))
    s = Shop(robot, cell, cell, tool, np.zeros(3), 0.0, 0.0, 1.0)
    asked = folder / f"{name}_asked.csv"
    unseen = s.states(q[held], 0.0)
    asked.write_text(csv_of(rows_of(unseen, "asked", [""] * held.sum(), np.nan, {}), bare=True))
    seen = rows_of(s.states(q[~held], 0.0), "position", ["T"] * len(own), NOISE, {"T": np.zeros(6)}, place=own)
    results: list[dict[str, Any]] = [{"set": f"{name} nominal", "at": tcp(cell, unseen), "rows": 0}]
    for kind, make in {"positions": lambda *_: seen, **MAKERS}.items():
        if only and kind not in ("positions", *only.split(",")):
            continue
        rows = make(s, q[~held], own)
        table, model, out = (folder / f"{name}_{kind}{x}" for x in (".csv", ".toml", "_predicted.csv"))
        table.write_text(csv_of(rows, bare=True))
        x: dict[str, Any] = {"set": f"{name} {kind}", "rows": len(rows), "file": str(table)}
        try:
            words = ("--robot", robot, "--tool", ",".join(f"{1e3 * t:g}" for t in tool), "--effects", effects)
            command("fit", table, *words, "-o", model, "--json")
            command("predict", model, asked, "-o", out)
            x["at"] = 1e-3 * numbers(out.read_text(), "x_mm", "y_mm", "z_mm")
        except Exception as failure:  # a failure is a figure of the set
            x["failed"] = f"{type(failure).__name__}: {failure}"[:300]
        results.append(x)
        if reference:
            results.append(
                {"set": f"{name} {kind}, refit", "rows": len(rows), "at": tcp(refit(s, rows, PRIOR).cell, unseen)}
            )
    return judged(results, p[held])


def judged(results: list[dict[str, Any]], p: np.ndarray) -> list[dict[str, Any]]:
    """The figures with the errors at positions (n, 3) in place of what was predicted, of rows that are no bad readings."""
    best = next(x["at"] for x in results if "at" in x and not x["set"].endswith("nominal"))
    away = np.linalg.norm(placed(best, p) - p, axis=1)
    good = away < BAD * np.median(away)
    for x in results:
        if "at" in x:
            at = x.pop("at")[good]
            x["held_mm"], x["scaled_mm"] = (rms(placed(at, p[good], scaled) - p[good]) for scaled in (False, True))
        held, scaled = (x.get(k, float("nan")) for k in ("held_mm", "scaled_mm"))
        print(
            f"{x['set']:28s} {x['rows']:5d} rows  {held:.3f} mm, scaled {scaled:.3f}, of {good.sum()} poses held out  {x.get('failed', '')}",
            flush=True,
        )
    return results


def report(
    data: Path, folder: Path, only: str, effects: str, reference: bool
) -> tuple[list[dict[str, Any]], list[str]]:
    """Figures of both tables, and which derived readings are worse than they may be."""
    results, bad = [], []
    for name in TABLES:
        some = one(name, data, folder, only, effects, reference)
        best = next(x.get("held_mm", np.nan) for x in some if x["set"].endswith("positions"))
        for x in some[1:]:
            if "failed" in x or ("file" in x and not x["held_mm"] <= BETTER * best):
                bad.append(f"{x['set']}: {x.get('failed', x.get('held_mm'))}, positions {best:.3f}, {x['file']}")
        results += some
    return results, bad
