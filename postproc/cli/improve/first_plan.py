"""``postproc plan`` without a table: what a shop can measure first, with a program and a sheet for it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

from postproc.cli.improve.model_options import ArmOptions
from postproc.cli.inputs import load_model
from postproc.cli.options import VectorText, parse_vector, positive
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
        tool: TCP in tool0 [mm], X,Y,Z. Default: that of the model.
        signal: digital input that says when a plane is touched.
    """

    kind: Literal["gauge", "tip", "plane", "distance", "position"] | None = None
    load: Annotated[float | None, Parameter(validator=positive)] = None
    pull: Annotated[float | None, Parameter(validator=positive)] = None
    tool: VectorText | None = None
    signal: str = "diTouch"


@dataclass(frozen=True, slots=True)
class Wanted:
    """What is planned for, and where it is written.

    Args:
        count: number of set-ups. box: (2, 3) region of the TCP [m], or None.
        sigma: standard deviation [m] of a number that is read, None for what is usual.
        table, rapid, sheet: files, None for none; json: print the document.
    """

    count: int
    box: Array | None
    sigma: float | None
    table: Path | None
    rapid: Path | None
    sheet: Path | None
    json: bool


def plan_first(name: Path, options: FirstOptions, arm_options: ArmOptions, wanted: Wanted) -> int:
    """Plan set-ups without a table; write the table to fill in, the RAPID program and the sheet.

    Args:
        name: a model file, or the name of an arm of the library.

    Raises:
        PostprocError: CLI017 where no table is given and the options say too little.
    """
    import numpy as np

    from postproc.arrays import GRAVITY
    from postproc.identification.planning.setups import Asked, plan_setups
    from postproc.identification.planning.table import setups_csv
    from postproc.render.measuring import setups_module
    from postproc.report.page import render_sheet
    from postproc.results.first_plan import BOXES, first_plan_document
    from postproc.robot.pose import transform

    check_outputs((name, *arm_options.effects, arm_options.cell), wanted.table, wanted.rapid, wanted.sheet)
    kind, load, pull = options.kind, options.load or 0.0, options.pull or 0.0
    if kind is None or (kind == "gauge" and not (load or pull)):
        text = "a gauge needs a load" if kind else "without a table nothing says what is to be measured"
        raise PostprocError.of("CLI017", text, help="write `--kind gauge --load KG`, the mass that is hung on")
    arm = _arm(name, arm_options)
    rated = arm.robot.payload
    if rated is not None and max(load, pull / GRAVITY) > rated:
        text = f"{max(load, pull / GRAVITY):g} kg are over the rated payload of `{arm.robot.name}`"
        raise PostprocError.of("CLI017", text, help=f"hang at most {rated:g} kg on it")
    if options.tool is not None:
        tool = transform(np.array(parse_vector("--tool", options.tool, "0,0,350")) * 1e-3)
        arm = replace(arm, T_flange_tcp=tool)
    say(f"arm `{arm.robot.name}`; {kind}; no table")
    plan = plan_setups(arm, Asked(kind, load, pull, wanted.sigma, wanted.box), wanted.count)
    document = first_plan_document(name.name, plan)
    label = "the table" if wanted.table is None else wanted.table.name
    sheet = render_sheet(document, BOXES.get(kind, ())).encode("utf-8", "replace")
    files = [(wanted.rapid, setups_module(plan, label, options.signal)), (wanted.sheet, sheet)]
    table = [(wanted.table, setups_csv(plan).encode())] * (wanted.table is not None or not wanted.json)
    write_together([*((path, data) for path, data in files if path is not None), *table])
    present(document, json=wanted.json, text=True, on_stderr=True)
    if wanted.table is not None and not wanted.json:
        words = [] if options.tool is None else ["--tool", options.tool]
        what = "says what is known of the arm, once the readings are filled in"
        say_next(what, "fit", wanted.table, "--robot", arm.robot_name, *words, "-o", "MODEL.toml")
    return 0


def _arm(name: Path, arm_options: ArmOptions) -> Model:
    """Return the model in a file, or an arm of the library by its name, with springs if somebody knows them."""
    from postproc.model.arm import Model
    from postproc.robot.catalogue import load_robot

    if name.exists() or name.suffix:
        return load_model(name, arm_options.effects, arm_options.cell)
    return Model(load_robot(str(name)), robot_name=str(name))
