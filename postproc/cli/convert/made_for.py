"""What a module for run time is made for, as the command line asks it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from cyclopts import Parameter

from postproc.cli.options import Names, VectorText, parse_channel, parse_numbers, parse_vector
from postproc.cli.program_options import RobotOptions
from postproc.cli.programs import settled
from postproc.diagnostics import PostprocError

if TYPE_CHECKING:
    from postproc.model.arm import Model
    from postproc.runtime.conditions import Conditions
    from postproc.settings import Settings


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class RunTimeOptions(RobotOptions):
    """The arm, and what the module is made for.

    Attributes:
        tcp: TCP for which errors are stated, in tool0 [mm]. Default: the tool of the model.
        load: mass of tool and payload and its centre in tool0, KG,X,Y,Z [kg, mm]. Default: half the rated payload.
        region: ranges of the six joint angles, LOW:HIGH,.. [deg]. Default: the limits of the arm.
        channel: what effects read and a controller does not tell, NAME=NUMBER: temperature [degC], columns of your own.
    """

    tcp: VectorText | None = None
    load: VectorText | None = None
    region: VectorText | None = None
    channel: Names = ()

    def arm(self, module: Path) -> tuple[Settings, Model]:
        """Return the settings for a module (options over ``postproc.toml`` or backup) and the model they name."""
        return settled(self.settings_at(module.parent), str(module))

    def conditions(self, settings: Settings, model: Model) -> Conditions:
        """Return the range of targets that the module is made for, without process force.

        Raises:
            PostprocError: an option cannot be read (CLI006).
        """
        import numpy as np

        from postproc.runtime.conditions import Conditions

        frame = model.T_flange_tcp.copy()
        if self.tcp is not None:
            frame = np.eye(4)
            frame[:3, 3] = 1e-3 * np.array(parse_vector("--tcp", self.tcp, "0,0,350"))
        mass, centre = 0.5 * (model.robot.payload or 0.0), 0.5 * frame[:3, 3]
        if self.load is not None:
            mass, *xyz = parse_numbers("--load", self.load, 4, "`--load 30,0,0,120`")
            centre = 1e-3 * np.array(xyz)
        lower, upper = model.robot.lower, model.robot.upper
        if self.region is not None:
            pairs = self.region.split(",")
            ranges = [parse_numbers("--region", pair, 2, REGION, ":") for pair in pairs]
            if len(ranges) != 6 or any(low > high for low, high in ranges):
                raise PostprocError.of("CLI006", f"`--region {self.region}` is not six ranges", help=f"write {REGION}")
            low, high = np.radians(ranges).T
            lower, upper = np.maximum(low, lower), np.minimum(high, upper)
        return Conditions(
            lower,
            upper,
            frame,
            mass,
            centre,
            channels=dict(map(parse_channel, self.channel)),
            source=settings.model.name if settings.model else "",
        )


REGION = "`--region=-90:90,-30:60,-60:30,-180:180,20:100,-180:180`"
