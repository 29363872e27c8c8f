"""Elastic equilibrium: loads deflect the arm, and the deflected arm carries other loads."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from postproc.arrays import Array, blocks
from postproc.channels.state import State
from postproc.diagnostics import PostprocError
from postproc.effects.asking import displacement_of
from postproc.effects.base import Effect
from postproc.model.arm import ALL_BODIES, Model
from postproc.model.chain import Chain, deflected_chain
from postproc.model.deflection import REACH, Deflection, deflect, distance, moved_by, moves, tcp
from postproc.model.loads import loaded_state
from postproc.model.ordered import with_ordered_channels
from postproc.robot.pose import between, displace

SETTLED = 1e-10  # [m]; rotations count at the arm's reach
FORETOLD = 1e4  # times what counts as settled: a sweep that moves no more tells what the next one would move
EQUILIBRIUM_SWEEPS = 120
EVEN = 8
WIDER = 1.2
"""From the eighth sweep on, what turns back goes half as far as it came, what does not by so much farther."""


@dataclass(frozen=True, slots=True)
class Equilibrium:
    """Where the real arm comes to rest.

    Args:
        state: the states with poses and loads filled in, as the effects saw them last.
        deflection: displacement of every coordinate. chain: geometry of the deflected arm.
        T_base_tcp: (n, 4, 4) real TCP.
        bodies: those whose far ends are moved or whose loads are read; loads of the others are NaN.
    """

    state: State
    deflection: Deflection
    chain: Chain
    T_base_tcp: Array
    bodies: tuple[int, ...] = ()

    @property
    def T_reference_tcp(self) -> Array:
        """(n, 4, 4) real TCP in the frame of measured points (base, world or work), without the instrument's place."""
        reference = self.state.T_reference_base
        return self.T_base_tcp if reference is None else reference @ self.T_base_tcp

    @property
    def T_instrument_tcp(self) -> Array:
        """(n, 4, 4) real TCP as the instrument sees it."""
        instrument = self.deflection.instrument
        T = self.T_reference_tcp
        return T if instrument is None else np.asarray(displace(instrument) @ T)

    @property
    def R_instrument_reference(self) -> Array:
        """(n, 3, 3) axes of the frame of `T_reference_tcp` as the instrument sees them."""
        moved = np.zeros(6) if self.deflection.instrument is None else self.deflection.instrument
        return np.asarray(np.broadcast_to(displace(moved)[..., :3, :3], (len(self.T_base_tcp), 3, 3)))

    @property
    def R_instrument_base(self) -> Array:
        """(n, 3, 3) axes of the base as the instrument sees them."""
        reference = self.state.T_reference_base
        return self.R_instrument_reference if reference is None else self.R_instrument_reference @ reference[:, :3, :3]


def equilibrium(model: Model, state: State, also: tuple[int, ...] = (), settled: float = SETTLED) -> Equilibrium:
    """Compute where the arm comes to rest: deflection xi = C load(q, xi), by fixed-point sweeps.

    A sweep contracts the error by about 1e-3. Where an effect is steep or jumps at a load, sweeps alternate between
    both sides; the arm then rests at the load where it jumps (Filippov 1988). From the eighth sweep on, steps that turn
    back are halved, which finds it.

    Args:
        also: numbers of bodies whose loads are wanted beside those that the effects move or read.
        settled: [m] movement of the TCP in a sweep below which the search ends.

    Raises:
        PostprocError: MOD010, the arm is so soft that its loads do not settle.
    """
    state = model.with_arm(state)
    if not len(state):
        poses, load = np.zeros((0, 7, 4, 4)), np.zeros((0, 6))
        state = state.with_(T_base_body=poses, joint_load=load, body_load=np.zeros((0, 7, 6)))
        return _settled(model, state, Deflection(np.zeros((0, 6)), {}, None, None), ())
    loaded = carries_load(model)
    bodies = tuple(sorted({*(active_bodies(model, state) if loaded else ()), *also}))
    deflection = Deflection(np.zeros((len(state), 6)), {}, None, None)
    yielding = [e for e in model.effects if _follows_arm(e)]
    rigid = deflect((e for e in model.effects if not _follows_arm(e)), state)
    last, reach, before = np.inf, np.full(1, np.inf), np.zeros(1)
    for sweep in range(1, EQUILIBRIUM_SWEEPS + 1):
        seen = loaded_state(model, state, deflection, bodies) if loaded else state
        new = deflect(yielding, seen, rigid)
        if sweep >= EVEN:
            move = moves(new, deflection)
            reach = np.where(move * before < 0, 0.5 * np.abs(before), WIDER * reach)
            before = np.clip(move, -reach, reach)
            new = moved_by(deflection, new, before)
        change = distance(new, deflection)
        deflection = new
        worst = float(change.max())
        # Sweeps contract evenly, so the next change is foretold and need not be computed.
        if not loaded or worst < settled or (worst < FORETOLD * settled and worst * (worst / last) < 0.1 * settled):
            return _settled(model, seen, deflection, bodies)
        if not np.isfinite(worst) or worst > 10.0 * REACH:
            break
        last = worst
    raise unsettled(int(np.argmax(np.where(np.isfinite(change), change, np.inf))))


def unsettled(index: int) -> PostprocError:
    """Return the error MOD010: at the pose with this index the deflection grows from sweep to sweep."""
    help_ = "a compliance is too large for the loads: check its unit (rad/(N m)), payload [kg] and force [N]"
    return PostprocError.of("MOD010", f"the deflection of pose {index} does not settle", help=help_, exit_code=1)


def _settled(model: Model, state: State, deflection: Deflection, bodies: tuple[int, ...]) -> Equilibrium:
    """Return the `Equilibrium` at a converged deflection; the states hold its loads, computed for ``bodies``."""
    every = tuple(sorted({*bodies, *deflection.body}))
    chain = deflected_chain(model.robot, state.q + deflection.joint, deflection.body, bool(deflection.body))
    return Equilibrium(state, deflection, chain, tcp(chain, state, deflection), every)


def predict(model: Model, state: State, settled: float = SETTLED) -> Array:
    """Return the real TCP poses T_instrument_tcp (n, 4, 4) of states in their order; arguments of `equilibrium`.

    What holds near measured rows alone counts by what these tell at each state (`Field.known`).
    """
    if model.surest is not None and model.measured is not None:
        near, far = predict(model.with_effects(*model.effects), state, settled), predict(model.surest, state, settled)
        return between(far, near, model.measured.known(state))
    result, state = np.empty((len(state), 4, 4)), with_ordered_channels(model, state)
    for rows in blocks(len(state)):
        result[rows] = equilibrium(model, state.rows(rows), settled=settled).T_instrument_tcp
    return result


def carries_load(model: Model) -> bool:
    """Tell whether any effect reads loads or the pose of the deflected arm."""
    return any(_follows_arm(e) for e in model.effects)


def _follows_arm(effect: Effect) -> bool:
    """Tell whether an effect reads loads or the pose of the deflected arm."""
    return not {"load", "pose"}.isdisjoint(effect.reads)


def active_bodies(model: Model, state: State) -> tuple[int, ...]:
    """Return the numbers of the bodies whose far ends an effect moves or whose load it reads, ascending.

    Effects are evaluated at one state with NaN as the load of one body after another: NaN in the result shows that it
    is read. A comparison hides NaN, so an effect that reads loads and returns none counts as reading those of all
    bodies.
    """
    requests: list[str] = []

    class Listening(State):
        def __getattribute__(self, name: str) -> Any:
            if name == "body_load":
                requests.append(name)
            return super().__getattribute__(name)

    probe = state.rows(np.zeros(8, dtype=int))
    body_load = np.zeros((8, 7, 6))
    body_load[ALL_BODIES, ALL_BODIES] = np.nan
    chain = deflected_chain(model.robot, probe.q, {}, False)
    poses, load = chain.T_base_body, np.zeros((8, 6))
    probe = probe.with_(robot=model.robot, T_base_body=poses, joint_load=load, body_load=body_load)
    bodies: set[int] = set()
    listening = Listening(**{f.name: getattr(probe, f.name) for f in fields(probe)})
    for effect in model.effects:
        requests.clear()
        share = displacement_of(effect, listening)
        parts = [share.joint, share.tool, share.instrument, *share.body.values()]
        read = np.array([np.isnan(p).any(axis=1) for p in parts if p is not None and p.ndim == 2]).reshape(-1, 8)
        shown = {b for b in ALL_BODIES if read[:, b].any()}
        bodies |= {*share.body, *(shown or (ALL_BODIES if requests else ()))}
    return tuple(sorted(bodies))
