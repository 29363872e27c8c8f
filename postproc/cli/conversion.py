"""What is asked for where programs are read: the real arm, what is read along, what acts on the arm."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Parameter

from postproc.cli.options import CellFile, EffectFiles, Flag, FreeAxes, ModelFile, Names, SideFiles, Tolerance
from postproc.cli.words import parse_channel, parse_vector

if TYPE_CHECKING:
    from postproc.settings import Settings

VectorText = Annotated[str, Parameter(allow_leading_hyphen=True)]  # a component may be negative


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class ProgramOptions:
    """The real arm, and how a program is read. What is not given here stands in ``postproc.toml``, or has a default.

    Attributes:
        model: TOML file of the real arm. Default: the shipped model of the arm, with elastic joints.
        robot: arm of the library, in place of the model's. Default: that of the controller's backup.
        side_files: RAPID module that is read along for what it declares, never changed. May be repeated.
        constant: name of data that keeps the value in its file, whatever the program writes to it. May be repeated.
        cell: what carries the arm and its work: TOML file with [[external_axes]], controller's backup, or its MOC.cfg.
        free_axes: letters of external axes, a to f, that carry neither the robot nor its work and may move.
    """

    model: ModelFile = None
    robot: str | None = None
    effects: EffectFiles = ()
    side_files: SideFiles = ()
    constant: Names = ()
    cell: CellFile = None
    free_axes: FreeAxes = ""

    def _stated(self) -> dict[str, Any]:
        """What is given, by the keys of ``postproc.toml``."""
        return {
            "model": self.model and str(self.model),
            "robot": self.robot,
            "side_files": list(map(str, self.side_files)) or None,
            "constant": list(self.constant) or None,
            "cell": self.cell and str(self.cell),
            "free_axes": self.free_axes.lower() or None,
        }

    def settings_at(self, place: Path, entry: str | None = None) -> Settings:
        """What holds for the programs of a folder: its ``postproc.toml``, what is given here, where it begins."""
        from postproc.choices import Choices, settings_at, with_choices

        chosen = with_choices(settings_at(place), Choices.model_construct(None, **self._stated()), Path())
        return replace(chosen, effects=self.effects, options=replace(chosen.options, entry=entry))


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class ConvertOptions(ProgramOptions):
    """What acts on the arm, and how near it has to come.

    Attributes:
        force: force on the TCP in base axes [N], FX,FY,FZ. Default: none.
        moment: moment on the TCP in base axes [N m], MX,MY,MZ. Default: none.
        force_on: where the force acts: along the whole program (default), or while the arc burns.
        inertia: compensate the deflection under sustained acceleration. Default: on.
        tolerance: largest distance from the programmed path [mm]. Default: 0.01.
        air_tolerance: the same where nothing welds [mm]. Default: 0.2.
        scope: correct all motions (default), or those that weld.
        allow_partial: write the program although statements that the arm cannot run stay uncorrected, or a weld
            statement between corrected ones does.
        template: folder of Jinja templates in place of the shipped ones.
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
    template: Path | None = None
    channel: Names = ()

    def _stated(self) -> dict[str, Any]:
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
            "template": self.template and str(self.template),
            "channel": dict(map(parse_channel, self.channel)) or None,
        }


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class TaskOptions(ConvertOptions):
    """The same, and what is corrected while the program runs.

    Attributes:
        run_time: correct on the controller, by a function in a module beside the output, what numbers cannot correct
            (where-needed) or all that it can (all). Default: off.
        run_time_module: file of that module; its name becomes the name of the module. Default: ppModel.sys beside the
            output.
    """

    run_time: Literal["off", "where-needed", "all"] | None = None
    run_time_module: Path | None = None

    def _stated(self) -> dict[str, Any]:
        module = self.run_time_module and str(self.run_time_module)
        return {**super()._stated(), "run_time": self.run_time, "run_time_module": module}
