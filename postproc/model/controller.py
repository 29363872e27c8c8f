"""What a controller knows: the part of a model that it corrects by itself, and the model that its configuration gives.

The arm is told to go to P. Its controller commands joints q with FK_C(q) = P, where FK_C has the parts that it knows
(Absolute Accuracy); the real arm then stands at FK_M(q), with all of the model. What is left to correct is the
difference of the two.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from postproc.channels.state import State
from postproc.diagnostics import PostprocError, did_you_mean
from postproc.effects.asking import displacement_of, load_of
from postproc.effects.base import Effect
from postproc.effects.registry import effect_in_role
from postproc.effects.roles import Role
from postproc.model.arm import Model
from postproc.model.chain import deflected_chain
from postproc.robot.catalogue import load_robot
from postproc.robot.controller import Calibration

PARTS = ("geometry", "gravity", "force", "tool", "inertia")
"""Constant errors of the arm; its deflection under its own weight, process force, tool and grip load, acceleration."""
_LOADS = ("gravity", "force", "tool", "inertia")
LOADS_OF_PART = {
    "force": ("wrench",),
    "tool": ("payload_mass", "payload_center"),
    "inertia": ("v", "a", "base_spin", "base_spin_rate"),
}
"""Fields of a state by the part of a controller that corrects what they do."""
_PROBE = np.array([[0.3, -0.4, 0.5, 0.6, 0.7, -0.8], [-0.9, 0.2, -0.3, -0.5, 1.1, 0.4]])
FAR_FACTOR = 10.0
"""A compliance farther from what is usual for the joint than by this factor is in another unit, or of another joint."""
SOFTEST = 1e-3  # [rad/(N m)], where nobody says what is usual
STIFFNESS = "joints.stiffness_Nm_per_rad"
UNREAD = "absolute_accuracy.unread"


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
    controller = replace(model, robot=robot, effects=tuple(kept), already=(), surest=None)
    return replace(model, controller=controller, already=parts)


def known_state(parts: Sequence[str], state: State) -> State:
    """Return the states with those loads only that the controller knows.

    ``force`` in ``parts`` keeps the wrench, ``tool`` the payload, ``inertia`` speeds and accelerations; else None.
    """
    return state.with_(**{name: None for part in LOADS_OF_PART if part not in parts for name in LOADS_OF_PART[part]})


def unknown_loads(model: Model, state: State) -> tuple[Model, State]:
    """Return model and states without the loads whose deflection the controller corrects already (``model.already``).

    Payload and wrench become None in the states, link masses zero in the model, and so do the links' moments of inertia
    where the controller corrects both gravity and inertia.
    """
    corrected = {"force", "tool"}.intersection(model.already)
    if "gravity" in model.already:
        inertia = model.robot.inertia * float("inertia" not in model.already)
        model = replace(model, robot=replace(model.robot, mass=0.0 * model.robot.mass, inertia=inertia))
    return model, state.with_(**{name: None for part in corrected for name in LOADS_OF_PART[part]})


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


def controller_model(robot_name: str, calibration: Calibration | None) -> Model:
    """Return the arm with the joint compliances of its Absolute Accuracy calibration; other joints take the library's.

    ``robot.sources`` says where each number comes from and which entries are not used.

    Raises:
        PostprocError: KIN018, there is no calibration, or a value in it is no compliance; those of `load_robot`.
    """
    robot = load_robot(robot_name)
    if calibration is None:
        text = "the controller's configuration has no joint compliances (`Compl` of JOINT_CALIB)"
        help_ = "only a backup of an arm with Absolute Accuracy has them: name a program in it, or `--cell BACKUP`"
        raise PostprocError.of("KIN018", text, help=help_, exit_code=1)
    usual = robot.joint_compliance
    compliance = np.zeros(6) if usual is None else usual.copy()
    for joint, value in calibration.compliance.items():
        least, most = (0.0, SOFTEST) if usual is None else (usual[joint] / FAR_FACTOR, usual[joint] * FAR_FACTOR)
        if not least < value < most:
            text = f"`Compl {value:g}` of `{calibration.entries[joint]}` in JOINT_CALIB is no compliance in rad/(N m)"
            help_ = f"it would have to be between {least:.1g} and {most:.1g}: give a fitted model with -m"
            raise PostprocError.of("KIN018", text, help=help_, exit_code=1)
        compliance[joint] = value
    sources = {**robot.sources, STIFFNESS: _source(calibration, usual is not None)}
    sources[UNREAD] = ", ".join(calibration.unread)
    kind = "controller"
    robot = replace(robot, joint_compliance=compliance, stiffness_source=kind, stiffness_factor=None, sources=sources)
    springs = effect_in_role(Role.JOINT_SPRINGS).null().with_vector(compliance)
    return Model(robot, (springs,), robot_name=robot_name, stiffness_source=kind)


def _source(calibration: Calibration, library: bool) -> str:
    """Say in one sentence where the compliance of each joint comes from.

    Args:
        library: the library knows compliances for the joints without an entry; else these are rigid.
    """
    read = ", ".join(f"joint {j + 1} (`{entry}`)" for j, entry in sorted(calibration.entries.items()))
    others = " and ".join(str(j + 1) for j in range(6) if j not in calibration.entries)
    origin = "as the library has it" if library else "rigid, for nobody says"
    return f"JOINT_CALIB in the controller's MOC.cfg: {read}" + (f"; joint {others}: {origin}" if others else "")
