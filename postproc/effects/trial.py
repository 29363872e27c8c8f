"""Everything that an effect gives at some states as one array, refusing what has the wrong shape."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from dataclasses import fields
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array
from postproc.diagnostics import Diagnostic, PostprocError
from postproc.effects.base import Displacement, Effect, Load, State, displacement_of, load_of
from postproc.effects.findings import describe, finding, line_of

T = TypeVar("T")
Rows = NDArray[np.int_]


class Failure(Exception):
    def __init__(self, diagnostic: Diagnostic) -> None:
        super().__init__(diagnostic.message)
        self.diagnostic = diagnostic


def sensitivity(effect: Effect, state: State, freed: Rows) -> Array:
    """(rows, k) change of everything the effect gives, per typical size of each freed parameter."""
    exact = effect.basis(state)
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
    """(n, 108) everything an effect gives: displacement of joints, bodies, tool, instrument; load on joints, bodies."""
    return np.concatenate([displaced(effect, state), _loaded(effect, state)], axis=1)


def displaced(effect: Effect, state: State) -> Array:
    given: Displacement = _call(effect, "displacement", lambda: displacement_of(effect, state))
    return _blocks(effect, "displacement", state, (given.joint, given.body, given.tool, given.instrument))


def _loaded(effect: Effect, state: State) -> Array:
    given: Load = _call(effect, "load", lambda: load_of(effect, state))
    return _blocks(effect, "load", state, (given.joint, given.body))


def _call(effect: Effect, member: str, ask: Callable[[], T]) -> T:
    try:
        with np.errstate(all="ignore"):  # What is not finite is found in the result.
            return ask()
    except PostprocError:
        raise
    except (Exception, SystemExit) as error:
        raise Failure(raised(type(effect), error, member)) from error


def _blocks(effect: Effect, member: str, state: State, parts: tuple[object, ...]) -> Array:
    """Everything given as (n, 6 k), refusing what is not (n, 6), not finite, or on a body that is not there."""
    n, result = len(state), []
    for part in parts:
        if isinstance(part, Mapping):
            if not set(part) <= set(range(7)):
                raise Failure(_shape(effect, member, f"names body {max(part)}", "bodies are numbered 0 to 6"))
            result += [_block(effect, member, n, part.get(b)) for b in range(7)]
        else:
            result.append(_block(effect, member, n, part))
    return np.concatenate(result, axis=1)


def _block(effect: Effect, member: str, n: int, part: object) -> Array:
    if part is None:
        return np.zeros((n, 6))
    array = np.asarray(part)
    if array.shape not in ((n, 6), (6,)):
        text = f"gives shape {array.shape} for {n} states"
        raise Failure(_shape(effect, member, text, "give (n, 6): one row a state, six numbers a row"))
    if array.dtype.kind not in "fi" or not np.all(np.isfinite(array)):
        raise Failure(_shape(effect, member, "gives numbers that are not finite", "look for a division by zero"))
    return np.broadcast_to(array.astype(float), (n, 6))


def _shape(effect: Effect, member: str, what: str, help: str) -> Diagnostic:
    cls = type(effect)
    return finding("EFF003", f"`{member}` of `{cls.key}` {what}", cls, member=member, help=help)


def raised(cls: type[Effect], error: BaseException, member: str = "") -> Diagnostic:
    line = line_of(error, inspect.getsourcefile(cls) or "")
    if isinstance(error, ValueError) and "read-only" in str(error):
        help = "work on a copy: q = state.q.copy()"
        return finding("EFF010", f"`{cls.key}` writes into the state", cls, line=line, help=help)
    help = ""
    if isinstance(error, KeyError):
        help = f'name the column that it uses: class {cls.__name__}(Effect, reads=("q", {str(error.args[0])!r}))'
    elif "NoneType" in str(error):
        help = f'name every channel that it uses: class {cls.__name__}(Effect, reads=("q", "temperature"))'
    elif isinstance(error, AttributeError) and isinstance(error.obj, State):
        help = f"a state has {', '.join(f.name for f in fields(State))}"
    what = f"`{member}` of `{cls.key}`" if member else f"`{cls.key}`"
    return finding("EFF005", f"{what} fails: {describe(error)}", cls, line=line, help=help)


def locked(state: State) -> State:
    for value in [*(getattr(state, f.name) for f in fields(state)), *state.channels.values()]:
        if isinstance(value, np.ndarray):
            value.setflags(write=False)
    return state
