"""A program corrected as its options say: by numbers, and what these leave by a function on the controller."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from postproc.compensation.conversion import Conversion, Draft
from postproc.compensation.options import Options
from postproc.convert import converted, correct_by_numbers, follow_program, prove_numbers
from postproc.diagnostics import Diagnostic, Matter, Source
from postproc.model.arm import Model
from postproc.runtime.programs.reach import Reach, counted
from postproc.watch import Watch, unwatched


def correct_program(
    source: Source | Sequence[Source],
    model: Model,
    options: Options,
    watch: Watch = unwatched,
    findings: Sequence[Diagnostic] = (),
) -> Conversion:
    """Correct the program of one task so that the real arm follows its programmed paths.

    Without ``options.run_time`` numbers alone correct it, and RUN007 says what a function could correct.

    Args:
        source: one file, or all files of a task; each of them that is not read only may change.
        model: the real arm.
        watch: is called with the name of each step and the share of the work done so far.
        findings: on how its files were read; they come before those of the conversion.
    """

    def convert(sources: Sequence[Source]) -> Conversion:
        """The conversion in one pass or two."""
        draft = follow_program(sources, model, options, watch)
        if options.run_time == "off":
            return prove_numbers(say_reachable(correct_by_numbers(draft, watch)), watch)
        from postproc.runtime.programs.correct import correct_at_run_time, leave_to_function

        draft = correct_by_numbers(leave_to_function(draft), watch)
        return correct_at_run_time(draft, watch) or prove_numbers(draft, watch)

    return converted(source, convert, findings)


def say_reachable(draft: Draft) -> Draft:
    """A written program with RUN007, an info that says how many statements the function could correct, if any."""
    reach = Reach(draft.program, draft.events, draft.options.scope)
    keys = {key for key in draft.not_corrected() if reach.takes(key)}
    statements = [s for s in draft.program.statements if s.key in keys]
    if not statements:
        return draft
    welds = sum(bool(s.signature.phase) for s in statements)
    burning = f" ({welds} of them weld)" if welds else ""
    text = f"{counted(len(statements), 'motion statement')}{burning} could be corrected on the controller"
    help_ = "numbers cannot correct them: `--run-time where-needed` writes a function beside the program that does"
    first = statements[0]
    reachable = Diagnostic("RUN007", "info", text, first.source, first.span, help_, Matter.CONTROLLER)
    remedy = f"`--run-time where-needed` corrects {len(statements)} of its motion statements on the controller"
    return replace(draft, remedy=remedy).with_findings([reachable])
