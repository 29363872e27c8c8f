"""Measurements and a model: whitened residuals, and what each parameter of an effect would do to them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array
from postproc.channels.sight import Site
from postproc.channels.tool import in_tool_axes
from postproc.channels.units import recorded
from postproc.effects.asking import displacement_of
from postproc.effects.base import Effect
from postproc.effects.roles import Role
from postproc.estimation.priors import may_be_anywhere
from postproc.measure.checks.repeats import Noise
from postproc.measure.kinds.base import UNKNOWNS, Read
from postproc.measure.kinds.observed import observed
from postproc.measure.measurements import Measurements
from postproc.model.arm import Model
from postproc.model.derivatives.places import INSTRUMENT, PLACES, SETUP
from postproc.model.derivatives.sensitivity import Sensitivity, sensitivity
from postproc.model.equilibrium import Equilibrium, equilibrium
from postproc.robot.pose import rotation_vectors


@dataclass(frozen=True)
class Weights:
    """One over the standard deviation of every measured number, 0 where it was not measured or is excluded.

    The r numbers of a row are the position, or what it reads in its place (3), then the rotation vector (3) where
    orientations were measured, then the joint angles (6) where they were measured on the output side.

    Args:
        values: (n, r) [1/m], [1/rad].
        turn: (n, m, m) matrices that whiten the first m numbers of a row, already multiplied by their values, where
            these have a common error; m is 3, or 6 with the orientation. None where errors are independent.
    """

    values: Array
    turn: Array | None = None

    @property
    def used(self) -> NDArray[np.bool_]:
        """(n, r) mask of the numbers that were measured and are not excluded."""
        return self.values > 0

    def whiten(self, numbers: Array) -> Array:
        """Return (n, r, k) numbers in measured units as independent ones of variance 1, 0 where not used."""
        scaled: Array = numbers * self.values[:, :, None]
        if self.turn is None:
            return scaled
        m = self.turn.shape[1]
        return np.concatenate([self.turn @ scaled[:, :m], scaled[:, m:]], axis=1)

    def measured(self, whitened: Array) -> Array:
        """Return whitened numbers (N,), those in use row by row, in measured units: (n, r), NaN where not used."""
        numbers = np.zeros(self.values.shape)
        numbers[self.used] = whitened
        if self.turn is not None:
            m = self.turn.shape[1]
            numbers[:, :m] = np.linalg.solve(self.turn, numbers[:, :m, None])[:, :, 0]
        return np.where(self.used, numbers, np.nan) / np.where(self.used, self.values, 1.0)

    def nearly(self, other: Weights) -> bool:
        """Return whether other weights use the same numbers and differ by less than 1 %."""
        same = np.array_equal(self.used, other.used) and np.allclose(self.values, other.values, rtol=0.01)
        if self.turn is None or other.turn is None:
            return same and self.turn is other.turn
        return same and np.allclose(self.turn, other.turn, atol=0.01)

    def rows(self, index: NDArray[np.bool_] | NDArray[np.int_]) -> Weights:
        """Return the weights of some rows, by a mask or by indices."""
        return Weights(self.values[index], None if self.turn is None else self.turn[index])


def make_weights(data: Measurements, noise: Noise) -> Weights:
    """Return the weights of positions [1/m], rotations and joint angles [1/rad] that follow from the noise.

    The variance of a row's position is that of the instrument there, `sigma_mm`, plus that of the arm, which is the
    same in all rows: s_i^2 + r^2. Where the noise is not known, 30 micrometres and 30 microradians are assumed; figures
    that depend on the assumption are scaled by the residual in the end.
    """
    sigma = weighed_by(noise)
    relative = np.ones(len(data))
    if data.sigma is not None:
        square = np.where(np.isfinite(data.sigma) & (data.sigma > 0), data.sigma, np.nanmedian(data.sigma)) ** 2
        square += max(sigma**2 - float(np.mean(square)), 0.0)
        relative = np.sqrt(square / np.mean(square))
    parts = [np.isfinite(data.points) / (sigma * relative)[:, None]]
    if data.rotation is not None:
        measured = np.asarray(np.isfinite(data.rotation).all(axis=(1, 2)))
        parts.append(np.repeat(measured[:, None], 3, axis=1) / (noise.rotation or sigma))
    if data.joint is not None:
        parts.append(np.isfinite(data.joint) / sigma)
    return Weights(np.hstack(parts))


def weighed_by(noise: Noise) -> float:
    """Return the standard deviation [m], [rad] assumed for a measured number in the weights; 3e-5 if none is known."""
    return noise.sigma or noise.instrument or 3e-5


@dataclass(frozen=True)
class Problem:
    """A model with measurements, at the model's present parameters."""

    model: Model
    data: Measurements
    weights: Weights

    @cached_property
    def equilibrium(self) -> Equilibrium:
        """The equilibrium of the model at the measured states: poses of arm and TCP, deflections, loads."""
        state = self.data.state
        if not self.data.tool_known:
            state = state.with_(T_flange_tcp=self.model.T_flange_tcp)
        return equilibrium(self.model, state)

    @cached_property
    def T_instrument_tcp(self) -> Array:
        """(n, 4, 4) predicted pose of the TCP in the instrument's frame."""
        return self.equilibrium.T_instrument_tcp

    @cached_property
    def error(self) -> Array:
        """(n, r) measured minus predicted [m], [rad], positions in instrument axes; NaN where not measured."""
        T = self.T_instrument_tcp
        parts = [self.data.position - T[:, :3, 3]]
        if self.read is not None and self.data.readings is not None:
            numbers = self.data.readings.numbers
            # One end of a distance alone tells nothing: its zero takes up whatever it reads.
            off = np.where(np.isfinite(numbers) & np.isnan(self.read.value), 0.0, numbers - self.read.value)
            parts = [np.where(self.set_up[:, None], off, parts[0])]
        if self.data.rotation is not None:
            parts.append(rotation_vectors(self.data.rotation @ np.swapaxes(T[:, :3, :3], 1, 2)))
        if self.data.joint is not None:
            parts.append(self.data.joint - self.equilibrium.chain.q)
        return np.hstack(parts)

    @property
    def set_up(self) -> NDArray[np.bool_]:
        """(n,) mask of rows that measure no position, but read what their set-up shows."""
        setup = self.data.state.setup
        return np.zeros(len(self.data), dtype=bool) if setup is None else np.asarray(setup) >= 0

    @property
    def few(self) -> bool:
        """Whether rows are few and say little, so that priors take part in the fit: no tracker was there."""
        return self.data.readings is not None or self.data.T_frame_object is not None

    @cached_property
    def anywhere(self) -> frozenset[str]:
        """Keys of effects of which any value is as likely as another: of frames, but for a tool that is stated.

        An instrument sees a point of its own on the tool; what touches is the TCP itself.
        """
        stated = self.data.tool_known or not np.array_equal(self.model.T_flange_tcp, np.eye(4))
        touched = self.few and (self.data.T_frame_object is not None or not np.isfinite(self.data.position).any())
        known = {Role.TOOL_FRAME} if stated and touched else set()
        return frozenset(e.key for e in self.model.effects if may_be_anywhere(e) and e.role not in known)

    @cached_property
    def read(self) -> Read | None:
        """What rows with a set-up read by the model, with derivatives; None where all rows measure positions."""
        readings, state = self.data.readings, self.data.state
        if readings is None:
            return None
        unknowns = [displacement_of(e, state).setup for e in self.model.effects if e.role is Role.SETUPS]
        some = [x for x in unknowns if x is not None] or [np.zeros((len(state), UNKNOWNS))]
        return observed(state, readings, self.equilibrium.T_reference_tcp[:, :3, 3], some[0])

    @property
    def directions(self) -> Array:
        """(n, k, d) directions of the numbers of a row that are observed: axes, or those along which a set-up reads."""
        if self.read is None or self.data.observed.name != "position":
            width = self.data.observed.columns.stop - self.data.observed.columns.start
            return np.broadcast_to(np.eye(width), (len(self.data), width, width))
        axes = np.swapaxes(self.equilibrium.R_instrument_reference, 1, 2)
        return np.where(self.set_up[:, None, None], self.read.by_point, np.swapaxes(axes, 1, 2))

    def weighted(self, weights: Weights) -> Problem:
        """Return the problem with other weights; what the model predicts is taken over and not computed again."""
        other = replace(self, weights=weights)
        same = ("equilibrium", "read", "error", "sensitivity")
        other.__dict__.update({k: v for k, v in self.__dict__.items() if k in same})
        return other

    @cached_property
    def residual(self) -> Array:
        """(N,) whitened errors of the numbers in use, row by row."""
        if self.weights.turn is None:
            used = self.weights.used
            return np.asarray(self.error[used] * self.weights.values[used])
        return self.whiten(np.nan_to_num(self.error)[:, :, None])[:, 0]

    @cached_property
    def row(self) -> NDArray[np.int_]:
        """(N,) index of the measured row of each entry of the residual."""
        return np.asarray(np.nonzero(self.weights.used)[0])

    @cached_property
    def site(self) -> Site:
        """Where the measured point is on the nominal tool, and where the instrument stands, as the model has them."""
        instrument = self.equilibrium.deflection.instrument
        # Where it drifts, by millimetres: on average.
        stands = np.zeros(6) if instrument is None else np.atleast_2d(instrument).mean(axis=0)
        point = in_tool_axes(self.sensitivity.state, self.equilibrium.T_base_tcp[:, :3, 3])
        return Site(tuple(point.tolist()), tuple(stands.tolist()))

    @cached_property
    def channels(self) -> dict[str, Array]:
        """Every channel (n,) that varies over the rows, by name."""
        return recorded(self.sensitivity.state, self.site)

    @property
    def lever(self) -> Array:
        """(n, 6, 66) derivative of the TCP pose [m], [rad], whatever was measured, by 66 unit moves.

        The moves are a turn of each of the 6 joints, and a shift and turn (6 each) of each of the 7 bodies, of the tool
        and of the instrument, and six unknowns of a set-up, which move no pose.
        """
        return sensitivity(self.model, self.equilibrium).matrix[:, :6]

    @cached_property
    def sensitivity(self) -> Sensitivity:
        """Derivative (n, r, 66) of the measured numbers [m], [rad] by the 66 unit moves of `lever`."""
        of_pose = sensitivity(self.model, self.equilibrium)
        n, r = self.weights.values.shape
        if r == 6 and self.data.rotation is not None and self.read is None:
            return of_pose
        matrix = np.zeros((n, r, PLACES))
        pose = 3 if self.data.rotation is None else 6
        matrix[:, :pose] = of_pose.matrix[:, :pose]
        if self.read is not None:
            matrix[self.set_up, :3] = of_readings(of_pose, self.equilibrium, self.read, self.set_up)
        if self.data.joint is not None:
            matrix[:, pose:, :6] = np.eye(6)
        return replace(of_pose, matrix=matrix)

    @cached_property
    def whitened(self) -> Sensitivity:
        """The sensitivity with every measured number whitened; 0 for numbers that are not used."""
        measured = self.sensitivity
        return replace(measured, matrix=self.weights.whiten(measured.matrix))

    def slopes(self, effect: Effect, free: NDArray[np.bool_]) -> Array:
        """Return (N, p) whitened derivatives of the prediction by the free parameters of an effect of the model.

        Args:
            free: (q,) mask over the effect's vector, p of it True.
        """
        return self._rows(self.whitened.by_parameter(effect, free))

    def columns(self, effect: Effect, free: NDArray[np.bool_]) -> Array:
        """Return (N, p) whitened derivatives of the prediction by parameters of an effect that the model may lack.

        The effect's load acts on joint springs no stiffer than is ordinary: a compliance that the missing load has
        pushed towards zero would hide it.

        Args:
            free: (q,) mask over the effect's vector, p of it True.
        """
        return self._rows(self.softer.by_parameter(effect, free))

    @cached_property
    def softer(self) -> Sensitivity:
        """The whitened sensitivity with joint springs no stiffer than is ordinary (`at_least_ordinary`)."""
        springs = tuple(at_least_ordinary(self.model, e) for e in self.whitened.springs)
        return replace(self.whitened, springs=springs)

    @cached_property
    def turns(self) -> Array:
        """(N, 6) whitened derivative of the prediction by a turn of each joint."""
        return self._rows(self.whitened.matrix[:, :, :6])

    def whiten(self, columns: Array) -> Array:
        """Return columns (n, r, p) in measured units as (N, p) whitened numbers, those in use row by row."""
        return self._rows(self.weights.whiten(columns))

    def _rows(self, whitened: Array) -> Array:
        """Return whitened columns (n, r, p) as (N, p): the numbers in use, row by row."""
        used = self.weights.used
        every = whitened.reshape(used.size, whitened.shape[2])
        return every if used.all() else np.asarray(every[used.ravel()])

    def at(self, effects: Iterable[Effect]) -> Problem:
        """Return the problem with these effects in place of all effects of its model."""
        return replace(self, model=self.model.with_effects(*effects))

    def some(self, rows: NDArray[np.bool_] | NDArray[np.int_]) -> Problem:
        """Return the problem with some of its rows, by a mask or by indices."""
        return Problem(self.model, self.data.rows(rows), self.weights.rows(rows))

    def subsample(self, most: int) -> NDArray[np.bool_]:
        """Return (n,) mask of every k-th pose with its repeats, for about ``most`` measured numbers at most."""
        return self.data.one_in(max(1, -(-len(self.row) // most)))

    def squares(self) -> Array:
        """Return (n, r) squared whitened errors, also of numbers that are excluded.

        Those get the largest weight of their column.
        """
        typical = np.where(self.weights.used, self.weights.values, 0.0)
        scale = typical.max(axis=0, initial=0.0)
        filled = Weights(np.where(typical > 0, typical, scale), self.weights.turn)
        return np.asarray(filled.whiten(np.nan_to_num(self.error)[:, :, None])[:, :, 0] ** 2)


def of_readings(of_pose: Sensitivity, balance: Equilibrium, read: Read, rows: NDArray[np.bool_] | slice) -> Array:
    """Return (m, 3, 66) derivatives of what m rows with a set-up read, 0 where they read nothing.

    Set-ups are fixed to the frame of measured points, wherever an instrument stands.

    Args:
        of_pose: derivatives of all n poses, balance: their equilibrium, read: what they read; rows: which count.
    """
    matrix = read.by_point[rows] @ np.swapaxes(balance.R_instrument_reference, 1, 2)[rows] @ of_pose.matrix[rows, :3]
    matrix[:, :, INSTRUMENT:SETUP], matrix[:, :, SETUP:] = 0.0, read.by_unknown[rows]
    return matrix


def at_least_ordinary(model: Model, spring: Effect) -> Effect:
    """Return the joint compliance with its values raised to a least one; other effects come back unchanged.

    The least value is half the arm's measured compliance, or a fifth of the median positive one of the effect where
    none was measured: a compliance that a missing load has pushed towards zero would hide that load.
    """
    if spring.role is not Role.JOINT_SPRINGS:
        return spring
    x, known = spring.vector(), model.robot.stiffness_source == "measured"
    stated = model.robot.joint_compliance if known else None
    fitted = float(np.median(x[x > 0])) if (x > 0).any() else 0.0
    return spring.with_vector(np.maximum(x, 0.2 * fitted if stated is None else 0.5 * stated))
