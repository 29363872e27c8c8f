"""``postproc compare``: where a model fails on measurements."""

from __future__ import annotations

from postproc.cli.improve.model_options import ArmOptions, MeasuredOptions, opened
from postproc.cli.inputs import short_names
from postproc.cli.options import ArmFile, CertificateFile, CheckFlag, ReportFile, Tables, TextFlag
from postproc.cli.output import present, write
from postproc.cli.printing import say_next, show
from postproc.cli.progress import watching
from postproc.files import read_source


def run(
    model: ArmFile,
    /,
    *data: Tables,
    arm_options: ArmOptions = ArmOptions(),
    table: MeasuredOptions = MeasuredOptions(),
    report: ReportFile = None,
    certificate: CertificateFile = None,
    json: CheckFlag = False,
    text: TextFlag = False,
) -> int:
    """Compare a model with measurements: figures, the worst poses, the residual against every column.

    Args:
        json: print the postproc/compare/1 document.
    """
    from postproc.identification.compare import compare
    from postproc.report.page import render_certificate
    from postproc.results.certificate import arm_certificate
    from postproc.results.improve.comparison import comparison_document

    arm, measured = opened(model, data, arm_options, table, report, certificate)
    with watching(f"comparing {len(measured)} rows"):
        comparison = compare(arm, measured, noise=table.sigma)
    show(comparison.moved)
    if certificate is not None:
        files = [read_source(model), *map(read_source, arm_options.effects)]
        write(certificate, render_certificate(arm_certificate(short_names(model, *data), comparison, files)))
    present(comparison_document(short_names(model, *data), comparison), report, json=json, text=text)
    if not json:
        say_next("says whether an effect is missing", "diagnose", model, *data, *table.words(), *arm_options.words())
    return 0
