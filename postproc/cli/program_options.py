"""What is asked for where programs are read: what is read along, what acts on the arm, how near it has to come."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from cyclopts import Parameter

from postproc.cli.options import (  # noqa: F401 - types of the fields of `RobotOptions`, too
    CellFile,
    EffectFiles,
    Flag,
    FreeAxes,
    ModelFile,
    Names,
    SideFiles,
    Taught,
    Tolerance,
    VectorText,
    parse_channel,
    parse_vector,
    split_names,
)
from postproc.cli.robot_options import RobotOptions


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class ProgramOptions(RobotOptions):
    """The real arm, and how a program is read. What is not given here stands in ``postproc.toml``, or has a default.

    Attributes:
        side_files: RAPID module that is read along for what it declares, never changed. May be repeated.
        alone: read no data along that the program lacks and a file near it declares.
        taught: data that calibration and teach routines of the program set to the value in its file, NAME[,NAME..].
        cell: what carries the arm and its work: TOML file with [[external_axes]], controller's backup, or its MOC.cfg.
        free_axes: letters of external axes, a to f, that carry neither the robot nor its work and may move.
    """

    side_files: SideFiles = ()
    alone: Flag = False
    taught: Taught = ()
    cell: CellFile = None
    free_axes: FreeAxes = ""

    def _stated(self) -> dict[str, Any]:
        """Return these options by the keys of ``postproc.toml``; None where one was not given."""
        return {
            **super()._stated(),
            "side_files": list(map(str, self.side_files)) or None,
            "alone": self.alone or None,
            "taught": split_names(self.taught) or None,
            "cell": self.cell and str(self.cell),
            "free_axes": self.free_axes.lower() or None,
        }


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class ConvertOptions(ProgramOptions):
    """What acts on the arm, and how near it has to come.

    Attributes:
        force: force on the TCP in base axes [N], FX,FY,FZ. Default: none.
        moment: moment on the TCP in base axes [N m], MX,MY,MZ. Default: none.
        force_on: where the force acts: along the whole program (default), or while the arc burns.
        inertia: compensate the deflection under sustained acceleration. Default: on.
        tolerance: largest distance from the programmed path [mm]. Default: 0.1.
        air_tolerance: the same where nothing welds [mm]. Default: 0.2.
        scope: correct all motions (default), or those that weld.
        allow_partial: write the program although what the arm cannot run, or a weld between others, stays uncorrected.
        largest_correction: farthest that a target may be moved [mm]; beyond it nothing is written. Default: 15.
        template: folder of Jinja templates in place of the shipped ones.
        wobj_taught: work objects taught with this arm, NAME[,NAME..] or all: one rigid shift of each is left out.
        already: what the controller corrects by itself (Absolute Accuracy): geometry, gravity, force, tool, inertia.
        channel: what effects read and a program does not tell, NAME=NUMBER: temperature [degC], columns of your own.
    """

    force: VectorText | None = None
    moment: VectorText | None = None
    force_on: Literal["all", "arc"] | None = None
    inertia: Literal["on", "off"] | None = None
    tolerance: Tolerance | None = None
    air_tolerance: Tolerance | None = None
    scope: Literal["all", "welds"] | None = None
    allow_partial: Flag = False
    largest_correction: Tolerance | None = None
    template: Path | None = None
    wobj_taught: Names = ()
    already: Names = ()
    channel: Names = ()

    def _stated(self) -> dict[str, Any]:
        """Return these options by the keys of ``postproc.toml``; None where one was not given."""
        return {
            **super()._stated(),
            "force": None if self.force is None else parse_vector("--force", self.force),
            "moment": None if self.moment is None else parse_vector("--moment", self.moment),
            "force_on": self.force_on,
            "inertia": self.inertia and self.inertia == "on",
            "tolerance_mm": self.tolerance,
            "air_tolerance_mm": self.air_tolerance,
            "scope": self.scope,
            "allow_partial": self.allow_partial or None,
            "largest_correction_mm": self.largest_correction,
            "template": self.template and str(self.template),
            "wobj_taught": split_names(self.wobj_taught) or None,
            "already": split_names(self.already) or None,
            "channel": dict(map(parse_channel, self.channel)) or None,
        }


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class TaskOptions(ConvertOptions):
    """The same, and what is corrected while the program runs.

    Attributes:
        run_time: correct on the controller, by a function in a module beside the output, what numbers cannot correct
            (where-needed) or all that it can (all). Default: off.
        run_time_module: file of that module, whose name becomes the module's. Default: ppModel.sys beside the output.
    """

    run_time: Literal["off", "where-needed", "all"] | None = None
    run_time_module: Path | None = None

    def _stated(self) -> dict[str, Any]:
        """Return these options by the keys of ``postproc.toml``; None where one was not given."""
        return {**super()._stated(), "run_time": self.run_time, "run_time_module": self.run_time_module}
