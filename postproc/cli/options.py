"""Options that several commands share: their types, their checks and what they mean."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from postproc.diagnostics import Diagnostic, PostprocError

Vector = tuple[float, float, float]


def _positive(_: object, value: float | None) -> None:
    if value is not None and not (math.isfinite(value) and value > 0):
        raise ValueError("Must be a positive number.")


def _distance(_: object, value: float) -> None:
    if not (math.isfinite(value) and value >= 0):
        raise ValueError("Must be zero or a positive number.")


Tolerance = Annotated[float, Parameter(validator=_positive)]
Distance = Annotated[float, Parameter(validator=_distance)]
VectorText = Annotated[str, Parameter(allow_leading_hyphen=True)]  # a component may be negative
Output = Annotated[Path | None, Parameter(name=["--output", "-o"])]
Noise = Annotated[float | None, Parameter(name="--noise", validator=_positive)]
Effects = Annotated[str, Parameter(name="--effects")]
RunProgram = Annotated[str | None, Parameter(name="--program")]
Columns = Annotated[str | None, Parameter(name="--columns")]
Flag = Annotated[bool, Parameter(show_default=False)]
EffectFiles = Annotated[tuple[Path, ...], Parameter(name="--effects", n_tokens=1, show_default=False)]
ReportFile = Annotated[Path | None, Parameter(name="--report")]
ModelFile = Annotated[Path | None, Parameter(name=["--model", "-m"])]


def parse_vector(option: str, text: str) -> Vector:
    """Three numbers with commas between them, ``200,-200,-200``.

    Raises:
        PostprocError: anything else (CLI006).
    """
    try:
        x, y, z = (float(part) for part in text.split(","))
    except ValueError:
        x = y = z = math.nan
    if not all(map(math.isfinite, (x, y, z))):
        help_ = f"write `{option} 200,-200,-200`"
        raise PostprocError(Diagnostic("CLI006", "error", f"`{option} {text}` is not three numbers", help=help_))
    return x, y, z
