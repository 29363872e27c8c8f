"""The RAPID module with the function that corrects targets on the controller."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from postproc.arrays import Array
from postproc.diagnostics import PostprocError
from postproc.rapid.evaluation.state import NO_MASS
from postproc.render.templates import environment, fill, load_template
from postproc.runtime.conditions import WRIST
from postproc.runtime.formulas.correction import LARGEST_TURN, PASSES, RunTimeCorrection
from postproc.runtime.formulas.curves import Curve
from postproc.runtime.formulas.tape import number, written

MARKER = "postproc runtime 1"
"""First words of the comment after MODULE, by which a module of this kind is known."""
MOST_LOAD = 2.0  # times what the arm carries
PER_LINE = 10
UNKNOWN_LOAD_KG = 1000.0
NAME = "ppModel"


def runtime_module(
    correction: RunTimeCorrection, errors: Sequence[str] = (), name: str = NAME, template_dir: Path | None = None
) -> bytes:
    """The text of the module.

    Args:
        errors: lines of the header that say how large its error is. name: of the module.
        template_dir: folder whose `runtime_module.j2` takes the place of the shipped one.

    Raises:
        PostprocError: RUN001 the name is none of RAPID; REN001, REN002 the template.
    """
    if not (name.isascii() and name.isidentifier() and not name.startswith("_") and len(name) <= 32):
        text = f"`{name}` is no name of a module"
        raise PostprocError.of("RUN001", text, help="a letter, then at most 31 letters, digits and underscores")
    formula, done = correction.formula, correction.conditions
    moved = tuple(-x for x in formula.moved or ())
    first = written((formula.straight, *formula.joints, *moved))
    # Names go on after those of the first part.
    second = written(formula.commanded or (), len(first.variables))
    most = MOST_LOAD * (correction.model.robot.payload or UNKNOWN_LOAD_KG)
    values = {
        "module": name,
        "marker": MARKER,
        "header": [*header(correction), *errors],
        "bound": number(1e3 * done.bound_m),
        "force": [number(x) for x in done.force] if done.forced else [],
        "moment": [number(x) for x in done.moment],
        "force_on": done.force_on,
        "tables": [_table(curve) for curve in correction.tables.every],
        "region": [(number(a), number(b)) for a, b in np.degrees([done.lower, done.upper]).T.tolist()],
        "variables": [*first.variables, *second.variables],
        "most_kg": number(most),
        "no_mass": number(NO_MASS),
        "statements": first.statements,
        "straight": first.results[0],
        "straightest": number(float(np.cos(np.arcsin(WRIST)))),
        "joints": first.results[1:7],
        "moved": first.results[7:],
        "commanded": second.results,
        "commanded_statements": second.statements,
        "passes": PASSES,
        "largest_turn": number(float(np.degrees(LARGEST_TURN))),
    }
    text = fill(load_template(environment(template_dir), "runtime_module.j2"), values)
    return (text.rstrip("\n") + "\n").encode("ascii", "replace")


def header(correction: RunTimeCorrection) -> Iterator[str]:
    """Lines that say what the module is made for."""
    done, laws = correction.conditions, correction.laws
    estimated = correction.model.stiffness_source == "estimated"
    shipped = f"shipped, with a stiffness that is {'estimated by a rule' if estimated else 'published for its type'}"
    yield f"model: {done.source or shipped}; arm: {correction.model.robot.name}"
    yield f"in closed form or as tables: {_words(laws.exact)}"
    if correction.fitted is not None:
        terms = len(correction.fitted.terms)
        yield f"fitted over the region with {terms} terms, for the load below: {_words(laws.fitted)}"
    if correction.left_out:
        yield f"left out, a target does not tell what they follow: {_words(correction.left_out)}"
    for name, value in done.channels.items():
        yield f"constant: {name} = {value:g}"
    yield f"gravity in axes of the base [m/s2]: {_numbers(correction.model.gravity)}"
    if done.forced:
        when = "on every target" if done.force_on == "all" else "where Weld is given"
        yield f"process force {when} [N]: {_numbers(done.force)}, moment [N m]: {_numbers(done.moment)}"
    for j, (low, high) in enumerate(np.degrees([done.lower, done.upper]).T, 1):
        yield f"region of axis {j} [deg]: {low:.6g} to {high:.6g}"
    yield (
        f"errors are stated for TCP {_numbers(1e3 * done.T_flange_tcp[:3, 3])} mm, {done.mass:g} kg "
        f"at {_numbers(1e3 * done.center)} mm"
    )
    yield f"one target costs {cost(correction)}"


def cost(correction: RunTimeCorrection) -> str:
    """Operations and calls that one target takes."""
    formula = correction.formula
    first = written((formula.straight, *formula.joints, *(formula.moved or ())))
    again = written(formula.commanded or ())
    curves = first.lookups + PASSES * again.lookups
    operations = first.operations + PASSES * again.operations + CURVE_OPERATIONS * curves
    solved = 3 if formula.moved else 2
    functions = first.functions + PASSES * again.functions
    calls = f"{operations} operations, {functions} sines and cosines, {solved} CalcJointT, 2 CalcRobT"
    taken = steps(correction)
    return f"{calls} in {taken} steps, about {taken / STEPS_PER_MS:.0f} ms"


def steps(correction: RunTimeCorrection) -> int:
    """Statements of RAPID that one target takes that is corrected."""
    formula = correction.formula
    first = written((formula.straight, *formula.joints, *(formula.moved or ())))
    again = written(formula.commanded or ())
    beside = FORCE_STEPS * correction.conditions.forced + MOVED_STEPS * (formula.moved is not None)
    looked_up = CURVE_STEPS * (first.lookups + PASSES * again.lookups)
    passes = 1 + PASSES * (6 + len(again.statements)) if formula.commanded is not None else 0
    return PLAIN_STEPS + beside + len(first.statements) + passes + looked_up


CURVE_OPERATIONS = 30
PLAIN_STEPS, FORCE_STEPS, MOVED_STEPS, CURVE_STEPS = 74, 7, 3, 10
"""Statements of the template: always, with a process force, with soft bodies, for a value of a table."""
STEPS_PER_MS = 44.0
"""Statements that a controller runs in a millisecond, RobotWare 6.12 and later, of a program that runs ahead of the
motion (industrialmonitordirect.com); nobody has measured the function on a controller here."""


def _table(curve: Curve) -> dict[str, object]:
    values = [number(float(x)) for x in curve.values]
    rows = [values[i : i + PER_LINE] for i in range(0, len(values), PER_LINE)]
    lines = [",".join(row) + ("," if i + 1 < len(rows) else "") for i, row in enumerate(rows)]
    return {"name": curve.name, "size": len(values), "lines": lines}


def _words(keys: Sequence[str]) -> str:
    return ", ".join(keys) or "nothing"


def _numbers(values: Array) -> str:
    return "[" + ",".join(f"{x:.6g}" for x in values) + "]"
