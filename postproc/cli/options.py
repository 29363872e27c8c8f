"""Options that several commands share: their types, their checks, and values that are given in one word."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Group, Parameter, Token

from postproc.diagnostics import PostprocError
from postproc.numbers import read_number


def positive(_: object, value: float | None) -> None:
    """Raise ValueError for a value that is not positive or not finite."""
    if value is not None and not (math.isfinite(value) and value > 0):
        raise ValueError("Must be a positive number.")


def _distance(_: object, value: float) -> None:
    """Raise ValueError for a value that is negative or not finite."""
    if not (math.isfinite(value) and value >= 0):
        raise ValueError("Must be zero or a positive number.")


def _axes(_: object, value: str) -> None:
    """Raise ValueError for letters other than a to f."""
    if not set(value.lower()) <= set("abcdef"):
        raise ValueError("Must be letters a to f.")


def _number(kind: type[float] | type[int], tokens: Sequence[Token]) -> float:
    """Convert an option's word to a number; ValueError for forms that only Python reads, such as ``1_0``."""
    text = tokens[0].value
    try:
        value = read_number(text)
        return int(text) if kind is int else value
    except ValueError:
        raise ValueError(f'unable to convert "{text}" into {kind.__name__}.') from None


GROUPS = {
    name: Group(name, sort_key=key)
    for key, name in enumerate(("Common", "Loads", "Cell and files", "Outputs", "Scripts and CI"), 1)
}
"""Headings of help, in their order."""
_OUTPUTS = Parameter(group=GROUPS["Outputs"])
_CHECKS = Parameter(group=GROUPS["Scripts and CI"])
AS_WRITTEN = Parameter(converter=_number)
"""A number that Python alone would understand, ``1_0``, is none."""
Tolerance = Annotated[float, AS_WRITTEN, Parameter(validator=positive)]
Distance = Annotated[float, AS_WRITTEN, Parameter(validator=_distance)]
ArmFile = Annotated[Path, Parameter(help="TOML file of the arm.")]
Output = Annotated[Path | None, _OUTPUTS, Parameter(name=["--output", "-o"])]
RequiredOutput = Annotated[Path, _OUTPUTS, Parameter(name=["--output", "-o"])]
Format = Annotated[
    Literal["json", "sarif"] | None,
    _CHECKS,
    Parameter(name="--format", help="print this on stdout: the document (as --json), or the findings as SARIF 2.1.0."),
]
Require = Annotated[
    Literal["model", "arm"] | None,
    _CHECKS,
    Parameter(
        name="--require",
        help="exit 1 where the tolerance is not kept in the model, or not shown on the arm; the outputs are written.",
    ),
]
Flag = Annotated[bool, Parameter(show_default=False)]
OutputFlag = Annotated[bool, _OUTPUTS, Parameter(show_default=False)]
CheckFlag = Annotated[bool, _CHECKS, Parameter(show_default=False)]
LISTED = Parameter(n_tokens=1, show_default=False)
"""An option that may be repeated, one value each time."""
EFFECTS_HELP = "Python file with effects of your own; its code is run. May be repeated."
EffectFiles = Annotated[tuple[Path, ...], LISTED, Parameter(name="--effects", help=EFFECTS_HELP)]
SideFiles = Annotated[tuple[Path, ...], LISTED, Parameter(name="--with")]
Names = Annotated[tuple[str, ...], LISTED]
FreeAxes = Annotated[str, Parameter(validator=_axes, show_default=False)]
TextFlag = Annotated[
    bool, _CHECKS, Parameter(name="--text", show_default=False, help="with --json: print the text as well, on stderr.")
]
ReportFile = Annotated[Path | None, _OUTPUTS, Parameter(name="--report", help="HTML page to write.")]
CertificateFile = Annotated[
    Path | None, _OUTPUTS, Parameter(name="--certificate", help="certificate to print and sign (HTML) to write.")
]
Tables = Annotated[str, Parameter(required=True, help="tables of measured poses (CSV); - reads stdin.")]
DataFiles = Annotated[tuple[str, ...], Parameter(name="--data", n_tokens=1)]
VectorText = Annotated[str, Parameter(allow_leading_hyphen=True)]  # a component may be negative
Vector = tuple[float, float, float]


def parse_numbers(option: str, text: str, count: int, such_as: str, between: str = ",") -> list[float]:
    """Parse numbers in one word.

    Args:
        option, such_as: its name and an example, for the message. between: the separator.
        count: how many there must be, all of them finite.

    Raises:
        PostprocError: another number of them, or something else (CLI006).
    """
    try:
        values = [read_number(part) for part in text.split(between)]
    except ValueError:
        values = []
    if len(values) != count or not all(map(math.isfinite, values)):
        what = "three" if count == 3 else count
        raise PostprocError.of("CLI006", f"`{option} {text}` is not {what} numbers", help=f"write {such_as}")
    return values


def parse_vector(option: str, text: str, such_as: str = "200,-200,-200") -> Vector:
    """Parse three numbers with commas between them, ``200,-200,-200``.

    Args:
        option, such_as: its name and an example, for the message.

    Raises:
        PostprocError: anything else (CLI006).
    """
    x, y, z = parse_numbers(option, text, 3, f"`{option} {such_as}`")
    return x, y, z


def parse_channel(text: str) -> tuple[str, float]:
    """Parse name and value of a channel, ``temperature=30``; the name may hold "=", as in ``shift=night=1``.

    Raises:
        PostprocError: anything else (CLI006).
    """
    name, _, value = text.rpartition("=")
    try:
        number = read_number(value)
    except ValueError:
        number = math.nan
    if not (name.strip() and math.isfinite(number)):
        text, help_ = f"`--channel {text}` is not a name and a number", "write `--channel temperature=30`"
        raise PostprocError.of("CLI006", text, help=help_)
    return name.strip(), number


def split_names(words: Iterable[str]) -> list[str]:
    """Return names given one after the other or with commas between them, each once."""
    return list(dict.fromkeys(name.strip() for word in words for name in word.split(",") if name.strip()))
