"""``postproc compensate``: a program in, the corrected program out."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from postproc.cli.convert.finish import finish, module_file, say_missed, show_result
from postproc.cli.data_names import check_names
from postproc.cli.options import CertificateFile, CheckFlag, Format, Output, OutputFlag, ReportFile, Require
from postproc.cli.output import check_outputs
from postproc.cli.printing import STDIN, print_document, say_next, show
from postproc.cli.program_options import TaskOptions
from postproc.cli.programs import check_unchanged, named_files, read_program_file, read_task, settled
from postproc.cli.progress import watching
from postproc.cli.run import Outcome
from postproc.diagnostics import PostprocError
from postproc.files import place
from postproc.process import spare_scipy

if TYPE_CHECKING:
    from postproc.compensation.conversion import Conversion
    from postproc.settings import Settings


def run(
    program: str,
    /,
    *,
    output: Output = None,
    convert: TaskOptions = TaskOptions(),
    report: ReportFile = None,
    certificate: CertificateFile = None,
    in_place: OutputFlag = False,
    check: CheckFlag = False,
    diff: CheckFlag = False,
    require: Require = None,
    format: Format = None,
    json: CheckFlag = False,
) -> Outcome:
    """Correct a program so that the real arm goes where the program says.

    Args:
        program: RAPID module; - reads stdin.
        output: where to write the corrected program. Default: stdout, and nowhere with --json.
        in_place: write over the program itself.
        check: write nothing; exit 1 if the output (the program, without -o) would change.
        diff: write nothing; print the textual difference, exit 1 if there is one.
        json: print the postproc/compensate/1 document.
    """
    spare_scipy()
    from postproc.runtime.passes import correct_program

    _check_target(program, output, in_place)
    source = read_program_file(program)
    form = "json" if json else format
    settings = convert.settings_at(Path(program).parent)
    target = Path(program) if in_place else output
    module_path = module_file(settings.options, target, nothing=check or diff or form is not None)
    check_outputs((program, *settings.inputs), output, report, certificate, module_path)
    settings, arm = settled(settings, program)
    sources, options, findings = read_task(source, settings, output, report, certificate, module_path)
    check_names(convert, sources)
    with watching(f"correcting `{source.path}`", len(source.line_starts)) as watch:
        result = correct_program(sources, arm, options, watch, findings)
    show(named_files(result.diagnostics, sources))
    show_result(Path(source.path), result, settings, report, certificate)
    _say_next(settings, result, program)
    code, changes = 0 if result.outputs else max(1, result.exit_code), False
    if result.output is not None:
        names = (source.path, str(target or "compensated"))
        if in_place and not (check or diff):
            check_unchanged(source)
        module = None if result.module is None or module_path is None else (module_path, result.module)
        quiet = form is not None
        changes = finish(source.data, result.output, names, target, check=check, diff=diff, silent=quiet, module=module)
    if form is not None:  # files first: who reads stdout may go away
        print_document({**result.report, **settings.document(arm.robot.name)}, form)
    lacks = say_missed(require, {Path(source.path).name: result.report})
    return Outcome(max(code, changes, lacks), changes, lacks)


def _check_target(program: str, output: Path | None, in_place: bool) -> None:
    """Check that the corrected program is written over the program where that is asked for, and only there; CLI007."""
    if in_place and program == STDIN:
        text = "`--in-place` writes over a file, and the program comes from stdin"
        raise PostprocError.of("CLI007", text, help="name the result with `-o`, or leave it to stdout")
    if in_place and output is not None:
        raise PostprocError.of("CLI007", "`--in-place` and `-o` exclude each other", help="leave one of them out")
    if output is not None and program != STDIN and place(output) == place(Path(program)):
        help_ = "choose another name; or say `--in-place` to write over the program"
        raise PostprocError.of("CLI007", f"the output `{output}` is the input `{program}`", help=help_)


def _say_next(settings: Settings, result: Conversion, program: str) -> None:
    """Say how to plan touches of a tip where these would tell weights of links that readings of a gauge leave open."""
    from postproc.results.convert.conclusion import touches_help

    model, judged = result.model, result.judged
    if model is None or judged is None or not touches_help(judged.accuracy, model):
        return
    heaviest = model.fit["range"].get("payload", (0.0, 0.0))[1]
    loads, what = ("--load", f"{heaviest:g}") if heaviest else (), "chooses touches that tell how far the arm sags"
    named = "PROGRAM" if program == STDIN else program
    say_next(what, "plan", settings.model, "--kind", "tip", *loads, "--for", named, "-o", "tip.csv")
