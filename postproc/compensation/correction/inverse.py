"""The inverse of the model: what to command so that the real arm goes where it should."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from postproc.arrays import Array, blocks, full_turns, invert
from postproc.channels.state import State
from postproc.model.arm import Model
from postproc.model.chain import deflected_chain
from postproc.model.controller import known_state
from postproc.model.deflection import REACH, Deflection, deflect, distance, tcp
from postproc.model.equilibrium import active_bodies, carries_load, predict, unsettled
from postproc.model.loads import loaded_state
from postproc.robot.closed_form import inverse
from postproc.robot.kinematics import forward, jacobian
from postproc.robot.pose import pose_error

INVERSE_SWEEPS = 30
# Start joints farther from the pose [m, rad] than this are replaced by the nearest closed-form solution.
REACHED_WITHIN = 5e-6
SAME_ARM = 1e-6  # axes 1 to 3 that differ by less [rad] are one shoulder and elbow
INVERSE_DAMPING = 1e-3  # of the Jacobian's singular values [m or rad per rad]
INVERSE_TOLERANCE_M = 1e-9  # largest residual
PATIENCE = 6  # sweeps of Newton steps before the closed form takes over for the poses that are left
BETWEEN_STEPS = 2  # Newton steps from between two models; one leaves about 1e-6 m
PROVED_M = 1e-7  # what a deflection may still move in the proof: a hundredth of the usual tolerance


@dataclass(frozen=True, slots=True)
class Commands:
    """Commands for n poses.

    Args:
        q: (n, 6) joint angles to command [rad], in the branch and turn of the start.
        T_base_tcp: (n, 4, 4) the nominal pose at these joint angles: what to write in the program.
        residual_m: (n,) how far the real arm then is from the desired pose [m] (rotations count at 1 m).
    """

    q: Array
    T_base_tcp: Array
    residual_m: Array


def command(model: Model, state: State, T_base_tcp: Array) -> Commands:
    """Commanded joints and poses for which the real arm reaches the desired TCP poses.

    Seeks q with FK_real(q) = T: real joint angles theta follow from the desired pose by Newton steps on the deflected
    arm (none, if only joints deflect), then q = theta - dq(loads at theta). Both contract by about 1e-3 a sweep. The
    fixed point is that of Eqs. 24-25 of the source paper with the accumulated correction p_f <- p_f + (p - p_c).

    Args:
        state: n states along the program (approach, speed, wrench, payload, ..); ``q`` are the nominal joint angles of
            the desired poses, or near them: they choose branch and turns.
        T_base_tcp: (n, 4, 4) desired.

    Raises:
        PostprocError: MOD010, the deflection does not settle.
    """
    desired = np.asarray(T_base_tcp, dtype=float).reshape(-1, 4, 4)
    if model.controller is not None:
        # The joint angles come from the whole model; the pose to write is the one that the controller assigns to them.
        solution = command(_real_arm(model), state, desired)
        T_commanded = controller_pose(model, state.with_(q=solution.q))
        nominal = command(rigid(model), state.with_(q=solution.q), T_commanded)
        return Commands(nominal.q, T_commanded, np.maximum(solution.residual_m, nominal.residual_m))
    state = model.with_arm(state)
    if model.surest is not None and model.measured is not None:
        return _between(model, state, desired)
    # Work on batches that stay in the processor's cache: twice as fast as 20,000 poses at once.
    done = [_command(model, state.rows(b), desired[b]) for b in blocks(max(len(state), 1))]
    q, residual = np.concatenate([d[0] for d in done]), np.concatenate([d[1] for d in done])
    return Commands(q, forward(model.robot, q) @ state.T_flange_tcp, residual)


def _between(model: Model, state: State, desired: Array) -> Commands:
    """Return the commands of a model of which a part holds near the measured rows alone; arguments as in `command`.

    They begin between those with and without that part, and go on by Newton steps on the model itself.
    """
    near, far = (command(m, state, desired).q for m in (replace(model, surest=None), model.surest or model))
    known = np.ones(len(state)) if model.measured is None else model.measured.known(state)
    q = far + known[:, None] * (near - far)
    for _ in range(BETWEEN_STEPS):
        error = pose_error(predict(model, state.with_(q=q), PROVED_M), desired)
        q = q + np.einsum("nij,nj->ni", _newton(model, state.with_(q=q)), error)
    error = pose_error(predict(model, state.with_(q=q), PROVED_M), desired)
    return Commands(q, forward(model.robot, q) @ state.T_flange_tcp, np.abs(error).max(axis=1, initial=0.0))


def _newton(model: Model, state: State) -> Array:
    """Return damped inverses J^T (J J^T + lambda^2)^-1 (n, 6, 6) of the nominal Jacobian, finite at singular poses."""
    J = jacobian(model.robot, state.q, state.T_flange_tcp)
    Jt = np.swapaxes(J, 1, 2)
    return np.asarray(Jt @ np.linalg.inv(J @ Jt + INVERSE_DAMPING**2 * np.eye(6)))


def reached(model: Model, state: State) -> Array:
    """T_base_tcp (n, 4, 4) that the real arm reaches when a program states the nominal poses of ``state.q``.

    A controller that corrects by itself then commands other joint angles, which follow from its own model.
    """
    if model.controller is None:
        return predict(model, state, PROVED_M)
    T_base_tcp = forward(model.robot, state.q) @ state.T_flange_tcp
    q = command(model.controller, known_state(model.already, state), T_base_tcp).q
    return predict(_real_arm(model), state.with_(q=q), PROVED_M)


def controller_pose(model: Model, state: State) -> Array:
    """T_base_tcp (n, 4, 4) where the controller assumes the TCP at joint angles ``state.q``.

    It is the nominal pose, or that of the controller's own model if it corrects by itself.
    """
    if model.controller is None:
        return forward(model.robot, state.q) @ state.T_flange_tcp
    return predict(model.controller, known_state(model.already, state))


def rigid(model: Model) -> Model:
    """The model without effects and without correction by the controller: nominal kinematics alone."""
    return _real_arm(model).with_effects()


def _real_arm(model: Model) -> Model:
    """The model with all its effects and without correction by the controller: the real arm."""
    return replace(model, controller=None, already=())


def _command(model: Model, state: State, desired: Array) -> tuple[Array, Array]:
    """Commanded joints (n, 6) [rad] and residuals (n,) [m] for one batch of desired poses (n, 4, 4)."""
    q, residual = _sweeps(model, state, desired, PATIENCE)
    slow = np.flatnonzero(residual > INVERSE_TOLERANCE_M)
    if len(slow):
        q[slow], residual[slow] = _sweeps(model, state.rows(slow), desired[slow], INVERSE_SWEEPS)
    return q, residual


def _sweeps(model: Model, state: State, desired: Array, most: int) -> tuple[Array, Array]:
    """Commanded joints (n, 6) and residuals (n,) [m] after at most ``most`` fixed-point sweeps.

    Raises:
        PostprocError: the deflection diverges.
    """
    theta = _start(model, state, desired)
    deflection = Deflection(np.zeros((len(state), 6)), {}, None, None)
    loaded = carries_load(model)
    bodies = active_bodies(model, state) if loaded and len(state) else ()
    # Where only joints deflect, by loads alone, the real joint angles fix the loads and the first sweep is exact.
    coupled = bool(bodies) or any("q" in e.reads for e in model.effects)
    residual, last = np.zeros(len(state)), np.inf
    newton: Array | None = None
    for sweep in range(1, most + 1):
        seen = state.with_(q=theta - deflection.joint)
        if loaded:
            seen = loaded_state(model, seen, deflection, bodies)
        new = deflect(model.effects, seen)
        moved = distance(new, deflection)
        deflection = new
        T_reached = tcp(deflected_chain(model.robot, theta, deflection.body, False), state, deflection)
        error = pose_error(T_reached, desired)
        # Sweeps contract evenly: what the next one would still move is foretold by the last two, never by the first.
        worst = float(moved.max(initial=0.0))
        shrinks = min(1.0, worst / last) if sweep > 1 and last > 0.0 else 1.0
        still = moved * shrinks if coupled or deflection.body else np.zeros(len(state))
        residual, last = np.maximum(still, np.abs(error).max(axis=1)), worst
        if not np.isfinite(still).all() or worst > 10.0 * REACH:
            raise unsettled(int(np.argmax(~(moved <= REACH))))
        if residual.max(initial=0.0) <= INVERSE_TOLERANCE_M or sweep == most:
            break
        if sweep >= PATIENCE and model.robot.opw is not None:
            # One step p_f <- p_f + (p - p_c) (source paper, Eq. 25 accumulated) in closed form: it needs no Jacobian,
            # so it also converges near singular poses. In the flange's axes the correction needs no base frame:
            # T_f <- T_f (T_c^-1 T) with the tool taken off.
            tool = state.T_flange_tcp
            T_flange = forward(model.robot, theta) @ tool @ invert(T_reached) @ desired @ invert(tool)
            theta = _nearest(model, T_flange, theta)
        else:
            if newton is None:
                newton = _newton(model, state.with_(q=theta))
            theta = theta + np.einsum("nij,nj->ni", newton, error)
    return theta - deflection.joint, residual


def _start(model: Model, state: State, desired: Array) -> Array:
    """Nominal joint angles (n, 6) of the desired poses (n, 4, 4), in the branch and turn of ``state.q``."""
    robot, q = model.robot, np.array(state.q, dtype=float)
    error = pose_error(forward(robot, q) @ state.T_flange_tcp, desired)
    away = np.abs(error).max(axis=1, initial=0.0) > REACHED_WITHIN
    if robot.opw is not None and away.any():
        tool = state.T_flange_tcp if state.T_flange_tcp.ndim == 2 else state.T_flange_tcp[away]
        q[away] = _nearest(model, desired[away] @ invert(tool), q[away])
    return q


def _nearest(model: Model, T_base_flange: Array, q: Array) -> Array:
    """Closed-form solution (n, 6) nearest to joint angles q (n, 6), whole turns included; q itself if there is none.

    The nearest shoulder and elbow come first: near a straight wrist axes 4 and 6 turn far while the arm hardly moves.
    """
    solutions = inverse(model.robot, T_base_flange)
    solutions = solutions + full_turns(solutions, near=q[:, None])
    away = np.abs(solutions - q[:, None])
    arm = away[..., :3].max(axis=-1)
    nearest_arm = arm <= np.nanmin(np.append(arm, np.full((len(arm), 1), np.inf), axis=1), axis=1)[:, None] + SAME_ARM
    far = np.where(nearest_arm, away.max(axis=-1), np.inf)
    best = np.argmin(far, axis=1)
    nearest = solutions[np.arange(len(q)), best]
    return np.where(np.isnan(nearest), q, nearest)
