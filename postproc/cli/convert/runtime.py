"""``postproc runtime write|check``: a RAPID module that corrects targets on the controller."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from cyclopts import Parameter

from postproc.cli.frames import parse_tool
from postproc.cli.inputs import read_source
from postproc.cli.options import (
    CheckFlag,
    Names,
    RequiredOutput,
    Tolerance,
    VectorText,
    parse_channel,
    parse_numbers,
    parse_vector,
)
from postproc.cli.output import check_outputs, present
from postproc.cli.output import write as write_file
from postproc.cli.printing import show
from postproc.cli.program_options import RobotOptions
from postproc.cli.programs import settled
from postproc.cli.progress import watching
from postproc.diagnostics import PostprocError, has_errors

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

    def conditions(self, settings: Settings, model: Model) -> Conditions:
        """Return the range of targets that the module is made for, without process force.

        Raises:
            PostprocError: an option cannot be read (CLI006).
        """
        import numpy as np

        from postproc.runtime.conditions import Conditions

        frame = model.T_flange_tcp if self.tcp is None else parse_tool(self.tcp, "--tcp", "0,0,350")
        mass, centre = 0.5 * (model.robot.payload or 0.0), 0.5 * frame[:3, 3]
        if self.load is not None:
            mass, *xyz = parse_numbers("--load", self.load, 4, "`--load 30,0,0,120`")
            centre = 1e-3 * np.array(xyz)
        lower, upper = model.robot.lower, model.robot.upper
        if self.region is not None:
            pairs = self.region.split(",")
            example = "`--region=-90:90,-30:60,-60:30,-180:180,20:100,-180:180`"
            ranges = [parse_numbers("--region", pair, 2, example, ":") for pair in pairs]
            if len(ranges) != 6 or any(low > high for low, high in ranges):
                text = f"`--region {self.region}` is not six ranges"
                raise PostprocError.of("CLI006", text, help=f"write {example}")
            low, high = np.radians(ranges).T
            lower, upper = np.maximum(low, lower), np.minimum(high, upper)
        channels, source = dict(map(parse_channel, self.channel)), settings.model.name if settings.model else ""
        return Conditions(lower, upper, frame, mass, centre, channels=channels, source=source)


def write(
    *,
    output: RequiredOutput,
    made_for: RunTimeOptions = RunTimeOptions(),
    force: VectorText = "0,0,0",
    moment: VectorText = "0,0,0",
    force_on: Literal["all", "arc"] = "arc",
    bound: Tolerance = 5.0,
    template: Path | None = None,
    json: CheckFlag = False,
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
    import numpy as np

    from postproc.runtime.document import written_document
    from postproc.runtime.written import write_module

    settings = made_for.settings_at(output.parent)
    check_outputs(settings.inputs, output)
    settings, model = settled(settings, str(output))
    push, turn = (np.array(parse_vector(f"--{n}", v)) for n, v in (("force", force), ("moment", moment)))
    conditions = replace(
        made_for.conditions(settings, model), force=push, moment=turn, force_on=force_on, bound_m=1e-3 * bound
    )
    with watching(f"fitting `{output}`"):
        result = write_module(model, conditions, output.stem, template)
    show(result.diagnostics)
    failed = has_errors(result.diagnostics)
    if not failed:
        write_file(output, result.text)
    present(written_document(str(output), model.robot.name, result), json=json, text=True, on_stderr=True)
    return int(failed)


def check(
    module: str,
    /,
    *,
    made_for: RunTimeOptions = RunTimeOptions(),
    targets: int = 60,
    tolerance: Tolerance = 0.02,
    json: CheckFlag = False,
) -> int:
    """Run a written module on targets drawn from a region and compare it with the exact correction of a model.

    Args:
        module: file of `postproc runtime write`, also one that was edited.
        targets: how many.
        tolerance: exit 1 where it is off by more [mm].
        json: print the postproc/runtime/1 document.
    """
    from postproc.runtime.document import check_document
    from postproc.runtime.proof.check import check_module
    from postproc.runtime.tables import corrected_model

    settings, model = settled(made_for.settings_at(Path(module).parent), str(Path(module)))
    conditions = made_for.conditions(settings, model)
    source = read_source(module)
    with watching(f"running `{module}`"):
        (result,) = check_module(source, corrected_model(model, conditions).model, [(conditions, targets)])
    present(check_document(module, model.robot.name, result), json=json, text=True, on_stderr=True)
    return 1 if result.raised or not result.corrected or 1e3 * result.largest_m > tolerance else 0
