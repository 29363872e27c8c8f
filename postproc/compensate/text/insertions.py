"""Which statement an added target gets, and where none may be added."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from decimal import Decimal

from postproc.compensate.text.values import Insertion, TargetValue
from postproc.rapid.data.events import MotionEvent, StatementKey
from postproc.rapid.program.program import Program
from postproc.rapid.unknown import Kind

# An added target of the approach to a seam is a plain move: the arc is lit at the seam's first target only.
# Instructions that do something at their target (outputs, procedure calls) get plain moves as well; those with triggers
# at distances from their start or end get none.
_ARC = re.compile(r"(?P<stem>Arc[LC])(?P<system>\d?)(?P<phase>Start|End)?(?P<older>\d?)$")
_PLAIN = re.compile(r"(Move|ArcMove)(?P<way>[LC])(DO|AO|GO|Sync)?$")

TIME_DECIMALS = 5  # of a divided duration: 10 microseconds, finer than `num` has for some seconds
_DECIMAL = re.compile(r"\d+\.?\d*|\.\d+")
_TURN_ONLY = 1e-3  # [m]: a shorter way is a reorientation

TURNED_ASIDE = r"`SingArea\Wrist` turns the tool aside on the way, as its controller decides"
ASTRAY = "it also runs on ways that are not followed, which begin elsewhere"

_NO_CODE = re.compile(rb'"[^"\n]*"|![^\n]*')
_OPENS = re.compile(
    rb"(?i)[;:]$|\b(THEN|ELSE|DO|ENDIF|ENDFOR|ENDWHILE|ENDTEST|ERROR|UNDO|BACKWARD)$|^(LOCAL\s+)?(PROC|TRAP)\b"
)


def added_instruction(instruction: str) -> str | None:
    """Name of the instruction that may stand before one, on the same curve; None where nothing may be added.

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


def why_indivisible(event: MotionEvent, length: float) -> str | None:
    """Why no target may be added before a statement, or None.

    Args:
        length: of the TCP's way to its target [m].
    """
    statement = event.statement
    if statement.source.lent:
        return "it stands in a file that is only read along: convert both together (`postproc batch`)"
    if statement.instruction.startswith("Trigg"):
        return "its triggers are placed along the whole way"
    if added_instruction(statement.instruction) is None:
        return f"nothing may be added before {statement.instruction}"
    if event.elsewhere:
        return "it also runs with other targets, on ways that are not followed"
    if event.detached:
        return "the arm may come here from more than one place"
    if statement.argument("\\id") is not None:
        return "`\\ID` coordinates it with another task"
    if statement.argument("\\t") is not None and (length < _TURN_ONLY or stated_time(event) is None):
        return "`\\T` gives the time of the whole move"
    if statement.argument("\\corr") is not None:
        return "`\\Corr` follows a sensor"
    if not _stands_alone(statement.source.data, statement.span[0]):
        return "it stands in a one-line IF"
    return None


def runs_astray(events: Sequence[MotionEvent], rows: Iterable[int]) -> frozenset[StatementKey]:
    """Statements that also run in a way that is not followed (with a payload that is not known, ..), but for those from
    and to the places of a run that is: a target that is added for the one lies beside the way of the other.

    Args:
        rows: of the events that are moves with a known start.
    """
    lost = {row: e for row, e in enumerate(events) if e.reason is not None and e.again is None and not e.loose}
    keys = {e.statement.key for e in lost.values()}
    followed = {_way(events, row) for row in rows if events[row].statement.key in keys}
    return frozenset(e.statement.key for row, e in lost.items() if _way(events, row) not in followed)


def _way(events: Sequence[MotionEvent], row: int) -> tuple[object, ...]:
    """What tells whether two runs of a statement lie on one line in the object frame."""
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
    """Why an execution is left alone, without words."""
    return [(unknown.root.kind, unknown.root.subject) for unknown in event.unknowns]


def _stands_alone(data: bytes, offset: int) -> bool:
    """Whether a statement may be put in front: the code before it ends a statement or opens a block or a routine."""
    end = offset
    while end > 0:
        start = data.rfind(b"\n", 0, end) + 1
        code = _NO_CODE.sub(b"", data[start:end]).strip()
        if code:
            return code.endswith(b";") or _OPENS.search(code) is not None
        end = start - 1
    return True


def stated_time(event: MotionEvent) -> Decimal | None:
    """The duration ``\\T`` [s] where it can be divided: a plain number, and no weld speed that governs instead."""
    argument = event.statement.argument("\\t")
    if argument is None or event.weld is not None or not _DECIMAL.fullmatch(argument.text):
        return None
    return Decimal(argument.text)


def divided_time(event: MotionEvent, share: float) -> Decimal | None:
    """The part of ``\\T`` for a share of the way: as even in time as the whole move, so the speed stays the same."""
    whole = stated_time(event)
    return None if whole is None else round(whole * Decimal(share), TIME_DECIMALS).normalize()


def insertion_of(event: MotionEvent, to: TargetValue, via: TargetValue | None, zone: str, share: float) -> Insertion:
    """The statement to add for a target, after a share of the way to the event's target."""
    name = added_instruction(event.statement.instruction)
    assert name is not None
    if event.statement.argument("\\on") is not None:  # the older form of ArcLStart
        name = "Move" + name[3]
    return Insertion(event.statement, name, to, via, zone, divided_time(event, share))


def small_zone(program: Program, event: MotionEvent) -> str:
    """A fly-by zone so small that the corner it cuts off a nearly straight path is nothing."""
    statement = event.statement
    own = event.zone
    if not own.finep and own.pzone_tcp <= 1.0:
        argument = statement.argument("zone")
        if argument is not None:
            return argument.text
    for name in ("z1", "z0"):
        if program.declaration(name, statement.module, statement.routine) is None:
            return name
    argument = statement.argument("zone")
    return argument.text if argument is not None and not own.finep else "z5"
