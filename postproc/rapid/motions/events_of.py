"""One execution of a motion statement: its arguments evaluated, with what instructions have set at the moment.

The event also names the numbers of the program that it goes with, for corrections that depend on them.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import replace
from operator import is_, itemgetter
from types import MappingProxyType
from typing import TypeVar

from postproc.diagnostics import Diagnostic
from postproc.rapid.data.events import InForce, MotionEvent, MotionStatement, Origin, StatementShape
from postproc.rapid.data.records import NO_AXIS, JointTarget, LoadData, Pose, RobTarget
from postproc.rapid.data.values import Data
from postproc.rapid.evaluation.evaluate import evaluate, names_in
from postproc.rapid.evaluation.memory import Memory
from postproc.rapid.evaluation.state import AT_START, NO_MASS, NO_OFFSET
from postproc.rapid.motions.missing import Missing
from postproc.rapid.motions.settings import MotionSettings, SettingsReader
from postproc.rapid.motions.targets import RUNTIME, Targets
from postproc.rapid.program.program import Program
from postproc.rapid.program.signatures import SETTERS
from postproc.rapid.syntax.expressions import read_full_expression
from postproc.rapid.syntax.tokens import identifiers
from postproc.rapid.syntax.trees import Call, Component, Expression, Index, Name, Number
from postproc.rapid.unknown import Causes, Kind, Unknown, joined_causes, without_causes

Term = tuple[str, Expression]
Numbers = tuple[tuple[str, float], ...]
DATA_NAME = re.compile(r"[A-Za-z_]\w*(?:\{[\w+*/, -]*\}|\.\w+)*")


def named_numbers(statement: MotionStatement, origin: Origin, memory: Memory) -> Numbers:
    """Numbers that tell this execution of a statement from others, each with the RAPID expression that gives it.

    They are num variables, parameters and loop indices at hand, the amounts of ``Offs`` or ``RelTool``, the coordinates
    of the target's variable, of its work object and of the program displacement. For an array element they are its
    coordinates alone; there are none if all executions go to one place.
    """
    frames = [*_frames(statement, memory)]
    terms: list[Term] = []
    if origin.kind == "expression" or origin.handed is not None or frames:
        terms += _words(statement, memory)
    elif origin.kind != "element":
        return ()
    if "to" not in statement.roles:
        return ()
    data = statement.source.data
    for written in (data[slice(*statement.span_of("to"))], *frames):
        try:
            terms += _terms(read_full_expression(written, 0, len(written)), written, memory)
        except Unknown:
            continue
    numbers = {}
    for text, tree in terms:
        try:
            value = evaluate(tree, memory.trial_copy())
        except Unknown:
            continue
        if value.type == "num" and isinstance(value.data, float):
            numbers[text] = value.data
    return tuple(numbers.items())


def _frames(statement: MotionStatement, memory: Memory) -> Iterator[bytes]:
    """RAPID expressions of the frames whose pose may differ between executions.

    They are the program displacement, where the program sets it, and user and object frame of a work object that the
    program writes or that is a parameter.
    """
    if "@pdisp" in memory.changes.everything:
        yield b"C_PROGDISP.pdisp"
    if (wobj := statement.argument("\\wobj")) is not None:
        declaration = memory.find(wobj.text.lower())
        if wobj.text.lower() in memory.frame.bindings or (
            declaration is not None and declaration.key in memory.changes.everything
        ):
            yield from (f"{wobj.text}.{frame}".encode("latin-1") for frame in ("uframe", "oframe"))


def _words(statement: MotionStatement, memory: Memory) -> Iterator[Term]:
    """Parameters, loop indices and num variables in the statement or bound in its routine, as (RAPID text, tree)."""
    for word in sorted(identifiers(statement.source.data[slice(*statement.span)]) | memory.frame.bindings.keys()):
        bound = memory.frame.bindings.get(word)
        declaration = memory.find(word) if bound is None else None
        if bound is not None or (
            declaration is not None and declaration.storage != "CONST" and declaration.type == "num"
        ):
            yield word, Name((0, 0), word, word)


def _terms(tree: Expression, data: bytes, memory: Memory) -> Iterator[Term]:
    """Numbers that place a target expression, as terms (RAPID text, tree): amounts of Offs and RelTool, coordinates.

    Args:
        data: the text of the tree, in which its spans count.
    """
    text = data[slice(*tree.span)].decode("latin-1")
    match tree:
        case Call(_, "offs" | "reltool", (base, *amounts), options):
            yield from _terms(base, data, memory)
            for part in (*amounts, *(value for _, value in options if value is not None)):
                words = data[slice(*part.span)].decode("latin-1")
                if not isinstance(part, Number) and _harmless(part, words, memory):
                    yield (words.lower() if isinstance(part, Name) else f"({words})"), part
        case Name() | Index() | Component() if _harmless(tree, text, memory):
            for axis in "xyz":
                place = Component(tree.span, Component(tree.span, tree, "trans"), axis)
                yield f"{text}.trans.{axis}", place


def _harmless(tree: Expression, text: str, memory: Memory) -> bool:
    """Whether an expression may be evaluated a second time: it is on one line and calls no routine of the program."""
    routines = (memory.program.routine(name, memory.frame.routine.module) for name in names_in(tree))
    return "\n" not in text and "!" not in text and not any(routines)


T = TypeVar("T")
FIXED_AXES = "\\noeoffs"  # the option of a motion that is made without the offset of external axes


class Moment:
    """What is in force for all motions.

    ``known`` says whether all of it is; ``reasons`` why load and displacement are not, ``causes`` why they are not
    certain; ``offset`` of external axes is None where it is not known.

    Args:
        values: of the state by the keys of ``SETTERS``, in their order.
    """

    def __init__(self, values: tuple[Data, ...]) -> None:
        """Work out payload, displacement, speed and options from state values in the order of ``SETTERS``."""
        state = {key: without_causes(value) for key, value in zip(SETTERS, values, strict=True)}
        known = {key: None if causes or isinstance(value, Unknown) else value for key, (value, causes) in state.items()}
        self.values = values
        self.known = not any(isinstance(value, Unknown) for value in values)
        self.reasons: list[Unknown] = []
        self.gripload, load_causes = self._or_else(state["@gripload"], LoadData(), Kind.PAYLOAD)
        self.displacement, causes = self._or_else(state["@pdisp"], Pose(), Kind.DISPLACEMENT)
        self.causes = joined_causes(load_causes, causes)
        if state["@soft"][0] is True:
            self.reasons.append(Unknown(Kind.SOFT_SERVO))
        self.offset, self.units = known["@eoffs"], known["@units"]
        velocity, acceleration, singarea = (state[key][0] for key in ("@velset", "@accset", "@singarea"))
        self.velocity: tuple[float, float | None] = velocity if isinstance(velocity, tuple) else (100.0, None)
        self.acceleration = 100.0 if isinstance(acceleration, Unknown) else acceleration
        options = {name: on for name in ("conf_l", "conf_j") if isinstance(on := state[f"@{name}"][0], bool)}
        if isinstance(singarea, str):
            options["wrist_in_joints"] = singarea in ("wrist", "lockaxis4")
        self.options = MappingProxyType(options)
        self._motions: dict[StatementShape, tuple[MotionSettings, InForce]] = {}  # the last of each shape

    def _or_else(self, state: tuple[Data, Causes], default: T, kind: Kind) -> tuple[T, Causes]:
        """The value of a state and why it is not certain; the default if it is Unknown, which is added to ``reasons``.

        Args:
            state: its value and why that is not certain; kind: reason to add.
        """
        if isinstance(state[0], Unknown):
            self.reasons.append(Unknown(kind, cause=state[0]))
            return default, ()
        return state

    def in_force(self, shape: StatementShape, settings: MotionSettings) -> InForce:
        """Tool, frames, speed, load and state of a motion; one object for motions of equal shape and settings."""
        settled, causes = self._motions.get(shape, (None, None))
        if causes is None or not (settled is settings or settled == settings):
            causes = self._with(settings, fixed_axes=FIXED_AXES in shape.roles)
            self._motions[shape] = settings, causes
        return causes

    def _with(self, settings: MotionSettings, fixed_axes: bool) -> InForce:
        r"""Settings joined with the state; ``\TLoad`` above 1 g replaces the tool's load and removes the payload.

        Args:
            fixed_axes: the motion ignores the offset of external axes (``\NoEOffs``).
        """
        tool, gripload, total = settings.tool, self.gripload, settings.total
        if total is not None and total.mass > NO_MASS:
            tool, gripload = replace(tool, tload=total), LoadData()
        offset = NO_OFFSET if self.offset is None or fixed_axes else self.offset
        return InForce(
            tool, settings.wobj, settings.speed, settings.zone, settings.weld, settings.duration, gripload,
            self.displacement, self.options, *self.velocity, self.acceleration, offset, self.units, total,
        )  # fmt: skip


_SET = itemgetter(*SETTERS)  # what instructions have set


class EventMaker:
    """Makes motion events."""

    def __init__(self, program: Program, diagnostics: list[Diagnostic], named: bool) -> None:
        """Make events of a program.

        Args:
            diagnostics: gets the findings.
            named: events also get the names of their numbers, which RAPID text to be written needs.
        """
        self.program = program
        self.named = named
        self.targets = Targets(named)
        self.missing = Missing(program, diagnostics)
        self.settings = SettingsReader(program, self.missing)
        self.last = Moment(_SET(AT_START))

    def event(self, statement: MotionStatement, memory: Memory) -> MotionEvent:
        """The event of one execution of a motion statement, with all values taken from ``memory`` as they are now."""
        findings: list[Diagnostic] = []
        reasons: list[Unknown] = []
        memory.noted.clear()
        target, origin, via, via_origin = self.places(statement, memory, reasons, findings)
        if statement.signature.why_not and "to" in statement.signature.roles:
            reasons.append(Unknown(Kind.UNSUPPORTED, statement.signature.why_not))
        if memory.changes.acting is not None:
            handed = [o.handed for o in (origin, via_origin) if o is not None and o.handed is not None]
            spans = [(statement.source, statement.span), *((h.source, h.span) for h in handed)]
            matches = (memory.changes.acting.search(source.data, *span) for source, span in spans)
            acting = sorted({called[1].decode("latin-1") for called in matches if called is not None})
            reasons += [Unknown(Kind.ACTS, name) for name in acting]
        settings = self.settings.read(statement, memory, reasons, findings)
        moment = self.moment(memory.changed)
        in_force = moment.in_force(statement.shape, settings)
        reasons += moment.reasons
        causes = joined_causes(tuple(memory.noted), moment.causes) if memory.noted or moment.causes else ()
        # Where a trap reads where the arm stands, that holds the correction: it would count twice.
        written = [why for why in causes if why.kind is Kind.WRITTEN_AT_ANY_TIME]
        reasons += [why for why in written if why.key in memory.changes.measured]
        wobj = in_force.wobj
        if not wobj.ufprog and not wobj.ufmec and not wobj.robhold:
            reasons.append(Unknown(Kind.MOVED_BY_NOBODY, wobj.name))
        shifted = moment.offset is None and FIXED_AXES not in statement.roles
        if shifted and any(abs(axis) < NO_AXIS for axis in getattr(target, "extax", ())):
            reasons.append(Unknown(Kind.EXTERNAL_OFFSET))
        if not moment.known:
            self.missing.say_assumed(memory.changed, statement, findings)
        # Numbers tell executions apart whose target is worked out or whose frames may have changed.
        settled = self.settings.settled.get(statement.shape) is settings and "@pdisp" not in memory.changes.everything
        apart = not settled or origin.kind in ("expression", "element") or origin.handed is not None
        return MotionEvent(
            statement,
            target,
            via,
            origin,
            via_origin,
            in_force,
            memory.conditional > 0,
            "; ".join(dict.fromkeys(unknown.reason for unknown in reasons)) if reasons else None,
            tuple(findings),
            numbers=named_numbers(statement, origin, memory) if apart and self.named else (),
            assumed=tuple(cause.reason for cause in causes) if causes else (),
            turns=memory.turns,
            unknowns=tuple(reasons),
        )

    def moment(self, state: Mapping[str, Data]) -> Moment:
        """What instructions have set, as a ``Moment``; the same object while no value changes.

        Args:
            state: values by ``@`` key, as ``Memory.changed`` has them.
        """
        now = _SET(state)
        if not all(map(is_, now, self.last.values)):
            self.last = Moment(now)
        return self.last

    def places(
        self, statement: MotionStatement, memory: Memory, reasons: list[Unknown], findings: list[Diagnostic]
    ) -> tuple[RobTarget | JointTarget | None, Origin, RobTarget | None, Origin | None]:
        """Target, its origin, circle point and its origin; the target is None if one of the places is not known.

        Args:
            reasons: gets why places are not known; findings: gets the findings about it.
        """
        shape = statement.shape
        signature, roles = shape.signature, shape.roles
        target: RobTarget | JointTarget | Unknown
        via: RobTarget | Unknown | None = None
        origin, via_origin = RUNTIME, None
        if signature.why_not and "to" not in signature.roles:
            target = Unknown(Kind.UNSUPPORTED, signature.why_not)
        elif not shape.complete:
            target = Unknown(Kind.ARGUMENTS)
        elif "to" not in roles:
            target = Unknown(Kind.NO_TARGET)
        else:
            read = self.targets.jointtarget if signature.jointed else self.targets.robtarget
            target, origin = read(statement.source, statement.span_of("to"), memory)
            if "via" in roles and not signature.jointed:
                via, via_origin = self.targets.robtarget(statement.source, statement.span_of("via"), memory)
        if not isinstance(target, Unknown) and not isinstance(via, Unknown):
            return target, origin, via, via_origin
        for place, role in ((target, "to"), (via, "via")):
            if isinstance(place, Unknown):
                self.missing.explain(place, statement.argument(role), statement, findings)
                reasons.append(place)
        return None, origin, None if isinstance(via, Unknown) else via, via_origin
