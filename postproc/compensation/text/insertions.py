"""Which statement an added target gets, and where none may be added.

It is added where the arm always comes from one motion statement: the one that stands directly before, in the same
statement list.

    MoveL p10,v100,z1,tT;
    SetDO doLamp,1;
    MoveL p20,v100,z1,tT;

Whoever starts the routine, by whatever branch or loop, the third statement begins where the first one has led. So does
the first statement of a branch whose IF or TEST stands directly behind a motion.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from functools import cache, cached_property

from postproc.compensation.text.values import Insertion, TargetValue
from postproc.motion.path.samples import Samples
from postproc.rapid.data.events import MotionEvent, MotionStatement, StatementKey
from postproc.rapid.program.arguments import BY_REFERENCE
from postproc.rapid.program.program import Program, statements_in
from postproc.rapid.program.signatures import READ_ONLY
from postproc.rapid.program.statement_effects import UNSEEN
from postproc.rapid.program.write_effects import WriteEffects
from postproc.rapid.syntax.nodes import Routine, Statement
from postproc.rapid.syntax.tokens import identifiers, word_set

# An added target of the approach to a seam is a plain move: the arc is lit at the seam's first target only.
# Instructions that do something at their target (outputs, procedure calls) get plain moves as well; those with triggers
# at distances from their start or end get none.
_ARC = re.compile(r"(?P<stem>Arc[LC])(?P<system>\d?)(?P<phase>Start|End)?(?P<older>\d?)$")
_PLAIN = re.compile(r"(Move|ArcMove)(?P<way>[LC])(DO|AO|GO|Sync)?$")

# Options that mean on every part of a line what they mean on the whole: speed, frame, load, weaving, tracking.
CARRIED = frozenset({"\\v", "\\wobj", "\\tload", "\\weave", "\\track"})
# Options that act at the target of the statement, which keeps them: stop point or zone, a signal, the start of a seam.
_AT_TARGET = frozenset({"\\z", "\\inpos", "\\on", "\\off", "\\value", "\\dvalue"})
_AT_START = frozenset({"\\seamname", "\\preprocesstracking"})

NOT_ADJACENT = "the statement of the motion before does not stand directly before it: the arm may come from elsewhere"
FRAME_CHANGES = "its line begins in another work object or tool, or at joint angles"
INTERRUPTED = "a trap, or what a motion starts, may move the arm or its frame at any moment"
RESUMED = "an error handler may go on behind it with `TRYNEXT`, or move the arm before `RETRY`"
MAY_CHANGE = "where its line begins, or its frame, may be written at any moment"

# Instructions that may stand between two motions: they change neither where the arm is nor its path.
_BETWEEN = READ_ONLY - word_set("clearpath storepath restopath startmove stopmove")
# What these may set: how a line is driven, not where it is.
_DRIVING = frozenset({"@velset", "@accset", "@singarea", "@conf_l", "@conf_j", "@gripload"})
_ASTRAY = frozenset({"@moves", UNSEEN, "@pdisp", "@eoffs", "@units"})
CHOSEN = "only the controller chooses which element of an array it begins or ends at"
UNEVEN_TURN = r"`SingArea\Wrist` turns the tool aside on the way, as its controller decides"

_NO_CODE = re.compile(rb'"[^"\n]*"|![^\n]*')
_OPENS = re.compile(
    rb"(?i)[;:]$|\b(THEN|ELSE|DO|ENDIF|ENDFOR|ENDWHILE|ENDTEST|ERROR|UNDO|BACKWARD)$|^(LOCAL\s+)?(PROC|TRAP)\b"
)


def added_instruction(instruction: str) -> str | None:
    """Name of the instruction that may be added before one, on its curve; None where nothing may be added.

    >>> [added_instruction(i) for i in ("ArcL", "ArcL1End", "ArcLStart", "ArcCStart", "MoveLDO", "SearchL")]
    ['ArcL', 'ArcL1', 'MoveL', 'MoveC', 'MoveL', None]
    """
    arc = _ARC.match(instruction)
    if arc:
        if arc["phase"] == "Start":
            return "Move" + arc["stem"][-1]
        return arc["stem"] + (arc["system"] or arc["older"])
    plain = _PLAIN.match(instruction)
    return "Move" + plain["way"] if plain else None


def why_indivisible(event: MotionEvent) -> str:
    """Why no target may be added before a statement, by its file, instruction and options; empty if one may."""
    statement = event.statement
    name = added_instruction(statement.instruction)
    if statement.source.read_only:
        return "it stands in a file that is only read along: convert both together (`postproc batch`)"
    if statement.instruction.startswith("Trigg"):
        return "its triggers are placed along the whole way"
    if name is None:
        return f"nothing may be added before {statement.instruction}"
    if event.has_unresolved_runs:
        return "it also runs with other targets, on ways that are not followed"
    lasting = _AT_TARGET | (_AT_START if name != statement.instruction and name.startswith("Move") else frozenset())
    for i, role in enumerate(statement.roles):
        if role.startswith("\\") and role not in CARRIED | lasting:
            begin = statement.spans(i)[1][0]
            spelled = statement.source.data[begin : begin + len(role)].decode("latin-1")
            return f"`{spelled}` would act on each of its parts"
    return "" if _stands_alone(statement.source.data, statement.span[0]) else "it stands in a one-line IF"


class DivisibleMoves:
    """Tells before which moves targets may be added; each is examined when it is first needed.

    An added target lies on one line, so the statement must always be reached from the start of that line.

    Args:
        changes: write effects of the program.
        why_not: function of a move's index that returns why no target can be added before it; empty if one can.
    """

    def __init__(self, program: Program, samples: Samples, changes: WriteEffects) -> None:
        self.program, self.changes, self.moves = program, changes, samples.moves
        self.turned = frozenset(samples.unevenly_turned().tolist())
        self.why_not: Callable[[int], str] = cache(self._why_not)

    def _why_not(self, i: int) -> str:
        """Why no target can be added before move i; empty if one can."""
        event = self.moves[i].event
        if event.statement.interpolation in ("line", "arc"):
            before = self.moves[i - 1].event.statement if i else event.statement
            elsewhere = self._why_elsewhere(event.statement, before)
            if elsewhere:
                return elsewhere
            if event.one_of_several or self.moves[i - 1].event.one_of_several:
                return CHOSEN
        return UNEVEN_TURN if i in self.turned else why_indivisible(event)

    def _why_elsewhere(self, statement: MotionStatement, before: MotionStatement) -> str:
        """Why the arm may come to a line or arc from elsewhere than from the goal of ``before``; empty if it may not.

        Args:
            before: the motion statement that comes before it on the way that is followed.
        """
        routine = self.program.routine(statement.routine, statement.module)
        if routine is None or self._directly_before.get(statement.key) != before.key:
            return NOT_ADJACENT
        if not self.changes.interrupting.isdisjoint(_ASTRAY):
            return INTERRUPTED
        if self._goes_on_behind_errors(routine):
            return RESUMED
        frames, frames_before = ([_text(s, "tool"), _text(s, "\\wobj") or "wobj0"] for s in (statement, before))
        if frames != frames_before or before.signature.jointed:
            return FRAME_CHANGES
        names = identifiers(" ".join([_text(before, "to"), *frames]).encode("latin-1"))
        return "" if all(self._stays(name, routine) for name in names) else MAY_CHANGE

    @cached_property
    def _directly_before(self) -> Mapping[StatementKey, StatementKey]:
        """By key of a motion statement, the key of the one directly before it, where nothing between matters."""
        predecessors: dict[StatementKey, StatementKey] = {}
        for routine in self.program.all_routines():
            for body in (routine.body, *routine.handlers):
                self._read(body, routine, None, predecessors)
        return predecessors

    def _read(
        self,
        body: Sequence[Statement],
        routine: Routine,
        before: MotionStatement | None,
        predecessors: dict[StatementKey, StatementKey],
    ) -> None:
        """Add to ``predecessors`` what stands directly before the motion statements of a list and of those inside it.

        Args:
            before: the motion directly before the IF or TEST whose branch the list is.
        """
        changes = self.changes
        for statement in body:
            motion = self.program.motion(routine.source, statement)
            functions = changes.direct.functions(statement, routine)
            if functions.keys or changes.through(functions, routine):
                before = None
            for branch in statement.branches:
                self._read(branch.body, routine, before if statement.kind in ("if", "test") else None, predecessors)
            if motion is None:
                before = before if self._may_stand_between(statement, routine) else None
                continue
            if before is not None:
                predecessors[motion.key] = before.key
            # A search ends where it finds something; a procedure that a motion starts may write.
            plain = changes.of_one(statement, routine) == {"@moves"} and not motion.signature.results
            before = motion if plain and motion.interpolation != "none" else None

    def _may_stand_between(self, statement: Statement, routine: Routine) -> bool:
        """Whether a statement is an instruction that neither moves the arm nor writes what a line depends on."""
        if statement.kind != "call" or statement.word not in _BETWEEN:
            return False
        effect = self.changes.direct.of_statement(statement, routine)
        return not effect.calls and self.changes.of_one(statement, routine) <= _DRIVING

    def _goes_on_behind_errors(self, routine: Routine) -> bool:
        """Whether a handler of a routine may pass over the statement that failed, or repeat it from elsewhere.

        An error without a handler is raised again where the routine was called (Basic Characteristics RAPID, 8.1), and
        leaves the routine.
        """
        data, handlers = routine.source.data, routine.handlers
        words = [data[slice(*s.span)].lower() for body in handlers for s in statements_in(body) if s.kind == "leave"]
        if any(word.startswith(b"trynext") for word in words):
            return True
        retries = any(word.startswith(b"retry") for word in words)
        return retries and any(not self.changes.of(body, routine).isdisjoint(_ASTRAY) for body in handlers)

    def _stays(self, name: str, routine: Routine) -> bool:
        """Whether nothing writes, at any moment, to what a name means in a routine.

        Args:
            name: in lower case.
        """
        parameter = next((p for p in routine.parameters if p.name == name), None)
        if parameter is not None:
            return parameter.mode not in BY_REFERENCE or not self.changes.volatile
        declared = self.program.declaration(name, routine.module, routine.name)
        if declared is None or declared.storage == "CONST":
            return True
        return not self.changes.may_be_written_any_time(declared.key)


def _stands_alone(data: bytes, offset: int) -> bool:
    """Whether a statement may be put in at ``offset`` of a text: the code before ends a statement or opens a block."""
    end = offset
    while end > 0:
        start = data.rfind(b"\n", 0, end) + 1
        code = _NO_CODE.sub(b"", data[start:end]).strip()
        if code:
            return code.endswith(b";") or _OPENS.search(code) is not None
        end = start - 1
    return True


def insertion_of(event: MotionEvent, to: TargetValue, via: TargetValue | None, zone: str) -> Insertion:
    """The statement to add before an event's statement for a target on the way to it.

    Args:
        to, via: the added target, and its circle point on an arc.
        zone: text of the zone argument.
    """
    name = added_instruction(event.statement.instruction)
    assert name is not None
    if event.statement.argument("\\on") is not None:  # the older form of ArcLStart
        name = "Move" + name[3]
    return Insertion(event.statement, name, to, via, zone)


def small_zone(program: Program, event: MotionEvent) -> str:
    """Name of a fly-by zone so small that it hardly cuts the corner of a nearly straight path.

    It is the statement's own zone if that is at most 1 mm, else ``z1`` or ``z0`` if the program has no own data of that
    name, else the statement's own zone, or ``z5`` in place of a stop point.
    """
    statement, argument = event.statement, event.statement.argument("zone")
    zone = "" if argument is None or event.zone.finep else argument.text
    if zone and event.zone.pzone_tcp <= 1.0:
        return zone
    free = (name for name in ("z1", "z0") if not program.hides(name, statement.module, statement.routine))
    return next(free, zone or "z5")


def _text(statement: MotionStatement, role: str) -> str:
    """The text of an argument without white space, in lower case; empty if the statement has none of that role."""
    argument = statement.argument(role)
    return "" if argument is None else "".join(argument.text.lower().split())
