"""What the user can choose about a compensation."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from postproc.rapid.data.records import Vec3
from postproc.rapid.program.program import Elsewhere

TOLERANCE_M = 1e-4
"""Default of the tolerance [m]: an arm that nobody measured is off by more, and repeats to about half of that."""


@dataclass(frozen=True, slots=True)
class Options:
    """Choices of one conversion.

    Args:
        tolerance_m: largest deviation of the TCP from a programmed line or arc [m]. One below ``TOLERANCE_M`` holds for
            the model, whatever is expected to remain on the arm; the source paper reaches 0.01 mm.
        air_tolerance_m: the same on motions that do not weld, in a program that welds [m].
        scope: ``welds`` corrects what welds alone.
        allow_partial: a program is written although a weld stays uncorrected between corrected ones.
        largest_correction_m: farthest that a target may be moved [m]; beyond it nothing is written. An arm as it leaves
            the factory is 8 to 15 mm off its nominal one (ABB, Absolute Accuracy, product manuals).
        force, moment: external wrench on the TCP, base axes [N], [N m].
        force_on: ``all`` along the whole program, ``arc`` while the arc burns.
        inertia: compensate the deflection under sustained acceleration.
        template_dir: a folder whose templates replace the shipped ones of the same name.
        free_axes: letters of external axes (``"ab"``) that carry neither the robot nor its work and may move.
        taught: names of data that calibration and teach routines set to the value in the text.
        wobj_taught: names of work objects that this arm's own torch has taught, or ``all``: of the correction in them
            the rigid motion that fits best is left out.
        already: parts of the arm's error that its controller corrects by itself (``controller_part.PARTS``).
        channels: values for the whole program of what effects read and a program does not tell, by name:
            ``temperature`` [degC], columns of the user's own.
        run_time: which statements a function beside the program corrects while it runs: none, those that numbers
            cannot correct, or all that it can.
        run_time_module: file with that function, `ppModel.sys` beside the output where none is named; its name without
            ending is that of the module.
        elsewhere: what other tasks of the controller have of the program's data.
        entry: routine to start from; None takes ``main``, or every routine that nobody calls.
    """

    tolerance_m: float = TOLERANCE_M
    air_tolerance_m: float = 2e-4
    scope: Literal["all", "welds"] = "all"
    allow_partial: bool = False
    largest_correction_m: float = 0.015
    force: Vec3 = (0.0, 0.0, 0.0)
    moment: Vec3 = (0.0, 0.0, 0.0)
    force_on: Literal["all", "arc"] = "all"
    inertia: bool = True
    template_dir: Path | None = None
    free_axes: str = ""
    taught: tuple[str, ...] = ()
    wobj_taught: tuple[str, ...] = ()
    already: tuple[str, ...] = ()
    channels: tuple[tuple[str, float], ...] = ()
    run_time: Literal["off", "where-needed", "all"] = "off"
    run_time_module: Path | None = None
    entry: str | None = None
    elsewhere: Elsewhere = Elsewhere()

    @property
    def unknown_at_run_time(self) -> str:
        """What these options say and a function on the controller does not know; empty for nothing."""
        if self.already:
            return "what the controller corrects by itself (`--already`)"
        return "what a work object holds already (`--wobj-taught`)" if self.wobj_taught else ""
