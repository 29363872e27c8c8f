"""What the user can choose about a compensation."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from postproc.rapid.data.records import Vec3
from postproc.rapid.program.program import OtherTaskData
from postproc.user_options import option

TOLERANCE_M = 1e-4
"""Default of the tolerance [m]: an arm that nobody measured is off by more, and repeats to about half of that.

One below it holds for the model, whatever is expected to remain on the arm; the source paper reaches 0.01 mm.
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class Options:
    """Choices of one conversion. Lengths are millimetres where people state them, metres here.

    Args:
        force: force on the TCP in base axes [N]<, FX,FY,FZ>. Default: none.
        moment: moment on the TCP in base axes [N m]<, MX,MY,MZ>. Default: none.
        force_on: where the force acts: along the whole program (default), or while the arc burns.
        inertia: compensate the deflection under sustained acceleration. Default: {}.
        tolerance_m: largest distance from the programmed path [mm]. Default: {}.
        air_tolerance_m: the same where nothing welds [mm]. Default: {}.
        scope: correct all motions (default), or those that weld.
        run_time: correct on the controller, by a function in a module beside the output, what numbers cannot correct
            (where-needed) or all that it can (all). Default: {}.
        run_time_module: file of that module, whose name becomes the module's. Default: ppModel.sys beside the output.
        allow_partial: write the program although what the arm cannot run, or a weld between others, stays uncorrected.
        largest_correction_m: farthest that a target may be moved [mm]; beyond it nothing is written. Default: {}.
        template_dir: folder of Jinja templates in place of the shipped ones.
        taught: data that calibration and teach routines of the program set to the value in its file<, NAME[,NAME..]>.
        wobj_taught: work objects taught with this arm<, NAME[,NAME..]> or all: one rigid shift of each is left out.
        already: what the controller corrects by itself (Absolute Accuracy): geometry, gravity, force, tool, inertia.
        channels: what effects read and a program does not tell<, NAME=NUMBER>: temperature [degC], columns of your own.
        entry: routine that runs first.
        free_axes: letters of external axes, a to f, that carry neither the robot nor its work and may move.
        other_tasks: what other tasks of the controller have of the program's data.
    """

    force: Vec3 = option((0.0, 0.0, 0.0), group="Loads")
    moment: Vec3 = option((0.0, 0.0, 0.0), group="Loads")
    force_on: Literal["all", "arc"] = option("all", group="Loads")
    inertia: bool = option(True, group="Loads")
    tolerance_m: float = option(TOLERANCE_M)
    air_tolerance_m: float = option(2e-4)
    scope: Literal["all", "welds"] = option("all")
    run_time: Literal["off", "where-needed", "all"] = option("off", commands="task", group="Outputs")
    run_time_module: Path | None = option(None, commands="task", group="Outputs")
    allow_partial: bool = option(False, group="Outputs")
    # An arm as it leaves the factory is 8 to 15 mm off its nominal one (ABB, Absolute Accuracy, product manuals).
    largest_correction_m: float = option(0.015, group="Outputs")
    template_dir: Path | None = option(None, key="template", group="Outputs")
    taught: tuple[str, ...] = option((), commands="program", also="constant", group="Cell and files")
    wobj_taught: tuple[str, ...] = option((), in_files=list[str] | Literal["all"], group="Cell and files")
    already: tuple[Literal["geometry", "gravity", "force", "tool", "inertia"], ...] = option((), group="Cell and files")
    channels: tuple[tuple[str, float], ...] = option((), key="channel", in_files=dict[str, float], group="Loads")
    entry: str | None = option(None, commands="", files="jobs")
    free_axes: str = option("", commands="program", last=True, group="Cell and files")
    other_tasks: OtherTaskData = OtherTaskData()

    @property
    def unknown_at_run_time(self) -> str:
        """What these options say and a function on the controller does not know; empty for nothing."""
        if self.already:
            return "what the controller corrects by itself (`--already`)"
        return "what a work object holds already (`--wobj-taught`)" if self.wobj_taught else ""
