"""``postproc runtime write|check``: a RAPID module that corrects targets on the controller."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from postproc.cli.convert.made_for import RunTimeOptions
from postproc.cli.inputs import read_source
from postproc.cli.options import Flag, RequiredOutput, Tolerance, VectorText, parse_vector
from postproc.cli.output import check_outputs, present
from postproc.cli.output import write as write_file
from postproc.cli.printing import show
from postproc.cli.progress import watching


def write(
    *,
    output: RequiredOutput,
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
    from postproc.runtime.document import written_document
    from postproc.runtime.written import write_module

    check_outputs(made_for.settings_at(output.parent).inputs, output)
    settings, model = made_for.arm(output)
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
    present(written_document(str(output), model.robot.name, result), json=json, text=True, aside=True)
    return 1 if failed else 0


def check(
    module: str,
    /,
    *,
    made_for: RunTimeOptions = RunTimeOptions(),
    targets: int = 60,
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
    from postproc.runtime.document import check_document
    from postproc.runtime.proof.check import check_module
    from postproc.runtime.tables import corrected_model

    settings, model = made_for.arm(Path(module))
    conditions = made_for.conditions(settings, model)
    source = read_source(module)
    with watching(f"running `{module}`"):
        (result,) = check_module(source, corrected_model(model, conditions).model, [(conditions, targets)])
    present(check_document(module, model.robot.name, result), json=json, text=True, aside=True)
    return 1 if result.raised or not result.corrected or 1e3 * result.largest_m > tolerance else 0
