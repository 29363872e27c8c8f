"""What a program makes the arm do, and what loads it on the way: tool, payload, wrench, acceleration, approach."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from postproc.arrays import Array, blocks
from postproc.channels.state import State
from postproc.compensation.options import Options
from postproc.compensation.path.timeline import Timeline
from postproc.model.arm import Model, as_written
from postproc.model.ordered import with_ordered_channels
from postproc.motion.path.places import unit_of
from postproc.motion.path.samples import Samples
from postproc.motion.values import Flags, Index, Move
from postproc.robot.cells.station import Station

_SAME = 1e-9  # [m], [rad]: nearer than that the arm stands at one place
_NO_TRAVEL = 1e-7  # joint travel between samples [rad] that does not count as an approach


@dataclass(frozen=True, slots=True)
class Motion:
    """n samples of a program's curves in time, from which the arm's state is built for chosen rows.

    Args:
        place: (n,) place of each sample on the programmed path, as move index + fraction.
        timeline: timing of that path.
        moving: the joint speeds enter the state.
        sides: (n, 6) direction of approach of each joint if an effect reads it, else None.
        station: where the arm stands, None where it is not carried.
        ordered: (n,) channels that follow the samples in their order (`model.ordered`), by name.
        meant: samples of the curves where they are meant to be on the work; None where they are programmed.
    """

    samples: Samples
    timeline: Timeline
    options: Options
    place: Array
    moving: bool
    sides: Array | None
    station: Station | None = None
    meant: Samples | None = None
    ordered: Mapping[str, Array] = field(default_factory=dict)

    @property
    def wanted(self) -> Samples:
        """The curves that the real arm has to follow."""
        return self.samples if self.meant is None else self.meant

    @property
    def moves(self) -> tuple[Move, ...]:
        """The moves of the samples."""
        return self.samples.moves

    def at(self, rows: slice | Index) -> State:
        """The arm's state (joint angles, speeds, loads, channels) at samples, chosen by a slice or indices."""
        samples, timeline, place = self.samples, self.timeline, self.place[rows]
        index, of = np.unique(samples.move[rows], return_inverse=True)
        moves = [samples.moves[i] for i in index.tolist()]
        loaded = np.array([self.options.force_on == "all" or m.welding for m in moves])[of]
        wrench = np.where(loaded[:, None], [*self.options.force, *self.options.moment], 0.0)
        stated = {name: np.full(len(place), value) for name, value in self.options.channels}
        stated |= {name: values[rows] for name, values in self.ordered.items()}
        state = State(
            q=samples.q[rows],
            v=timeline.at(timeline.v, place) if self.moving else None,
            a=timeline.at(timeline.a, place) if self.options.inertia else None,
            time=timeline.at(timeline.t, place),
            approach=None if self.sides is None else self.sides[rows],
            payload_mass=np.array([m.payload_mass for m in moves])[of],
            payload_center=np.array([m.payload_center for m in moves])[of],
            wrench=wrench,
            temperature=stated.get("temperature"),
            channels=stated,
            T_flange_tcp=samples.mounts_at(rows).flange_tcp(samples.T_work_tcp[rows]),
        )
        if self.station is None:
            return state
        axes = samples.axes[rows]
        work = np.array([unit_of(m.event) or "" for m in moves])[of]
        state = state.with_(
            external_axes=axes, work=work, channels={**as_written(self.station, np.nan_to_num(axes)), **stated}
        )
        return self._carried(state, self.station, rows, place)

    def _carried(self, state: State, station: Station, rows: slice | Index, place: Array) -> State:
        """The state with gravity and motion of a base that external axes move or tilt.

        Args:
            rows: the samples of the state.
            place: (n,) their place on the programmed path, as move index + fraction.
        """
        axes, timeline = self.samples.axes[rows], self.timeline
        gravity = station.gravity(axes) if station.carried else None
        if gravity is None:
            return state
        if not self.options.inertia:
            return state.with_(gravity=gravity)
        v, a = timeline.at(timeline.axes_v, place), timeline.at(timeline.axes_a, place)
        acceleration, spin, spin_rate = station.base_motion(axes, v, a)
        turns = {"base_spin": spin, "base_spin_rate": spin_rate} if spin.any() or spin_rate.any() else {}
        return state.with_(gravity=gravity - acceleration, **turns)

    def distinct(self, rows: slice) -> tuple[Index, Index]:
        """Indices (d,) of the samples of a block without repetitions, and which of these each sample equals.

        Where a move continues with the tool and load of the one before, its start equals that move's goal and is left
        out. The second array (rows of the block,) holds positions in the first.
        """
        samples, every = self.samples, np.arange(rows.start, rows.stop)
        begins = every[1:][samples.u[every[1:]] == 0.0]
        before = begins - 1
        pairs = [(samples.moves[i], samples.moves[j]) for i, j in samples.move[np.stack([begins, before], 1)].tolist()]
        pressed = self.options.force_on == "all"
        same = np.array([
            (pressed or a.welding == b.welding)
            and a.payload_mass == b.payload_mass
            and (a.payload_center is b.payload_center or bool((a.payload_center == b.payload_center).all()))
            for a, b in pairs
        ], dtype=bool)  # fmt: skip
        same &= samples.curves.mounts[samples.move[begins]].same(samples.curves.mounts[samples.move[before]])
        stands = [self.place[:, None], samples.q, np.nan_to_num(samples.axes), self.wanted.T_work_tcp.reshape(-1, 16)]
        for values in stands if self.sides is None else [*stands, self.sides]:
            same &= (np.abs(values[begins] - values[before]) < _SAME).all(axis=1)
        kept = np.ones(len(every), dtype=bool)
        kept[begins[same] - rows.start] = False
        return every[kept], np.cumsum(kept) - 1

    def steady(self) -> Flags:
        """(n,) whether the load of inertia stays the same at each sample; all are true if inertia is not compensated.

        It changes where the TCP speeds up or slows down, and in zone corners passed faster than 0.1 m/s.
        """
        return self.timeline.steady(self.options, self.place)

    def blocks(self) -> Iterator[slice]:
        """Slices that cover all rows, each of some thousand samples."""
        return blocks(len(self.place))


def motion_of(
    model: Model, samples: Samples, timeline: Timeline, options: Options, place: Array | None = None
) -> Motion:
    """The motion through samples of a program, with the approach of the joints if an effect of the model reads it.

    Args:
        timeline: timing of the programmed path.
        place: (n,) place of the samples on the programmed path, as move index + fraction; without it they are samples
            of that path itself.
    """
    # Speeds alone load the arm too (centripetal forces): without inertia they are kept for effects that follow speed.
    moving = options.inertia or any("v" in effect.reads for effect in model.effects)
    sides = approach_side(samples) if feels_sides(model) else None
    where = samples.move + samples.u if place is None else place
    motion = Motion(samples, timeline, options, where, moving, sides, model.station)
    if any(effect.ordered_channels for effect in model.effects):
        state = motion.at(slice(None))
        ordered = with_ordered_channels(model, state).channels
        motion = replace(motion, ordered={name: x for name, x in ordered.items() if name not in state.channels})
    return motion


def feels_sides(model: Model) -> bool:
    """Whether an effect of the model depends on the direction from which joints approach (lost motion)."""
    return any("approach" in effect.reads for effect in model.effects)


def approach_side(samples: Samples) -> Array:
    """Sign of each joint's last travel before a sample, (n, 6), within its chain of connected moves.

    It is 0 until the joint first moves in the chain. Where a chain resumes from an earlier target, the travel to that
    target counts.
    """
    first = np.array([m.starts_chain for m in samples.moves])
    step = np.diff(samples.q, axis=0, prepend=samples.q[:1])
    side = np.where(np.abs(step) > _NO_TRAVEL, np.sign(step), 0.0)
    at_start = (samples.u == 0.0)[:-1]
    side[:-1][at_start] = np.where(side[1:][at_start] != 0, side[1:][at_start], side[:-1][at_start])
    side[first[samples.move]] = 0.0
    # Where a joint rests, its last travel counts, but not across the start of a chain.
    index = np.where(side != 0, np.arange(len(side))[:, None], -1)
    begin = np.maximum.accumulate(np.where(first[samples.move], np.arange(len(side)), 0))
    last = np.maximum.accumulate(index, axis=0)
    valid = last >= begin[:, None]
    sides = np.where(valid, np.take_along_axis(side, np.maximum(last, 0), axis=0), 0.0)
    chains = np.append(samples.start[first], len(sides))
    for i in (i for i, move in enumerate(samples.moves) if move.resumes_from is not None):
        begin_of = samples.goal[i]
        rows = slice(begin_of, chains[np.searchsorted(chains, begin_of, side="right")])
        earlier = sides[samples.goal[samples.moves[i].resumes_from]]
        sides[rows] = np.where(sides[rows] == 0, earlier, sides[rows])
    return sides
