"""What an effect declares, checked before it is asked for anything: docstring, units, bounds, channels, members."""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterator, Sequence

import numpy as np

from postproc.channels.state import COLUMNS
from postproc.diagnostics import Diagnostic, did_you_mean
from postproc.effects.base import FILLED_BY_MODEL, Effect
from postproc.effects.findings import finding
from postproc.effects.parameters import Parameter, unit_suffix

COLUMN_CHANNELS = tuple(COLUMNS)
HELD = {
    column
    for key, columns in COLUMNS.items()
    if key != "external_axes"
    for name in columns
    for column in (name.lower(), name.split("_")[0])
}
KNOWN_READS = HELD.union(COLUMN_CHANNELS, FILLED_BY_MODEL, ("channels", "state", "joint_load", "body_load"))
"""Columns of a table, and their beginnings (`q1`), that a state holds under other names alone."""

SI = ("rad", "m", "kg", "s", "K", "N", "J", "W", "Pa", "Hz", "V", "A")
INSTEAD = {
    **dict.fromkeys(("deg", "°", "mrad", "urad", "arcmin", "arcsec"), "rad"),
    **dict.fromkeys(("mm", "cm", "um", "µm", "in", "inch"), "m"),
    **dict.fromkeys(("min", "h", "ms", "d"), "s"),
    "C": "K",
    "degC": "K",
    "°C": "K",
    "g": "kg",
    "t": "kg",
    "lb": "kg",
    "kN": "N",
    "Nm": "N m",
    "%": "1",
}
"""What is commonly written in place of a part of the SI, or of two without the blank between them."""


def declaration(cls: type[Effect]) -> Iterator[Diagnostic]:
    """Yield everything wrong with what an effect class declares, before it is evaluated.

    EFF002 and EFF017 for units, EFF006 for the docstring, EFF014 for no method that moves or loads the arm, EFF016 for
    names, bounds and channels.
    """
    own = inspect.get_annotations(cls)
    if taken := [name for name in own if hasattr(Effect, name) or name in Effect.__annotations__]:
        for name in taken:
            message = f"the parameter `{name}` of `{cls.key}` has a name that is taken: every effect has a `{name}`"
            help = f"call it otherwise, `{name}_of_` and what it belongs to"
            yield finding("EFF016", message, cls, member=name, help=help)
        return
    if not cls.title:
        help = "say what it is, its equation, its source and its usual size"
        yield finding("EFF006", f"`{cls.__name__}` has no docstring", cls, help=help)
    for name, meta in cls.parameters().items():
        if not meta.unit:
            help = f'write `{name}: ... = param(unit="rad", ...)`, or unit="1" for a pure number'
            yield finding("EFF002", f"the parameter `{name}` of `{cls.key}` has no unit", cls, member=name, help=help)
        elif odd := foreign(meta.unit, columns_read(cls)):
            help = f"write `{INSTEAD[odd]}` in place of `{odd}`; " if odd in INSTEAD else ""
            help += f"units are those of the SI and what they make, `rad/(N m)`: {', '.join(SI)}; `1` for a pure number"
            message = f"the unit `{meta.unit}` of `{name}` of `{cls.key}` is not of the SI"
            yield finding("EFF002", message, cls, member=name, help=help)
        elif not name.endswith(unit_suffix(meta.unit)):
            help = f"rename it to `{name}{unit_suffix(meta.unit)}`"
            message = f"the name `{name}` of `{cls.key}` does not end in its unit, {meta.unit}"
            yield finding("EFF017", message, cls, member=name, help=help, warn=True)
        yield from _bounds(cls, name, meta)
    for name in columns_read(cls):
        if name.lower() in KNOWN_READS:
            message = f"`{cls.key}` reads `{name}`, which would be a column of the table that is called so"
            known = ", ".join((*COLUMN_CHANNELS, *FILLED_BY_MODEL))
            help = f'a state has {known}; a column is named itself: reads=("rail_m",)'
            yield finding("EFF016", message, cls, help=help)
    if not cls.parameters():
        yield finding("EFF016", f"`{cls.key}` has no parameters", cls, help="declare what a fit may move with `param`")
    if cls.displacement is Effect.displacement and cls.load is Effect.load and cls.joint_basis is Effect.joint_basis:
        members = (name for name, value in vars(cls).items() if inspect.isfunction(value))
        meant = (f"`{n}`: {d}" for n in members if (d := did_you_mean(n, ("displacement", "load"))))
        help = next(meant, "write one of the two")
        yield finding("EFF014", f"`{cls.key}` has neither `displacement` nor `load`", cls, help=help)


def _bounds(cls: type[Effect], name: str, meta: Parameter) -> Iterator[Diagnostic]:
    """Yield EFF016 where a parameter's bounds, null value and typical size are inconsistent."""
    message = ""
    try:
        low, high, null, typical = (0.0 + np.asarray(x) for x in (meta.low, meta.high, meta.null, meta.typical))
    except (TypeError, ValueError):
        message, help_ = f"the bounds of `{name}` of `{cls.key}` are no numbers", "write numbers in SI units"
    else:
        if np.any(low > null) or np.any(null > high) or not np.all(typical > 0.0):
            message = (
                f"the bounds of `{name}` of `{cls.key}` leave out its null value, or its typical size is not positive"
            )
            help_ = "write low <= null <= high and typical > 0"
        elif meta.amplitude and np.any(typical > np.maximum(high - null, null - low)):
            message = f"the typical size of `{name}` of `{cls.key}` lies beyond its bounds"
            help_ = "say how large it usually is: typical=1e-4"
    if message:
        yield finding("EFF016", message, cls, member=name, help=help_)


def foreign(unit: str, columns: Sequence[str]) -> str:
    """Return the first part of a unit that is not of the SI; empty where all are.

    Args:
        columns: columns of the table that the effect reads; with any, the unit below the slash may be anything.
    """
    told = unit.partition("/")[0] if columns else unit
    return next((part for part in re.split(r"[\s()*/^\d.-]+", told) if part and part not in SI), "")


def columns_read(cls: type[Effect]) -> tuple[str, ...]:
    """Return the columns of the measurement table that an effect reads.

    They are its ``reads`` without the channels of a state, what the model fills in, and ``row``.
    """
    return tuple(n for n in cls.reads if n not in (*COLUMN_CHANNELS, *FILLED_BY_MODEL, "row"))
