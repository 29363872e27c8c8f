"""A module for run time that proves itself: written, run, and written again with what it was found to do."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from postproc.diagnostics import Diagnostic, Source
from postproc.model.arm import Model
from postproc.runtime.conditions import Conditions
from postproc.runtime.formulas.correction import RunTimeCorrection, run_time_correction
from postproc.runtime.module import NAME, runtime_module
from postproc.runtime.proof.check import Check, check_module, said
from postproc.runtime.proof.chord import ChordError, chord_error

COARSE_M = 2e-5
"""Error above which a module is said to be coarse."""


@dataclass(frozen=True)
class RunTimeModule:
    """A module and what is known of it.

    Args:
        text: the file. checks: with the stated load, then with none and with all that the arm carries.
        chord: what is left between corrected ends.
    """

    text: bytes
    correction: RunTimeCorrection
    checks: tuple[tuple[Conditions, Check], ...]
    chord: ChordError
    diagnostics: tuple[Diagnostic, ...]


def write_module(model: Model, conditions: Conditions, name: str = NAME, template: Path | None = None) -> RunTimeModule:
    """Make the module, run it over the region with three loads, and state its errors in its header.

    Raises:
        PostprocError: RUN001 the name; REN001, REN002 the template; RUN003 the template's text cannot be run; MOD010.
    """
    correction = run_time_correction(model, conditions)
    source = Source(f"{name}.sys", runtime_module(correction, (), name, template))
    rated = model.robot.payload or conditions.mass
    masses = dict.fromkeys((conditions.mass, 0.0, rated))
    every = [replace(conditions, mass=mass) for mass in masses]
    checks = tuple((each, check_module(source, model, each)) for each in every)
    chord = chord_error(model, conditions)
    lines = [line for each, found in checks for line in said(found, each).split("; ")]
    lines += str(chord).split("; ")
    text = runtime_module(correction, lines, name, template)
    return RunTimeModule(text, correction, checks, chord, tuple(_findings(correction, checks)))


def _findings(correction: RunTimeCorrection, checks: tuple[tuple[Conditions, Check], ...]) -> list[Diagnostic]:
    found = []
    if correction.left_out:
        keys = ", ".join(f"`{key}`" for key in correction.left_out)
        text, help_ = (
            f"{keys} is left out: a target does not tell what it follows",
            "state it with --channel, if it can be",
        )
        found.append(Diagnostic("RUN004", "warning", text, help=help_))
    worst = max(check.largest_m for _, check in checks)
    if worst > COARSE_M:
        text = f"the module is off by up to {1e3 * worst:.3f} mm in the region"
        help_ = "give a smaller --region, around the poses of the work, and the tool that is used"
        found.append(Diagnostic("RUN005", "warning", text, help=help_))
    if not any(check.corrected for _, check in checks):
        text = "the module corrects no target of the region"
        found.append(Diagnostic("RUN006", "error", text, help="look at --bound, the loads and the region"))
    return found
