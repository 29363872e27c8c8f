"""What all effects move together: joints, ends of bodies, the tool, the base as the instrument sees it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from postproc.arrays import Array
from postproc.channels.state import State
from postproc.effects.asking import displacement_of
from postproc.effects.base import Effect
from postproc.model.chain import Chain
from postproc.robot.pose import displace

REACH = 3.0  # [m] at which a rotation of a joint or a body counts


@dataclass(frozen=True, slots=True)
class Deflection:
    """What all effects move together at n states.

    Args:
        joint: (n, 6) joint angles [rad].
        body: by number of the body, (n, 6) displacement of its far end, translation [m] and rotation [rad], body axes.
        tool: (n, 6) or (6,) displacement at the TCP in tool axes; None for none.
        instrument: (n, 6) or (6,) displacement of the base as the instrument sees it; None for none.
    """

    joint: Array
    body: Mapping[int, Array]
    tool: Array | None
    instrument: Array | None


def deflect(effects: Iterable[Effect], state: State, first: Deflection | None = None) -> Deflection:
    """Add up the displacements that effects cause at the states.

    Args:
        first: displacements that are added to theirs.
    """
    n = len(state)
    joint, body = (np.zeros((n, 6)), dict[int, Array]()) if first is None else (first.joint, dict(first.body))
    tool, instrument = (None, None) if first is None else (first.tool, first.instrument)
    for effect in effects:
        share = displacement_of(effect, state)
        if share.joint is not None:
            joint = joint + share.joint
        for b, xi in share.body.items():
            moved = np.broadcast_to(xi, (n, 6))
            body[b] = body[b] + moved if b in body else moved
        tool = _plus(tool, share.tool)
        instrument = _plus(instrument, share.instrument)
    return Deflection(joint, body, tool, instrument)


def _plus(total: Array | None, share: Array | None) -> Array | None:
    """Add a displacement to a total, where None is zero."""
    return share if total is None else total if share is None else total + share


def distance(new: Deflection, old: Deflection) -> Array:
    """Return an upper bound (n,) [m] of how far the TCP moves from deflection ``old`` to ``new``.

    Displacements of tool and instrument are not counted; rotations count at a lever of `REACH`.
    """
    total = np.abs(new.joint - old.joint).max(axis=1) * REACH
    for b, xi in new.body.items():
        step = np.abs(xi - old.body[b]) if b in old.body else np.abs(xi)
        total = np.maximum(total, np.maximum(step[:, :3].max(axis=1), REACH * step[:, 3:].max(axis=1)))
    return total


def moves(new: Deflection, old: Deflection) -> Array:
    """Return ``new`` minus ``old`` as an array (n, k): six columns of the joints, then six for each body of ``new``."""
    return np.hstack([new.joint - old.joint, *(xi - old.body.get(b, 0.0) for b, xi in new.body.items())])


def moved_by(old: Deflection, new: Deflection, part: Array) -> Deflection:
    """Return ``old`` plus a step (n, k) in the columns of `moves`, with the bodies, tool and instrument of ``new``."""
    body = {b: old.body.get(b, 0.0) + part[:, 6 * k + 6 : 6 * k + 12] for k, b in enumerate(new.body)}
    return Deflection(old.joint + part[:, :6], body, new.tool, new.instrument)


def tcp(chain: Chain, state: State, deflection: Deflection) -> Array:
    """Return the real TCP in the base frame, (n, 4, 4): flange times nominal tool times tool displacement."""
    T: Array = chain.T_base_flange @ state.T_flange_tcp
    return T if deflection.tool is None else T @ displace(deflection.tool)
