"""Everything that an effect gives at some states as one array, refusing what has the wrong shape."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from dataclasses import fields
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array
from postproc.diagnostics import Diagnostic, PostprocError
from postproc.effects.asking import displacement_of, load_of
from postproc.effects.base import Displacement, Effect, Load, State
from postproc.effects.conformance.failures import EffectFailure, raised
from postproc.effects.findings import finding

T = TypeVar("T")
Rows = NDArray[np.int_]


def sensitivity(effect: Effect, state: State, freed: Rows) -> Array:
    """Return (rows, k) the change of all outputs at all states per typical size of each of k parameters.

    Where the effect has a `basis` a row is a state, and a column the angle of the joint that its parameter moves.

    Args:
        freed: (k,) indices of the parameters in the effect's vector.
    """
    exact = effect.joint_basis(state)
    if exact is not None:
        return np.asarray(exact.values[:, freed] * effect.scale()[freed])
    x, step = effect.vector(), 1e-4 * effect.scale()
    columns = []
    for i in freed:
        up, down = x.copy(), x.copy()
        up[i], down[i] = x[i] + step[i], x[i] - step[i]
        columns.append(contribution(effect.with_vector(up), state) - contribution(effect.with_vector(down), state))
    return np.stack([c.ravel() for c in columns], axis=1) / 2e-4


def contribution(effect: Effect, state: State) -> Array:
    """Return all outputs (n, 108): displacement of joints, bodies, tool, instrument; load on joints, bodies."""
    return np.concatenate([displaced(effect, state), _loaded(effect, state)], axis=1)


def displaced(effect: Effect, state: State) -> Array:
    """Return the displacement (n, 60): joints (6), bodies 0 to 6 (42), tool, instrument; EFF003 for a wrong shape."""
    given = _call(effect, "displacement", lambda: displacement_of(effect, state), Displacement)
    return _blocks(effect, "displacement", state, (given.joint, given.body, given.tool, given.instrument))


def _loaded(effect: Effect, state: State) -> Array:
    """Return the load (n, 48) on joints (6) and bodies 0 to 6 (42); EFF003 for a wrong shape."""
    given = _call(effect, "load", lambda: load_of(effect, state), Load)
    return _blocks(effect, "load", state, (given.joint, given.body))


def _call(effect: Effect, member: str, ask: Callable[[], T], kind: type[T]) -> T:
    """Evaluate the method ``member`` by ``ask``; EffectFailure if it raises an exception or returns no ``kind``."""
    try:
        with np.errstate(all="ignore"), warnings.catch_warnings():  # What is not finite is found in the result.
            warnings.simplefilter("error", np.exceptions.ComplexWarning)
            given = ask()
    except PostprocError:
        raise
    except (Exception, SystemExit) as error:
        raise EffectFailure(raised(type(effect), error, member)) from error
    if not isinstance(given, kind):
        help = "give Load(joint=..), (n, 6) torques, or Load(body={3: ..})"
        raise EffectFailure(_shape(effect, member, f"gives {type(given).__name__}", help))
    return given


def _blocks(effect: Effect, member: str, state: State, parts: tuple[object, ...]) -> Array:
    """Return all parts of a result, arrays or mappings of such by body, side by side, (n, 6 k).

    Raises:
        EffectFailure: EFF003, a part is not (n, 6), not finite, or on an unknown body.
    """
    n, result = len(state), []
    for part in parts:
        if isinstance(part, Mapping):
            if not set(part) <= set(range(7)):
                odd = next(b for b in part if b not in range(7))
                raise EffectFailure(_shape(effect, member, f"names body {odd!r}", "bodies are the numbers 0 to 6"))
            result += [_block(effect, member, n, part.get(b)) for b in range(7)]
        else:
            result.append(_block(effect, member, n, part))
    return np.concatenate(result, axis=1)


def _block(effect: Effect, member: str, n: int, part: object) -> Array:
    """Return one part of a result as (n, 6), zero for None; EffectFailure for other shapes or not finite values."""
    if part is None:
        return np.zeros((n, 6))
    array = np.asarray(part)
    if array.shape not in ((n, 6), (6,)):
        text = f"gives shape {array.shape} for {n} states"
        raise EffectFailure(_shape(effect, member, text, "give (n, 6): one row a state, six numbers a row"))
    if array.dtype.kind not in "fi" or not np.all(np.isfinite(array)):
        help = "look for a division by zero, and for roots and logarithms of negative numbers"
        raise EffectFailure(_shape(effect, member, "gives numbers that are not finite", help))
    return np.broadcast_to(array.astype(float), (n, 6))


def _shape(effect: Effect, member: str, what: str, help: str) -> Diagnostic:
    """Return EFF003: ``member`` of the effect returns something of the wrong form, as the clause ``what`` says."""
    cls = type(effect)
    return finding("EFF003", f"`{member}` of `{cls.key}` {what}", cls, member=member, help=help)


def locked(state: State) -> State:
    """Make all arrays of a state read-only, and return it."""
    for value in [*(getattr(state, f.name) for f in fields(state)), *state.channels.values()]:
        if isinstance(value, np.ndarray):
            value.setflags(write=False)
    return state
