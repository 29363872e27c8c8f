"""Errors that an effect raises when it is asked, as diagnostics with what to do about them."""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterator
from dataclasses import FrozenInstanceError, fields

import numpy as np

from postproc.channels.state import FIELDS
from postproc.diagnostics import Diagnostic, did_you_mean
from postproc.effects.base import Effect, State
from postproc.effects.conformance.declaration import columns_read
from postproc.effects.findings import describe, finding, line_of


class EffectFailure(Exception):
    """Raised where an effect cannot be used; its diagnostic says why."""

    def __init__(self, diagnostic: Diagnostic) -> None:
        """Keep the diagnostic that says why."""
        super().__init__(diagnostic.message)
        self.diagnostic = diagnostic


def raised(cls: type[Effect], error: BaseException, member: str = "") -> Diagnostic:
    """Return the diagnostic of an exception in an effect: EFF010 if it wrote into the state, else EFF005.

    Args:
        member: name of the method that was called.
    """
    line = line_of(error, inspect.getsourcefile(cls) or "")
    if isinstance(error, ValueError) and "read-only" in str(error):
        help_ = "work on a copy: q = state.q.copy()"
        return finding("EFF010", f"`{cls.key}` writes into the state", cls, line=line, help=help_)
    what = f"`{member}` of `{cls.key}`" if member else f"`{cls.key}`"
    return finding("EFF005", f"{what} fails: {describe(error)}", cls, line=line, help=next(_helps(cls, error)))


def _helps(cls: type[Effect], error: BaseException) -> Iterator[str]:
    """Yield texts on what may help against an exception in an effect, the most likely first; at least one."""
    text = str(error)
    if isinstance(error, KeyError) and error.args:
        yield f'name the column that it uses: class {cls.__name__}(Effect, reads=("q", {str(error.args[0])!r}))'
    if "NoneType" in text:
        code = inspect.getsource(cls)
        used = [f.name for f in fields(State) if f.name != "q" and re.search(rf"\bstate\.{f.name}\b", code)]
        told = dict.fromkeys(CHANNEL_OF.get(name, name) for name in used or ["temperature"])
        reads = ", ".join(f'"{name}"' for name in ("q", *told))
        yield f"name every channel that it uses: class {cls.__name__}(Effect, reads=({reads}))"
    if isinstance(error, FrozenInstanceError):
        yield "an effect is a value: declare what a fit may move with `param`, and keep everything else in the method"
    if isinstance(error, AttributeError):
        owner = type(error.obj)
        known = [*cls.structures(), *cls.parameters()] if owner is cls else [f.name for f in fields(State)]
        meant = did_you_mean(error.name or "", known)
        if owner is State and error.name in columns_read(cls):
            yield " ".join(filter(None, (meant, f'a column of the table is `state.channels["{error.name}"]`')))
        if owner in (cls, State):
            has = f"{'a state' if owner is State else f'`{cls.key}`'} has {', '.join(known) or 'no parameters'}"
            yield meant or has
    yield from (help_ for kind, words, help_ in FAILURE_HELPS if isinstance(error, kind) and words in text)
    yield (
        "it is asked for many states at once: `from postproc.effects.example import example_state` gives the 240 on "
        "which it was tried"
    )


CHANNEL_OF = {"body_load": "load", **{field: channel for channel, field in FIELDS.items()}}
"""How an effect declares a field of the state that has another name."""
FAILURE_HELPS: tuple[tuple[type[BaseException], str, str], ...] = (
    (NameError, "", "define it above the class, import it, or declare it with `param`"),
    (ImportError, "", "install that package beside postproc, or do without it"),
    (IndexError, "", "counting starts at 0: joints are 0 to 5, bodies 0 to 6"),
    (ValueError, "truth value", "write one value for each state: np.where(state.q[:, 1] > 0.4, a, b)"),
    (ValueError, "broadcast", "state.q is (n, 6); one joint of it, state.q[:, 1], is (n,), n = len(state)"),
    (ValueError, "inhomogeneous", "give one array (n, 6) of joint angles, or a Displacement"),
    (ValueError, "shapes", "state.q is (n, 6); one joint of it, state.q[:, 1], is (n,)"),
    (TypeError, "Python scalar", "use numpy's function for all states at once: np.sin(x), not math.sin(x)"),
    (TypeError, "float() argument", "give one array (n, 6) of joint angles, or a Displacement"),
    (AttributeError, "'items'", "name the parts: Displacement(joint=.., body={3: ..}, tool=.., instrument=..)"),
    (TypeError, "positional argument", "write it as `def displacement(self, state)`, `def load(self, state)`"),
    (TypeError, "keyword argument", "Displacement has joint, body, tool and instrument; Load has joint and body"),
    (np.exceptions.ComplexWarning, "", "angles and lengths are real numbers: is it the root of a negative one?"),
    (ZeroDivisionError, "", "keep clear of zero: np.where(x == 0, 0, a / np.where(x == 0, 1, x))"),
    (RecursionError, "", "it calls itself"),
)
"""Kind of error, words in it, and what helps."""
