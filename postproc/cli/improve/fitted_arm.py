"""The arm that ``postproc fit`` has measured, as the command line and ``postproc.toml`` state it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from postproc.cli.frames import parse_mounting, parse_tool
from postproc.cli.options import VectorText
from postproc.cli.printing import show
from postproc.diagnostics import PostprocError

if TYPE_CHECKING:
    from postproc.model.arm import Model


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class FittedArm:
    """The arm that was measured, and what is fitted.

    Attributes:
        robot: library name, or a robot TOML or URDF file. Default: that of ``postproc.toml``.
        effects: effects to fit, KEY,KEY,..; FILE.py among them stands for the effects it defines, its code is run.
            Default: instrument_frame,tool_frame,joint_offset,joint_compliance.
        mounting: roll, pitch, yaw of the base in the world [deg], R,P,Y: 180,0,0 hangs from a gantry. Default: 0,0,0.
        tool: TCP of tables of joint angles, X,Y,Z [mm] in tool0. Default: the fit finds it where the rows tell it.
        cell: what carries the arm and its work: TOML file with [[external_axes]], controller's backup, or its MOC.cfg.
            Default: that of ``postproc.toml``.
    """

    robot: str | None = None
    effects: Annotated[str | None, Parameter(name="--effects")] = None
    mounting: VectorText | None = None
    tool: VectorText | None = None
    cell: Path | None = None

    def completed(self, data: str) -> tuple[FittedArm, str]:
        """Return the same with what the ``postproc.toml`` nearest to a table states, and what names the arm.

        Raises:
            PostprocError: CLI013 where nothing names an arm, CLI011 for a mounting beside a cell.
        """
        from postproc.settings_files import FitChoices, find_settings, in_folder

        path, choices = find_settings(Path(data).parent) or (Path(), None)
        stated, fit = ({}, FitChoices()) if choices is None else (choices.stated(), choices.fit)
        robot, cell, origin = self.robot, self.cell, "arm from `--robot`"
        if robot is None and "robot" in stated:
            robot, origin = in_folder(path.parent, stated["robot"]), f"arm from `{path}`"
        if cell is None and "cell" in stated:
            cell = path.parent / stated["cell"]
        if robot is None:
            help_ = "add `--robot NAME`; `postproc robots list` has the names"
            raise PostprocError.of("CLI013", "nothing says which arm was measured", help=help_)
        if cell is not None and self.mounting is not None:
            help_ = "write `[mounting]` into the cell's file"
            raise PostprocError.of("CLI011", "`--cell` and `--mounting` both say how the base stands", help=help_)
        mounting = self.mounting or (",".join(map(str, fit.mounting)) if fit.mounting else None)
        effects = ",".join(fit.effects or ()) or None if self.effects is None else self.effects
        return replace(self, robot=robot, cell=cell, mounting=mounting, effects=effects), origin

    def model(self) -> Model:
        """Return the nominal arm as it stands, with its tool; prints what is doubtful about its file."""
        import numpy as np

        from postproc.model.arm import Model
        from postproc.robot.catalogue import doubts, load_robot
        from postproc.robot.cells.cell_file import restated
        from postproc.settings import read_station

        arm = load_robot(str(self.robot))
        show(doubts(arm))
        tool = np.eye(4) if self.tool is None else parse_tool(self.tool)
        model = Model(arm, (), parse_mounting(self.mounting), tool, str(self.robot))
        return model if self.cell is None else model.at_station(restated(read_station(self.cell)))
