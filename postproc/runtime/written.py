"""A module for run time that proves itself: written, run, and written again with what it was found to do."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from postproc.diagnostics import Diagnostic, Source
from postproc.model.arm import Model
from postproc.runtime.conditions import Conditions
from postproc.runtime.module import MODULE_NAME, module_tables, runtime_module
from postproc.runtime.proof.check import TARGETS, Check, ChordError, check_module, chord_error
from postproc.runtime.tables import CorrectedModel, corrected_model

COARSE_M = 2e-5
"""Error above which a module is said to be coarse."""
STEPS_PER_MS = 44.0
"""Statements that a controller runs in a millisecond, RobotWare 6.12 and later, of a program that runs ahead of the
motion (industrialmonitordirect.com); nobody has measured the function on a controller here."""


@dataclass(frozen=True)
class RunTimeModule:
    """A module for run time and what is known of its errors.

    Args:
        text: the file.
        corrected: the part of the model that it corrects.
        checks: with the stated load, with none, and with the arm's full payload.
        chord: error that remains on lines between corrected ends.
    """

    text: bytes
    corrected: CorrectedModel
    checks: tuple[Check, ...]
    chord: ChordError
    diagnostics: tuple[Diagnostic, ...]

    @property
    def cost(self) -> str:
        """Text that states the number of statements and the time for one target."""
        steps = max(check.steps for check in self.checks)
        return f"{steps} statements, about {steps / STEPS_PER_MS:.0f} ms"


def write_module(
    model: Model, conditions: Conditions, name: str = MODULE_NAME, template: Path | None = None
) -> RunTimeModule:
    """Make the run-time module, run it over the region with three loads, and state the errors found in its header.

    Raises:
        PostprocError: RUN001 the name; REN001, REN002 the template; RUN003 the template's text cannot be run; RUN006
            the region; MOD010 the deflection does not settle.
    """
    corrected = corrected_model(model, conditions)
    tables = module_tables(corrected, conditions)
    source = Source(f"{name}.sys", runtime_module(tables, (), name, template))
    rated = model.robot.payload or conditions.mass
    every = [replace(conditions, mass=mass) for mass in dict.fromkeys((conditions.mass, 0.0, rated))]
    counts = (TARGETS, *[TARGETS // 3] * (len(every) - 1))
    checks = check_module(source, corrected.model, [*zip(every, counts, strict=True)])
    chord = chord_error(corrected.model, conditions)
    made = RunTimeModule(source.data, corrected, checks, chord, tuple(_findings(corrected, checks)))
    lines = [f"one target takes {made.cost}", *(line for part in (*checks, chord) for line in str(part).split("; "))]
    return replace(made, text=runtime_module(tables, lines, name, template))


def _findings(corrected: CorrectedModel, checks: tuple[Check, ...]) -> list[Diagnostic]:
    """Diagnostics: effects left out (RUN004, RUN012), errors over 0.02 mm (RUN005), no target corrected (RUN006)."""
    findings = []
    for keys, code, why, help_ in (
        (corrected.untold, "RUN004", "a target does not tell what it follows", "state it with --channel, if it can be"),
        (corrected.unfit, "RUN012", "the tables of the function do not hold its law", "correct by numbers"),
    ):
        if keys:
            text = f"{', '.join(f'`{key}`' for key in keys)} is left out: {why}"
            findings.append(Diagnostic(code, "warning", text, help=help_))
    worst = max(check.largest_m for check in checks)
    if worst > COARSE_M:
        text = f"the module is off by up to {1e3 * worst:.3f} mm in the region"
        help_ = "give a smaller --region, around the poses of the work, and the tool that is used"
        findings.append(Diagnostic("RUN005", "warning", text, help=help_))
    if not any(check.corrected for check in checks):
        text = "the module corrects no target of the region"
        findings.append(Diagnostic("RUN006", "error", text, help="look at --bound, the loads and the region"))
    return findings
