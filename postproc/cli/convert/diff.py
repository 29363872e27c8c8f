"""``postproc diff``: two programs compared by meaning."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from postproc.cli.inputs import read_source
from postproc.cli.options import Distance, Flag, ReportFile
from postproc.cli.output import check_outputs, write
from postproc.cli.report import print_json, put, show
from postproc.diagnostics import PostprocError, has_errors

if TYPE_CHECKING:
    from postproc.rapid.program.program import Program


def run(
    a: str,
    b: str,
    /,
    *,
    tolerance: Distance = 0.001,
    angle_tolerance: Distance = 0.01,
    report: ReportFile = None,
    json: Flag = False,
) -> int:
    """Compare two programs by meaning, statement by statement; exit 1 if they differ by more than the tolerance.

    Args:
        a: RAPID module.
        b: RAPID module.
        tolerance: distance between targets that is still the same [mm].
        angle_tolerance: angle between their orientations, or between joints, that is still the same [deg].
        json: print the postproc/diff/1 document.
    """
    from postproc.rapid.diff.compare import compare_programs
    from postproc.report.difference import difference_page
    from postproc.report.document import plain

    check_outputs((a, b), report)
    found = compare_programs(_read(a), _read(b), tolerance, angle_tolerance)
    if report is not None:
        write(report, difference_page(Path(a).name, Path(b).name, plain(found.as_json())))
    if json:
        print_json(found.as_json())
    else:
        put(found.render())
    return int(not found.equal)


def _read(name: str) -> Program:
    from postproc.rapid.program.program import read_program

    program = read_program(read_source(name))
    if has_errors(program.diagnostics):
        raise PostprocError(program.diagnostics)
    show(program.diagnostics)
    return program
