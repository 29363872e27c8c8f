"""What was measured: one value, SI and radians, rows as in the file."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from hashlib import blake2b
from typing import Any

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array
from postproc.channels.state import State
from postproc.diagnostics import Diagnostic, Source, Span
from postproc.measure.kinds.base import Readings
from postproc.measure.observations import Observation, observations

OF_ROWS = ("position", "T_frame_object", "rotation", "joint", "sigma")
"""Arrays of measurements that have a row for each."""
TOUCHED_LINE = re.compile(rb"^# touched-up program: .* sha256 ([0-9a-f]{64})\s*$", re.MULTILINE)
"""Line of a table that names a program whose touch-ups it holds."""
FEWEST_SETUPS = 3
"""Set-ups from which on one of them can be left out: fewer determine nothing of the arm without it."""
FEWEST_ROWS_JUDGED = 8
"""Fewer rows tell nothing of a table: their angles may all be round, and any half of them be right, by chance."""


@dataclass(frozen=True)
class Measurements:
    """n measured rows of one arm.

    Args:
        state: what was commanded, and the channels.
        position: (n, 3) measured TCP in the instrument's frame [m]; NaN where not measured.
        T_frame_object: (n, 4, 4) the work object that the points of the table are stated in [m], where the program
            says that it is; NaN for rows without one, None without such columns. ``position`` is where it stands, too.
        rotation: (n, 3, 3) measured orientation, NaN where not measured; None where the file has none.
        readings: what rows read that measure no position (`measure.kinds`), None where all do.
        joint: (n, 6) joint angles measured on the output side [rad], NaN where not measured; None where the file has
            none.
        sigma: (n,) the instrument's own standard deviation [m], None where not known; sigma_stated: whether the table
            states it, and repeats or what is usual of such readings do not tell it.
        pose_id: (n,) labels; rows with the same label and the same state are repeats.
        row: (n,) row numbers in the file, the first data row is 1; line: (n,) line numbers in the file.
        tool_known: the tool of every row is in ``state.T_flange_tcp`` (it came from a program).
        counted: the channel `row` is the number of the row in its file, as the user says that rows stand in order.
        sides_from: what tells the order of rows from which sides of approach were derived; empty where they were not.
        accepted: codes of findings that the user accepts.
        references: names of reflectors that stand beside the arm: no fit uses their rows.
        rounded: whether joint angles of few digits were rounded when they were written, and the arm stood beside them;
            None where a fit has to tell.
        wrong: file and row number of those that cannot have been measured as the table says: no fit uses them.
        sampled_from: rows of the table that these were taken from by chance; 0 where they are all of it.
        sources: the files, none for data made in memory; file: (n,) number of the one that a row stands in, () for one.
        diagnostics: findings about the file.
    """

    state: State
    position: Array
    T_frame_object: Array | None = None
    rotation: Array | None = None
    joint: Array | None = None
    sigma: Array | None = None
    sigma_stated: bool = True
    readings: Readings | None = None
    pose_id: tuple[str, ...] = ()
    row: tuple[int, ...] = ()
    line: tuple[int, ...] = ()
    tool_known: bool = False
    counted: bool = False
    sides_from: str = ""
    accepted: frozenset[str] = frozenset()
    references: frozenset[str] = frozenset()
    rounded: bool | None = None
    wrong: frozenset[tuple[int, int]] = frozenset()
    sampled_from: int = 0
    sources: tuple[Source, ...] = field(default=(), repr=False)
    file: tuple[int, ...] = ()
    diagnostics: tuple[Diagnostic, ...] = field(default=(), repr=False)

    def __len__(self) -> int:
        return len(self.state.q)

    @property
    def source(self) -> Source | None:
        """The only file, None where there are several or none."""
        return self.sources[0] if len(self.sources) == 1 else None

    def name(self, index: int) -> str:
        """Return what people call a row by its index: ``row 12``, with the file where there are several."""
        number = self.row[index] if self.row else index + 1
        return f"row {number} of {self.sources[self.file[index]].path}" if self.file else f"row {number}"

    def where(self, index: int) -> tuple[Source | None, Span | None]:
        """Return the file and the place in it of a row by its index; None where unknown."""
        if not (self.sources and self.line):
            return self.source, None
        source = self.sources[self.file[index] if self.file else 0]
        return source, source.line_span(self.line[index])

    @property
    def touched_programs(self) -> tuple[str, ...]:
        """Hashes (SHA-256) of the touched-up programs that the tables name in their first lines."""
        return tuple(m.decode() for source in self.sources for m in TOUCHED_LINE.findall(source.data))

    @cached_property
    def usable(self) -> NDArray[np.bool_]:
        """(n,) bool: rows with a commanded state and something measured, less those that cannot be right."""
        if not self.wrong:
            return self.filled
        places = zip(self.file or (0,) * len(self), self.row, strict=True)
        return self.filled & np.array([place not in self.wrong for place in places], dtype=bool)

    @cached_property
    def filled(self) -> NDArray[np.bool_]:
        """(n,) bool: rows with a commanded state and something measured."""
        measured = np.asarray(np.isfinite(self.points).any(axis=1))
        if self.rotation is not None:
            measured |= np.isfinite(self.rotation).all(axis=(1, 2))
        if self.joint is not None:
            measured |= np.isfinite(self.joint).any(axis=1)
        return np.asarray(measured & np.isfinite(self.state.q).all(axis=1) & ~self.off_arm)

    @property
    def points(self) -> Array:
        """(n, 3) positions [m], in rows that measure none what they read in its place; NaN where not measured."""
        read = self.readings
        return self.position if read is None else np.where(np.isfinite(read.numbers), read.numbers, self.position)

    @property
    def listed(self) -> int:
        """Rows that a table lists: without the far ends of distances between two rows, which stand last."""
        return len(self) if self.readings is None else int(np.sum(self.readings.sign >= 0))

    @property
    def off_arm(self) -> NDArray[np.bool_]:
        """(n,) bool: rows of reflectors that stand beside the arm."""
        return np.isin(self.state.reflector_of_rows, list(self.references))

    @cached_property
    def observations(self) -> tuple[Observation, ...]:
        """The kinds of measured numbers that the table has columns for."""
        read = self.readings is not None and not np.isfinite(self.position).any()
        return observations(self.rotation is not None, self.joint is not None, read)

    @cached_property
    def observed(self) -> Observation:
        """The kind of number that errors are of: positions if there are any, else orientations, else joint angles."""
        some = [kind for kind in self.observations if np.isfinite(self.numbers(kind)).any()]
        return some[0] if some else self.observations[0]

    def numbers(self, kind: Observation) -> Array:
        """Return (n, k) measured numbers of one kind, NaN where not measured; orientations as matrices (n, 9)."""
        if kind.name == "position":
            return self.points
        values = self.rotation if kind.name == "orientation" else self.joint
        assert values is not None
        return values.reshape(len(self), -1)

    def rows(self, index: NDArray[Any] | Sequence[int]) -> Measurements:
        """Return the rows of an index, slice or mask, in that order."""
        picked = np.arange(len(self))[np.asarray(index)]
        some: dict[str, Any] = {name: getattr(self, name) for name in OF_ROWS}
        some = {name: values if values is None else values[picked] for name, values in some.items()}
        some["readings"] = None if self.readings is None else self.readings.rows(picked)
        for name in ("pose_id", "row", "line", "file"):
            values = getattr(self, name)
            some[name] = tuple(values[i] for i in picked) if values else ()
        return replace(self, state=self.state.rows(picked), **some)

    def one_in(self, step: int) -> NDArray[np.bool_]:
        """Return (n,) mask of one random pose out of every ``step``, with all its repeats; the same at every call."""
        poses = int(self.repeats.max(initial=-1)) + 1
        first = np.arange(0, poses, step)
        return np.isin(self.repeats, first + np.random.default_rng(0).integers(step, size=len(first)))

    @cached_property
    def order(self) -> NDArray[np.int_]:
        """(n,) indices of the rows in an order that depends on the file only if the user says that its order counts.

        Sessions one after another, in each by `time_s`, or by the number of the row where that counts. Without either
        the rows are exchangeable: they are sorted by a hash of their angles, repeats of a pose together.
        """
        state = self.state
        clock = state.time if state.time is not None else state.channels.get("row") if self.counted else None
        session = self._sessions(clock)
        q = np.round(state.q, 9) + 0.0
        mixed = np.array([blake2b(row.tobytes(), digest_size=8).digest() for row in q])
        tie_breakers = np.nan_to_num(np.column_stack([q, self._tie_breakers()]), nan=-1e9)
        first = np.unique(mixed, return_inverse=True)[1] if clock is None else clock
        return np.lexsort((*tie_breakers.T, first, session))

    def _sessions(self, clock: Array | None) -> NDArray[np.int_]:
        """Return (n,) rank of the session of each row: by file, then by its first time, then by its name."""
        if self.state.session is None:
            return np.zeros(len(self), dtype=int)
        keys = []
        for session in range(len(self.state.session_names)):
            rows = np.flatnonzero(self.state.session == session)
            first = float(np.min(clock[rows])) if clock is not None and len(rows) else 0.0
            file = min((self.file[i] for i in rows), default=0) if self.file else 0
            keys.append((file, first, self.state.session_names[session]))
        place = np.argsort(sorted(range(len(keys)), key=lambda k: keys[k]))
        return np.asarray(place[np.asarray(self.state.session, dtype=int)])

    def _tie_breakers(self) -> Array:
        """Return (n, k) channels and measured numbers of every row: they order rows with equal joint angles."""
        state, n = self.state, len(self)
        some = (state.payload_mass, state.approach, state.v, state.temperature, *state.channels.values())
        parts = [part.reshape(n, -1) for part in some if part is not None]
        return np.hstack([*parts, *(self.numbers(kind) for kind in self.observations)])

    @property
    def in_order(self) -> Measurements:
        """The measurements with their rows sorted by ``order``; the object itself where they are."""
        order = self.order
        return self if (np.diff(order) > 0).all() else self.rows(order)

    @cached_property
    def fold_group(self) -> NDArray[np.int_]:
        """(n,) number of the group of rows that a cross-validation fold leaves out whole: repeats of a pose, set-ups.

        Set-ups are left out whole where there are `FEWEST_SETUPS` or more, or where two rows are all that they have:
        with rows of its own a plane predicts others on it whatever the arm is like.
        """
        state = self.state
        if self.readings is None or state.setup is None:
            return self.repeats
        setup = np.asarray(state.setup, dtype=int)
        rows = np.bincount(setup[setup >= 0], minlength=len(state.setup_names))
        together = (rows <= 2) | (np.sum(rows > 0) >= FEWEST_SETUPS)
        return np.where((setup >= 0) & together[setup], self.repeats.max() + 1 + setup, self.repeats)

    @cached_property
    def step(self) -> float:
        """Step [rad] of which all joint angles are multiples, 1 to 1e-4 of a degree or radian by tens; 0 for none."""
        if len(self) < FEWEST_ROWS_JUDGED or not np.isfinite(self.state.q).all():
            return 0.0
        q, places = self.state.q, np.geomspace(1.0, 1e-4, 5)
        units = (float(unit) for place in places for unit in (np.radians(place), place))
        return next((unit for unit in units if np.abs(q / unit - np.round(q / unit)).max() < 1e-6), 0.0)

    @cached_property
    def repeats(self) -> NDArray[np.int_]:
        """(n,) number of the group of repeats that each row belongs to.

        Repeats have the same label, session, reflector, set-up, commanded joints and speeds, payload, force, stated
        side of approach and external axes.
        """
        stated = None if self.sides_from else self.state.approach
        keys: dict[tuple[object, ...], int] = {}
        parts = [np.round(self.state.q, 9)]
        state = self.state
        loads = state.payload_mass, state.wrench
        for channel in (stated, state.reflector, state.setup, *loads, state.v, state.external_axes):
            if channel is not None:
                parts.append(np.round(channel.reshape(len(self), -1 if len(self) else 1), 9))
        stacked = np.nan_to_num(np.hstack(parts), nan=-1e9)
        labels = self.pose_id or tuple(str(i) for i in range(len(self)))
        sessions = np.zeros(len(self)) if self.state.session is None else self.state.session
        rows = zip(labels, sessions.tolist(), stacked, strict=True)
        groups = [keys.setdefault((label, session, row.tobytes()), len(keys)) for label, session, row in rows]
        return np.array(groups, dtype=int)
