"""Measured arms on tracks, gantries and columns, and beside positioners, whose axes are not what the controller believes.

The arm is the independent one; the chain around it is written here in plain numpy. An external axis may go another way, about
another place or by another scale (`askew`), leave its line or circle (`crooked`), or lean under its load (`leaning`). Points are
measured on the work that an axis carries, else in the world.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from tests.independent import arm as A
from tests.independent import rapid as R
from tests.independent.cells import DEG, Cell, States, draw_cell, draw_states, settle

NOISES = (0.01, 0.02, 0.03, 0.045)
"""Standard deviations of the instrument per axis [mm]."""
EYE = np.eye(4)


@dataclass(frozen=True)
class Axis:
    """An external axis as the cell states it: a linear one slides along x of its frame, a rotary one turns about z.

    Args:
        at: (4, 4) its frame in the world with all axes at zero; low, high: travel [mm] or [deg].
    """

    letter: str
    kind: str
    carries: str
    at: np.ndarray
    low: float
    high: float
    unit: str

    @property
    def text(self) -> str:
        q = R.matrix_quaternion(self.at[:3, :3])
        place = [round(1e3 * float(x), 6) for x in self.at[:3, 3]]
        lines = [
            f'axis = "{self.letter}"',
            f'kind = "{self.kind}"',
            f'carries = "{self.carries}"',
            f'unit = "{self.unit}"',
        ]
        lines += [
            f"xyz_mm = {place}",
            f"quat = {[round(float(x), 12) for x in q]}",
            f"limits = [{self.low}, {self.high}]",
        ]
        return "\n".join(["[[external_axes]]", *lines, ""])

    def move(self, e: np.ndarray) -> np.ndarray:
        """(n, 4, 4) of positions [mm] or [deg]."""
        if self.kind == "linear":
            return A.transform(np.eye(3), e[:, None] / 1e3 * np.array([1.0, 0.0, 0.0]))
        return A.transform(A.rotation(np.array([0.0, 0.0, 1.0]), np.radians(e)), np.zeros(3))


Shape = Callable[[np.ndarray], np.ndarray]
"""Small shift and turn (n, 6) of an axis by its position (n,) [mm] or [deg], in the axes of its frame."""


Lean = Callable[[np.ndarray], list[tuple[np.ndarray, np.ndarray]]]
"""Springs by the position of an axis (n,) [mm]: the place of each in the frame of the axis, (n, 3), and its share (n,)."""


@dataclass(frozen=True)
class Fault:
    """What is wrong with one axis.

    Args:
        frame: (4, 4) where it really is, in its frame, and scale: by which it goes too far; shape: how it strays.
        tilt: (3,) turn by the arm's moment about the frame [rad/(N m)]; sag: (3,) about the axis by the work's weight
            times its lever, along the axes of the work, over one g [rad].
        lean: where that turn happens, and how much of it, if not at the frame.
    """

    letter: str
    frame: np.ndarray | None = None
    scale: float = 0.0
    shape: Shape | None = None
    tilt: np.ndarray | None = None
    sag: np.ndarray | None = None
    lean: Lean | None = None


def chain(
    axes: list[Axis], e: np.ndarray, faults: dict[str, Fault], load: Callable[..., np.ndarray] | None = None
) -> np.ndarray:
    """T_world_end (n, 4, 4) of axes that stand on one another; e (n, 6) [mm], [deg]."""
    T = np.tile(EYE, (len(e), 1, 1))
    before = EYE
    for axis in axes:
        T = T @ np.linalg.inv(before) @ axis.at
        before = axis.at
        fault = faults.get(axis.letter, Fault(axis.letter))
        position = e[:, "abcdef".index(axis.letter)]
        if load is not None and (fault.tilt is not None or fault.sag is not None):
            w = np.zeros((len(e), 6))
            here = [(np.zeros((len(e), 3)), np.ones(len(e)))]
            for point, share in here if fault.lean is None else fault.lean(position):
                at = T @ A.transform(np.eye(3), point)
                turn = share[:, None] * load(at, axis, fault)
                w += np.concatenate([np.cross(point, turn), turn], axis=1)
            T = T @ A.small(w)
        strays = A.small(fault.shape(position)) if fault.shape is not None else EYE
        if axis.kind == "rotary":
            T = T @ strays
        C = EYE if fault.frame is None else fault.frame
        T = T @ C @ axis.move(position * (1 + fault.scale)) @ np.linalg.inv(C)
        if axis.kind == "linear":
            T = T @ strays
    return T


@dataclass(frozen=True)
class Station:
    """An arm in a cell: axes under the arm and under the work, both from the world outwards."""

    name: str
    arm: tuple[Axis, ...] = ()
    work: tuple[Axis, ...] = ()
    hangs: bool = False

    @property
    def text(self) -> str:
        mounting = "[mounting]\nrpy_deg = [180, 0, 0]\n" if self.hangs else ""
        return mounting + "".join(axis.text for axis in (*self.arm, *self.work))

    @property
    def gravity(self) -> np.ndarray:
        return -A.G if self.hangs else A.G

    def places(self, e: np.ndarray, faults: dict[str, Fault], s: States, f: A.Frames, arm: A.Arm) -> np.ndarray:
        """(n, 4, 4) the base as the work really sees it, or the world where no axis carries work."""

        def leans(T: np.ndarray, axis: Axis, fault: Fault) -> np.ndarray:
            down = self.gravity
            R_axis = T[:, :3, :3]
            if axis.carries == "work":
                turn = A.rotation(np.array([0.0, 0.0, 1.0]), np.radians(e[:, "abcdef".index(axis.letter)]))
                lever = (R_axis @ turn @ fault.sag[:, None])[:, :, 0]
                pull = np.einsum("nji,nj->ni", R_axis, np.cross(lever, down / 9.81))
                return pull * [0.0, 0.0, 1.0]
            # Weights of the arm's links and payload about the foot of the column.
            B = chain(list(self.arm), e, {}) @ np.linalg.inv(self.arm[-1].at)
            moment = np.zeros((len(e), 3))
            center = [(f.body[b], arm.center[b], arm.mass[b] * np.ones(len(e))) for b in range(1, 7)]
            for frame, c, m in [*center, (f.flange, s.center, s.mass)]:
                c = np.broadcast_to(c, (len(e), 3))
                p = frame[:, :3, 3] + np.einsum("nij,nj->ni", frame[:, :3, :3], c)
                p = B[:, :3, 3] + np.einsum("nij,nj->ni", B[:, :3, :3], p)
                moment += np.cross(p - T[:, :3, 3], m[:, None] * down)
            return np.einsum("nji,nj->ni", R_axis, moment) * fault.tilt

        base = chain(list(self.arm), e, faults, leans)
        base = base @ np.linalg.inv(self.arm[-1].at) if self.arm else base
        return np.linalg.inv(chain(list(self.work), e, faults, leans)) @ base if self.work else base


def framed(
    x: float, y: float, z: float, about: tuple[float, float, float] = (0, 0, 1), degrees: float = 0.0
) -> np.ndarray:
    return A.transform(A.rotation(np.array(about, float), np.radians(degrees)), np.array([x, y, z]))


TRACK = Axis("a", "linear", "robot", framed(0, 0, -0.4, degrees=30.0), 0.0, 4000.0, "TRACK_1")
GANTRY = (
    Axis("a", "linear", "robot", framed(-0.3, 0.2, 1.0), 0.0, 6000.0, "GANTRY"),
    Axis("b", "linear", "robot", framed(0, 0, 0.4, degrees=90.0), 0.0, 2500.0, "GANTRY"),
)
COLUMN = Axis("a", "linear", "robot", framed(-0.6, 0.0, -0.8, (0, 1, 0), -90.0), 0.0, 1500.0, "LIFT")
TABLE = Axis("b", "rotary", "work", framed(1.2, 0.1, 0.5, (1, 0, 0), 90.0), -180.0, 180.0, "STN1")
LEANING = Axis("b", "rotary", "work", framed(1.1, -0.2, 0.4, (1, 0, 0), 35.0), -100.0, 100.0, "STN1")
PLATE = Axis("c", "rotary", "work", framed(1.2, 0.0, 0.62), -170.0, 170.0, "STN1")
TILT = Axis("b", "rotary", "work", framed(1.2, 0.0, 0.5, (1, 0, 0), 90.0), -80.0, 80.0, "STN1")
STATIONS = {
    "track": Station("track", (TRACK,)),
    "gantry": Station("gantry", GANTRY, hangs=True),
    "column": Station("column", (COLUMN,)),
    "table": Station("table", work=(TABLE,)),
    "leaning table": Station("leaning table", work=(LEANING,)),
    "two axes": Station("two axes", work=(TILT, PLATE)),
    "track and table": Station("track and table", (TRACK,), (LEANING,)),
}


Kind = Callable[[np.random.Generator, Axis], Fault]


def crooked(g: np.random.Generator, axis: Axis) -> Fault:
    """Waves no shorter than two thirds of the travel on a rail; eccentricity, wobble and second orders of a table."""
    if axis.kind == "linear":
        length = axis.high - axis.low
        waves = g.uniform(0.5, 1.5, (6, 2)) / length
        size = np.array([0.05, 0.2, 0.2, 0.1, 0.1, 0.1])[:, None] * 1e-3 * g.normal(0, 1, (6, 2)) + 0.0
        phase = g.uniform(0, 2 * np.pi, (6, 2))
        return Fault(
            axis.letter, shape=lambda e: np.sum(size * np.sin(2 * np.pi * waves * e[:, None, None] + phase), axis=2)
        )
    size = np.array([0.1, 0.1, 0.05, 0.1, 0.1, 0.15])[:, None] * 1e-3 * g.normal(0, 1, (6, 2)) * [1.0, 0.7]
    phase = g.uniform(0, 2 * np.pi, (6, 2))
    return Fault(
        axis.letter, shape=lambda e: np.sum(size * np.sin(np.radians(e)[:, None, None] * [1.0, 2.0] + phase), axis=2)
    )


def askew(g: np.random.Generator, axis: Axis) -> Fault:
    turn, place = g.normal(0, 0.4e-3, 3), g.normal(0, 0.6e-3, 3)
    scale = float(g.choice([0.0, 1.0])) * g.uniform(1e-4, 3e-4) * float(g.choice([-1, 1])) * (axis.kind == "linear")
    return Fault(axis.letter, frame=A.transform(A.rotation_vector(turn), place), scale=scale)


def leaning(g: np.random.Generator, axis: Axis) -> Fault:
    if axis.carries == "robot":
        return Fault(axis.letter, tilt=g.uniform(0.4e-7, 1.5e-7, 3))
    return Fault(axis.letter, sag=g.normal(0, 2.5e-4, 3))


def _springs(law: Lean) -> Kind:
    """A column or carriage whose springs are at other places than the frame; stiff about its own line."""

    def lean(g: np.random.Generator, axis: Axis) -> Fault:
        return Fault(axis.letter, tilt=g.uniform(0.5e-7, 1.5e-7, 3) * [0.0, 1.0, 1.0], lean=law)

    return lean


def _along(x: np.ndarray | float, y: float, z: float, e: np.ndarray) -> np.ndarray:
    return np.stack([x + 0 * e, y + 0 * e, z + 0 * e], axis=1)


def _slices(e: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    """A cantilever whose foot is 0.3 m below the frame, in twenty slices; as soft as one spring at a height of 1 m."""
    h = e / 1e3 + 0.3
    return [(_along(h * (k + 0.5) / 20 - 0.3, 0.0, 0.0, e), h / 20) for k in range(20)]


foot_elsewhere = _springs(lambda e: [(_along(-0.7, 0.2, 0.4, e), np.ones(len(e)))])
carriage = _springs(lambda e: [(_along(e / 1e3, 0.1, -0.2, e), np.ones(len(e)))])
cantilever = _springs(_slices)
telescope = _springs(lambda e: [(_along(e / 1e3 + 0.4, 0.0, -0.6, e), (e / 1e3) ** 2)])
at_the_foot = _springs(lambda e: [(_along(0.0, 0.0, 0.0, e), e / 1e3)])
bridge = _springs(lambda e: [(_along(e / 1e3, 0.0, 0.0, e), e / 1e3 * (6.0 - e / 1e3) / 4)])
"""Springs at the foot, at the carriage, all along a column; a carriage that is softer the farther it is out; a foot that
is; a bridge on two ends that is softest in its middle."""

KEYS = {crooked: "external_axis_error", askew: "external_axis_frame"}
HIDDEN: list[tuple[Kind, str, str]] = [
    (crooked, "track", "a"), (askew, "track", "a"), (leaning, "column", "a"), (crooked, "leaning table", "b"),
    (askew, "table", "b"), (leaning, "table", "b"), (crooked, "gantry", "b"), (askew, "gantry", "a"), (askew, "two axes", "c"),
    (crooked, "track and table", "a"), (askew, "track and table", "b"), (leaning, "gantry", "b"), (crooked, "table", "b"),
    (askew, "leaning table", "b"), (leaning, "leaning table", "b"), (crooked, "column", "a"), (crooked, "gantry", "a"),
    (askew, "column", "a"), (crooked, "two axes", "c"), (leaning, "track", "a"),
]  # fmt: skip
"""Twenty hidden effects: what, in which cell, and which axis has it."""
LEANS: list[tuple[Kind, str, str]] = [
    (foot_elsewhere, "column", "a"), (cantilever, "column", "a"), (carriage, "column", "a"), (telescope, "column", "a"),
    (at_the_foot, "column", "a"), (bridge, "gantry", "a"), (foot_elsewhere, "gantry", "b"), (carriage, "gantry", "b"),
]  # fmt: skip
"""Columns and gantries that lean in other ways than about the origin of the frame that is stated."""


@dataclass(frozen=True)
class Measured:
    """A cell's table as a user has it, other poses with their true places, and what is hidden.

    Args:
        key: of the library; empty where nothing is hidden. noise: per axis [mm].
    """

    station: Station
    fit_csv: str
    true_csv: str
    key: str
    noise: float
    fault: Fault | None


def positions(g: np.random.Generator, station: Station, n: int, stops: bool) -> np.ndarray:
    """(n, 6) [mm], [deg]: anywhere, or at nine stops of every axis."""
    e = np.zeros((n, 6))
    for axis in (*station.arm, *station.work):
        share = g.integers(0, 9, n) / 8 if stops else g.uniform(0, 1, n)
        e[:, "abcdef".index(axis.letter)] = np.round(axis.low + share * (axis.high - axis.low), 2)
    return e


def seen(cell: Cell, station: Station, e: np.ndarray, s: States, faults: dict[str, Fault]) -> np.ndarray:
    """(n, 3) true TCP in the instrument's frame [m]."""
    found = settle(replace(cell, gravity=station.gravity), s)
    T = cell.instrument @ station.places(e, faults, s, found.frames, cell.arm) @ found.frames.tcp
    return T[:, :3, 3]


def table(s: States, e: np.ndarray, places: np.ndarray, ids: np.ndarray, letters: str, digits: int) -> str:
    """The rows as a measurement table; payloads, and positions of the axes that the cell has."""
    names = ["pose_id", *(f"q{j}_deg" for j in range(1, 7)), "x_mm", "y_mm", "z_mm", "payload_kg"]
    names += [*(f"payload_{a}_mm" for a in "xyz"), *(f"eax_{letter}" for letter in letters)]
    lines = [",".join(names)]
    for i in range(len(s)):
        row = [f"P{ids[i]:03d}", *(f"{x:.5f}" for x in s.q[i] / DEG), *(f"{x:.{digits}f}" for x in places[i] * 1e3)]
        row += [f"{s.mass[i]:g}", *(f"{x * 1e3:g}" for x in s.center[i])]
        lines.append(",".join([*row, *(f"{e[i, 'abcdef'.index(letter)]:.2f}" for letter in letters)]))
    return "\n".join(lines) + "\n"


def measured(kind: Kind | None, name: str, letter: str, seed: int) -> Measured:
    """A drawn table of a cell in which one axis has a fault, or none has."""
    g = np.random.default_rng(seed)
    station, arm = STATIONS[name], A.irb4600()
    letters = "".join(axis.letter for axis in (*station.arm, *station.work))
    axis = next((a for a in (*station.arm, *station.work) if a.letter == letter), None)
    fault = kind(g, axis) if kind is not None and axis is not None else None
    faults = {} if fault is None else {letter: fault}
    cell, noise, n = draw_cell(g, arm, ()), float(g.choice(NOISES)), int(g.choice([120, 150, 200]))
    stops = bool(g.random() < 0.4)
    again = np.concatenate([np.arange(n), *[np.arange(0, n, n // 12)] * 2])
    s, t = (draw_states(g, count, arm, False, False) for count in (n, 150))
    e, other = positions(g, station, n, stops), positions(g, station, 150, False)
    places = seen(cell, station, e, s, faults)[again] + g.normal(0, 1e-3 * noise, (len(again), 3))
    fit = table(s.take(again), e[again], places, again, letters, 4)
    true = table(t, other, seen(cell, station, other, t, faults), np.arange(150), letters, 6)
    return Measured(
        station, fit, true, "" if kind is None else KEYS.get(kind, "external_axis_compliance"), noise, fault
    )
