"""Measured tables of known truth, by kind: drawn from the independent arm, or real."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from scipy.spatial.transform import Rotation

from postproc.diagnostics import PostprocError, Source
from postproc.measure.measurements import Measurements
from postproc.measure.read.table import read_measurements
from postproc.measure.read.terms import Reading
from postproc.model.arm import Model
from postproc.model.file import parse_model
from postproc.robot.catalogue import load_robot
from postproc.robot.cells.station import Station
from tests.bench.diagnosis.bad_rows import SHARES, SORTS, spoil
from tests.independent import arm as A
from tests.independent import external_axes as X
from tests.independent import library_effects as K
from tests.independent import unknown_effects as U
from tests.independent.cells import DEG, Hidden, States, column, draw_cell, draw_states, seen_by_instrument, settle
from tests.independent.hidden_effects import LIBRARY, OTHER_ARM, OUTSIDE, PAIRS, Kind, write_table
from tests.independent.two_joints import TWO_JOINTS

NOISES = (0.01, 0.02, 0.03, 0.03, 0.045, 0.06)
"""Standard deviations of the instrument per axis [mm]."""
TURN, ENCODER = 5e-5, 5e-6
"""Standard deviations of measured orientations and of joint encoders [rad]."""
MAIN = "irb4600_60_205"


@dataclass(frozen=True)
class Truth:
    """What is hidden in a set.

    Args:
        accept: for every hidden effect of the library its key, then others that are right as well.
        outside: whether a law is hidden that the library does not have; channels: what it follows; tolerated: keys that
            describe it well enough.
    """

    accept: tuple[tuple[str, ...], ...] = ()
    outside: bool = False
    channels: frozenset[str] = frozenset()
    tolerated: frozenset[str] = frozenset()

    @classmethod
    def of(cls, hidden: tuple[Hidden, ...]) -> Truth:
        odd = [h for h in hidden if h.answer == "unknown"]
        return cls(
            tuple((h.answer, *h.accept) for h in hidden if h.answer != "unknown"),
            bool(odd),
            frozenset(c for h in odd for c in h.channels),
            frozenset(a for h in odd for a in h.accept),
        )


@dataclass(frozen=True)
class Set:
    """One measured table with what is true of it.

    Args:
        kind, name: ``library``, ``backlash x2``; robot: of the catalogue; data: measured rows; true: other poses with
            their true places, or rows held out; noise: standard deviation per axis [m], or [rad] of encoders.
        base: keys of the effects that are fitted before anything is asked; station: its cell, where it has one.
        whole: a real table, measured rows and those held out. wrong: rows of the table, as people count them, that were
            spoilt. asked: masks of the rows of ``true`` that are judged apart, by name.
    """

    kind: str
    name: str
    robot: str
    data: Measurements
    true: Measurements
    truth: Truth | None
    noise: float | None
    base: tuple[str, ...] = ("instrument_frame", "tool_frame", "joint_offset", "joint_compliance")
    station: Station | None = None
    whole: Measurements | None = None
    wrong: frozenset[int] = frozenset()
    asked: Mapping[str, np.ndarray] = field(default_factory=dict)

    @property
    def start(self) -> Model:
        """The nominal arm in its cell."""
        return Model(load_robot(self.robot), robot_name=self.robot, station=self.station)


@dataclass(frozen=True)
class Recipe:
    """How a set is drawn. Args: as in `Set`; size: factor on every hidden effect; measured: what the instrument tells;
    unseen: what is changed, to a level that no measured row has, at the poses with true places; later: repeats are of
    other times; spoilt: sort and share of rows that cannot be right."""

    kinds: tuple[Kind, ...] = ()
    robot: str = MAIN
    size: float = 1.0
    poses: int | None = None
    moving: bool = False
    measured: str = "positions"
    unseen: str = ""
    later: bool = False
    spoilt: tuple[str, float] | None = None
    name: str = field(default="")

    @property
    def label(self) -> str:
        words = "+".join(k.__name__ for k in self.kinds) or "nothing"
        robot = "" if self.robot == MAIN else f" on {self.robot}"
        words += f", {self.spoilt[1]:.0%} {self.spoilt[0]}" if self.spoilt else ""
        words += ", repeated later" if self.later else ""
        return self.name or f"{words}{robot}" + (f" x{self.size:g}" if self.size != 1.0 else "")


class Refused(Exception):
    """A table with rows that cannot be right was not read. Args: what was said, and the rows."""

    def __init__(self, said: str, wrong: frozenset[int]) -> None:
        super().__init__(said)
        self.wrong = wrong


def resized(h: Hidden, by: float) -> Hidden:
    """The same effect, so many times as large."""

    def force(s: States, f: A.Frames) -> A.Wrenches:
        assert h.force is not None
        w = h.force(s, f)
        return A.Wrenches([(b, p, by * F, by * M) for b, p, F, M in w.parts], by * np.asarray(w.joint))

    def times(law: Callable[..., np.ndarray] | None) -> Callable[..., np.ndarray] | None:
        return None if law is None else lambda *states: by * law(*states)

    forced = None if h.force is None else force
    return replace(h, joint=times(h.joint), body=times(h.body), world=times(h.world), force=forced)


def drawn(kind: str, index: int, recipe: Recipe, seed: int) -> Set:
    """The set of a recipe and a seed."""
    g = np.random.default_rng(seed)
    arm = A.ARMS[recipe.robot]()
    hidden = tuple(resized(k(g, arm), recipe.size) for k in recipe.kinds)
    noise = float(g.choice(NOISES))
    n = recipe.poses or int(g.choice([90, 120, 150, 150]))
    moving = recipe.moving or any(h.needs == "moving" for h in hidden) or (not hidden and g.random() < 0.15)
    session = any(h.needs == "session" for h in hidden) or (not hidden and g.random() < 0.15)
    cell = draw_cell(g, arm, hidden)
    if recipe.unseen:
        every = draw_states(g, 8 * (n + 150), arm, moving, session)
        new = CHANGED[recipe.unseen](every)
        s, t = every.take(np.sort(g.permutation(np.flatnonzero(~new))[:n])), every.take(np.flatnonzero(new)[:150])
    else:
        s, t = (draw_states(g, count, arm, moving, session) for count in (n, 150))
    again = np.concatenate([np.arange(n), *[np.arange(0, n, max(n // 12, 1))] * 2])
    if recipe.later:
        # Every row is a state of its own: the repeats come at times of their own, warmer and cooler.
        s, again = s.take(again), np.arange(len(again))
        time, warm = g.permutation(s.time[n:]), s.temperature[n:]
        s = replace(s, time=np.append(s.time[:n], time), temperature=np.append(s.temperature[:n], warm + g.normal(0, 2, len(warm))))  # fmt: skip
    label = np.concatenate([np.arange(n), *[np.arange(0, n, max(n // 12, 1))] * 2])
    tables, wrong = [], frozenset[int]()
    for states, rows, spread in ((s, again, 1e-3 * noise), (t, np.arange(150), 0.0)):
        e = settle(cell, states)
        seen = seen_by_instrument(cell, states, e)[rows] + g.normal(0, spread, (len(rows), 3))
        if recipe.spoilt and spread:
            seen, some = spoil(g, *recipe.spoilt, seen)
            wrong = frozenset((np.flatnonzero(some) + 1).tolist())
        ids = [f"P{i:03d}" for i in (label if spread else rows)]
        try:
            table = read_rows(recipe.robot, states.take(rows), seen, ids, 4 if spread else 6)
        except PostprocError as error:
            if not wrong:
                raise
            raise Refused("; ".join(d.message for d in error.diagnostics), wrong) from error
        if recipe.measured == "orientations":
            turn = Rotation.from_rotvec(g.normal(0, TURN if spread else 0.0, (len(rows), 3))).as_matrix()
            table = replace(table, rotation=cell.instrument[:3, :3] @ e.frames.tcp[rows, :3, :3] @ turn)
        if recipe.measured == "encoders":
            joint = (states.q + e.dq)[rows] + g.normal(0, ENCODER if spread else 0.0, (len(rows), 6))
            table = replace(table, position=np.full_like(seen, np.nan), joint=joint)
        tables.append(table)
    encoders = recipe.measured == "encoders"
    base = ("joint_offset", "joint_compliance") if encoders else Set.base
    name = f"{recipe.label} #{index}"
    level = ENCODER if encoders else 1e-3 * noise
    return Set(kind, name, recipe.robot, *tables, Truth.of(hidden), level, base, wrong=wrong)


CHANGED: dict[str, Callable[[States], np.ndarray]] = {
    "payload": lambda s: s.mass == s.mass.max(),
    "side": lambda s: s.approach[:, 1] != s.approach[:, 2],
    "temperature": lambda s: s.temperature > 34.0,
    "region": lambda s: s.q[:, 0] > np.radians(40.0),
}
"""Rows of levels that a table does not have: the heaviest payload of three; joints 2 and 3 approached from different
sides; the last degrees of a warm-up; a sector of joint 1."""


def read_rows(robot: str, s: States, places: np.ndarray, ids: list[str], digits: int) -> Measurements:
    """Rows as a user's table holds them."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "rows.csv"
        write_table(path, s, places, ids, digits)
        return read_measurements(Source(path.name, path.read_bytes()), load_robot(robot))


def encoder_lag(g: np.random.Generator, arm: A.Arm) -> Hidden:
    lag = g.uniform(1e-3, 4e-3)
    return Hidden("lag", "servo_lag", joint=lambda s, tau: -lag * (0 if s.v is None else s.v), needs="moving")


def encoder_wave(g: np.random.Generator, arm: A.Arm) -> Hidden:
    j, n, size = int(g.integers(6)), int(g.choice([2, 3, 5, 8, 12])), g.uniform(3e-5, 2e-4)
    alike = ("joint_error_map",) if n <= 3 else ()
    return Hidden(
        "wave", "transmission_error", joint=lambda s, tau: column(j, size * np.sin(n * s.q[:, j])), accept=alike
    )


def encoder_play(g: np.random.Generator, arm: A.Arm) -> Hidden:
    gap = g.uniform(0.002, 0.01, 6) * DEG * (g.random(6) < 0.6)
    return Hidden("play", "backlash", joint=lambda s, tau: -gap * s.approach)


def _cycle(recipes: list[Recipe]) -> Callable[[int], Recipe]:
    return lambda i: recipes[i % len(recipes)]


def _several(count: int, poses: int, pools: tuple[list[Kind], ...]) -> Callable[[int], Recipe]:
    """Effects of different keys, drawn by the number of the set."""

    def recipe(i: int) -> Recipe:
        g, arm, kinds, keys = np.random.default_rng(77_000 + i), A.ARMS[MAIN](), list[Kind](), set[str]()
        while len(kinds) < count:
            pool = pools[len(kinds) % len(pools)]
            kind = pool[int(g.integers(len(pool)))]
            key = kind(np.random.default_rng(0), arm)
            words = {key.answer if key.answer != "unknown" else kind.__name__}
            if not words & keys:
                kinds.append(kind)
                keys |= words
        return Recipe(tuple(kinds), poses=poses)

    return recipe


CARRIED: dict[str, list[Kind]] = {
    "payload": [K.arm_load, K.payload_error, K.backlash, K.base_compliance, K.link_compliance, K.bearing_tilt, K.gravity_compensator, K.dress_pack],
    "side": [K.backlash, K.arm_load, K.transmission_error, K.thermal_growth],
    "temperature": [K.thermal_growth, K.backlash, K.thermal_joint_drift, K.frame_drift],
    "region": [K.backlash, K.arm_load, K.transmission_error, K.wrist_coupling, K.gravity_compensator, K.base_compliance, K.link_geometry, K.thermal_growth],
}  # fmt: skip
"""Effects that are asked at levels which the table does not have."""
MOVING = [K.servo_lag, K.backlash, K.transmission_error, K.arm_load, K.joint_error_map, K.dress_pack]
TURNING = [K.backlash, K.joint_error_map, K.link_geometry, K.thermal_joint_drift, K.bearing_tilt, K.transmission_error]
KINDS: dict[str, tuple[int, Callable[[int], Recipe]]] = {
    "library": (57, _cycle([Recipe((k,), size=x) for x in (1.0, 0.5, 2.0) for k in LIBRARY])),
    "pairs": (36, _cycle([Recipe(p) for p in PAIRS])),
    "four": (40, _several(4, 220, (LIBRARY,))),
    "beside": (30, _several(2, 150, (LIBRARY, OUTSIDE))),
    "outside": (36, _cycle([Recipe((k,)) for k in [*OUTSIDE, U.encoder]])),
    "clean": (30, _cycle([Recipe(), Recipe(moving=True), Recipe(poses=60), Recipe(robot="ur10")])),
    "few": (19, _cycle([Recipe((k,), poses=22) for k in LIBRARY])),
    "moving": (14, _cycle([Recipe((k,), moving=True) for k in MOVING] + [Recipe(moving=True)])),
    "orientation": (14, _cycle([Recipe(k, measured="orientations") for k in [*((k,) for k in TURNING), ()]])),
    "encoder": (
        20,
        _cycle(
            [
                Recipe(k, moving=True, measured="encoders")
                for k in [(encoder_lag,), (encoder_play,), (encoder_wave,), ()]
            ]
        ),
    ),
    **{
        f"new {what}": (2 * len(some), _cycle([Recipe((k,), poses=150, unseen=what) for k in some]))
        for what, some in CARRIED.items()
    },
    "arms": (
        18,
        _cycle(
            [
                Recipe(k, robot=r)
                for r in ("ur10", "irb4600_40_255", "irb4600_20_250")
                for k in [*((k,) for k in OTHER_ARM), ()]
            ]
        ),
    ),
    "two joints": (
        24,
        _cycle([Recipe((k,), poses=n, later=x) for n, x in ((150, False), (260, True)) for k in TWO_JOINTS]),
    ),
    "bad rows": (
        30,
        _cycle(
            [
                Recipe(() if (i + k) % 2 else (K.backlash,), poses=150, spoilt=(sort, share))
                for k, share in enumerate(SHARES)
                for i, sort in enumerate(SORTS)
            ]
        ),
    ),
}
"""How many different sets there are of each kind before they come again with other numbers, and the recipe of each."""
LATEST = ("two joints", "bad rows")
"""Kinds whose seeds stand after those of all others, which keep theirs."""
REAL = {"ur10_iso_b": "ur10", "ur5_grid": "ur5"}
"""Real tables by name, with their arm."""


FAULTS = X.HIDDEN * 2 + X.LEANS
CELLS = {"cell": len(FAULTS), "clean cell": 2 * len(X.STATIONS)}
"""Sets of arms on tracks and gantries and beside positioners, with a fault of one external axis, and with none."""


def cell_set(kind: str, index: int) -> Set:
    """An arm in a cell; seeds are far from those of other kinds."""
    clean = [(None, name, "") for name in X.STATIONS]
    what, name, letter = FAULTS[index % len(FAULTS)] if kind == "cell" else clean[index % len(clean)]
    found = X.measured(what, name, letter, 60_000_000 + 100_000 * (kind != "cell") + index)
    text = f'robot = "{MAIN}"\n{found.station.text}'
    station = parse_model(Source("cell.toml", text.encode())).station
    tables = [
        read_measurements(Source("rows.csv", rows.encode()), load_robot(MAIN), terms=Reading(station=station))
        for rows in (found.fit_csv, found.true_csv)
    ]
    truth = Truth(((found.key,),)) if found.key else Truth()
    label = f"{found.key or 'nothing'} of {name} #{index}"
    return Set(kind, label, MAIN, *tables, truth, 1e-3 * found.noise, station=station)


def recipes(kind: str, count: int) -> Iterator[tuple[int, Recipe]]:
    """The first recipes of a kind."""
    for i in range(count):
        yield i, KINDS[kind][1](i)


def seed_of(kind: str, index: int) -> int:
    """Seeds of different kinds are far apart, and apart from those of the tests."""
    known = [kind for kind in KINDS if not kind.startswith("new ") and kind not in LATEST]
    asked = [kind for kind in KINDS if kind.startswith("new ")]
    return 40_000_000 + 100_000 * [*known, *asked, *LATEST].index(kind) + index


def real(name: str, folder: Path, block: int) -> Set:
    """A real table with a fifth of its poses held out: every fifth of 25 runs of rows, from the ``block``-th on."""
    path = next(p for p in (folder / f"{name}.csv", folder / f"{name}_thinned.csv") if p.exists())
    data = read_measurements(Source(path.name, path.read_bytes()), load_robot(REAL[name]))
    data = data.rows(data.usable)
    held = np.arange(len(data)) * 25 // len(data) % 5 == block
    base = ("instrument_frame", "tool_frame", "joint_offset", "joint_compliance", "link_geometry")
    return Set("real", f"{name} #{block}", REAL[name], data.rows(~held), data.rows(held), None, None, base, whole=data)
