"""Figures of one run: values, limits and peers; printed as a table, saved, and compared with a saved run."""

from __future__ import annotations

import json
import statistics
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

MARGIN = 0.03  # what a figure may vary by however often it was measured
CALIBRATION = "a fixed loop of Python and numpy"
COLUMNS = (
    "figure",
    "min",
    "median",
    "max",
    "unit",
    "limit",
    "share of the limit",
    "peer",
    "times better than the peer",
)


@dataclass(frozen=True)
class Figure:
    """One figure of a run.

    Args:
        name: what was measured; values: of each repetition.
        limit: the largest median that is allowed, the smallest where ``more`` is better.
        peer: what somebody would use in its place, and its values in the same run.
    """

    name: str
    unit: str
    values: tuple[float, ...]
    limit: float | None = None
    more: bool = False
    peer: str = ""
    peer_values: tuple[float, ...] = ()

    @property
    def median(self) -> float:
        return statistics.median(self.values)

    @property
    def share(self) -> float | None:
        """Of the limit, at most 1 where it is kept."""
        if self.limit is None:
            return None
        return self.limit / self.median if self.more else self.median / self.limit

    @property
    def advantage(self) -> float | None:
        """How many times better the median is than that of the peer."""
        if not self.peer_values:
            return None
        peer = statistics.median(self.peer_values)
        return self.median / peer if self.more else peer / self.median

    def cells(self) -> list[str]:
        shown = [number(min(self.values)), number(self.median), number(max(self.values))]
        limit = "" if self.limit is None else f"{'at least' if self.more else 'at most'} {number(self.limit)}"
        peer = f"{self.peer}: {number(statistics.median(self.peer_values))}" if self.peer_values else ""
        return [self.name, *shown, self.unit, limit, number(self.share), peer, number(self.advantage)]


@dataclass(frozen=True)
class Run:
    """All figures of one run.

    Args:
        machine: what it ran on, in words.
    """

    figures: tuple[Figure, ...]
    machine: Mapping[str, str]

    def figure(self, name: str) -> Figure | None:
        return next((f for f in self.figures if f.name == name), None)


def number(value: float | None) -> str:
    """Three significant digits, thousands with commas."""
    if value is None:
        return ""
    return f"{value:,.0f}" if abs(value) >= 1000 else f"{value:.3g}"


def markdown(run: Run) -> str:
    """The page of the documentation."""
    rows = [COLUMNS, tuple("---" for _ in COLUMNS), *(f.cells() for f in run.figures)]
    table = "\n".join("| " + " | ".join(row) + " |" for row in rows)
    told = "\n".join(f"| {key} | {value} |" for key, value in run.machine.items())
    return f"""# Speed and memory

Written by `make bench`: every figure from one run, with the smallest, the median and the largest of its repetitions.
Seconds are of the processor, on one core, after imports where nothing else is said.

| machine | |
|---|---|
{told}

{table}

The figure "growth" is the exponent of CPU time over 200, 2,000 and 20,000 targets: 1 is linear. A peer solves the same in
the same run: the pose loop takes closed-form inverse kinematics once and one pinocchio pass for each pose, the fit
`scipy.optimize.least_squares` with finite differences on the same residual, from a start that knows the instrument's place.

`make bench AGAINST=saved.json` compares with a saved run (`--json FILE` saves one). Times are scaled by the fixed loop, which
each run measures too; slower is what stands beyond all repetitions of the saved run with 3 % more.
"""


def save(run: Run, path: Path) -> None:
    document = {"machine": dict(run.machine), "figures": [asdict(f) for f in run.figures]}
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(document, indent=1) + "\n", "utf-8")


def load(path: Path) -> Run:
    document: dict[str, Any] = json.loads(path.read_text("utf-8"))
    lists = ("values", "peer_values")
    figures = [Figure(**{k: tuple(v) if k in lists else v for k, v in f.items()}) for f in document["figures"]]
    return Run(tuple(figures), document["machine"])


def compared(now: Run, before: Run) -> tuple[list[str], list[str]]:
    """What became slower or larger by more than the noise of both runs, and what became better."""
    worse, better = list[str](), list[str]()
    old, new = before.figure(CALIBRATION), now.figure(CALIBRATION)
    speed = new.median / old.median if old is not None and new is not None else 1.0
    for figure in now.figures:
        was = before.figure(figure.name)
        if was is None or figure.name == CALIBRATION:
            continue
        scale = {"s": speed, "ms": speed}.get(figure.unit, 1 / speed if figure.unit.endswith("/s") else 1.0)
        low, high = scale * min(was.values) * (1 - MARGIN), scale * max(was.values) * (1 + MARGIN)
        text = f"{figure.name}: {number(scale * was.median)} -> {number(figure.median)} {figure.unit}"
        if min(figure.values) > high:
            (better if figure.more else worse).append(text)
        elif max(figure.values) < low:
            (worse if figure.more else better).append(text)
    return worse, better


def growth(sizes: Sequence[int], times: Sequence[float]) -> float:
    """Exponent of a power law through the first and the last size."""
    import math

    return math.log(times[-1] / times[0]) / math.log(sizes[-1] / sizes[0])
