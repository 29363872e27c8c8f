"""What a controller corrects by itself (Absolute Accuracy): the part of a model that it inverts before it moves.

The arm is told to go to P. Its controller commands joints q with FK_C(q) = P, where FK_C has the parts that it knows;
the real arm then stands at FK_M(q), with all of the model. What is left to correct is the difference of the two.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from postproc.channels.state import State
from postproc.diagnostics import PostprocError, did_you_mean
from postproc.effects.asking import displacement_of, load_of
from postproc.effects.base import Effect
from postproc.model.arm import Model
from postproc.model.chain import deflected_chain

PARTS = ("geometry", "gravity", "force", "tool", "inertia")
"""Constant errors of the arm; its deflection under its own weight, process force, tool and grip load, acceleration."""
_LOADS = ("gravity", "force", "tool", "inertia")
_PROBE = np.array([[0.3, -0.4, 0.5, 0.6, 0.7, -0.8], [-0.9, 0.2, -0.3, -0.5, 1.1, 0.4]])


def check_parts(parts: Sequence[str]) -> tuple[str, ...]:
    """Return the names of corrected parts in the order of `PARTS`, each once.

    Raises:
        PostprocError: MOD012, one of them does not exist, or stands without the one that it needs.
    """
    for part in parts:
        if part not in PARTS:
            help_ = did_you_mean(part, PARTS) or f"the parts are {', '.join(PARTS)}"
            raise PostprocError.of("MOD012", f"no controller corrects `{part}`", help=help_)
    if "inertia" in parts and "gravity" not in parts:
        text, help_ = "a controller that knows the arm's inertia knows its weight, too", "write `gravity,inertia`"
        raise PostprocError.of("MOD012", text, help=help_)
    return tuple(part for part in PARTS if part in parts)


def corrected_by_controller(model: Model, parts: Sequence[str]) -> Model:
    """Return the model with ``controller`` and ``already`` set to the parts that the controller corrects by itself.

    The controller is taken to correct, for ``geometry``, effects that displace joints or bodies equally in every
    posture; for a load, all springs; with ``gravity``, also torques that act on joints alone (a balancer). It knows no
    forces that effects add (cables, a payload that is not as stated).

    Args:
        parts: names out of `PARTS`; with none the model is returned as it is.

    Raises:
        PostprocError: MOD012, as in ``check_parts``.
    """
    parts = check_parts(parts)
    if not parts:
        return model
    kept = [e for e in model.effects if _known(model, e, parts)]
    robot = model.robot
    if "gravity" not in parts:
        robot = replace(robot, mass=0.0 * robot.mass, inertia=0.0 * robot.inertia)
    controller = replace(model, robot=robot, effects=tuple(kept), already=())
    return replace(model, controller=controller, already=parts)


def known_state(parts: Sequence[str], state: State) -> State:
    """Return the states with those loads only that the controller knows.

    ``force`` in ``parts`` keeps the wrench, ``tool`` the payload, ``inertia`` speeds and accelerations; else None.
    """
    if "force" not in parts:
        state = state.with_(wrench=None)
    if "tool" not in parts:
        state = state.with_(payload_mass=None, payload_center=None)
    if "inertia" not in parts:
        state = state.with_(v=None, a=None, base_spin=None, base_spin_rate=None)
    return state


def unknown_loads(model: Model, state: State) -> tuple[Model, State]:
    """Return model and states without the loads whose deflection the controller corrects already (``model.already``).

    Payload and wrench become None in the states, link masses zero in the model.
    """
    parts = model.already
    if "force" in parts:
        state = state.with_(wrench=None)
    if "tool" in parts:
        state = state.with_(payload_mass=None, payload_center=None)
    if "gravity" in parts:
        model = replace(model, robot=replace(model.robot, mass=0.0 * model.robot.mass))
    return model, state


def _known(model: Model, effect: Effect, parts: Sequence[str]) -> bool:
    """Tell whether a controller that corrects these parts corrects this effect, as `corrected_by_controller` says."""
    if "load" in effect.reads:
        return any(part in parts for part in _LOADS)
    if not {"q", "robot"} >= set(effect.reads):
        return False
    probe = State(_PROBE, robot=model.robot, T_base_body=deflected_chain(model.robot, _PROBE, {}, False).T_base_body)
    if type(effect).load is not Effect.load:
        return "gravity" in parts and not load_of(effect, probe).body
    share = displacement_of(effect, probe)
    if "geometry" not in parts or share.tool is not None or share.instrument is not None:
        return False
    columns = [x for x in (share.joint, *share.body.values()) if x is not None]
    return all(np.ndim(x) == 1 or bool((x == x[0]).all()) for x in columns)
