"""One table, fitted as a user would by the command line, and compared on unseen poses with the true arm and with the refit."""

from __future__ import annotations

import csv
import io
import json
import time
from pathlib import Path
from typing import Any

import numpy as np

from tests.bench.loads.judge import command
from tests.bench.shop.arms import Shop, free_postures, shop, sides
from tests.bench.shop.refit import ORDINARY, PRIOR, placed, refit, rms, tcp
from tests.bench.shop.sets import LARGE, Rows, csv_of, real_tcp, rows_of, seen_from, table
from tests.independent import library_effects as K
from tests.independent.hidden_effects import Kind

UNSEEN = 40
FRAMES = "instrument_frame,tool_frame"
BASE = f"{FRAMES},joint_offset,joint_compliance"
GEOMETRY = f"{BASE},link_geometry"
CHANGE, NEAR, INSIDE = 0.10, 1.4, (0.88, 1.0)
"""Error of the change under load over its size, error of the TCP over that of the refit, share of intervals that hold."""
HIDDEN: dict[str, tuple[tuple[Kind, ...], str]] = {
    "transmission_error": ((K.transmission_error,), GEOMETRY),
    "backlash": ((K.backlash,), GEOMETRY),
    "joint_compliance": ((), f"{FRAMES},joint_offset,link_geometry"),
}
"""What a model lacks: what is hidden in the arm, and the effects that are fitted. A soft joint is a spring that is not."""


def unseen_rows(s: Shop, seed: int) -> Rows:
    """Unseen poses, each under the light load, then under the full one."""
    g = np.random.default_rng([43, 99, seed])
    q, side = free_postures(g, s, UNSEEN), sides(g, UNSEEN)
    load = np.tile([s.light, s.full], UNSEEN)
    states = s.states(np.repeat(q, 2, axis=0), load, np.repeat(side, 2, axis=0))
    return rows_of(states, "asked", [f"U{i // 2 + 1}" for i in range(2 * UNSEEN)], np.nan, {})


def asked_gauges(r: Rows) -> Rows:
    """The same rows as three gauges at every pose that nobody has read, along the axes of the base."""
    n, every = len(r), np.tile(np.arange(len(r)), 3)
    way = np.repeat(np.eye(3), n, axis=0)
    names = [f"{r.name[i]}{c}" for c in "xyz" for i in range(n)]
    label = np.array([f"{r.label[i]}{c}" for c in "xyz" for i in range(n)], object)
    return rows_of(r.states.take(every), "gauge", names, np.nan, {}, normal=way, label=label)


def numbers(text: str, *names: str) -> np.ndarray:
    """(n, k) columns of a table that `predict` wrote, NaN where empty."""
    lines = list(csv.DictReader(io.StringIO(text)))
    return np.array([[float(x[name] or "nan") if name in x else np.nan for name in names] for x in lines])


class Desk:
    """A folder with the files of one set, and the commands of a user in it."""

    def __init__(self, folder: Path, s: Shop, rows: Rows, effects: str, sigma: bool = True) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self.folder, self.table, self.model = folder, folder / "rows.csv", folder / "model.toml"
        self.tool, self.robot, self.effects = ",".join(f"{1e3 * x:g}" for x in s.tool), s.robot, effects
        self.table.write_text(csv_of(rows, sigma))
        self.columns: tuple[str | Path, ...] = ()
        if rows.offset_free:
            (folder / "columns.toml").write_text('anchor_offset = "free"\n')
            self.columns = ("--columns", folder / "columns.toml")

    def fit(self) -> dict[str, Any]:
        """The document of the fit, whose model is written."""
        words = ("--robot", self.robot, "--tool", self.tool, "--effects", self.effects, *self.columns)
        return dict(json.loads(command("fit", self.table, *words, "-o", self.model, "--json")))

    def predict(self, name: str, text: str, *names: str) -> np.ndarray:
        """Columns of what the model predicts for a table."""
        asked, out = self.folder / f"{name}.csv", self.folder / f"{name}_predicted.csv"
        asked.write_text(text)
        command("predict", self.model, asked, "-o", out)
        return numbers(out.read_text(), *names)

    def diagnose(self) -> dict[str, Any]:
        """The document of the diagnosis; it ends with 1 where something is missing."""
        out = self.folder / "diagnosis.json"
        text = command("diagnose", self.model, self.table, *self.columns, "--json", accept=(0, 1))
        out.write_text(text)
        return dict(json.loads(text))


def judge(
    kind: str, robot: str, seed: int, folder: Path, effects: str = GEOMETRY, sigma: bool = True
) -> dict[str, Any]:
    """All figures of one set; lengths [mm] are root mean squares over the unseen poses, light and full load.

    `pose`: error of the TCP after the best rigid placement, as no such table tells where the base stands. `change`: error
    of the change from the light to the full load, over its size. `inside`: share of 95 % intervals that hold, of places in
    the frame of the base, or of the tracker, and of changes. `best`: of the refit that knows the law by which arms are drawn;
    `usual`: of one with ordinary sizes of links; `nominal`: of the stated arm.
    """
    begin = time.process_time()
    s = shop(robot, seed)
    rows, asked = table(kind, s, seed), unseen_rows(s, seed)
    true, nominal = real_tcp(s, asked.states), tcp(s.nominal, asked.states)
    best, usual = (tcp(refit(s, rows, before).cell, asked.states) for before in (PRIOR, ORDINARY))

    def change(p: np.ndarray) -> np.ndarray:
        return p[1::2] - p[::2]

    size = rms(change(true))
    found: dict[str, Any] = {
        "set": f"{kind} {robot} #{seed}",
        "kind": kind,
        "robot": robot,
        "seed": seed,
        "rows": len(rows),
    }
    for name, p in (("best", best), ("usual", usual), ("nominal", nominal)):
        found[name] = {"pose": rms(placed(p, true) - true), "change": rms(change(p) - change(true)) / size}
    desk = Desk(folder / found["set"].replace(" ", "_").replace("#", ""), s, rows, effects, sigma)
    try:
        document = desk.fit()
        found["remaining"] = document.get("expected_remaining_fraction")
        p = desk.predict("asked", csv_of(asked, False), "x_mm", "y_mm", "z_mm", "sigma_mm")
        off = 1e-3 * p[:, :3] - (seen_from(rows.truth["T"], true) if "T" in rows.truth else true)
        own = {
            "pose": rms(placed(1e-3 * p[:, :3], true) - true),
            "change": rms(change(1e-3 * p[:, :3]) - change(true)) / size,
        }
        own["inside"] = float((np.abs(off) <= 1.96e-3 * p[:, 3:]).mean())
        own["stated"] = float(np.sqrt((3 * p[:, 3] ** 2).mean()))
        found["own"] = own
        d = desk.predict("gauges", csv_of(asked_gauges(asked), False), "predicted_mm", "sigma_mm").reshape(
            3, UNSEEN, 2, 2
        )
        moved, sigma_mm = (d[:, :, 1, 0] - d[:, :, 0, 0]).T, d[:, :, 1, 1].T
        own["gauge_change"] = rms(1e-3 * moved - change(true)) / size
        own["change_inside"] = float((np.abs(moved - 1e3 * change(true)) <= 1.96 * sigma_mm).mean())
    except Exception as failure:  # a failure is a figure of the set
        found["failed"] = f"{type(failure).__name__}: {failure}"[:300]
    return found | {"folder": str(desk.folder), "cpu_s": time.process_time() - begin}


def faults(x: dict[str, Any]) -> list[str]:
    """What of one set is not as it must be."""
    if "failed" in x:
        return [f"{x['set']}: {x['failed']}"]
    own, best, usual = x["own"], x["best"], x["usual"]
    some = []
    if "gauge" in x["kind"]:
        for name in ("change", "gauge_change"):
            if not own.get(name, 0) <= CHANGE:
                some.append(f"{x['set']}: {name} is off by {own[name]:.1%}, refit {best['change']:.1%}")
    if x["kind"] not in ("gauge", "gauge 0.001") and not own["pose"] <= NEAR * max(best["pose"], usual["pose"]):
        some.append(
            f"{x['set']}: TCP off by {own['pose']:.3f} mm, refit {best['pose']:.3f}, {usual['pose']:.3f}, stated arm {x['nominal']['pose']:.3f}"
        )
    return some


def diagnosed(kind: str, hidden: str, robot: str, seed: int, folder: Path) -> dict[str, Any]:
    """The answer of `diagnose` on a table: clean where nothing is hidden, else a large one."""
    begin = time.process_time()
    kinds, effects = HIDDEN.get(hidden, ((), GEOMETRY))
    s = shop(robot, 1000 + seed, kinds)
    rows = LARGE[kind](np.random.default_rng([43, 50, seed]), s) if hidden else table(kind, s, 1000 + seed)
    name = f"{hidden or 'clean'} {kind} {robot} #{seed}"
    notes = [h.note for h in s.cell.hidden if h.kind != "link_geometry"]
    found: dict[str, Any] = {"set": name, "hidden": hidden, "rows": len(rows), "notes": notes}
    accept = {hidden, *(a for h in s.cell.hidden if h.kind == hidden for a in h.accept)}
    desk = Desk(folder / name.replace(" ", "_").replace("#", ""), s, rows, effects)
    try:
        desk.fit()
        d = desk.diagnose()
        found |= {"verdict": d["verdict"], "named": [m["effect"] for m in d["missing"]]}
        found["right"] = bool(accept & set(found["named"])) if hidden else not found["named"]
    except Exception as failure:  # a failure is a figure of the set
        found |= {"failed": f"{type(failure).__name__}: {failure}"[:300], "right": False}
    return found | {"folder": str(desk.folder), "cpu_s": time.process_time() - begin}
