"""``postproc compare``: where a model fails on measurements."""

from __future__ import annotations

from pathlib import Path

from postproc.cli.inputs import cell_words, open_model, short_names
from postproc.cli.options import (
    ArmFile,
    CertificateFile,
    EffectFiles,
    Flag,
    MeasuredOptions,
    ReportFile,
    Tables,
    TextFlag,
)
from postproc.cli.output import check_outputs, present, write
from postproc.cli.progress import watching
from postproc.cli.report import say_next, show


def run(
    model: ArmFile,
    /,
    *data: Tables,
    effects: EffectFiles = (),
    cell: Path | None = None,
    table: MeasuredOptions = MeasuredOptions(),
    report: ReportFile = None,
    certificate: CertificateFile = None,
    json: Flag = False,
    text: TextFlag = False,
) -> int:
    """Compare a model with measurements: figures, the worst poses, the residual against every channel.

    Args:
        json: print the postproc/compare/1 document.
        cell: what carries the arm and its work, in place of what the model says: as for ``compensate``.
    """
    from postproc.identification.compare import compare
    from postproc.report.page import render_certificate
    from postproc.results.certificate import arm_certificate
    from postproc.results.comparison import comparison_document

    check_outputs((model, *data, *table.inputs, *effects, cell), report, certificate)
    arm = open_model(model, effects, cell, sigma=table.sigma)
    measured = table.read(data, arm.robot, at=arm.station)
    with watching(f"comparing {len(measured)} rows"):
        found = compare(arm, measured, noise=table.sigma)
    show(found.moved)
    if certificate is not None:
        write(certificate, render_certificate(arm_certificate(short_names(model, *data), found)))
    present(comparison_document(short_names(model, *data), found), report, json=json, text=text)
    if not json:
        say_next(
            "says whether an effect is missing", "diagnose", model, *data, *table.words(effects), *cell_words(cell)
        )
    return 0
