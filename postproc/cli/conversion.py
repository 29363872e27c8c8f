"""What is asked for where programs are read: the real arm, what is read along, what acts on the arm."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

from postproc.cli.inputs import load_model
from postproc.cli.options import EffectFiles, FreeAxes, ModelFile, Names, SideFiles, Tolerance
from postproc.compensate.options import Options
from postproc.diagnostics import PostprocError

if TYPE_CHECKING:
    from postproc.model.arm import Model

Vector = tuple[float, float, float]
VectorText = Annotated[str, Parameter(allow_leading_hyphen=True)]  # a component may be negative


def parse_vector(option: str, text: str, such_as: str = "200,-200,-200") -> Vector:
    """Three numbers with commas between them, ``200,-200,-200``.

    Raises:
        PostprocError: anything else (CLI006).
    """
    try:
        x, y, z = (float(part) for part in text.split(","))
    except ValueError:
        x = y = z = math.nan
    if not all(map(math.isfinite, (x, y, z))):
        text, help_ = f"`{option} {text}` is not three numbers", f"write `{option} {such_as}`"
        raise PostprocError.of("CLI006", text, help=help_)
    return x, y, z


def parse_channel(text: str) -> tuple[str, float]:
    """Name and value of a channel, ``temperature=30``, or ``shift=night=1`` of a word.

    Raises:
        PostprocError: anything else (CLI006).
    """
    name, _, value = text.rpartition("=")
    try:
        number = float(value)
    except ValueError:
        number = math.nan
    if not (name.strip() and math.isfinite(number)):
        text, help_ = f"`--channel {text}` is not a name and a number", "write `--channel temperature=30`"
        raise PostprocError.of("CLI006", text, help=help_)
    return name.strip(), number


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class ProgramOptions:
    """The real arm, and how a program is read.

    Attributes:
        model: TOML file of the real arm. Default: the shipped model of the arm, with elastic joints.
        robot: arm of the library, in place of the model's.
        side_files: RAPID module that is read along for what it declares, never changed. May be repeated.
        constant: name of data that keeps the value in its file, whatever the program writes to it. May be repeated.
        free_axes: letters of external axes, a to f, that carry neither the robot nor its work and may move.
    """

    model: ModelFile = None
    robot: str | None = None
    effects: EffectFiles = ()
    side_files: SideFiles = ()
    constant: Names = ()
    free_axes: FreeAxes = ""

    def arm(self) -> Model:
        """The model, with another arm where one is named."""
        return load_model(self.model, self.robot, self.effects)


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class ConvertOptions(ProgramOptions):
    """What acts on the arm, and how near it has to come.

    Attributes:
        force: force on the TCP in base axes [N], FX,FY,FZ.
        moment: moment on the TCP in base axes [N m], MX,MY,MZ.
        force_on: where the force acts: along the whole program, or while the arc burns.
        inertia: compensate the deflection under sustained acceleration.
        tolerance: largest distance from the programmed path [mm].
        template: folder of Jinja templates in place of the shipped ones.
        channel: what effects read and a program does not tell, NAME=NUMBER: temperature [degC], columns of your own.
    """

    force: VectorText = "0,0,0"
    moment: VectorText = "0,0,0"
    force_on: Literal["all", "arc"] = "all"
    inertia: Literal["on", "off"] = "on"
    tolerance: Tolerance = 0.01
    template: Path | None = None
    channel: Names = ()

    @property
    def inputs(self) -> tuple[str | Path | None, ...]:
        """Files that are read."""
        return (self.model, self.robot, *self.effects, *self.side_files)

    def told(self) -> dict[str, str]:
        """What a page says about how its result was made."""
        shipped = "shipped with postproc: stiffness from the literature, not measured on this arm"
        beside = {"effects": self.effects, "read along": self.side_files, "constant": self.constant}
        beside["channels"] = self.channel
        return {
            "model": str(self.model) if self.model else shipped,
            "force on the TCP [N]": self.force,
            "moment on the TCP [N m]": self.moment,
            "they act": "along the whole program" if self.force_on == "all" else "while the arc burns",
            "inertia": self.inertia,
            "tolerance [mm]": f"{self.tolerance:g}",
            **{name: ", ".join(map(str, values)) for name, values in beside.items() if values},
        }

    def options(self, entry: str | None = None) -> Options:
        """What the conversion is asked for; ``entry`` is the routine that runs first."""
        return Options(
            tolerance_m=self.tolerance * 1e-3,
            force=parse_vector("--force", self.force),
            moment=parse_vector("--moment", self.moment),
            force_on=self.force_on,
            inertia=self.inertia == "on",
            template_dir=self.template,
            free_axes=self.free_axes.lower(),
            constants=self.constant,
            channels=tuple(map(parse_channel, self.channel)),
            entry=entry,
        )
