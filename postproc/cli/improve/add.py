"""``postproc add``: a model with more physics, and the error before and after."""

from __future__ import annotations

from postproc.cli.improve.model_options import ArmOptions, MeasuredOptions, opened
from postproc.cli.inputs import say_uses, short_names
from postproc.cli.options import ArmFile, CheckFlag, DataFiles, Output, ReportFile, TextFlag
from postproc.cli.output import present, write_model
from postproc.cli.printing import show
from postproc.cli.progress import watching
from postproc.diagnostics import Diagnostic, PostprocError


def run(
    model: ArmFile,
    /,
    *effect: str,
    data: DataFiles,
    arm_options: ArmOptions = ArmOptions(),
    output: Output = None,
    table: MeasuredOptions = MeasuredOptions(),
    report: ReportFile = None,
    json: CheckFlag = False,
    text: TextFlag = False,
) -> int:
    """Add effects to a model, refit everything, and show how far the error falls on rows the fit has not seen.

    Args:
        effect: keys of the effects to add, one after another.
        data: table of measured poses (CSV); - reads stdin. May be repeated.
        output: model file to write; comments of the model survive. Default: stdout, and nowhere with --json.
        json: print the postproc/fit/1 document.
    """
    from postproc.identification.add import add_effects
    from postproc.results.improve.addition import addition_document

    keys = [key for word in effect for key in word.split(",") if key]
    if not keys:
        help_ = "write `postproc add MODEL backlash --data DATA`"
        raise PostprocError.of("CLI011", "no effect is named", help=help_)
    arm, measured = opened(model, data, arm_options, table, output, report)
    show(
        Diagnostic("DAT029", "info", f"`{key}` is in the model: it is fitted again") for key in keys if arm.effect(key)
    )
    with watching("adding") as watch:
        addition = add_effects(arm, measured, keys, arm_options.classes, noise=table.sigma, watch=watch)
    write_model(output, addition.model, like=model, silent=json)
    document = addition_document(short_names(model, *keys, *data), addition)
    present(document, report, json=json, text=text, on_stderr=output is None)
    unnamed = addition.fit.unnamed  # of which no row is held out
    if not json and output is not None and (unnamed or addition.fit.held_out_rms < addition.before.held_out_rms):
        tables = (*data, *table.words(), *arm_options.words())
        say_uses(output, tables, ArmOptions(effects=arm_options.effects).words())
    return 0
