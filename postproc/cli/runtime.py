"""``postproc runtime write|check``: a RAPID module that corrects targets on the controller."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

from postproc.cli.conversion import VectorText, parse_channel, parse_vector
from postproc.cli.inputs import load_model, read_source
from postproc.cli.options import EffectFiles, Flag, ModelFile, Names, Tolerance
from postproc.cli.output import check_outputs
from postproc.cli.output import write as write_file
from postproc.cli.report import print_json, say, show
from postproc.diagnostics import PostprocError

if TYPE_CHECKING:
    from postproc.model.arm import Model
    from postproc.runtime.check import Check
    from postproc.runtime.conditions import Conditions


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class RunTimeOptions:
    """The arm, and what the module is made for.

    Attributes:
        model: TOML file of the real arm. Default: the shipped model of the arm, with elastic joints.
        robot: arm of the library, in place of the model's.
        tcp: TCP for which errors are stated, in tool0 [mm]. Default: the tool of the model.
        load: mass of tool and payload and its centre in tool0, KG,X,Y,Z [kg, mm]. Default: half the rated payload.
        region: ranges of the six joint angles, LOW:HIGH,.. [deg]. Default: the limits of the arm.
        channel: what effects read and a controller does not tell, NAME=NUMBER: temperature [degC], columns of your own.
    """

    model: ModelFile = None
    robot: str | None = None
    effects: EffectFiles = ()
    tcp: VectorText | None = None
    load: VectorText | None = None
    region: VectorText | None = None
    channel: Names = ()

    def arm(self) -> Model:
        """The model, with another arm where one is named."""
        return load_model(self.model, self.robot, self.effects)

    def conditions(self, model: Model) -> Conditions:
        """What the module is made for, without process force.

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
            mass, *rest = numbers("--load", self.load, ",", 4, "30,0,0,120")
            centre = 1e-3 * np.array(rest)
        lower, upper = model.robot.lower, model.robot.upper
        if self.region is not None:
            pairs = self.region.split(",")
            ranges = [numbers("--region", pair, ":", 2, REGION) for pair in pairs]
            if len(ranges) != 6 or any(low > high for low, high in ranges):
                raise PostprocError.of("CLI006", f"`--region {self.region}` is not six ranges", help=f"write {REGION}")
            low, high = np.radians(ranges).T
            lower, upper = np.maximum(low, lower), np.minimum(high, upper)
        return Conditions(lower, upper, frame, mass, centre, channels=dict(map(parse_channel, self.channel)))


REGION = "`--region=-90:90,-30:60,-60:30,-180:180,20:100,-180:180`"


def numbers(option: str, text: str, between: str, count: int, such_as: str) -> list[float]:
    """Finite numbers of an option.

    Raises:
        PostprocError: another number of them, or none at all (CLI006).
    """
    import math

    try:
        values = [float(part) for part in text.split(between)]
    except ValueError:
        values = []
    if len(values) != count or not all(map(math.isfinite, values)):
        raise PostprocError.of("CLI006", f"`{option} {text}` is not {count} numbers", help=f"write {such_as}")
    return values


def write(
    *,
    output: Annotated[Path, Parameter(name=["--output", "-o"])],
    made_for: RunTimeOptions = RunTimeOptions(),
    force: VectorText = "0,0,0",
    moment: VectorText = "0,0,0",
    force_on: Literal["all", "arc"] = "arc",
    bound: Tolerance = 5.0,
    template: Path | None = None,
    json: Flag = False,
) -> int:
    """Write a module with a function that corrects targets that exist only at run time.

    Args:
        output: module to write, ppModel.sys; its name becomes the name of the module.
        force: force of the process on the TCP in base axes [N], FX,FY,FZ.
        moment: moment of the process on the TCP in base axes [N m], MX,MY,MZ.
        force_on: where the force acts: on every target, or where the function is called with Weld.
        bound: largest correction [mm]; targets that ask for more are returned as they came.
        template: folder of Jinja templates in place of the shipped ones.
        json: print the postproc/runtime/1 document.
    """
    from dataclasses import replace

    import numpy as np

    from postproc.diagnostics import has_errors
    from postproc.runtime.check import said
    from postproc.runtime.module import cost
    from postproc.runtime.written import write_module

    check_outputs((made_for.model, *made_for.effects), output)
    model = made_for.arm()
    push, turn = (np.array(parse_vector(f"--{n}", v)) for n, v in (("force", force), ("moment", moment)))
    conditions = replace(made_for.conditions(model), force=push, moment=turn, force_on=force_on, bound_m=1e-3 * bound)
    result = write_module(model, conditions, output.stem, template)
    show(result.diagnostics)
    failed = has_errors(result.diagnostics)
    if not failed:
        write_file(output, result.text)
    say(f"{output}: `{model.robot.name}`, {cost(result.correction)} for one target")
    for done, found in result.checks:
        say(said(found, done))
    if json:
        checks = [_document(done, found) for done, found in result.checks]
        laws = result.correction.laws
        effects = {"exact": laws.exact, "fitted": laws.fitted, "left_out": result.correction.left_out}
        found_ = [d.as_json() for d in result.diagnostics]
        print_json({"schema": "postproc/runtime/1", "effects": effects, "checks": checks, "diagnostics": found_})
    return 1 if failed else 0


def check(
    module: str,
    /,
    *,
    made_for: RunTimeOptions = RunTimeOptions(),
    targets: int = 1000,
    tolerance: Tolerance = 0.02,
    json: Flag = False,
) -> int:
    """Run a written module on targets drawn from a region and compare it with the exact correction of a model.

    Args:
        module: file of `postproc runtime write`, also one that was edited.
        targets: how many.
        tolerance: exit 1 where it is off by more [mm].
        json: print the postproc/runtime/1 document.
    """
    from postproc.runtime.check import check_module, said

    model = made_for.arm()
    conditions = made_for.conditions(model)
    found = check_module(read_source(module), model, conditions, targets)
    say(f"{module}: `{model.robot.name}`, {said(found, conditions)}")
    if found.raised:
        say(f"an error leaves the function at {found.raised} targets")
    if json:
        print_json(
            {"schema": "postproc/runtime/1", "effects": {}, "checks": [_document(conditions, found)], "diagnostics": []}
        )
    return 1 if found.raised or not found.corrected or 1e3 * found.largest_m > tolerance else 0


def _document(done: Conditions, found: Check) -> dict[str, object]:
    return {
        "mass_kg": done.mass,
        "corrected": found.corrected,
        "returned": {str(why): times for why, times in found.returned.items()},
        "errors": found.raised,
        "max_error_mm": 1e3 * found.largest_m,
        "rms_error_mm": 1e3 * found.rms_m,
        "max_correction_mm": 1e3 * found.correction_m,
    }
