"""What the conformance kit finds in an effect: one table of codes, messages and helps, and what an exception means."""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterator, Mapping
from dataclasses import FrozenInstanceError, fields
from typing import Any

import numpy as np

from postproc.channels.state import COLUMNS, FIELDS
from postproc.diagnostics import Diagnostic, did_you_mean
from postproc.effects.base import FILLED_BY_MODEL, Effect, State
from postproc.effects.findings import describe, finding, line_of

# fmt: off
FINDINGS: Mapping[str, tuple[str, str, str]] = {
    "name taken": ("EFF016", "the parameter `{name}` of `{key}` has a name that is taken: every effect has a `{name}`",
        "call it otherwise, `{name}_of_` and what it belongs to"),
    "docstring": ("EFF006", "`{cls}` has no docstring", "say what it is, its equation, its source and its usual size"),
    "no unit": ("EFF002", "the parameter `{name}` of `{key}` has no unit",
        'write `{name}: ... = param(unit="rad", ...)`, or unit="1" for a pure number'),
    "foreign unit": ("EFF002", "the unit `{unit}` of `{name}` of `{key}` is not of the SI",
        "{hint}units are those of the SI and what they make, `rad/(N m)`: {si}; `1` for a pure number"),
    "no unit in name": ("EFF017", "the name `{name}` of `{key}` does not end in its unit, {unit}",
        "rename it to `{name}{suffix}`"),
    "no numbers": ("EFF016", "the bounds of `{name}` of `{key}` are no numbers", "write numbers in SI units"),
    "bounds": ("EFF016",
        "the bounds of `{name}` of `{key}` leave out its null value, or its typical size is not positive",
        "write low <= null <= high and typical > 0"),
    "typical": ("EFF016", "the typical size of `{name}` of `{key}` lies beyond its bounds",
        "say how large it usually is: typical=1e-4"),
    "reads": ("EFF016", "`{key}` reads `{name}`, which would be a column of the table that is called so",
        'a state has {known}; a column is named itself: reads=("rail_m",)'),
    "no parameters": ("EFF016", "`{key}` has no parameters", "declare what a fit may move with `param`"),
    "no method": ("EFF014", "`{key}` has neither `displacement` nor `load`", "{hint}"),
    "type": ("EFF003", "`{member}` of `{key}` gives {kind}",
        "give Load(joint=..), (n, 6) torques, or Load(body={{3: ..}})"),
    "body": ("EFF003", "`{member}` of `{key}` names body {body}", "bodies are the numbers 0 to 6"),
    "shape": ("EFF003", "`{member}` of `{key}` gives shape {shape} for {n} states",
        "give (n, 6): one row a state, six numbers a row"),
    "not finite": ("EFF003", "`{member}` of `{key}` gives numbers that are not finite",
        "look for a division by zero, and for roots and logarithms of negative numbers"),
    "nothing": ("EFF003", "`displacement` of `{key}` gives nothing", "is `return dq` missing at its end?"),
    "writes": ("EFF010", "`{key}` writes into the state", "work on a copy: q = state.q.copy()"),
    "fails": ("EFF005", "{method} fails: {error}", "{hint}"),
    "not null": ("EFF004", "`{key}` does not vanish at its null parameters: {largest:.3g} is left",
        "every term must be multiplied by an amplitude whose null value is 0"),
    "rows": ("EFF009", "a row of `{key}` depends on the other rows",
        "compute each row from its own channels: no means, sorting or differences between rows"),
    "basis": ("EFF012", "`joint_basis` and `displacement` of `{key}` disagree", ""),
    "not linear": ("EFF012", "`{key}` says it is linear in its amplitudes and is not",
        "declare it: class Name(Effect, linear=False), or mark forming parameters with amplitude=False"),
    "no change": ("EFF014", "{names} of `{key}` changes nothing on a rich set of poses",
        "remove the parameter, or check the channel, the index and the limit (rad, m) that it acts on"),
    "maybe no change": ("EFF014",
        "{names} of `{key}` changes nothing on a rich set of poses, with payloads of 5 to 60 kg and your own "
        "columns from -1e5 to 1e5",
        "leave a threshold, or what acts beyond these, as it is; else check the channel, the index and the limit"),
    "repeated": ("EFF014", "the {count} parameters of `{key}` ({form}) repeat each other",
        "leave out what the others can express"),
    "size": ("EFF018", "at its ordinary size `{key}` {does}; no single cause does so much",
        "give results in rad, m, N and N m; if they are, say a smaller `typical` of its parameters"),
}
"""By what is wrong: code, message and help; ``{key}`` is that of the effect, ``{cls}`` the name of its class."""
WARNINGS = ("EFF017", "EFF018")

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
    (BaseException, "", "it is asked for many states at once: "
        "`from postproc.effects.conformance.example import example_state` gives the 240 on which it was tried"),
)
"""Kind of error, words in it, and what helps."""
# fmt: on
COLUMN_CHANNELS = tuple(COLUMNS)
CHANNEL_OF = {"body_load": "load", **{field: channel for channel, field in FIELDS.items()}}
"""How an effect declares a field of the state that has another name."""


def report(
    what: str, cls: type[Effect], *, member: str = "", line: int = 0, warn: bool = False, **words: Any
) -> Diagnostic:
    """Return the finding of this row of the table, at the effect's class, a member of it, or a line of its file.

    Args:
        words: what the message and the help of the row ask for, beside ``key``, ``cls`` and ``member``.
    """
    code, message, help_ = FINDINGS[what]
    words = {"key": cls.key, "cls": cls.__name__, "member": member, **words}
    text, advice = message.format(**words), help_.format(**words)
    return finding(code, text, cls, member=member, line=line, help=advice, warn=warn or code in WARNINGS)


def raised(cls: type[Effect], error: BaseException, member: str = "") -> Diagnostic:
    """Return the diagnostic of an exception in an effect: EFF010 if it wrote into the state, else EFF005.

    Args:
        member: name of the method that was called.
    """
    line = line_of(error, inspect.getsourcefile(cls) or "")
    if isinstance(error, ValueError) and "read-only" in str(error):
        return report("writes", cls, line=line)
    method = f"`{member}` of `{cls.key}`" if member else f"`{cls.key}`"
    return report("fails", cls, line=line, method=method, error=describe(error), hint=next(_helps(cls, error)))


def columns_read(cls: type[Effect]) -> tuple[str, ...]:
    """Return the columns of the measurement table that an effect reads.

    They are its ``reads`` without the channels of a state, what the model fills in, and ``row``.
    """
    return tuple(n for n in cls.reads if n not in (*COLUMN_CHANNELS, *FILLED_BY_MODEL, "row"))


def _helps(cls: type[Effect], error: BaseException) -> Iterator[str]:
    """Yield texts on what may help against an exception in an effect, the most likely first; at least one."""
    text = str(error)
    if isinstance(error, KeyError) and error.args:
        yield f'name the column that it uses: class {cls.__name__}(Effect, reads=("q", {str(error.args[0])!r}))'
    if "NoneType" in text:
        code = inspect.getsource(cls)
        used = [f.name for f in fields(State) if f.name != "q" and re.search(rf"\bstate\.{f.name}\b", code)]
        channels = dict.fromkeys(CHANNEL_OF.get(name, name) for name in used or ["temperature"])
        reads = ", ".join(f'"{name}"' for name in ("q", *channels))
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
