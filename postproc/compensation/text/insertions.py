"""Which statement an added target gets, and where none may be added."""

from __future__ import annotations

import re

from postproc.compensation.text.predecessors import Predecessors
from postproc.compensation.text.values import Insertion, TargetValue
from postproc.motion.path.samples import Samples
from postproc.rapid.data.events import MotionEvent, MotionStatement
from postproc.rapid.program.program import Program
from postproc.rapid.program.write_effects import WriteEffects

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


def why_indivisible(event: MotionEvent) -> str | None:
    """Why no target may be added before a statement, by its file, instruction and options; None if one may."""
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
    for role in statement.roles:
        if role.startswith("\\") and role not in CARRIED | lasting:
            return f"`{_spelled(statement, role)}` would act on each of its parts"
    if not _stands_alone(statement.source.data, statement.span[0]):
        return "it stands in a one-line IF"
    return None


class DivisibleMoves:
    """Tells before which moves targets may be added; each is examined when it is first needed.

    An added target lies on one line, so the statement must always be reached from the start of that line.

    Args:
        changes: write effects of the program.
    """

    def __init__(self, program: Program, samples: Samples, changes: WriteEffects) -> None:
        self.moves = samples.moves
        self.predecessors = Predecessors(program, changes)
        self.turned = frozenset(samples.unevenly_turned().tolist())
        self._reasons: dict[int, str] = {}

    def why_not(self, i: int) -> str:
        """Why no target can be added before move i; empty if one can."""
        if i not in self._reasons:
            self._reasons[i] = self._reason(i)
        return self._reasons[i]

    def _reason(self, i: int) -> str:
        """The reason that `why_not` returns, without its cache."""
        event = self.moves[i].event
        if event.statement.interpolation in ("line", "arc"):
            before = self.moves[i - 1].event.statement if i else event.statement
            elsewhere = self.predecessors.why_not(event.statement, before)
            if elsewhere:
                return elsewhere
            if event.one_of_several or self.moves[i - 1].event.one_of_several:
                return CHOSEN
        return UNEVEN_TURN if i in self.turned else why_indivisible(event) or ""


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


def _spelled(statement: MotionStatement, role: str) -> str:
    r"""The option of that role as the statement writes it, with its backslash: ``\Wobj`` for the role ``\wobj``."""
    argument = statement.argument(role)
    assert argument is not None
    start = argument.whole[0]
    return statement.source.data[start : start + len(role)].decode("latin-1")


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
    statement = event.statement
    zone = event.zone
    if not zone.finep and zone.pzone_tcp <= 1.0:
        argument = statement.argument("zone")
        if argument is not None:
            return argument.text
    for name in ("z1", "z0"):
        if not program.hides(name, statement.module, statement.routine):
            return name
    argument = statement.argument("zone")
    return argument.text if argument is not None and not zone.finep else "z5"
