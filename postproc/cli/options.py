"""Options that several commands share: their types, their checks and what they mean."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter, Token

from postproc.cli.inputs import effect_words, read_source
from postproc.cli.report import show
from postproc.diagnostics import PostprocError
from postproc.numbers import read_number

if TYPE_CHECKING:
    from postproc.measure.measurements import Measurements
    from postproc.robot.arm import Robot
    from postproc.robot.cells.station import Station


def _positive(_: object, value: float | None) -> None:
    if value is not None and not (math.isfinite(value) and value > 0):
        raise ValueError("Must be a positive number.")


def _distance(_: object, value: float) -> None:
    if not (math.isfinite(value) and value >= 0):
        raise ValueError("Must be zero or a positive number.")


def _axes(_: object, value: str) -> None:
    if not set(value.lower()) <= set("abcdef"):
        raise ValueError("Must be letters a to f.")


def _number(kind: type[float] | type[int], tokens: Sequence[Token]) -> float:
    text = tokens[0].value
    try:
        value = read_number(text)
        return int(text) if kind is int else value
    except ValueError:
        raise ValueError(f'unable to convert "{text}" into {kind.__name__}.') from None


AS_WRITTEN = Parameter(converter=_number)
"""A number that Python alone would understand, ``1_0``, is none."""
Tolerance = Annotated[float, AS_WRITTEN, Parameter(validator=_positive)]
Distance = Annotated[float, AS_WRITTEN, Parameter(validator=_distance)]
ArmFile = Annotated[Path, Parameter(help="TOML file of the arm.")]
Output = Annotated[Path | None, Parameter(name=["--output", "-o"])]
Format = Annotated[
    Literal["json", "sarif"] | None,
    Parameter(name="--format", help="print this on stdout: the document (as --json), or the findings as SARIF 2.1.0."),
]
Flag = Annotated[bool, Parameter(show_default=False)]
EffectFiles = Annotated[
    tuple[Path, ...],
    Parameter(
        name="--effects",
        n_tokens=1,
        show_default=False,
        help="Python file with effects of your own; its code is run. May be repeated.",
    ),
]
SideFiles = Annotated[tuple[Path, ...], Parameter(name="--with", n_tokens=1, show_default=False)]
Names = Annotated[tuple[str, ...], Parameter(n_tokens=1, show_default=False)]
Taught = Annotated[tuple[str, ...], Parameter(name=["--taught", "--constant"], n_tokens=1, show_default=False)]
FreeAxes = Annotated[str, Parameter(validator=_axes, show_default=False)]
TextFlag = Annotated[
    bool, Parameter(name="--text", show_default=False, help="with --json: print the text as well, on stderr.")
]
ReportFile = Annotated[Path | None, Parameter(name="--report", help="HTML page to write.")]
CertificateFile = Annotated[
    Path | None, Parameter(name="--certificate", help="certificate to print and sign (HTML) to write.")
]
Tables = Annotated[str, Parameter(required=True, help="tables of measured poses (CSV); - reads stdin.")]
DataFiles = Annotated[tuple[str, ...], Parameter(name="--data", n_tokens=1)]
CellFile = Annotated[Path | None, Parameter(name="--cell")]
ModelFile = Annotated[Path | None, Parameter(name=["--model", "-m"])]


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class TableOptions:
    """How a table of measured poses is read.

    Attributes:
        program: RAPID module that was run, for tables that name targets.
        side_files: RAPID module that is read along with it for what it declares. May be repeated.
        columns: TOML file that maps the columns of another layout.
        joints: table of the commanded joint angles beside the one that the instrument wrote, joined by the names of
            the poses or row by row.
        rows_in_order: the rows stand in the order of measuring. Default: their order counts for nothing without time_s.
        accept: code of a finding that stops nothing, because you know better. May be repeated.
    """

    program: str | None = None
    side_files: SideFiles = ()
    columns: str | None = None
    joints: str | None = None
    rows_in_order: Flag = False
    accept: Annotated[tuple[str, ...], Parameter(n_tokens=1, show_default=False)] = ()

    @property
    def inputs(self) -> tuple[str | Path | None, ...]:
        """Files that are read."""
        return (self.program, self.columns, self.joints, *self.side_files)

    def words(self, effects: Sequence[Path | str] = ()) -> list[str]:
        """The options as they were written, for a command that reads the same table with the same effects."""
        listed = ("side_files", "accept", "rows_in_order")
        given = [(f.name, getattr(self, f.name)) for f in fields(self) if f.name not in listed]
        given += [("with", file) for file in self.side_files] + [("accept", code) for code in self.accept]
        words = [word for name, value in given if value is not None for word in (f"--{name}", str(value))]
        return [*words, *(["--rows-in-order"] if self.rows_in_order else []), *effect_words(effects)]

    def read(self, data: Sequence[str], robot: Robot, measured: bool = True, at: Station | None = None) -> Measurements:
        """The tables as one, their findings printed.

        Args:
            data: CSV files; ``-`` is stdin. robot: the arm that was measured.
            measured: False where the table need not say what was measured. at: the arm in its cell.

        Raises:
            PostprocError: what is wrong with one of the files.
        """
        from postproc.measure.read.terms import ACCEPTABLE, Reading
        from postproc.measure.read.together import read_tables

        unknown = [code for code in self.accept if code not in ACCEPTABLE]
        if unknown:
            help_ = f"those that can be are {', '.join(ACCEPTABLE)}"
            raise PostprocError.of("CLI010", f"`--accept {unknown[0]}`: this finding cannot be accepted", help=help_)
        joints, layout = (read_source(file) if file else None for file in (self.joints, self.columns))
        terms = Reading(self.rows_in_order, frozenset(self.accept), joints, at)
        beside = [read_source(str(path), read_only=True) for path in self.side_files]
        run = [read_source(self.program), *beside] if self.program else None
        table = read_tables([read_source(name) for name in data], robot, run, layout, measured, terms=terms)
        show(table.diagnostics)
        return table.in_order if measured else table


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class MeasuredOptions(TableOptions):
    """How measurements are read and weighed.

    Attributes:
        noise: standard deviation of the instrument per axis [mm]. Default: from repeated poses.
    """

    noise: Annotated[float | None, AS_WRITTEN, Parameter(validator=_positive)] = None

    @property
    def sigma(self) -> float | None:
        """The stated noise [m]."""
        return None if self.noise is None else self.noise * 1e-3
