"""``postproc plan``: the poses to measure next."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter
from cyclopts.validators import Number

from postproc.cli.improve.first_plan import FirstOptions, plan_first
from postproc.cli.improve.for_programs import weld_targets
from postproc.cli.improve.model_options import ArmOptions, MeasuredOptions, opened
from postproc.cli.inputs import short_names
from postproc.cli.options import AS_WRITTEN, LISTED, CheckFlag, Flag, Output, ReportFile, parse_numbers
from postproc.cli.output import present, write
from postproc.cli.printing import say_next
from postproc.cli.progress import watching
from postproc.diagnostics import PostprocError

if TYPE_CHECKING:
    from postproc.arrays import Array
    from postproc.identification.planning.design import Room
    from postproc.model.arm import Model


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class PoseOptions:
    """Where poses may be, and with which loads.

    Attributes:
        region: box of the TCP in the base frame [mm], X1,Y1,Z1,X2,Y2,Z2.
        candidates: table of the only poses that may be chosen (CSV).
        sight: half the opening angle [deg] of a reflector that looks along +z of the tool: the instrument stands in it.
        measured_range: keep every joint inside the range of DATA.
        payloads: masses on the flange that poses may have [kg], KG,KG,... Default: those of DATA.
        force: pull at the TCP [N] in the direction that the table states at each pose. Default: none.
    """

    region: str | None = None
    candidates: str | None = None
    sight: Annotated[float | None, Parameter(validator=Number(gt=0, lte=180))] = None
    measured_range: Flag = False
    payloads: str | None = None
    force: Annotated[float, Parameter(validator=Number(gte=0))] = 0.0

    @property
    def box(self) -> Array | None:
        """The region, lowest and highest corner (2, 3) [m]; CLI006 where it is no box."""
        import numpy as np

        if self.region is None:
            return None
        such_as = "two corners [mm], `--region 800,-600,400,1600,600,1200`"
        return np.sort(np.reshape(parse_numbers("--region", self.region, 6, such_as), (2, 3)), axis=0) * 1e-3

    def room(self, arm: Model, table: MeasuredOptions) -> Room:
        """Return where poses of an arm may be.

        Args:
            table: how the candidates are read.

        Raises:
            PostprocError: CLI006 or CLI010 for an option that cannot be read, or what is wrong with the candidates.
        """
        from postproc.identification.planning.design import Room

        listed = None if self.candidates is None else table.read([self.candidates], arm, False).state
        q, axes = (None, None) if listed is None else (listed.q, listed.external_axes)
        try:
            masses = tuple(float(word) for word in (self.payloads or "").split(",") if self.payloads)
        except ValueError:
            masses = (math.nan,)
        if not all(math.isfinite(mass) and mass >= 0 for mass in masses):
            text = f"`--payloads {self.payloads}` are no masses"
            raise PostprocError.of("CLI010", text, help="write `--payloads 0,30,60` [kg]")
        sight = None if self.sight is None else math.radians(self.sight)
        return Room(self.box, q, sight, self.measured_range, axes, masses, self.force)


WITHOUT_TABLE = "`--kind`, `--load`, `--pull`, `--signal` and `--mounting` are for a plan without a table"


def run(
    model: Annotated[Path, Parameter(help="TOML file of the arm; without a table also a name of the library.")],
    /,
    *data: Annotated[str, Parameter(help="tables of measured poses (CSV); - reads stdin. None: with --kind.")],
    between: str | None = None,
    programs: Annotated[tuple[str, ...], LISTED, Parameter(name="--for")] = (),
    count: Annotated[int, AS_WRITTEN, Parameter(name=["--count", "-n"], validator=Number(gte=1, lte=1000))] = 20,
    output: Output = None,
    rapid: Path | None = None,
    poses: PoseOptions = PoseOptions(),
    first: FirstOptions = FirstOptions(),
    arm_options: ArmOptions = ArmOptions(),
    table: MeasuredOptions = MeasuredOptions(),
    report: ReportFile = None,
    json: CheckFlag = False,
) -> int:
    """Choose the poses to measure next: for programs that weld, to tell two effects apart, or to know the arm better.

    Without a table: what to measure first with a dial gauge, a tip, a cube, a ball bar or an instrument, as in
    ``postproc plan irb2600_20_165 --kind gauge --load 20 --for seam.mod -n 6 -o gauge.csv``.

    Args:
        between: two effects to be told apart, KEY,KEY. Default: sharpen the worst-determined parameters.
        programs: RAPID module that is to be welded: what tells most of its welds is measured. May be repeated.
        count: number of poses.
        output: CSV file to write, a table whose measured columns are to be filled in. Default: stdout.
        rapid: RAPID program to write that visits the poses, from the stated sides, with waits.
        json: print the postproc/plan/1 document.
    """
    from postproc.identification.planning.plan import plan_poses
    from postproc.render.measuring import measuring_module
    from postproc.results.improve.plan import plan_document

    if not data:
        if between or replace(poses, region=None) != PoseOptions():
            text = "`--between`, `--candidates`, `--sight`, `--measured-range`, `--payloads` and `--force` need a table"
            raise PostprocError.of("CLI017", text, help="name the table after the model, or leave them out")
        request, files = (model, first, arm_options, count), (output, rapid, report)
        return plan_first(*request, files, box=poses.box, table_options=table, programs=programs, json=json)
    if first != FirstOptions():
        raise PostprocError.of("CLI017", WITHOUT_TABLE, help="leave the table out, or these options")
    if between and programs:
        text = "`--between` and `--for` ask for different poses"
        raise PostprocError.of("CLI010", text, help="leave one of them out")
    arm, measured = opened(model, data, arm_options, table, output, rapid, report, also=(poses.candidates, *programs))
    question = arm, measured, count, _pair(between), arm_options.classes
    room, welds = poses.room(arm, table), weld_targets(programs, table.side_files)
    with watching(f"choosing {count} poses") as watch:
        plan = plan_poses(*question, noise=table.sigma, room=room, programs=welds, watch=watch)
    document = plan_document(short_names(model, *data), plan)
    if rapid is not None:
        name = output.name if output is not None else "the table"
        write(rapid, measuring_module(arm.robot, plan.state, plan.ids, name, plan.extax))
    if output is not None or not json:
        write(output, plan.as_csv())
    present(document, report, json=json, text=True, on_stderr=True)
    if output is not None and not json:
        what = "says what is missing, once x_mm, y_mm, z_mm and what else the first table has are filled in"
        say_next(what, "diagnose", model, *data, output, *table.words(), *arm_options.words())
    return 0


def _pair(text: str | None) -> tuple[str, str] | None:
    """Parse ``--between KEY,KEY``; CLI010 where it is not two different keys."""
    if text is None:
        return None
    words = [word.strip() for word in text.split(",")]
    if len(words) != 2 or words[0] == words[1] or not all(words):
        help_ = "write `--between arm_load,gravity_compensator`"
        raise PostprocError.of("CLI010", f"`--between {text}` is not two effects", help=help_)
    return words[0], words[1]
