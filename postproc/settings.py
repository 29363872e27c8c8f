"""How a program is converted: the arm, its model, what is read along, and the options of the conversion."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from postproc.compensation.options import Options
from postproc.diagnostics import Diagnostic, PostprocError
from postproc.files import real, short_path
from postproc.user_options import option, options_of

if TYPE_CHECKING:
    from postproc.model.arm import Model
    from postproc.robot.cells.station import Station

NAME = "postproc.toml"


@dataclass(frozen=True, slots=True)
class Settings:
    """How a program is converted.

    Args:
        model: TOML file of the real arm, or controller: joint compliances of Absolute Accuracy in the backup. Default:
            the shipped model of the arm, with elastic joints.
        robot: arm of the library, in place of the model's. Default: that of the controller's backup.
        another_arm: with --robot: the model was made for another arm, and is meant for this one all the same.
        effects: Python file with effects of your own; its code is run.< May be repeated.>
        side_files: RAPID module that is read along for what it declares, never changed.< May be repeated.>
        alone: read no data along that the program lacks and a file near it declares.
        cell: what carries the arm and its work: TOML file with [[external_axes]], controller's backup, or its MOC.cfg.
        from_controller: in place of a model, the joint compliances that Absolute Accuracy has of the arm.
        robot_from: what names the arm: an option, or a file.
        stated_in: settings files that these settings come from, found from the program's folder upwards.
        inherited: (key, value as text) of what such a file states and no inner layer overrides.
        station: the arm in its cell, as a controller's configuration describes it.
    """

    model: Path | None = option(None, commands="arm", also="-m")
    robot: str | None = option(None, commands="arm")
    another_arm: bool = option(False, commands="arm", files="", key="model_of_another_arm", group="Cell and files")
    effects: tuple[Path, ...] = option((), commands="arm", files="jobs", group="Cell and files")
    side_files: tuple[Path, ...] = option((), commands="program", key="with", group="Cell and files")
    alone: bool = option(False, commands="program", group="Cell and files")
    cell: Path | None = option(None, commands="program", last=True, group="Cell and files")
    from_controller: bool = False
    robot_from: str = ""
    stated_in: tuple[Path, ...] = ()
    inherited: tuple[tuple[str, str], ...] = ()
    station: Station | None = None
    options: Options = field(default_factory=Options)

    @property
    def names_arm(self) -> bool:
        """Whether an arm is named, by a model or by a robot."""
        return self.model is not None or self.robot is not None

    @property
    def inputs(self) -> tuple[Path | str | None, ...]:
        """Files that are read beside the programs; None for those not stated."""
        folder = self.options.template_dir
        templates = sorted(folder.glob("*.j2")) if folder is not None else ()
        return (self.model, self.robot, self.cell, *self.effects, *self.side_files, *self.stated_in, *templates)

    def headline(self, robot: str) -> str:
        """Return the first line for people: the arm, what names it, tolerances and scope.

        Args:
            robot: name of the arm.
        """
        model = f" as in `{self.model}`" if self.model is not None else ""
        model = f" with `{self.model}`, the model of another arm" if model and self.another_arm else model
        model = " with the joint compliances of its controller" if self.from_controller else model
        o = self.options
        near = f"tolerance {1e3 * o.tolerance_m:g} mm, {1e3 * o.air_tolerance_m:g} mm in the air"
        wobj = f"; taught with this arm: {', '.join(o.wobj_taught)}" if o.wobj_taught else ""
        already = f"; its controller corrects {', '.join(o.already)} by itself" if o.already else ""
        cell = f"; cell `{self.cell}`" if self.cell is not None else ""
        known_from = self.robot_from or "the call"
        return f"arm `{robot}`{model} (from {known_from}){cell}{already}{wobj}; {near}; scope {o.scope}"

    def inherited_line(self, folder: Path) -> list[str]:
        """Return one line with the file and the ``key = value`` pairs in force from a settings file above a folder.

        Empty if that file lies in the folder itself or decides nothing (what the command line states is not listed).
        """
        keys = ", ".join(f"{key} = {value}" for key, value in self.inherited)
        above = keys and real(self.stated_in[0]).parent != real(folder)
        return [f"from `{self.stated_in[0]}`: {keys}"] if above else []

    def document(self, robot: str) -> dict[str, str]:
        """Return entries of documents on the arm, what names it, and the scope.

        Args:
            robot: name of the arm.
        """
        return {"robot": robot, "robot_from": self.robot_from, "scope": self.options.scope}


USER_OPTIONS = tuple(sorted((*options_of(Settings, Station=object), *options_of(Options)), key=lambda one: one.last))
"""All that people may state about a conversion, in the order of files."""


def made_with(settings: Settings, folder: Path) -> dict[str, str]:
    """Return what a page says about how its result was made, by label.

    Args:
        folder: of the programs.
    """
    o, file = settings.options, partial(short_path, folder=folder)
    shipped = "shipped with postproc, not measured on this arm"
    listed: dict[str, Iterable[object]] = {
        "effects": map(file, settings.effects),
        "read along": map(file, settings.side_files),
        "taught": o.taught,
        "work objects taught with this arm": o.wobj_taught,
        "corrected by the controller itself": o.already,
        "channels": [f"{name}={value:g}" for name, value in o.channels],
        "settings": map(file, settings.stated_in),
    }
    texts = {name: ", ".join(map(str, values)) for name, values in listed.items()}
    model = shipped if settings.model is None else file(settings.model)
    return {
        "model": "joint compliances of the controller" if settings.from_controller else model,
        "arm named by": settings.robot_from,
        "force on the TCP [N]": ",".join(f"{value:g}" for value in o.force),
        "moment on the TCP [N m]": ",".join(f"{value:g}" for value in o.moment),
        "they act": "along the whole program" if o.force_on == "all" else "while the arc burns",
        "inertia": "on" if o.inertia else "off",
        "tolerance [mm]": f"{1e3 * o.tolerance_m:g}",
        "tolerance in the air [mm]": f"{1e3 * o.air_tolerance_m:g}",
        "scope": o.scope,
        "at run time": o.run_time,
        **({"cell": file(settings.cell)} if settings.cell is not None else {}),
        **{name: text for name, text in texts.items() if text},
    }


def read_arm(settings: Settings, program: str, unknown: Diagnostic | None = None, *, bare: bool = False) -> Model:
    """Load the model that the settings name.

    Args:
        program: name of what is converted, for people.
        unknown: why its controller does not name the arm either; None for CLI013.
        bare: the program is only looked at, whatever its controller corrects by itself.

    Raises:
        PostprocError: nothing names an arm (CLI013), its controller corrects by itself (KIN017), nobody knows how stiff
            it is (MOD004), the model is of another arm (MOD014), or a file does not fit.
    """
    import numpy as np

    from postproc.effects.registry import effect_library
    from postproc.model.controller import controller_model
    from postproc.model.file import default_model, read_model
    from postproc.robot.catalogue import load_robot

    library = effect_library(settings.effects)
    if not settings.names_arm:
        line = f'`--robot NAME`, or the line `robot = "NAME"` in a file `{NAME}` beside or above it'
        help_ = f"say it with {line}; `postproc robots list` has the names"
        text = f"nothing says which arm runs `{program}`"
        raise PostprocError(unknown or Diagnostic("CLI013", "error", text, help=help_))
    station = settings.station if settings.cell is None else read_station(settings.cell)
    if findings := [] if bare else corrected_twice(settings, station):
        raise PostprocError(findings, 1)
    calibration = None if station is None else station.cell_arm.calibration
    if settings.model is None:
        robot = str(settings.robot)
        model = controller_model(robot, calibration) if settings.from_controller else default_model(robot)
        return model if station is None else model.at_station(station)
    model = read_model(settings.model, library)
    if settings.robot is not None:
        other = load_robot(settings.robot)
        if other.name != model.robot.name and not settings.another_arm:
            text = f"`{settings.model}` is a model of `{model.robot.name}`, not of `{other.name}`"
            help_ = "leave the name of the arm out; or say `--model-of-another-arm` if that is what you want"
            raise PostprocError.of("MOD014", text, help=help_)
        # The uncertainty of its fit is kept only if the geometry is equal.
        links = zip((model.robot.link, model.robot.axis), (other.link, other.axis), strict=True)
        fit = model.fit if all(np.allclose(one, two, atol=1e-9) for one, two in links) else {}
        model = replace(model, robot=other, robot_name=settings.robot, fit=fit)
    return model if station is None else replace(model, station=station)


def corrected_twice(settings: Settings, station: Station | None) -> list[Diagnostic]:
    """Return KIN017 where the controller already corrects what the model of the arm's type would correct again.

    Args:
        station: the arm in its cell; None without one, and then nothing is found.
    """
    if settings.model is not None or settings.options.already or station is None or not station.cell_arm.calibrated:
        return []
    text = f"`{station.arm}` runs with Absolute Accuracy: its controller corrects geometry and weight already"
    help_ = "say `--already geometry,gravity` if these are what it corrects: what it leaves is corrected then; or "
    help_ += "give a model with -m that was fitted to the arm as it runs"
    return [Diagnostic("KIN017", "error", text, help=help_)]


def read_station(path: Path) -> Station:
    """Read the arm in its cell from a file or a backup.

    Raises:
        PostprocError: KIN016, it cannot be read, what it says does not fit, or it holds several arms.
    """
    from postproc.robot.cells.cell_file import read_cell_file
    from postproc.robot.cells.station import station_of

    cell = read_cell_file(path)
    station = station_of(cell)
    if station is None:
        names = " and ".join(f"`{arm.name}`" for arm in cell.arms.values()) or "none"
        text = f"which arm of `{path}` the program drives is not known: there are {names}"
        help_ = "convert the backup that the program belongs to, or describe the cell in a TOML file"
        raise PostprocError.of("KIN016", text, help=help_)
    return station
