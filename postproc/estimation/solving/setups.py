"""Unknowns of set-ups before the first step of a fit: where tips and anchors are, how planes lie, zeros of readings."""

from __future__ import annotations

import numpy as np

from postproc.arrays import Array
from postproc.channels.state import State
from postproc.effects.asking import displacement_of
from postproc.effects.base import Effect
from postproc.effects.registry import effect_in_role
from postproc.effects.roles import Role
from postproc.estimation.problem import Problem
from postproc.measure.kinds.base import POINT, TILT, ZERO
from postproc.measure.kinds.observed import kind_of, start_of
from postproc.model.arm import Model


def setups_known(model: Model) -> dict[str, Array]:
    """Return the unknowns (6,) of the set-ups that a model has, by name."""
    effect = model.in_role(Role.SETUPS)
    if effect is None:
        return {}
    names = tuple(dict.fromkeys(name for part in ("point", "plane", "zero") for name in vars(effect)[part]))
    each = State(np.zeros((len(names), 6)), setup=np.array(range(len(names))), setup_names=names)
    places = displacement_of(effect, each).setup
    assert places is not None
    return dict(zip(names, places, strict=True))


def with_setups(problem: Problem) -> Problem:
    """Return the problem with the unknowns of every set-up that its model does not know, by the model as it stands."""
    data, known = problem.data, setups_known(problem.model)
    read = np.zeros(0) if data.readings is None else np.isfinite(data.readings.numbers[:, 0])
    new = [name for name in dict.fromkeys(data.state.setup_of_rows[read > 0].tolist()) if name and name not in known]
    if not new or data.readings is None:
        return problem
    point = problem.equilibrium.T_reference_tcp[:, :3, 3]
    known |= {name: start_of(data.state, data.readings, point, name) for name in new}
    effect = _effect(known, data.readings.zero_open)
    return behind(problem, effect, Role.INSTRUMENT_FRAME, Role.SESSION_FRAMES)


def behind(problem: Problem, new: Effect, *roles: Role) -> Problem:
    """Return the problem with an effect in place of that of its role, behind effects of some roles.

    What does the same as an earlier effect is not fitted: joint 1 turns as an instrument does, joint 6 as a tool does.
    """
    effects = [e for e in problem.model.effects if e.role is not new.role]
    at = max((k + 1 for k, e in enumerate(effects) if e.role in roles), default=0)
    return problem.at([*effects[:at], new, *effects[at:]])


def lasting(model: Model) -> tuple[Model, dict[int, int]]:
    """Return the model without unknowns that only served one reading, and the new index of each parameter of `setup`.

    The unknown between the two ends of one distance tells nothing of another one.
    """
    effect = model.in_role(Role.SETUPS)
    if effect is None:
        return model, {}
    zero = vars(effect)["zero"]
    first = len(effect.vector()) - len(zero)
    kept = [*range(first), *(first + k for k, name in enumerate(zero) if kind_of(name).lasting)]
    effects = [e for e in model.effects if e is not effect]
    if kept:
        names = tuple(name for name in zero if kind_of(name).lasting)
        new = type(effect).null(point=vars(effect)["point"], plane=vars(effect)["plane"], zero=names)
        effects.insert(model.effects.index(effect), new.with_vector(effect.vector()[kept]))
    return model.with_effects(*effects), {old: new for new, old in enumerate(kept)}


def _effect(places: dict[str, Array], zero_open: bool) -> Effect:
    """Return the effect of set-ups with these unknowns (6,), by name."""
    has = {name: kind_of(name).unknowns(zero_open) for name in places}
    point, plane, zero = (tuple(name for name, some in has.items() if some[part]) for part in range(3))
    values = [places[name][POINT] for name in point], [places[name][TILT] for name in plane]
    zeros = np.array([places[name][ZERO] for name in zero])
    effect = effect_in_role(Role.SETUPS).null(point=point, plane=plane, zero=zero)
    return effect.with_vector(np.concatenate([np.zeros(0), *values[0], *values[1], zeros]))
