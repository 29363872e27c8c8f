"""How many simulated tables, with poses that are still to be measured, tell two effects apart."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation
from scipy.special import expit

from postproc.channels.state import State
from postproc.diagnostics import PostprocError
from postproc.effects.base import Effect
from postproc.estimation.fitted import Fit
from postproc.estimation.least_squares import fit_model
from postproc.estimation.problem import Problem, make_weights
from postproc.estimation.solving.settle import settled
from postproc.estimation.solving.solve import Terms
from postproc.identification.acceptance import fitted_best
from postproc.identification.add import grown
from postproc.identification.curves.families import CurveForms
from postproc.identification.refits import thinned, with_channels_of
from postproc.identification.screen.candidate import Screen
from postproc.identification.screen.composition import compose
from postproc.identification.search import backward, forward
from postproc.identification.state import SearchState
from postproc.measure.measurements import Measurements
from postproc.model.arm import Model
from postproc.model.ordered import with_ordered_channels
from postproc.watch import Watch, unwatched

TABLES, FEWER, LONG_TABLE = 20, 10, 250
"""Tables that are simulated, and how many where none of so many tells the effects apart or the data has many rows."""
ENOUGH_TABLES = 0.9
"""Share of the tables that must tell two effects apart for a plan to be called enough."""
TABLES_SEED = 21
BETWEEN_ROWS = 60.0
"""Seconds from one planned pose to the next, the first after the last measured row."""
PLANNED = ("q", "approach", "payload_mass", "payload_center", "external_axes", "T_reference_base", "temperature")
ZERO_UNLESS_PLANNED = ("v", "a", "wrench")
"""Channels that a plan states of its poses, and those that are zero unless it does; others are as in the last row."""


@dataclass(frozen=True)
class Promise:
    """How many simulated tables, the planned poses measured, tell two effects apart.

    Args:
        tables: that were simulated.
        told_apart: tables on which the search names the effect that was simulated, and the other one neither beside it
            nor as what the table does not tell from it.
    """

    tables: int
    told_apart: int

    @property
    def enough(self) -> bool:
        """Whether the share of tables that tell the effects apart is `ENOUGH_TABLES`."""
        return self.told_apart >= ENOUGH_TABLES * self.tables


@dataclass(frozen=True)
class Contest:
    """Two effects, each fitted to the data so far in the form that suits it best, as explanations of that data.

    Args:
        fit: of the data with neither of them; classes: of the two, by key.
        truths: the fit with each of them, by key; odds: probability of the first of the two, if one of them is there.
    """

    fit: Fit
    classes: Mapping[str, type[Effect]]
    truths: Mapping[str, Fit]
    odds: float

    @classmethod
    def of(cls, fit: Fit, pair: Sequence[type[Effect]]) -> Contest:
        """Return the contest of two effects on what a fit leaves.

        Raises:
            PostprocError: DAT021 a channel that is not in the data, DAT022 a fit that does not settle.
        """
        fit = thinned(fit)
        classes = {one.key: one for one in pair}
        truths, evidence = dict[str, Fit](), list[float]()  # 2 log of odds
        for key, one in classes.items():
            screen = Screen(fit.problem, {key: one})
            lacking = one.null().missing(fit.problem.sensitivity.state)
            candidate = None if lacking else compose(screen, fit.linear, key)
            best = None if candidate is None else fitted_best(fit, screen, candidate)
            truths[key] = settled(grown(fit, one) if best is None else best[1])
            evidence.append(0.0 if best is None else best[0].evidence)
        first, second = evidence
        odds = float(expit(0.5 * (first - second))) if np.isfinite(max(first, second)) else 0.5
        return cls(fit, classes, truths, odds)

    def promise(self, planned: State, hopeful: bool = False, watch: Watch = unwatched) -> Promise:
        """Return how many tables of the rows so far and the planned poses tell the two effects apart.

        Each table has one of the effects, as often as its odds on the rows so far say, with parameters drawn from the
        posterior of its fit, and noise and unexplained error of that fit on the planned poses.

        Args:
            planned: the poses. hopeful: stop as soon as the promise cannot be enough any more.
            watch: is called with what is being done and the share of the work that is done.
        """
        g, keys, separated = np.random.default_rng(TABLES_SEED), tuple(self.classes), 0
        tables = TABLES if len(self.fit.data) <= LONG_TABLE else FEWER
        first = np.diff(np.round(self.odds * np.arange(tables + 1)))
        for k, key in enumerate(keys[0] if is_first else keys[1] for is_first in first):
            separated += self.told_apart(simulated(self.truths[key], planned, g), key)
            watch("simulated tables", (k + 1) / tables)
            if separated == 0 and k + 1 == FEWER:
                return Promise(FEWER, 0)
            if hopeful and separated + tables - k - 1 < ENOUGH_TABLES * tables:
                return Promise(k + 1, separated)
        return Promise(tables, separated)

    def told_apart(self, table: Measurements, key: str) -> bool:
        """Return whether a search for the two effects on a table names one of them, and rules the other out.

        Args:
            key: of the one that is there.
        """
        (other,) = {*self.classes} - {key}
        terms = Terms(self.fit.free, self.fit.strength, determined=frozenset(self.fit.parameters))
        table = with_channels_of(self.classes.values(), self.fit.model, table)
        try:
            base = fit_model(self.fit.model, table, noise=self.fit.noise.stated, terms=terms)
            result = backward(forward(SearchState(base, base, self.classes, CurveForms(())), most=0))
        except PostprocError:  # a fit that does not settle tells nothing
            return False
        named = next((m for m in result.missing if m.key == key), None)
        return named is not None and other not in (*result.keys, *named.not_separable)


def simulated(truth: Fit, planned: State, g: np.random.Generator) -> Measurements:
    """Return the rows of a fit and planned poses, these measured on an arm drawn from the posterior of the fit.

    Args:
        truth: its rows are in order. planned: the poses, which follow these rows.
    """
    kept = truth.data.rows(np.setdiff1d(np.arange(len(truth.data)), truth.excluded))
    n, m = len(kept), len(planned)
    rows = kept.rows(np.concatenate([np.arange(n), np.full(m, n - 1)]))
    derived = {c.name for e in truth.model.effects for c in e.ordered_channels}
    changes: dict[str, object] = {"channels": {k: v for k, v in rows.state.channels.items() if k not in derived}}
    if rows.state.time is not None:
        changes["time"] = rows.state.time + BETWEEN_ROWS * np.maximum(np.arange(n + m) - n + 1, 0)
    for name in (*PLANNED, *ZERO_UNLESS_PLANNED, *(["gravity"] if planned.gravity.ndim == 2 else [])):
        value, before = getattr(planned, name), getattr(rows.state, name)
        if value is None and before is not None and name in ZERO_UNLESS_PLANNED:
            value = np.zeros_like(before[n:])
        if value is not None:
            before = np.zeros((n, *value.shape[1:])) if before is None else before[:n]
            changes[name] = np.concatenate([before, value])
    ids = (*(kept.pose_id or map(str, range(n))), *(f"planned {k}" for k in range(m)))
    state = with_ordered_channels(truth.model, rows.state.with_(**changes))
    rows = replace(rows, state=state, pose_id=ids, row=(), line=(), wrong=frozenset(), sources=(), file=())
    if rows.readings is not None:  # planned poses measure positions
        at = np.arange(n + m) < n
        readings = replace(rows.readings, numbers=np.where(at[:, None], rows.readings.numbers, np.nan))
        rows = replace(rows, state=state.with_(setup=np.where(at, np.asarray(state.setup), -1)), readings=readings)
    new = rows.rows(np.arange(n, n + m))
    level, turn = truth.parts.level, truth.noise.rotation
    deviation = float(np.sqrt(truth.parts.square) if level is None else np.hypot(level, truth.unexplained))
    seen = Problem(drawn(truth, g), new, make_weights(new, truth.noise))
    T, noise = seen.T_instrument_tcp, g.normal(size=(3, m, 6)) * deviation
    measured = np.isfinite(rows.position).any(axis=0) | (rows.readings is not None)
    position = np.where(measured, T[:, :3, 3] + noise[0, :, :3], np.nan)
    rotation, joint = rows.rotation, rows.joint
    if rotation is not None:
        turned = Rotation.from_rotvec(noise[1, :, :3] * (1.0 if turn is None else turn / deviation)).as_matrix()
        rotation = np.concatenate([rotation[:n], T[:, :3, :3] @ turned])
    if joint is not None:
        joint = np.concatenate([joint[:n], seen.equilibrium.chain.q + noise[2]])
    return replace(rows, position=np.concatenate([rows.position[:n], position]), rotation=rotation, joint=joint)


def drawn(fit: Fit, g: np.random.Generator) -> Model:
    """Return the model of a fit with parameters drawn from their posterior, inside their bounds."""
    after, count = fit.posterior, len(fit.posterior.names)
    value, vector = np.linalg.eigh(after.covariance)
    off = g.normal(size=len(after.directions)) @ after.directions
    off[:count] += vector @ (np.sqrt(np.maximum(value, 0.0)) * g.normal(size=count))
    vectors = {e.key: e.vector().copy() for e in fit.model.effects}
    for (key, i), x in zip((*after.names, *after.unidentifiable), after.mean + off, strict=True):
        vectors[key][i] = x
    return fit.model.with_effects(*(e.with_vector(np.clip(vectors[e.key], *e.bounds())) for e in fit.model.effects))
