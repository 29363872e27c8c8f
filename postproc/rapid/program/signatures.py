"""Positional arguments of the motion instructions, in order.

Source: ABB RAPID reference manual (instructions), Arc and Cap application manuals; the ArcMove forms are taken to be
those of Move. ``via`` is CirPoint; ``to`` is ToPoint or ToJointPos. Instructions that measure on their way are the ones
with ``results``, those of the option SmarTac among them: they write these arguments.
"""

from __future__ import annotations

from difflib import get_close_matches
from functools import cache

from postproc.rapid.data.events import Interpolation, Signature

MOVE = ("to", "speed", "zone", "tool")
ARC = ("to", "speed", "seam", "weld", "zone", "tool")
OLD_ARC = ("to", "speed", "seam", "weld", "weave", "zone", "tool")
CAP = ("to", "speed", "cap", "weavestart", "weave", "zone", "tool")
SEARCH = ("signal", "found", "to", "speed", "tool")
TRIGG = ("to", "speed", "trigg", "zone", "tool")
FOUND = ("found",)  # what a search stores
SEARCH_STOPS = "where a search stops is known only at run time"


def _circular(roles: tuple[str, ...]) -> tuple[str, ...]:
    """The roles of the circular form of an instruction: ``via`` stands in front of ``to``.

    Args:
        roles: of the positional arguments of its linear form.
    """
    at = roles.index("to")
    return (*roles[:at], "via", *roles[at:])


def _three(
    stem: str, roles: tuple[str, ...], tail: str = "", after: tuple[str, ...] = (), older: tuple[str, ...] = ()
) -> list[Signature]:
    """Signatures of the joint, linear and circular form of one instruction, named ``stem`` + J, L or C + ``tail``.

    Args:
        roles: of the arguments of the linear form; after: roles of the arguments behind them.
        older: roles that S4 programs may use instead of ``after``.
    """
    forms: tuple[tuple[str, Interpolation, tuple[str, ...]], ...] = (
        ("J", "joint", roles), ("L", "line", roles), ("C", "arc", _circular(roles))
    )  # fmt: skip
    return [
        Signature(f"{stem}{letter}{tail}", way, first + after, older=first + older if older else ())
        for letter, way, first in forms
    ]


def _arcs(number: str) -> list[Signature]:
    """Signatures of all arc welding instructions, ArcLStart to ArcCEnd, of one arc system.

    Args:
        number: of the arc system, a digit as in ``ArcL1Start``; empty for instructions without a number.
    """
    signatures = []
    for suffix, phase in (("Start", "start"), ("", "weld"), ("End", "end")):
        signatures.append(Signature(f"ArcL{number}{suffix}", "line", ARC, phase, OLD_ARC))
        signatures.append(Signature(f"ArcC{number}{suffix}", "arc", _circular(ARC), phase, _circular(OLD_ARC)))
    return signatures


def _unsupported(names: str, interpolation: Interpolation, why: str) -> list[Signature]:
    """Signatures, without roles of arguments, of motion instructions whose targets are never changed.

    Args:
        names: of the instructions, with blanks between them; why: the reason that the user is told.
    """
    return [Signature(name, interpolation, (), why_not=why) for name in names.split()]


_OPTION = "the arguments of this instruction are not known to this version"
_ALL = [
    *_three("Move", MOVE),
    *_three("Move", MOVE, "DO", ("signal", "value")),
    *_three("Move", MOVE, "AO", ("signal", "value")),
    *_three("Move", MOVE, "GO", ("signal",), ("signal", "value")),  # the value is \\Value or \\DValue
    *_three("Move", MOVE, "Sync", ("procedure",)),
    *_three("Trigg", TRIGG),
    *_three("ArcMove", MOVE),
    Signature("TriggLIOs", "line", MOVE),
    Signature("TriggJIOs", "joint", MOVE),
    Signature("MoveAbsJ", "absjoint", MOVE, jointed=True),
    Signature("ArcMoveAbsJ", "absjoint", MOVE, jointed=True),
    Signature("TriggAbsJ", "absjoint", TRIGG, jointed=True),
    Signature("MoveExtJ", "none", ("to", "speed", "zone"), jointed=True),
    Signature("ArcMoveExtJ", "none", ("to", "speed", "zone"), older=("to", "speed", "zone", "tool"), jointed=True),
    Signature(
        "SearchExtJ", "none", ("signal", "found", "to", "speed"), jointed=True, why_not=SEARCH_STOPS, results=FOUND
    ),
    Signature("SearchL", "line", SEARCH, why_not=SEARCH_STOPS, results=FOUND),
    Signature("SearchC", "arc", _circular(SEARCH), why_not=SEARCH_STOPS, results=FOUND),
    # SmarTac moves to a start and on until the torch or a sensor touches. The first argument gets the displacement that
    # is found, or whether there is a part; SearchStop the place.
    *(
        Signature(name, "line", FOUND, why_not=SEARCH_STOPS, results=(*FOUND, "\\searchstop"))
        for name in ("Search_1D", "Search_Groove", "Search_Part")
    ),
    *(s for number in ("", "1", "2", "3", "4", "5", "6") for s in _arcs(number)),
    Signature("CapL", "line", CAP, "weld"),
    Signature("CapC", "arc", _circular(CAP), "weld"),
    *_unsupported("ArcCalcL ArcCalcLStart ArcCalcLEnd ArcAdaptL ArcAdaptLStart ArcAdaptLEnd CapLATR", "line", _OPTION),
    *_unsupported("ArcCalcC ArcCalcCStart ArcCalcCEnd ArcAdaptC ArcAdaptCStart ArcAdaptCEnd CapCATR", "arc", _OPTION),
    *_unsupported("SpotL SpotML CalibL PaintL DispL NutL", "line", _OPTION),
    *_unsupported("FCPressL FCPress1LStart FCPressEnd", "line", _OPTION),
    *_unsupported("SpotJ SpotMJ CalibJ NutJ", "joint", _OPTION),
    *_unsupported("PaintC DispC FCPressC", "arc", _OPTION),
    *_unsupported("EGMMoveL EGMMoveC EGMRunPose EGMRunJoint", "line", "the path comes from a sensor at run time"),
    *_unsupported("ArcRepL StepBwdPath PathRecMoveBwd PathRecMoveFwd", "line", "it replays a stored path"),
]  # fmt: skip

SIGNATURES: dict[str, Signature] = {s.name.lower(): s for s in _ALL}
# Both spellings of a numbered arc system occur: ArcL1Start and ArcLStart1.
SIGNATURES.update(
    (f"{s.name[:4]}{s.name[5:]}{s.name[4]}".lower(), s)
    for s in _ALL
    if s.name.startswith("Arc") and s.name[4:5].isdigit()
)


@cache
def meant_instruction(word: str) -> str:
    """The motion instruction that an unknown word is nearest to, as the manual spells it; empty if none is near."""
    close = get_close_matches(word.lower(), SIGNATURES, n=1, cutoff=0.75)
    return SIGNATURES[close[0]].name if close else ""
