"""The next poses to measure: to tell two effects apart, or to sharpen what is determined worst."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from postproc.arrays import GRAVITY, Array
from postproc.channels.state import AXES, State
from postproc.diagnostics import PostprocError
from postproc.effects.base import Effect
from postproc.effects.registry import effect_library, find_effect
from postproc.effects.roles import Role
from postproc.estimation.fitted import Fit
from postproc.estimation.least_squares import fit_model
from postproc.estimation.priors import is_placed
from postproc.estimation.problem import Problem, make_weights
from postproc.estimation.recorded import recorded_model
from postproc.estimation.solving.settle import settled
from postproc.estimation.solving.step import Name
from postproc.identification.diagnose import diagnose
from postproc.identification.planning.design import FULL_RANGE, Room, choose, separate, sharpen
from postproc.identification.planning.promise import Contest, Promise
from postproc.identification.planning.standing import comfortable_range
from postproc.identification.planning.table import as_csv, posture_columns
from postproc.identification.planning.weld_targets import WeldTargets, weld_weight
from postproc.identification.refits import refit_all, without
from postproc.identification.regions import with_regions
from postproc.measure.measurements import Measurements
from postproc.model.arm import Model, as_written, with_axes
from postproc.model.equilibrium import predict
from postproc.model.uncertainty.prediction import error_directions, read_uncertainty
from postproc.watch import Watch, unwatched

CANDIDATES = 3000
POSES_SEED = 20
POSES_FACTOR = 4
"""Times as many poses that are simulated where those asked for do not tell two effects apart."""
NEARLY_RATED = 0.8
"""Share of the rated payload from which heavier ones are no other loads."""
PULL = 0.5
"""Share of the weight of the rated payload that pulls at the TCP where a force is simulated."""


@dataclass(frozen=True)
class Alternative:
    """Other poses or loads that were simulated, where the planned poses do not tell two effects apart.

    Args:
        poses: their number; payloads: that they have [kg], none for those of the plan; force: that pulls [N].
        promise: how many of the simulated tables tell the effects apart.
    """

    poses: int
    payloads: tuple[float, ...]
    force: float
    promise: Promise


@dataclass(frozen=True)
class MeasuringPlan:
    """Poses worth measuring next.

    Args:
        fit: of the data so far.
        state: n joint angles, approach sides and payloads, within the limits. T_base_tcp: (n, 4, 4) where the TCP will
            be.
        between: the two effects to be told apart, by key, or None.
        before, after: by how many standard deviations the two effects differ without and with these poses; without a
            pair, the largest standard deviation, in ordinary sizes, of the parameters that poses can determine.
        worst: the parameters of the fit that are determined worst; never: those that no pose determines.
        resolved: whether the data so far tells the two effects apart: `diagnose` names one of them, and the other is
            none that this data does not tell from it.
        promise: how many simulated tables with these poses tell the two effects apart; None without a pair.
        alternatives: what else was simulated, where these are too few; the last one is the first that is enough.
        programs: for which the poses were chosen, each with the 95 % interval of the largest deviation on the arm where
            it welds [mm], once they are measured.
    """

    fit: Fit
    state: State
    T_base_tcp: Array
    between: tuple[str, str] | None
    before: float
    after: float
    worst: tuple[Name, ...] = ()
    never: tuple[Name, ...] = ()
    resolved: bool = True
    promise: Promise | None = None
    alternatives: tuple[Alternative, ...] = ()
    programs: tuple[tuple[WeldTargets, list[float]], ...] = ()

    @property
    def ids(self) -> list[str]:
        """Names (n,) of the poses."""
        return [f"N{i + 1:03d}" for i in range(len(self.state))]

    @property
    def extax(self) -> Array | None:
        """(n, 6) external axes as programs state them [mm], [deg], NaN where there is none; None without any."""
        station, axes = self.fit.model.station, self.state.external_axes
        if station is None or axes is None:
            return None
        stood = as_written(station, axes)
        return np.column_stack([stood.get(f"eax_{axis}", np.full(len(axes), np.nan)) for axis in AXES])

    def as_csv(self) -> str:
        """Return the poses as a measurement table without measured columns.

        Its columns are ``pose_id``, joints, approach sides, payload, force and external axes.
        """
        return as_csv(self.ids, posture_columns(self.state, self.extax))


def plan_poses(
    model: Model,
    data: Measurements,
    n: int,
    between: tuple[str, str] | None = None,
    extra_effects: Iterable[type[Effect]] = (),
    *,
    noise: float | None = None,
    room: Room = FULL_RANGE,
    programs: Callable[[Model], Sequence[WeldTargets]] | None = None,
    watch: Watch = unwatched,
) -> MeasuringPlan:
    """Choose n poses one after another from random reachable ones.

    Between two effects: the pose that adds most to what is left of one effect after projecting out the other and all
    fitted parameters, both ways (T-optimal, Atkinson and Fedorov 1975). What the poses are worth is simulated: tables
    with one of the effects, and a search on each (`Contest.promise`). Where too few tell them apart, other poses and
    loads are simulated, too. For programs: the pose that lowers the mean square error expected at their welds most
    (L-optimal). Else: the pose that shrinks the volume of the parameters' covariance most (D-optimal), counted in
    ordinary sizes.

    Args:
        between: keys of the two effects; extra_effects: classes beside the library's.
        noise: standard deviation per axis [m] stated by the user; room: where poses may be.
        programs: returns those that the poses are for, as a model corrects them; None for none. Not beside a pair.
        watch: is called with what is being done and the share of the work that is done.

    Raises:
        PostprocError: EFF020 for an unknown effect, DAT021 for one whose channel is not in the data, DAT024 where an
            effect moves nothing on such poses, or where fewer of them are inside the room than are asked for.
    """
    library = effect_library() | {cls.key: cls for cls in extra_effects}
    pair = [find_effect(key, library) for key in between or ()]
    if between is None:
        fit = fit_model(model, data, noise=noise)
        if programs is not None:
            return _for_programs(fit, room, n, programs)
        pool = _pool(fit, room, n)
        chosen, before, after, worst, never = sharpen(fit, pool, n)
        return MeasuringPlan(fit, *_picked(fit, pool, chosen), None, before, after, tuple(worst), tuple(never))
    diagnosis = diagnose(model, data, extra_effects, noise=noise, watch=lambda what, share: watch(what, 0.3 * share))
    # The fit of the diagnosis with all missing effects, but without the two, even where the model has them.
    fit = refit_all(diagnosis.base, diagnosis.final, [m.key for m in diagnosis.missing if m.key not in between])
    keys = [e.key for e in fit.model.effects if e.key in between]
    fit = without(fit, keys) if keys else fit
    contest = Contest.of(fit, pair)
    pool = _pool(fit, room, n)
    chosen, before, after = separate(fit, pool, pair, n)
    state, T = _picked(fit, pool, chosen)
    promise = contest.promise(state, watch=lambda what, share: watch(what, 0.3 + 0.4 * share))
    named = {m.key: m.not_separable for m in diagnosis.missing if m.key in between}
    resolved = bool(named) and not any(other in between for some in named.values() for other in some)
    others = list(_alternatives(contest, pair, n, room)) if not (promise.enough or resolved) else []
    return MeasuringPlan(fit, state, T, between, before, after, (), (), resolved, promise, tuple(others))


def _for_programs(fit: Fit, room: Room, n: int, programs: Callable[[Model], Sequence[WeldTargets]]) -> MeasuringPlan:
    """Choose n poses that lower the mean square error expected at the welds of programs most, one after another."""
    fit = with_regions(settled(fit), without(fit, [e.key for e in fit.model.effects if not is_placed(e)]))
    model, pool = recorded_model(fit), _pool(fit, room, n)
    known, welds = read_uncertainty(model), programs(model)
    assert known is not None
    if any(one.scatter for one in welds):
        known = replace(known, link_mass=np.zeros((0, 0)))
    scale = pool.weights.values[:, :3, None] / np.sqrt(fit.scatter_of_parameters)
    Z = error_directions(model, pool.data.state, known) * scale
    causes = np.eye(Z.shape[2])
    chosen, open_causes = choose(Z, causes, n, weld_weight([one.errors(known) for one in welds]))
    state, T = _picked(fit, pool, chosen)
    shares = [(0.0, 0.0) if one.scatter is None else one.scatter.of_estimate for one in welds]
    after = [one.on_arm(s, one.errors_after(known, open_causes, state)) for one, s in zip(welds, shares, strict=True)]
    return MeasuringPlan(fit, state, T, None, 0.0, 0.0, programs=tuple(zip(welds, after, strict=True)))


def _alternatives(contest: Contest, pair: list[type[Effect]], n: int, room: Room) -> Iterator[Alternative]:
    """Yield what else may tell two effects apart, simulated one after another until one is enough.

    These are more poses; payloads up to the rated one where the data has none that is nearly as heavy; a force; and all
    of it.

    Args:
        pair: classes of the two effects; n: number of the planned poses; room: where these may be.
    """
    fit = contest.fit
    rated = fit.model.robot.payload
    many = POSES_FACTOR * n
    others = [(many, room)]
    if rated is not None:
        seen = fit.data.state.payload_mass
        light = bool(not room.payloads and (seen is None or (np.ptp(seen) > 0 and seen.max() < NEARLY_RATED * rated)))
        loaded = replace(room, payloads=(0.0, 0.5 * rated, rated)) if light else room
        pulled, both = (replace(where, force=PULL * rated * GRAVITY) for where in (room, loaded))
        others += [*[(n, loaded)] * light, (n, pulled), (many, both)]
    for count, where in others:
        pool = _pool(fit, where, n)
        chosen = separate(fit, pool, pair, min(count, len(pool.data)))[0]
        promise = contest.promise(_picked(fit, pool, chosen)[0], hopeful=True)
        yield Alternative(len(chosen), where.payloads, where.force, promise)
        if promise.enough:
            return


def _picked(fit: Fit, pool: Problem, chosen: Sequence[int]) -> tuple[State, Array]:
    """Return the states of some poses of a pool by their indices, and T_base_tcp (n, 4, 4) there."""
    state = pool.data.rows(np.array(chosen)).state
    arm = fit.model.with_effects(*(e for e in fit.model.effects if e.role is not Role.INSTRUMENT_FRAME))
    return state, predict(arm, state)


def _candidates(fit: Fit, room: Room) -> State:
    """Return random states to choose from, or the room's own candidates.

    Joints are uniform inside their limits less a margin (`comfortable_range`), or inside the measured range where the
    room asks for it; approach sides, payloads and directions of a force are drawn at random, payloads from those of the
    room, or those measured, or up to the rated one where there was one alone.
    """
    g = np.random.default_rng(POSES_SEED)
    robot, seen = fit.model.robot, fit.data.state
    low, high = np.clip(comfortable_range(robot), -np.pi, np.pi)
    if room.measured_range:
        low, high = np.nanmin(seen.q, axis=0), np.nanmax(seen.q, axis=0)
    count = CANDIDATES if room.candidates is None else len(room.candidates)
    q = g.uniform(low, high, (count, 6)) if room.candidates is None else room.candidates
    channels: dict[str, Array] = {"approach": g.choice([-1.0, 1.0], (count, 6))}
    loads = np.array(room.payloads)
    if not room.payloads and seen.payload_mass is not None:
        loads = np.unique(np.round(seen.payload_mass, 3))
        if len(loads) == 1 and robot.payload is not None:
            loads = np.array([loads[0], 0.5 * robot.payload, robot.payload])
    if len(loads):
        center = np.zeros(3) if seen.payload_center is None else seen.payload_center[0]
        channels |= {"payload_mass": g.choice(loads, count), "payload_center": np.tile(center, (count, 1))}
    if room.force:
        direction = g.normal(size=(count, 3))
        pull = room.force * direction / np.linalg.norm(direction, axis=1)[:, None]
        channels["wrench"] = np.hstack([pull, np.zeros_like(pull)])
    for name in ("temperature", "time"):
        if (values := getattr(seen, name)) is not None:
            channels[name] = np.full(count, float(np.median(values)))
    tool = seen.T_flange_tcp[0] if seen.T_flange_tcp.ndim == 3 else seen.T_flange_tcp
    state = State(q, T_flange_tcp=tool if fit.data.tool_known else fit.model.T_flange_tcp).with_(**channels)
    station = fit.model.station
    if station is None or seen.external_axes is None:
        return state
    stood = np.nan_to_num(seen.external_axes)
    axes = g.uniform(stood.min(axis=0), stood.max(axis=0), (count, 6)) if room.axes is None else room.axes
    return with_axes(station, state, axes)


def _pool(fit: Fit, room: Room, n: int) -> Problem:
    """Return poses inside the room as a problem in which every position is measured.

    Random poses with a body or the TCP less than 0.1 m above the base plane are left out, if 50 remain.

    Raises:
        PostprocError: DAT024 where there are fewer than n.
    """
    state = _candidates(fit, room)
    count = len(state)
    ids, row = tuple(map(str, range(count))), tuple(range(1, count + 1))
    data = Measurements(state, np.zeros((count, 3)), pose_id=ids, row=row, line=(1,) * count, tool_known=True)
    problem = Problem(fit.model, data, make_weights(data, fit.noise))
    up = fit.model.R_world_base[2]
    heights = problem.equilibrium.chain.T_base_body[:, 3:, :3, 3] @ up
    tip = problem.equilibrium.T_base_tcp[:, :3, 3] @ up
    free = np.minimum(heights.min(axis=1), tip) > 0.1
    free |= free.sum() < 50 or room.candidates is not None
    pool = problem.some(free & room.holds(problem))
    if len(pool.data) < n:
        message = f"{len(pool.data)} poses are where they may be, and {n} are asked for"
        raise PostprocError.of("DAT024", message, help="widen the region, or ask for fewer with `-n`")
    return pool
