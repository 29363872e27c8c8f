"""What was measured: one value, SI and radians, rows as in the file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array
from postproc.diagnostics import Diagnostic, Source
from postproc.effects.contract import State

FEWEST = 8
"""Rows whose angles may all be round by chance."""


@dataclass(frozen=True)
class Measurements:
    """n measured rows of one arm.

    Args:
        state: what was commanded, and the channels.
        position: (n, 3) measured TCP in the instrument's frame [m]; NaN where not measured.
        rotation: (n, 3, 3) measured orientation, NaN where not measured; None where the file has none.
        joint: (n, 6) joint angles measured on the output side [rad], NaN where not measured; None where the file has
            none.
        sigma: (n,) the instrument's own standard deviation [m], None where not stated.
        pose_id: (n,) labels; rows with the same label and the same state are repeats.
        row: (n,) row numbers in the file, the first data row is 1; line: (n,) line numbers in the file.
        tool_known: the tool of every row is in ``state.T_flange_tcp`` (it came from a program).
        rounded: whether joint angles of few digits were rounded when they were written, and the arm stood beside them;
            None where a fit has to tell.
        source: the file, None for data made in memory.
        diagnostics: findings about the file.
    """

    state: State
    position: Array
    rotation: Array | None = None
    joint: Array | None = None
    sigma: Array | None = None
    pose_id: tuple[str, ...] = ()
    row: tuple[int, ...] = ()
    line: tuple[int, ...] = ()
    tool_known: bool = False
    rounded: bool | None = None
    source: Source | None = field(default=None, repr=False)
    diagnostics: tuple[Diagnostic, ...] = field(default=(), repr=False)

    def __len__(self) -> int:
        return len(self.state.q)

    @cached_property
    def usable(self) -> NDArray[np.bool_]:
        """(n,) bool: rows with a commanded state and something measured."""
        measured = np.asarray(np.isfinite(self.position).any(axis=1))
        if self.rotation is not None:
            measured |= np.isfinite(self.rotation).all(axis=(1, 2))
        if self.joint is not None:
            measured |= np.isfinite(self.joint).any(axis=1)
        return np.asarray(measured & np.isfinite(self.state.q).all(axis=1))

    def rows(self, index: NDArray[Any] | Sequence[int]) -> Measurements:
        """The rows of an index or of a mask, in that order."""
        picked = np.arange(len(self))[np.asarray(index)]
        return replace(
            self,
            state=state_rows(self.state, picked),
            position=self.position[picked],
            rotation=None if self.rotation is None else self.rotation[picked],
            joint=None if self.joint is None else self.joint[picked],
            sigma=None if self.sigma is None else self.sigma[picked],
            pose_id=tuple(self.pose_id[i] for i in picked) if self.pose_id else (),
            row=tuple(self.row[i] for i in picked) if self.row else (),
            line=tuple(self.line[i] for i in picked) if self.line else (),
        )

    @cached_property
    def step(self) -> float:
        """Step [rad] of which all joint angles are multiples: a decimal place of a degree or a radian, 0 for none."""
        if len(self) < FEWEST or not np.isfinite(self.state.q).all():
            return 0.0
        for place in np.geomspace(1.0, 1e-4, 5):
            for unit in (np.radians(place), place):
                steps = self.state.q / unit
                if np.abs(steps - np.round(steps)).max() < 1e-6:
                    return float(unit)
        return 0.0

    @cached_property
    def repeats(self) -> NDArray[np.int_]:
        """(n,) number of the group of repeats each row belongs to.

        The same label, commanded joints, payload and approach.
        """
        keys: dict[tuple[object, ...], int] = {}
        parts = [np.round(self.state.q, 9)]
        for channel in (self.state.approach, self.state.payload_mass, self.state.v):
            if channel is not None:
                parts.append(np.round(channel.reshape(len(self), -1 if len(self) else 1), 9))
        stacked = np.nan_to_num(np.hstack(parts), nan=-1e9)
        labels = self.pose_id or tuple(str(i) for i in range(len(self)))
        sessions = np.zeros(len(self)) if self.state.session is None else self.state.session
        groups = np.empty(len(self), dtype=int)
        for i in range(len(self)):
            key = (labels[i], int(sessions[i]), stacked[i].tobytes())
            groups[i] = keys.setdefault(key, len(keys))
        return groups


def state_rows(state: State, picked: NDArray[np.int_]) -> State:
    """The rows of a state."""
    n = len(state)
    changes: dict[str, object] = {}
    for item in fields(state):
        value = getattr(state, item.name)
        if item.name == "channels":
            changes["channels"] = {name: channel[picked] for name, channel in value.items()}
        elif item.name == "session_names":
            continue
        elif item.name == "T_flange_tcp":
            changes[item.name] = value[picked] if value.ndim == 3 else value
        elif value is not None and len(value) == n:
            changes[item.name] = value[picked]
    return state.with_(**changes)
