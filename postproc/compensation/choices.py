"""What the corrections do where open data has another of its known values: `TEST nPart` chooses a target.

The program is followed with the value in the file. PERS data that nothing in the files writes may have another one:
those that the program itself compares it with, and the indices of arrays that it chooses from. With each of them, one
datum at a time, original and written program are followed again; where the arm then comes to another goal, the model
says how far from it the TCP is without and with what is written.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence, Set
from dataclasses import dataclass, replace

import numpy as np

from postproc.arrays import Array
from postproc.compensation.judgement.figures import finding
from postproc.compensation.plan import CorrectionPlan
from postproc.compensation.readback import run_again
from postproc.compensation.reading import read_runnable
from postproc.diagnostics import Diagnostic
from postproc.model.arm import Model
from postproc.model.equilibrium import predict
from postproc.motion.path.places import place_events
from postproc.rapid.data.events import MotionEvent, StatementKey
from postproc.rapid.data.records import RobTarget
from postproc.rapid.data.values import Data
from postproc.rapid.execution.walk import walk
from postproc.rapid.motions.recorder import reached
from postproc.rapid.program.program import Program, statements_of
from postproc.rapid.program.write_effects import WriteEffects
from postproc.rapid.syntax.nodes import Declaration
from postproc.robot.cells.station import Station

OPERATOR_TYPES = ("bool", "num", "dnum", "string")  # types of data that an operator sets
MOST_VALUES = 12  # that are followed; a program with more has a number that is no choice
_NUMBER_IN_TEXT = re.compile(r"(?<![\w.{])-?\d+(?:\.\d+)?(?![\w.])")
_STRING = re.compile(r'"([^"\n]*)"')


@dataclass(frozen=True, slots=True)
class OtherGoal:
    """A corrected statement at another goal.

    Args:
        name, value: of the data that leads there.
        event: the execution as it is corrected, with that goal and the frames and tool there.
        written: the goal that the written program gives it.
    """

    name: str
    value: Data
    event: MotionEvent
    written: RobTarget


def check_choices(
    model: Model, program: Program, events: Sequence[MotionEvent], drafts: Mapping[str, bytes], plan: CorrectionPlan
) -> list[Diagnostic]:
    """CMP023, a warning, at statements whose correction leaves more at another known goal than none would.

    Each has the goal at which it loses most.

    Args:
        events: all of the program.
        drafts: text of the written files by path.
    """
    goals = _other_goals(model, program, events, drafts, plan)
    if not goals:
        return []
    worst: dict[StatementKey, tuple[float, OtherGoal, float, float]] = {}
    for goal, (without, with_) in zip(goals, 1e3 * _deviations(model, goals, plan), strict=True):
        key, allowed = goal.event.statement.key, 1e3 * plan.motion.options.tolerance_m
        loses = float(with_ - without)
        if loses > allowed and loses > worst.get(key, (0.0,))[0]:
            worst[key] = loses, goal, float(without), float(with_)
    return [_finding(goal, without, with_) for _, goal, without, with_ in worst.values()]


def _finding(goal: OtherGoal, without: float, with_: float) -> Diagnostic:
    """CMP023 at the statement, with the deviation [mm] at the other goal without and with its correction."""
    value, shown = goal.value, f'"{goal.value}"'
    if isinstance(value, bool | float):
        shown = str(value).upper() if isinstance(value, bool) else f"{value:g}"
    text = (
        f"where `{goal.name}` is {shown}, its correction leaves {with_:.2f} mm, and none would leave {without:.2f} mm"
    )
    help_ = "give each of these goals a target of its own, or correct the program with each value in the file"
    return finding("CMP023", "warning", goal.event.statement, text, help_, size=with_)


def known_values(program: Program, written: Set[str]) -> list[tuple[Declaration, Data]]:
    """PERS data that decides, with each value that the program knows for it; at most ``MOST_VALUES`` in all.

    Known are the numbers and texts that its conditions compare it with (in a comparison by size also the numbers next
    to them), both truths, and the indices of an array that it chooses from.

    Args:
        written: keys of the data that the program may write, which is followed as it is set.
    """
    open_ = [d for d in program.declarations if _open(d) and d.key not in written]
    if not open_:
        return []
    conditions = [*_conditions(program)]
    texts = [source.data.decode("latin-1") for source in program.sources]
    lengths = ((d, d.source.data[slice(*d.dims[0])].strip()) for d in program.declarations if len(d.dims) == 1)
    sizes = {d.name.lower(): int(length) for d, length in lengths if length.isdigit()}
    known: list[tuple[Declaration, Data]] = []
    for d in open_:
        name = re.compile(rf"(?<![\w.]){re.escape(d.name)}(?!\w)", re.IGNORECASE)
        compared = [text for text in conditions if name.search(text)]
        values: list[Data] = []
        if d.type == "bool" and compared:
            values = [True, False]
        elif d.type == "string":
            values = [word for text in compared for word in _STRING.findall(text)]
        elif d.type in ("num", "dnum"):
            for text in compared:
                numbers = [float(number) for number in _NUMBER_IN_TEXT.findall(_STRING.sub("", text))]
                sized = re.search(r"<(?!>)|(?<!<)>", text) is not None
                values += [n + step for n in numbers for step in ((-1, 0, 1) if sized else (0,))]
            index = re.compile(rf"(\w+)\s*\{{\s*{re.escape(d.name)}\s*\}}", re.IGNORECASE)
            for array in {m[1].lower() for text in texts for m in index.finditer(text)}:
                values += [float(k + 1) for k in range(sizes.get(array, 0))]
        known += [(d, value) for value in dict.fromkeys(values)]
    return known if len(known) <= MOST_VALUES else []


def _open(declaration: Declaration) -> bool:
    """Whether an operator may set data: one number, truth or text that stays when the program ends."""
    return declaration.storage == "PERS" and declaration.type in OPERATOR_TYPES and not declaration.dims


def _conditions(program: Program) -> Iterator[str]:
    """The texts of the conditions of IF, and of a TEST with all its values, one for each statement."""
    for routine in program.all_routines():
        for statement in statements_of(routine):
            if statement.kind in ("if", "test"):
                spans = (*statement.parts, *(span for branch in statement.branches for span in branch.conditions))
                yield "\n".join(routine.source.data[slice(*span)].decode("latin-1") for span in spans)


def _other_goals(
    model: Model, program: Program, events: Sequence[MotionEvent], drafts: Mapping[str, bytes], plan: CorrectionPlan
) -> list[OtherGoal]:
    """Goals of corrected statements that are not followed with the values in the file, each once."""
    if not any(_open(d) for d in program.declarations):
        return []
    values = known_values(program, WriteEffects(program).may_be_written)
    corrected = plan.places.keys() - plan.uncorrected.keys()
    known = {reached(event) for event in events}
    options, station = plan.motion.options, model.station or Station()
    goals: list[OtherGoal] = []
    for declaration, value in values:
        chosen = replace(program, chosen={declaration.key: value})
        events = place_events(walk(chosen, options.entry), station)
        ran, owners = run_again(chosen, drafts, plan.insertions, events, options, station=station)
        written = dict(zip(owners or (), ran, strict=False))  # added statements come before their own
        for i, event in enumerate(events):
            target = written[i].target if i in written and event.statement.key in corrected else None
            runs = event.reason is None and not event.unreachable and event.resumes_from is None
            if runs and isinstance(target, RobTarget) and reached(event) not in known:
                known.add(reached(event))
                alone = replace(event, via=None, start_unknown=True)
                goals.append(OtherGoal(declaration.name, value, alone, target))
    return goals


def _deviations(model: Model, goals: Sequence[OtherGoal], plan: CorrectionPlan) -> Array:
    """(n, 2) distance [m] of the TCP from other goals without and with what is written; zero where the arm cannot come.

    Moves are taken alone and at rest.
    """
    result = np.zeros((len(goals), 2))
    events = [e for goal in goals for e in (goal.event, replace(goal.event, target=goal.written))]
    options = replace(plan.motion.options, inertia=False, allow_partial=True)
    _, motion, _ = read_runnable(model, events, options)
    if motion is None:
        return result
    samples = motion.samples
    real = predict(model, motion.at(samples.goal))[:, :3, 3]
    wanted = samples.mounts_at(samples.goal).base_tcp(samples.T_work_tcp[samples.goal])[:, :3, 3]
    at = {move.row: k for k, move in enumerate(motion.moves)}
    for i in range(len(goals)):
        if 2 * i in at and 2 * i + 1 in at:
            place = wanted[at[2 * i]]
            result[i] = [np.linalg.norm(real[at[row]] - place) for row in (2 * i, 2 * i + 1)]
    return result
