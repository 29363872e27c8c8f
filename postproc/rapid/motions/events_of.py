"""One execution of a motion statement: its arguments evaluated and the state of the moment put beside them."""

from __future__ import annotations

from collections.abc import Mapping
from operator import is_, itemgetter

from postproc.diagnostics import Diagnostic
from postproc.rapid.data.events import MotionEvent, MotionStatement, Origin
from postproc.rapid.data.records import NO_AXIS, JointTarget, RobTarget
from postproc.rapid.data.values import Data
from postproc.rapid.evaluation.memory import Memory
from postproc.rapid.evaluation.state import AT_START
from postproc.rapid.motions.missing import Missing
from postproc.rapid.motions.moments import FIXED_AXES, Moment
from postproc.rapid.motions.regressors import named_numbers
from postproc.rapid.motions.settings import SettingsReader
from postproc.rapid.motions.targets import RUNTIME, Targets
from postproc.rapid.program.instructions import SETTERS
from postproc.rapid.program.program import Program
from postproc.rapid.unknown import Kind, Unknown, joined_causes

_SET = itemgetter(*SETTERS)  # what instructions have set
NAMED = ("declared", "element", "expression")  # kinds of origins


class EventMaker:
    """Makes motion events."""

    def __init__(self, program: Program, diagnostics: list[Diagnostic], named: bool) -> None:
        """Make events of a program.

        Args:
            diagnostics: gets the findings.
            named: events also get the names of their numbers and places, which RAPID text to be written needs.
        """
        self.program = program
        self.named = named
        self.targets = Targets(named)
        self.missing = Missing(program, diagnostics)
        self.settings = SettingsReader(program, self.missing)
        self.last = Moment(_SET(AT_START))

    def event(self, statement: MotionStatement, memory: Memory, before: MotionEvent | None) -> MotionEvent:
        """The event of one execution of a motion statement, with all values taken from ``memory`` as they are now.

        Args:
            before: the motion event from which the arm comes; None if that is not known or may be one of several.
        """
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
        moment = self.moment(memory.changed)
        in_force = moment.in_force(statement.shape, settings)
        reasons += moment.reasons
        causes = joined_causes(tuple(memory.noted), moment.causes) if memory.noted or moment.causes else ()
        # Where a trap reads where the arm stands, that holds the correction: it would count twice.
        own = [why for why in causes if why.kind is Kind.WRITTEN_AT_ANY_TIME]
        reasons += [why for why in own if why.key in memory.changes.measured]
        wobj = in_force.wobj
        if not wobj.ufprog and not wobj.ufmec and not wobj.robhold:
            reasons.append(Unknown(Kind.MOVED_BY_NOBODY, wobj.name))
        shifted = moment.offset is None and FIXED_AXES not in statement.roles
        if shifted and any(abs(axis) < NO_AXIS for axis in getattr(target, "extax", ())):
            reasons.append(Unknown(Kind.EXTERNAL_OFFSET))
        if not moment.known:
            self.missing.say_assumed(memory.changed, statement, found)
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
            tuple(found),
            numbers=named_numbers(statement, origin, memory) if apart and self.named else (),
            start=self.start(before, statement, memory),
            assumed=tuple(cause.reason for cause in causes) if causes else (),
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

    def start(self, before: MotionEvent | None, here: MotionStatement, memory: Memory) -> str | None:
        """The name in the program of the target of the event ``before``, from which the arm comes.

        None if that target has no name, or the name means something else at the statement ``here``.
        """
        if before is None or not self.named:
            return None
        last, origin = before.statement, before.target_origin
        to = last.argument("to") if origin.kind in NAMED else None
        if to is None or "\n" in to.text:
            return None
        same = last.source is here.source and last.routine == here.routine and last.module == here.module
        unwritten = origin.declaration not in memory.changed
        if same and origin.kind == "declared" and origin.handed is None and unwritten:
            return to.text
        known = self.targets.robtarget(last.source, to.span, memory.aside())
        return to.text if known == (before.target, origin) else None

    def places(
        self, statement: MotionStatement, memory: Memory, reasons: list[Unknown], found: list[Diagnostic]
    ) -> tuple[RobTarget | JointTarget | None, Origin, RobTarget | None, Origin | None]:
        """Target, its origin, circle point and its origin; the target is None if one of the places is not known.

        Args:
            reasons: gets why places are not known; found: gets the findings about it.
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
        elif "to" in roles:
            read = self.targets.jointtarget if signature.jointed else self.targets.robtarget
            target, origin = read(statement.source, statement.span_of("to"), memory)
            if "via" in roles and not signature.jointed:
                via, via_origin = self.targets.robtarget(statement.source, statement.span_of("via"), memory)
        else:
            target = Unknown(Kind.NO_TARGET)
        goal, middle = None, None
        if isinstance(target, Unknown):
            self.missing.explain(target, statement.argument("to"), statement, found)
            reasons.append(target)
        else:
            goal = target
        if isinstance(via, Unknown):
            self.missing.explain(via, statement.argument("via"), statement, found)
            reasons.append(via)
            goal = None
        else:
            middle = via
        if signature.why_not and "to" in signature.roles:
            reasons.append(Unknown(Kind.UNSUPPORTED, signature.why_not))
        return goal, origin, middle, via_origin
