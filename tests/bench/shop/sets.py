"""Tables of what a shop can read of an arm: a spike, plates, a ball bar, a dial gauge under a weight, a tracker."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields

import numpy as np

from tests.bench.shop.arms import Shop, free_postures, sides, touching
from tests.independent import arm as A
from tests.independent.cells import DEG, States, settle

GAUGE, TOUCH, BAR, ARTEFACT, TRACKER = 0.01e-3, 0.05e-3, 0.02e-3, 0.03e-3, 0.03e-3
"""Standard deviations of one reading, or of a touch per axis [m]."""
LENGTH = 0.5
"""Distance of the two balls of the artefact [m]; a third of the reach where that is less."""
DOWN = np.array([0.0, 0.0, -1.0])


@dataclass(frozen=True)
class Rows:
    """n rows of a table.

    Args:
        states: commanded joints, sides and loads. kind: (n,) of the observation. name: (n,) of the set-up, or the
            `pose_id` of the other row. reading: (n,) [m] NaN for none. normal: (n, 3). place: (n, 3) [m]. sigma: (n,) [m].
        label: (n,) of the poses. truth: unknowns of the set-ups by name (point, plane, zero, frame).
        offset_free: whether distances have an unknown zero.
    """

    states: States
    kind: np.ndarray
    name: np.ndarray
    reading: np.ndarray
    normal: np.ndarray
    place: np.ndarray
    sigma: np.ndarray
    label: np.ndarray
    truth: dict[str, np.ndarray]
    offset_free: bool = False

    def __len__(self) -> int:
        return len(self.kind)


def rows_of(
    s: States, kind: str, name: Sequence[str], sigma: float, truth: dict[str, np.ndarray], **more: np.ndarray
) -> Rows:
    """Rows of one kind; what the kind does not have is NaN."""
    n = len(s)
    empty = {"reading": np.full(n, np.nan), "normal": np.full((n, 3), np.nan), "place": np.full((n, 3), np.nan)}
    label = np.array([f"{kind[0].upper()}{i + 1:03d}" for i in range(n)], object)
    given = empty | {"label": label} | more
    return Rows(s, np.full(n, kind, object), np.array(name, object), sigma=np.full(n, sigma), truth=truth, **given)


def joined(parts: Sequence[Rows]) -> Rows:
    """Several kinds in one table."""

    def every(name: str) -> np.ndarray:
        return np.concatenate([getattr(p, name) for p in parts])

    known = ("q", "approach", "temperature", "time", "mass", "center")
    states = States(**{k: np.concatenate([getattr(p.states, k) for p in parts]) for k in known})
    arrays = {k: every(k) for k in ("kind", "name", "reading", "normal", "place", "sigma", "label")}
    truth = {k: v for p in parts for k, v in p.truth.items()}
    return Rows(states, truth=truth, offset_free=any(p.offset_free for p in parts), **arrays)


def real_tcp(s: Shop, states: States) -> np.ndarray:
    """(n, 3) true TCP in the base frame [m]."""
    return settle(s.cell, states).frames.tcp[:, :3, 3]


def spot(g: np.random.Generator, s: Shop, azimuth_deg: float, height: float) -> np.ndarray:
    """(3,) a place before the arm, about half the reach away [m]."""
    a, r = np.radians(azimuth_deg + g.uniform(-10, 10)), s.reach * g.uniform(0.5, 0.6)
    return np.array([r * np.cos(a), r * np.sin(a), s.reach * (height + g.uniform(-0.05, 0.05))])


def gauges(g: np.random.Generator, s: Shop, count: int = 12, resolution: float = 1e-5) -> Rows:
    """Set-ups of a dial gauge: one reading without and one with a load of half to all that the arm may carry."""
    q = np.repeat(free_postures(g, s, count), 2, axis=0)
    load = np.ravel(np.column_stack([np.zeros(count), np.round(s.full * g.uniform(0.5, 1, count), 1)]))
    states = s.states(q, load, np.repeat(sides(g, count), 2, axis=0))
    # Mostly from below, where a weight moves the arm; sideways in every third set-up.
    way = np.tile(DOWN, (count, 1))
    way[::3] = np.eye(3)[g.integers(2, size=len(way[::3]))] * g.choice([-1, 1], len(way[::3]))[:, None]
    normal, zero = np.repeat(way, 2, axis=0), np.repeat(g.uniform(-1e-3, 1e-3, count), 2)
    along = (normal * real_tcp(s, states)).sum(axis=1)
    zero += np.repeat(along[::2], 2)
    read = np.round((along - zero + g.normal(0, GAUGE, 2 * count)) / resolution) * resolution
    names = [f"D{i // 2 + 1}" for i in range(2 * count)]
    return rows_of(
        states, "gauge", names, GAUGE, dict(zip(names, zero[:, None], strict=True)), normal=normal, reading=read
    )


def loads(s: Shop, n: int, several: bool) -> np.ndarray:
    """(n,) the light load, or that and the full one in turn [kg]."""
    return np.where(several & (np.arange(n) % 2 == 1), s.full, s.light)


def tips(g: np.random.Generator, s: Shop, count: int = 1, each: int = 30, several: bool = False) -> Rows:
    """Spikes, each touched in so many postures, from above."""
    where = [(0, 0.25), (55, 0.4), (-55, 0.2), (25, 0.5)][:count]
    points = {f"S{i + 1}": spot(g, s, azimuth, height) for i, (azimuth, height) in enumerate(where)}
    names = [name for name in points for _ in range(each)]
    at = np.array([points[name] for name in names]) + g.normal(0, TOUCH, (len(names), 3))
    states = touching(g, s, at, DOWN, sides(g, len(names)), loads(s, len(names), several))
    return rows_of(states, "tip", names, TOUCH, dict(points))


def planes(g: np.random.Generator, s: Shop, each: int = 20) -> Rows:
    """A table and two faces of a cube at its edge, each touched in so many postures."""
    parts = []
    size = 0.14 * s.reach
    for name, n, azimuth in (("top", [0.0, 0, 1], 0.0), ("front", [-1.0, 0, 0], 15.0), ("side", [0.0, 1, 0], -25.0)):
        normal = np.array(n) + g.normal(0, 5e-3, 3)
        normal /= np.linalg.norm(normal)
        middle, side = spot(g, s, azimuth, 0.3), sides(g, each)
        across = g.uniform(-size, size, (each, 3))
        across -= (across @ normal)[:, None] * normal
        at = middle + across + g.normal(0, TOUCH, each)[:, None] * normal
        truth = {name: np.append(normal, normal @ middle)}
        parts.append(rows_of(touching(g, s, at, -normal, side), "plane", [name] * each, TOUCH, truth))
        parts[-1].label[:] = [f"{name}{i + 1}" for i in range(each)]
    return joined(parts)


def distances(
    g: np.random.Generator, s: Shop, count: int = 60, offset_free: bool = False, several: bool = False
) -> Rows:
    """Distances from two fixed points, by a bar or a wire, at random postures within its length."""
    points = {"A1": spot(g, s, -35, 0.05), "A2": spot(g, s, 45, 0.1)}
    q = free_postures(g, s, 20 * count)
    states = s.states(q, loads(s, len(q), several)[g.permutation(len(q))], sides(g, len(q)))
    p = real_tcp(s, states)
    name = np.array(list(points), object)[np.arange(len(q)) % 2]
    far = np.linalg.norm(p - np.array([points[x] for x in name]), axis=1)
    keep = np.flatnonzero((far > 0.15 * s.reach) & (far < 0.6 * s.reach))[:count]
    zero = 3e-3 if offset_free else 0.0
    read = far[keep] - zero + g.normal(0, BAR, len(keep))
    truth = {k: np.append(c, zero) for k, c in points.items()}
    found = rows_of(states.take(keep), "distance", list(name[keep]), BAR, truth, reading=np.round(read, 6))
    return Rows(**{f.name: getattr(found, f.name) for f in fields(Rows)} | {"offset_free": offset_free})


def artefacts(g: np.random.Generator, s: Shop, places: int = 25) -> Rows:
    """Two balls of known distance, laid down in several places; each pair of postures touches both."""
    length = min(LENGTH, round(s.reach / 3, 2))
    parts = []
    for i in range(places):
        middle, way = spot(g, s, g.uniform(-50, 50), g.uniform(0.2, 0.45)), g.normal(size=3)
        way /= np.linalg.norm(way)
        ends = middle + np.array([[-0.5], [0.5]]) * length * way
        ends[1] += g.normal(0, ARTEFACT) * way
        states = touching(g, s, ends, DOWN, sides(g, 2))
        label = np.array([f"B{i + 1}a", f"B{i + 1}b"], object)
        read = np.array([np.nan, length])
        parts.append(rows_of(states, "between", ["", label[0]], ARTEFACT, {}, reading=read, label=label))
    return joined(parts)


def positions(g: np.random.Generator, s: Shop, count: int = 40) -> Rows:
    """Positions by a tracker that stands somewhere."""
    states = s.states(free_postures(g, s, count), s.light, sides(g, count))
    frame = np.concatenate([g.normal(0, 2e-3, 3), g.normal(0, 1e-3, 3)])
    seen = seen_from(frame, real_tcp(s, states)) + g.normal(0, TRACKER, (count, 3))
    return rows_of(states, "position", ["T"] * count, TRACKER, {"T": frame}, place=seen)


def seen_from(frame: np.ndarray, p: np.ndarray) -> np.ndarray:
    """(n, 3) points in a frame that stands in the base by shift and rotation vector (6,)."""
    t = A.small(frame)
    return np.asarray((p - t[:3, 3]) @ t[:3, :3])


Maker = Callable[[np.random.Generator, Shop], Rows]
KINDS: dict[str, Maker] = {
    "gauge": gauges,
    "gauge 0.001": lambda g, s: gauges(g, s, resolution=1e-6),
    "tip": tips,
    "two tips": lambda g, s: tips(g, s, 2, 15),
    "plane": planes,
    "distance": distances,
    "distance+b": lambda g, s: distances(g, s, offset_free=True),
    "between": artefacts,
    "position": positions,
}
MIXTURES = ("gauge+tip", "tip+plane+distance", "position+gauge")
LARGE: dict[str, Maker] = {
    "tip": lambda g, s: tips(g, s, 4, 40, True),
    "distance": lambda g, s: distances(g, s, 160, several=True),
    "tip+distance": lambda g, s: joined([tips(g, s, 3, 30, True), distances(g, s, 90, several=True)]),
}
"""Tables in which a hidden effect must be found: half of the rows under the full load."""


def table(kind: str, s: Shop, seed: int) -> Rows:
    """The rows of a kind or a mixture; the parts of a mixture are the tables of their kinds."""
    parts = [kind] if kind in KINDS else kind.split("+")
    return joined([KINDS[p](np.random.default_rng([43, list(KINDS).index(p), seed]), s) for p in parts])


COLUMNS = {"tip": "tip", "plane": "plane", "gauge": "gauge", "distance": "anchor", "between": "from"}
"""Column with the name of the set-up, by kind."""


def csv_of(r: Rows, sigma: bool = True, bare: bool = False) -> str:
    """The table as a file.

    Args:
        sigma: whether it states the standard deviation of its readings. bare: joints and readings alone.
    """
    s, kinds = r.states, set(r.kind)
    far = np.isin(r.kind, ["distance", "between"])
    columns: dict[str, list[str]] = {"pose_id": [str(x) for x in r.label]}
    columns |= {f"q{j + 1}_deg": [f"{x:.4f}" for x in s.q[:, j] / DEG] for j in range(6)}
    if not bare:
        columns |= {f"dir{j + 1}": [f"{x:+.0f}" for x in s.approach[:, j]] for j in range(6)}
        columns["payload_kg"] = [f"{x:g}" for x in s.mass]
        columns |= {f"payload_{c}_mm": numbers(1e3 * s.center[:, k]) for k, c in enumerate("xyz")}
    if "position" in kinds:
        columns |= {f"{c}_mm": numbers(1e3 * r.place[:, k]) for k, c in enumerate("xyz")}
    for kind in COLUMNS.keys() & kinds:
        columns[COLUMNS[kind]] = [str(x) if k == kind else "" for x, k in zip(r.name, r.kind, strict=True)]
    if far.any():
        columns["distance_mm"] = numbers(1e3 * np.where(far, r.reading, np.nan))
    if "gauge" in kinds:
        columns["reading_mm"] = numbers(1e3 * np.where(r.kind == "gauge", r.reading, np.nan))
        columns |= {f"n{c}": numbers(r.normal[:, k]) for k, c in enumerate("xyz")}
    if sigma and not bare:
        columns["sigma_mm"] = numbers(1e3 * np.where((r.kind == "between") & (r.name == ""), np.nan, r.sigma))
    return "\n".join([",".join(columns), *(",".join(row) for row in zip(*columns.values(), strict=True))]) + "\n"


def numbers(values: np.ndarray) -> list[str]:
    """Four decimals, empty for none."""
    return ["" if np.isnan(x) else f"{x + 0.0:.4f}".rstrip("0").rstrip(".") for x in values]
