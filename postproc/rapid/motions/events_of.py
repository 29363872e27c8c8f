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
from postproc.rapid.unknown import Causes, Kind, Unknown, joined_causes

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
        causes: Causes = ()
        if memory.noted or moment.causes:
            causes = joined_causes(tuple(memory.noted), moment.causes)
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
        elif "to" in roles:
            read = self.targets.jointtarget if signature.jointed else self.targets.robtarget
            target, origin = read(statement.source, statement.span_of("to"), memory)
            if "via" in roles and not signature.jointed:
                via, via_origin = self.targets.robtarget(statement.source, statement.span_of("via"), memory)
        else:
            target = Unknown(Kind.NO_TARGET)
        for place, role in ((target, "to"), (via, "via")):
            if isinstance(place, Unknown):
                self.missing.explain(place, statement.argument(role), statement, findings)
                reasons.append(place)
        if signature.why_not and "to" in signature.roles:
            reasons.append(Unknown(Kind.UNSUPPORTED, signature.why_not))
        known = None if isinstance(via, Unknown) else via
        return None if isinstance(target, Unknown) or known is not via else target, origin, known, via_origin
