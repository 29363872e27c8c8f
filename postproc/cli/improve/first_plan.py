"""``postproc plan`` without a table: what a shop can measure first, with a program and a sheet for it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

from postproc.cli.frames import parse_mounting, parse_tool
from postproc.cli.improve.for_programs import weld_targets
from postproc.cli.improve.model_options import ArmOptions, MeasuredOptions
from postproc.cli.inputs import load_model
from postproc.cli.options import VectorText, positive
from postproc.cli.output import check_outputs, present, write_together
from postproc.cli.printing import say, say_next
from postproc.diagnostics import PostprocError

if TYPE_CHECKING:
    from postproc.arrays import Array
    from postproc.model.arm import Model


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class FirstOptions:
    """What is measured where there is no table yet.

    Attributes:
        kind: what is read without a table: a dial gauge under a load, one tip or the faces of a cube that are touched,
            a ball bar, positions.
        load: mass that is hung on the tool [kg].
        pull: horizontal force of a spring balance at the tool [N], beside or in place of the load.
        signal: digital input that says when a plane is touched.
        mounting: roll, pitch, yaw of the base of an arm of the library in the world [deg], R,P,Y: 180,0,0 hangs from a
            gantry. Default: 0,0,0; a model file says its own.
    """

    kind: Literal["gauge", "tip", "plane", "distance", "position"] | None = None
    load: Annotated[float | None, Parameter(validator=positive)] = None
    pull: Annotated[float | None, Parameter(validator=positive)] = None
    signal: str = "diTouch"
    mounting: VectorText | None = None


def plan_first(
    name: Path,
    options: FirstOptions,
    arm_options: ArmOptions,
    count: int,
    outputs: tuple[Path | None, Path | None, Path | None],
    *,
    box: Array | None,
    table_options: MeasuredOptions,
    programs: Sequence[str],
    json: bool,
) -> int:
    """Plan set-ups without a table; write the table to fill in, the RAPID program and the sheet.

    Args:
        name: a model file, or the name of an arm of the library. count: number of set-ups.
        box: (2, 3) region of the TCP [m], or None. table_options: of these the noise of a reading and modules that are
            read along count. programs: that the set-ups are for. json: print the document.
        outputs: files of the table, the RAPID program and the sheet, None for none.

    Raises:
        PostprocError: CLI017 where the options say too little, or a load that is too heavy.
    """
    from postproc.arrays import GRAVITY
    from postproc.identification.planning.setups import Request, plan_setups
    from postproc.identification.planning.table import setups_csv
    from postproc.render.measuring import setups_module
    from postproc.report.page import render_sheet
    from postproc.results.improve.first_plan import first_plan_document

    check_outputs((name, *arm_options.effects, arm_options.cell, *programs, *table_options.side_files), *outputs)
    table, rapid, sheet = outputs
    kind, load, pull = _kind(options), options.load or 0.0, options.pull or 0.0
    arm = _arm(name, options.mounting, arm_options)
    rated, heaviest = arm.robot.payload, max(load, pull / GRAVITY)
    if rated is not None and heaviest > rated:
        text = f"{heaviest:g} kg are over the rated payload of `{arm.robot.name}`"
        raise PostprocError.of("CLI017", text, help=f"hang at most {rated:g} kg on it")
    say(f"arm `{arm.robot.name}`; {kind}; no table")
    welds = weld_targets(programs, table_options.side_files)
    plan = plan_setups(arm, Request(kind, load, pull, table_options.sigma, box), count, welds)
    document, csv = first_plan_document(name.name, plan), setups_csv(plan).encode()
    module = setups_module(plan, "the table" if table is None else table.name, options.signal)
    files = [(rapid, module), (sheet, render_sheet(document).encode("utf-8", "replace"))]
    shown = [(table, csv)] * (table is not None or not json)
    present(document, json=json, text=True, on_stderr=True)
    write_together([*(pair for pair in files if pair[0] is not None), *shown])
    if table is not None and not json:
        what = "says what is known of the arm, once the readings are filled in"
        noise = [] if table_options.noise is None else ["--noise", table_options.noise]
        tables = (*_tables_of(name, arm), table)
        say_next(
            what, "fit", *tables, "--robot", arm.robot_name, *_stands(arm, arm_options), *noise, "-o", "MODEL.toml"
        )
        for program in programs:
            say_next("corrects that program", "compensate", program, "-m", "MODEL.toml", "-o", "OUT", lead="then")
    return 0


def _kind(options: FirstOptions) -> Literal["gauge", "tip", "plane", "distance", "position"]:
    """Return what is to be measured; CLI017 where the options do not say it, or leave its load open."""
    if options.kind is None or (options.kind == "gauge" and not (options.load or options.pull)):
        text = "a gauge needs a load" if options.kind else "without a table nothing says what is to be measured"
        help_ = "write `--kind gauge --load KG`, the mass that is hung on, or `--pull N` of a spring balance"
        raise PostprocError.of("CLI017", text, help=help_)
    if options.pull and options.kind != "gauge":
        raise PostprocError.of("CLI017", "`--pull` is for a gauge", help="leave it out, or write `--kind gauge`")
    return options.kind


def _tables_of(name: Path, arm: Model) -> list[Path]:
    """Return the tables to which a model in a file was fitted, in its folder where they are there: a fit needs all."""
    data = arm.fit.get("data", [])
    places = [(name.parent / table, Path(table)) for table in ([data] if isinstance(data, str) else data)]
    return [path if path.is_file() else bare for path, bare in places]


def _stands(arm: Model, stated: ArmOptions) -> list[str]:
    """Return options of ``fit`` that state what was planned for: as stated, else mounting and tool of a model file."""
    import numpy as np

    from postproc.robot.pose import rpy_degrees

    numbers = [] if stated.cell is not None else [("--mounting", rpy_degrees(arm.R_world_base))]
    numbers += [] if stated.tool is not None else [("--tool", 1e3 * arm.T_flange_tcp[:3, 3])]
    words = [(option, ",".join(f"{x + 0.0:.6g}" for x in vector)) for option, vector in numbers if np.any(vector)]
    return [*(word for pair in words for word in pair), *stated.words()]


def _arm(name: Path, mounting: str | None, arm_options: ArmOptions) -> Model:
    """Return the model in a file, or an arm of the library by its name, with springs if somebody knows them.

    Args:
        mounting: of an arm of the library, R,P,Y [deg].

    Raises:
        PostprocError: CLI011 where a file says the mounting, too.
    """
    from postproc.model.arm import Model
    from postproc.robot.catalogue import load_robot

    if name.exists() or name.suffix:
        if mounting is not None:
            help_ = "write `[mounting]` into the model file"
            raise PostprocError.of("CLI011", f"`{name}` and `--mounting` both say how the base stands", help=help_)
        arm = load_model(name, arm_options.effects, arm_options.cell)
    else:
        arm = Model(load_robot(str(name)), (), parse_mounting(mounting), robot_name=str(name))
    return arm if arm_options.tool is None else replace(arm, T_flange_tcp=parse_tool(arm_options.tool))
