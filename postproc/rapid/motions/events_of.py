"""One execution of a motion statement: its arguments evaluated and the state of the moment put beside them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import TypeVar

from postproc.diagnostics import Diagnostic
from postproc.rapid.data.events import MotionEvent, MotionStatement, Origin
from postproc.rapid.data.records import NO_AXIS, JointTarget, LoadData, Pose, RobTarget
from postproc.rapid.data.values import Data
from postproc.rapid.evaluation.memory import Memory, Reference
from postproc.rapid.evaluation.state import NO_MASS, NO_OFFSET
from postproc.rapid.motions.missing import Missing
from postproc.rapid.motions.regressors import named_numbers
from postproc.rapid.motions.settings import SettingsReader
from postproc.rapid.motions.targets import Targets
from postproc.rapid.program.arguments import fits
from postproc.rapid.program.program import Program
from postproc.rapid.program.signatures import SIGNATURES
from postproc.rapid.syntax.tokens import identifiers
from postproc.rapid.unknown import Causes, Kind, Unknown, joined_causes, without_causes

T = TypeVar("T")
NAMED = ("declared", "element", "expression")  # kinds of origins
FRAMES = ("tool", "\\wobj")  # roles of arguments


class EventMaker:
    """Makes events."""

    def __init__(self, program: Program, diagnostics: list[Diagnostic]) -> None:
        self.program = program
        self.targets = Targets()
        self.missing = Missing(program, diagnostics)
        self.settings = SettingsReader(program, self.missing)
        self.options: dict[tuple[Data, ...], Mapping[str, bool]] = {}

    def event(self, statement: MotionStatement, memory: Memory, conditional: bool) -> MotionEvent:
        """The event of one execution."""
        found: list[Diagnostic] = []
        reasons: list[Unknown] = []
        memory.noted.clear()
        target, origin, via, via_origin = self.places(statement, memory, reasons, found)
        if memory.changes.acting is not None:
            handed = [o.handed for o in (origin, via_origin) if o is not None and o.handed is not None]
            spans = [(statement.source, statement.span), *((h.source, h.span) for h in handed)]
            found_at = (memory.changes.acting.search(source.data, *span) for source, span in spans)
            acting = sorted({called[1].decode("latin-1") for called in found_at if called is not None})
            reasons += [Unknown(Kind.ACTS, name) for name in acting]
        settings = self.settings.read(statement, memory, reasons, found)
        tool, wobj, total = settings.tool, settings.wobj, settings.total
        state = memory.changed
        payload, causes = self.state(state, "@gripload", LoadData(), Kind.PAYLOAD, reasons)
        if total is not None and total.mass > NO_MASS:
            tool, payload = replace(tool, tload=total), LoadData()
        displacement, more = self.state(state, "@pdisp", Pose(), Kind.DISPLACEMENT, reasons)
        assumed = joined_causes(tuple(memory.noted), causes, more)
        # Where a trap reads where the arm stands, that holds the correction: it would count twice.
        read = [why for why in assumed if why.kind is Kind.WRITTEN_AT_ANY_TIME and why.key in memory.changes.measured]
        reasons += read
        if not wobj.ufprog and not wobj.ufmec and not wobj.robhold:
            reasons.append(Unknown(Kind.MOVED_BY_NOBODY, wobj.name))
        offset, more = without_causes(state.get("@eoffs"))
        if isinstance(offset, Unknown) or more or statement.argument("\\noeoffs") is not None:
            stated = any(abs(axis) < NO_AXIS for axis in getattr(target, "extax", ()))
            if stated and statement.argument("\\noeoffs") is None:
                reasons.append(Unknown(Kind.EXTERNAL_OFFSET))
            offset = NO_OFFSET
        units, unsure = without_causes(state.get("@units", ()))
        self.missing.say_assumed(state, statement, found)
        override, limit = _pair(without_causes(state.get("@velset"))[0])
        acceleration, _ = without_causes(state.get("@accset", 100.0))
        return MotionEvent(
            statement,
            target,
            via,
            origin,
            via_origin,
            tool,
            wobj,
            settings.speed,
            settings.zone,
            settings.weld,
            settings.duration,
            payload,
            displacement,
            conditional,
            "; ".join(dict.fromkeys(unknown.reason for unknown in reasons)) or None,
            tuple(found),
            self.known_options(state),
            velocity_override=override,
            velocity_limit=limit,
            acceleration=100.0 if isinstance(acceleration, Unknown) else acceleration,
            axis_offset=offset,
            units=None if isinstance(units, Unknown) or unsure else units,
            numbers=named_numbers(statement, origin, memory),
            assumed=tuple(cause.reason for cause in assumed),
            unknowns=tuple(reasons),
        )

    def start(self, before: MotionEvent, event: MotionEvent, memory: Memory) -> str | None:
        """What the program calls the target of the event before here; None where that has no name or means another."""
        last, origin = before.statement, before.target_origin
        to = last.argument("to") if origin.kind in NAMED else None
        if to is None or "\n" in to.text:
            return None
        here = event.statement
        same = last.source is here.source and last.routine == here.routine and last.module == here.module
        if (
            same
            and origin.kind == "declared"
            and origin.handed is None
            and not _keys(to.text, memory) & memory.changed.keys()
        ):
            return to.text
        known = self.targets.robtarget(last.source, to.span, memory.aside())
        return to.text if known == (before.target, origin) else None

    def touched(self, event: MotionEvent, memory: Memory, since: int) -> bool:
        """Whether something unseen may have written the frames of an event, or the target before it, since a time."""
        if memory.time <= since and not memory.changes.volatile and not memory.changes.unseen_any_time:
            return False
        given = (event.statement.argument(role) for role in FRAMES)
        texts = [event.start or "", *(argument.text for argument in given if argument is not None)]
        keys = {"@pdisp", *_keys(" ".join(texts), memory)}
        return any(memory.invalidated(k)[1] > since or memory.changes.may_be_written_any_time(k) for k in keys)

    def places(
        self, statement: MotionStatement, memory: Memory, reasons: list[Unknown], found: list[Diagnostic]
    ) -> tuple[RobTarget | JointTarget | None, Origin, RobTarget | None, Origin | None]:
        """Target and circle point with their origins; without target where one of the two is not known."""
        signature = SIGNATURES[statement.instruction.lower()]
        to, circle = statement.span_of("to"), statement.span_of("via")
        target: RobTarget | JointTarget | Unknown = Unknown(Kind.NO_TARGET)
        via: RobTarget | Unknown | None = None
        origin, via_origin = Origin("runtime"), None
        if signature.why_not and not signature.roles:
            target = Unknown(Kind.UNSUPPORTED, signature.why_not)
        elif signature.roles and not fits(statement, signature):
            target = Unknown(Kind.ARGUMENTS)
        elif to is not None and signature.jointed:
            target, origin = self.targets.jointtarget(statement.source, to, memory)
        elif to is not None:
            target, origin = self.targets.robtarget(statement.source, to, memory)
            if circle is not None:
                via, via_origin = self.targets.robtarget(statement.source, circle, memory)
        for place, role in ((target, "to"), (via, "via")):
            if isinstance(place, Unknown):
                self.missing.explain(place, statement.argument(role), statement, found)
                reasons.append(place)
        if signature.why_not and signature.roles:
            reasons.append(Unknown(Kind.UNSUPPORTED, signature.why_not))
        known = None if isinstance(via, Unknown) else via
        return None if isinstance(target, Unknown) or known is not via else target, origin, known, via_origin

    @staticmethod
    def state(state: Mapping[str, Data], key: str, default: T, kind: Kind, reasons: list[Unknown]) -> tuple[T, Causes]:
        """What an instruction has set, and why it is not certain."""
        value, causes = without_causes(state.get(key, default))
        if isinstance(value, Unknown):
            reasons.append(Unknown(kind, cause=value))
            return default, ()
        return value, causes

    def known_options(self, state: Mapping[str, Data]) -> Mapping[str, bool]:
        conf_l, conf_j, singarea = key = tuple(
            without_causes(state.get(name))[0] for name in ("@conf_l", "@conf_j", "@singarea")
        )
        if key not in self.options:
            found = {name: value for name, value in (("conf_l", conf_l), ("conf_j", conf_j)) if isinstance(value, bool)}
            if isinstance(singarea, str):
                found["wrist_in_joints"] = singarea in ("wrist", "lockaxis4")
            self.options[key] = MappingProxyType(found)
        return self.options[key]


def _keys(text: str, memory: Memory) -> set[str]:
    """Keys of the data that some text names here."""
    found = set()
    for name in identifiers(text.encode("latin-1")):
        bound = memory.frame.bindings.get(name)
        declaration = bound.declaration if isinstance(bound, Reference) else memory.find(name)
        found |= {declaration.key} if declaration is not None else set()
    return found


def _pair(value: Data) -> tuple[float, float | None]:
    return value if isinstance(value, tuple) else (100.0, None)
