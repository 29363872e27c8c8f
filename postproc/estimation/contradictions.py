"""What no fit should be relied on for: springs that no arm has, rows that contradict each other."""

from __future__ import annotations

import numpy as np

from postproc.diagnostics import Diagnostic, Matter, joined
from postproc.effects.roles import Role
from postproc.estimation.fitted import Fit
from postproc.estimation.priors import prior_of
from postproc.measure.checks.setups import TIMES_TYPE
from postproc.measure.kinds.gauge import Gauge
from postproc.measure.kinds.observed import kind_of, rows_of
from postproc.model.arm import Model
from postproc.model.uncertainty.scatter import NORMAL_95
from postproc.robot.pose import rpy_degrees


def contradictions(fit: Fit) -> list[Diagnostic]:
    """Return the findings by which nothing can be promised of a fit: DAT026, DAT041."""
    findings = (*fit.data.diagnostics, *unphysical(fit))
    return [finding for finding in findings if finding.matter is Matter.CONTRADICTED]


def unphysical(fit: Fit) -> list[Diagnostic]:
    """Return DAT026 where springs are none that an arm has, by positions or by gauges."""
    return [*_negative(fit), *_unlike_type(fit)]


def _negative(fit: Fit) -> list[Diagnostic]:
    """Return DAT026 where the rows alone would make joint compliances negative by more than their 95 % interval."""
    effect = fit.model.in_role(Role.JOINT_SPRINGS)
    if effect is None:
        return []
    # The prior keeps springs positive: what counts is where the rows alone would have them.
    kept = effect.vector()
    x, sigma = kept.copy(), np.full(len(kept), np.inf)
    step = fit.inverse @ (fit.columns.T @ fit.problem.residual)
    for k, (key, j) in enumerate(fit.parameters):
        if key == effect.key:
            x[j] += step[k]
            sigma[j] = np.sqrt(fit.scatter_of_parameters * fit.inverse[k, k])
    for j in (i for key, i in fit.at_bound if key == effect.key):
        column = fit.linear.project(fit.problem.slopes(effect, np.arange(len(x)) == j))
        information = float(np.sum(column**2))
        x[j] += float(column[:, 0] @ fit.linear.residual) / max(information, 1e-300)
        sigma[j] = np.sqrt(fit.variance / max(information, 1e-300))
    joints = np.flatnonzero(x + NORMAL_95 * sigma < 0).tolist()
    if not joints:
        return []
    alone = joined([f"{1e6 * x[j]:.2g} ± {1e6 * sigma[j]:.1g} (joint {j + 1})" for j in joints])
    fitted_text = joined([f"{1e6 * kept[j]:.2g}" for j in joints])
    message = f"by the rows alone the compliance would be negative, {alone} \N{MICRO SIGN}rad/(N m): no gear yields "
    message += f"against its load; the model has {fitted_text}"
    if len(joints) > 1 and not (x > NORMAL_95 * sigma).any():
        return [_finding(fit, message, f"gravity pulls the other way: {_turned_over(fit.model)}", Matter.CONTRADICTED)]
    help_ = "a load is missing that works against gravity there (balancer, arm load, payload): ask `postproc diagnose`"
    return [_finding(fit, message, help_)]


def _turned_over(model: Model) -> str:
    """Return a clause on what to type where gravity pulls the other way than a model has it."""
    angles = ",".join(f"{x:.6g}" for x in rpy_degrees(np.diag([1.0, -1.0, -1.0]) @ model.R_world_base))
    if np.allclose(model.R_world_base, np.eye(3), atol=1e-3):
        return f"where the arm hangs, `postproc fit --mounting {angles}` says so"
    return f"is it mounted as stated? `postproc fit --mounting {angles}` turns it over (or `[mounting]` of the cell)"


def _unlike_type(fit: Fit) -> list[Diagnostic]:
    """Return DAT026 where gauges make springs `TIMES_TYPE` times as stiff or as soft as those of the arm's type.

    The prior holds what they do not tell: they tell this.
    """
    spring, gauges = fit.model.in_role(Role.JOINT_SPRINGS), rows_of(fit.data.state, kind_of(Gauge.column))
    if spring is None or fit.model.robot.joint_compliance is None or not len(gauges):
        return []
    usual, known = prior_of(spring, fit.model).value, {*fit.parameters, *fit.at_bound}
    times = spring.vector() / usual
    far = [j for j in range(6) if (spring.key, j) in known and not 1 / TIMES_TYPE < times[j] < TIMES_TYPE]
    if not far:
        return []
    one = "compliance would be" if len(far) == 1 else "compliances would be"
    listed = joined([f"{1e6 * spring.vector()[j]:.2f} (joint {j + 1}, of the type {1e6 * usual[j]:.2f})" for j in far])
    message = f"by the gauges {one} {listed} \N{MICRO SIGN}rad/(N m): no arm is {TIMES_TYPE:g} times as stiff or as "
    message += "soft as its type"
    help_ = "check the directions of the gauges, the loads and where they act, `--tool` and `--mounting`"
    return [_finding(fit, message, help_, Matter.CONTRADICTED)]


def _finding(fit: Fit, message: str, help_: str, matter: Matter | None = None) -> Diagnostic:
    """Return the warning DAT026 about the tables of a fit."""
    return Diagnostic("DAT026", "warning", message, fit.data.source, help=help_, matter=matter)
