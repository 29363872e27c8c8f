"""Which statement an added target gets, and where none may be added."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence

from postproc.compensation.text.values import Insertion, TargetValue
from postproc.motion.path.samples import Samples
from postproc.rapid.data.events import MotionEvent, MotionStatement, StatementKey
from postproc.rapid.flow.arrivals import Arrivals, only
from postproc.rapid.program.program import Program
from postproc.rapid.unknown import Kind

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

TURNED_ASIDE = r"`SingArea\Wrist` turns the tool aside on the way, as its controller decides"
RESUMED = "an error handler may go on behind it with `TRYNEXT`, from the middle of a divided line"
UNRESOLVED_START = "it also runs on ways that are not followed, which begin elsewhere"
FROM_ELSEWHERE = "the arm may come here from elsewhere than on the way that is followed"
MAY_HAVE_CHANGED = "where its line begins, or its frame, may have been written since the arm was there"
FRAMES = ("tool", "\\wobj")  # roles of arguments

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
        events: all of the program.
        arrivals: after which motions each statement may run.
    """

    def __init__(self, events: Sequence[MotionEvent], samples: Samples, arrivals: Arrivals) -> None:
        self.moves, self.arrivals = samples.moves, arrivals
        self.aside = frozenset(samples.unevenly_turned().tolist())
        self.unresolved = _unresolved_starts(events, (move.row for move in self.moves if not move.first))
        self._asked: dict[int, str] = {}

    def why_not(self, i: int) -> str:
        """Why no target can be added before move i; empty if one can."""
        if i not in self._asked:
            self._asked[i] = self._reason(i)
        return self._asked[i]

    def _reason(self, i: int) -> str:
        """The reason that `why_not` returns, without its cache."""
        event = self.moves[i].event
        statement = event.statement
        if statement.key in self.unresolved:
            return UNRESOLVED_START
        if i > 0 and statement.interpolation in ("line", "arc"):
            if only(self.arrivals.before(statement.key)) != self.moves[i - 1].event.statement.key:
                return FROM_ELSEWHERE
            frames = (statement.argument(role) for role in FRAMES)
            names = [event.start or "", *(argument.text for argument in frames if argument is not None)]
            if not self.arrivals.keeps(statement, " ".join(names)):
                return MAY_HAVE_CHANGED
        if f"{statement.module}.{statement.routine}".lower() in self.arrivals.resumed_behind_errors:
            return RESUMED
        return TURNED_ASIDE if i in self.aside else why_indivisible(event) or ""


def _unresolved_starts(events: Sequence[MotionEvent], rows: Iterable[int]) -> frozenset[StatementKey]:
    """Statements that also have runs which are not understood (with an unknown payload, for example).

    Those runs do not count that go from and to the same places as a run that is understood. A target added for one run
    would lie beside the way of the other.

    Args:
        rows: of the events that are moves with a known start.
    """
    lost = {
        row: e for row, e in enumerate(events) if e.reason is not None and e.resumes_from is None and not e.unreachable
    }
    keys = {e.statement.key for e in lost.values()}
    followed = {_way(events, row) for row in rows if events[row].statement.key in keys}
    return frozenset(e.statement.key for row, e in lost.items() if _way(events, row) not in followed)


def _way(events: Sequence[MotionEvent], row: int) -> tuple[object, ...]:
    """A key that is equal for two runs of a statement on one line in the object frame, by start, goal and frames.

    It is unique to the run if these are not known, and empty if no motion comes before.
    """
    event, before = events[row], row - 1
    while before >= 0 and events[before].statement.interpolation == "none" and events[before].reason is None:
        before -= 1
    if event.first or before < 0:
        return ()
    start = events[before]
    known = start.target is not None and event.target is not None and _unknowns(start) == _unknowns(event)
    place = (start.target, event.target, event.via)
    frames = ((e.wobj, e.displacement, e.tool) for e in (start, event))
    return (event.statement.key, *place, *frames) if known else (row,)


def _unknowns(event: MotionEvent) -> list[tuple[Kind, str]]:
    """Kind and subject of the reasons why an execution is not understood, without their wording."""
    return [(unknown.root.kind, unknown.root.subject) for unknown in event.unknowns]


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
    own = event.zone
    if not own.finep and own.pzone_tcp <= 1.0:
        argument = statement.argument("zone")
        if argument is not None:
            return argument.text
    for name in ("z1", "z0"):
        if not program.hides(name, statement.module, statement.routine):
            return name
    argument = statement.argument("zone")
    return argument.text if argument is not None and not own.finep else "z5"
