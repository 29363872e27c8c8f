"""State that instructions set and later motions feel: payload, displacement, monitoring, speed and acceleration."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence

from postproc.diagnostics import Span
from postproc.rapid.data.pose import add, pose_inv, pose_mult, subtract
from postproc.rapid.data.records import LoadData, Pose
from postproc.rapid.data.values import Data, to_load, to_pose
from postproc.rapid.evaluation.memory import Memory
from postproc.rapid.program.arguments import Piece
from postproc.rapid.program.signatures import SETTERS, STATE_OF_INSTRUCTION
from postproc.rapid.unknown import Kind, Unknown, assumed_for, joined_causes, without_causes

# The smallest mass a loaddata may have; load0 has it, and it stands for nothing at all.
NO_MASS = 0.001
NO_OFFSET = (0.0,) * 6


# After a program start: no payload, no displacement, ConfL and ConfJ on, full speed, stiff axes.
AT_START: Mapping[str, Data] = {
    "@gripload": LoadData(), "@pdisp": Pose(), "@eoffs": NO_OFFSET, "@units": (), "@conf_l": True, "@conf_j": True,
    "@singarea": "off", "@velset": (100.0, None), "@accset": 100.0, "@soft": False,
}  # fmt: skip


def start_without(keys: Iterable[str]) -> Mapping[str, Data]:
    """State after a program start by ``@`` key, in which the given keys are Unknown."""
    unknown = {k: Unknown(Kind.STATE_UNKNOWN, f"what {SETTERS[k]} sets", key=k) for k in keys if k in AT_START}
    return {**AT_START, **unknown}


def run_state_instruction(word: str, pieces: Sequence[Piece], memory: Memory, value: Callable[[Span], Data]) -> None:
    """Carry out an instruction of ``STATE_OF_INSTRUCTION``, as GripLoad: write certain, assumed or Unknown data.

    Args:
        word: the instruction in lower case; pieces: its arguments; value: evaluates the expression at a span.
    """
    memory.noted.clear()
    try:
        data = _state_after(word, pieces, memory, value)
    except Unknown as error:
        data = error.kept()
    except (IndexError, TypeError, ValueError):
        data = Unknown(Kind.UNREADABLE_ARGUMENTS, word)
    memory.changed[STATE_OF_INSTRUCTION[word]] = assumed_for(data, joined_causes(tuple(memory.noted)))


def _state_after(word: str, pieces: Sequence[Piece], memory: Memory, value: Callable[[Span], Data]) -> Data:
    """Value that the instruction ``word`` (lower case) gives to its state, in the form in which ``AT_START`` holds it.

    Raises:
        Unknown: it is not known; IndexError, TypeError or ValueError for arguments that do not fit.
    """
    switches = {option[1:] for option, _, _ in pieces if option}
    plain = [span for option, span, _ in pieces if not option]
    match word:
        case "gripload":
            load = to_load(value(plain[0]))
            return LoadData() if 0.0 <= load.mass <= NO_MASS else load
        case "pdispset":
            return to_pose(value(plain[0]))
        case "pdispadd":
            before, _ = without_causes(memory.changed["@pdisp"])
            if isinstance(before, Unknown):
                raise before
            added = to_pose(value(plain[0]))
            if before.rot != Pose().rot or added.rot != Pose().rot:
                raise Unknown(Kind.ADDED_TURN)
            return Pose(add(before.trans, added.trans))
        case "pdispoff":
            return Pose()
        case "pdispon":
            return _displacement(pieces, plain, "rot" in switches, value)
        case "eoffsset":
            return tuple(float(axis) for axis in value(plain[0]))
        case "eoffson":
            raise Unknown(Kind.EXTERNAL_OFFSET)
        case "eoffsoff":
            return NO_OFFSET
        case "actunit" | "deactunit":
            before, _ = without_causes(memory.changed["@units"])
            if isinstance(before, Unknown):
                raise before
            unit = memory.frame.routine.source.data[slice(*plain[0])].decode("latin-1").strip().lower()
            return (*before, (unit, word == "actunit"))
        case "confl" | "confj":
            return "off" not in switches
        case "softact" | "softdeact":
            return word == "softact"
        case "singarea":
            return next(iter(switches), "off")
        case "velset":
            return (float(value(plain[0])), float(value(plain[1])))
    return float(value(plain[0]))  # AccSet


def _displacement(pieces: Sequence[Piece], plain: Sequence[Span], rotated: bool, value: Callable[[Span], Data]) -> Pose:
    r"""The pose ``D`` that PDispOn sets from its option ``\ExeP``: ``D P_programmed = P_executed``.

    Args:
        plain: spans of the positional arguments; rotated: ``\Rot`` is given, else ``D`` only translates.
        value: evaluates the expression at a span.

    Raises:
        Unknown: without ``\ExeP`` it depends on where the arm stands.
    """
    executed = next((span for option, span, _ in pieces if option == "\\exep"), None)
    if executed is None:
        raise Unknown(Kind.DISPLACED_FROM_POSITION)
    moved, programmed = value(executed), value(plain[0])
    a, b = to_pose(moved[:2]), to_pose(programmed[:2])
    return pose_mult(a, pose_inv(b)) if rotated else Pose(subtract(a.trans, b.trans))
