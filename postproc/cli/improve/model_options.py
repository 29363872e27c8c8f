"""What commands on models ask and read: the model and what holds of the arm beside it, tables and how they are read."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from postproc.cli.frames import parse_tool
from postproc.cli.inputs import assumed, load_model, read_source
from postproc.cli.options import AS_WRITTEN, EffectFiles, Flag, Names, SideFiles, VectorText, positive
from postproc.cli.output import check_outputs
from postproc.cli.printing import say, show
from postproc.diagnostics import PostprocError

if TYPE_CHECKING:
    from postproc.effects.base import Effect
    from postproc.measure.measurements import Measurements
    from postproc.model.arm import Model


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class ArmOptions:
    """What holds of the arm beside its model file.

    Attributes:
        cell: what carries the arm and its work, in place of what the model says: as for ``compensate``.
        tool: TCP of tables of joint angles, X,Y,Z [mm] in tool0. Default: that of the model.
    """

    effects: EffectFiles = ()
    cell: Path | None = None
    tool: VectorText | None = None

    @property
    def classes(self) -> list[type[Effect]]:
        """Effect classes that the user's files define; their code is run."""
        from postproc.effects.loading import load_effect_file

        return [cls for file in self.effects for cls in load_effect_file(file)]

    def words(self, *drafts: Path) -> list[str]:
        """Return the options as they are written on a command line.

        Args:
            drafts: further files of effects.
        """
        cell = [] if self.cell is None else ["--cell", str(self.cell)]
        tool = [] if self.tool is None else ["--tool", self.tool]
        return [*(word for file in (*self.effects, *drafts) for word in ("--effects", str(file))), *cell, *tool]


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
        rows_in_order: the rows stand in the order of measuring. Default: time_s tells it, for sides also pose_id.
        accept: code of a finding that stops nothing, because you know better: DAT007, DAT009, DAT031 or DAT034. May be
            repeated.
    """

    program: str | None = None
    side_files: SideFiles = ()
    columns: str | None = None
    joints: str | None = None
    rows_in_order: Flag = False
    accept: Names = ()

    @property
    def inputs(self) -> tuple[str | Path | None, ...]:
        """Files that are read beside the tables; None for options not given."""
        return (self.program, self.columns, self.joints, *self.side_files)

    def words(self) -> list[str]:
        """Return the options as they are written on a command line that reads the same table."""
        listed = ("side_files", "accept", "rows_in_order")
        stated = [(f.name, getattr(self, f.name)) for f in fields(self) if f.name not in listed]
        stated += [("with", file) for file in self.side_files] + [("accept", code) for code in self.accept]
        words = [word for name, value in stated if value is not None for word in (f"--{name}", str(value))]
        return [*words, *(["--rows-in-order"] if self.rows_in_order else [])]

    def read(self, data: Sequence[str], arm: Model, measured: bool = True) -> Measurements:
        """Read the tables as one, and print their findings.

        Args:
            data: CSV files; ``-`` is stdin. arm: that was measured, in its cell and with its tool.
            measured: False where the table need not say what was measured.

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
        terms = Reading(self.rows_in_order, frozenset(self.accept), joints, arm.station, arm.T_flange_tcp, arm.gravity)
        side_sources = [read_source(str(path), read_only=True) for path in self.side_files]
        run = [read_source(self.program), *side_sources] if self.program else None
        table = read_tables([read_source(name) for name in data], arm.robot, run, layout, measured, terms=terms)
        show(table.diagnostics)
        return table.in_order if measured else table


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class MeasuredOptions(TableOptions):
    """How measurements are read and weighed.

    Attributes:
        noise: standard deviation of the instrument per axis [mm]. Default: from repeated poses.
    """

    noise: Annotated[float | None, AS_WRITTEN, Parameter(validator=positive)] = None

    @property
    def sigma(self) -> float | None:
        """The stated noise per axis [m]; None where it is not stated."""
        return None if self.noise is None else self.noise * 1e-3


def opened(
    model: Path,
    data: Sequence[str],
    arm_options: ArmOptions,
    table: TableOptions,
    *outputs: Path | None,
    also: Sequence[str | None] = (),
) -> tuple[Model, Measurements]:
    """Read the model and the tables, after refusing outputs that are inputs; prints arm, effects and noise.

    Args:
        data: files of the tables. arm_options: what holds of the arm beside the model file.
        table: how the tables are read.
        outputs: files that will be written. also: what else the command reads, which no output may replace.
    """
    check_outputs((model, *data, *also, *table.inputs, *arm_options.effects, arm_options.cell), *outputs)
    arm = load_model(model, arm_options.effects, arm_options.cell)
    if arm_options.tool is not None:
        arm = replace(arm, T_flange_tcp=parse_tool(arm_options.tool))
    weighed = isinstance(table, MeasuredOptions)
    sigma = table.sigma if isinstance(table, MeasuredOptions) else None
    say(f"{assumed(arm.robot.name, [e.key for e in arm.effects], sigma, weighed)}; model `{model}`")
    return arm, table.read(data, arm, weighed)
