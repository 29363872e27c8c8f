"""Values that the text alone does not give, why they are not known, and values that are only assumed.

Knowledge of data has three levels: a value; an assumed value (the last one seen in the text, with the causes why it is
not certain); an ``Unknown``.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import Enum
from typing import Any, Self

from postproc.diagnostics import Span

Data = Any  # float, bool, str or a tuple of Data


class Kind(Enum):
    """Why something is not known, with its words for people: a phrase that completes "left alone: ...".

    Here and nowhere else these texts are made; nothing reads them.
    """

    # Data and state: the subject is a name in backticks or what an instruction sets.
    UNSET = "{subject} is written by the program and has no certain value here"
    MAY_BE_WRITTEN = "{subject} may be written by {cause}"
    WRITTEN_BY_FUNCTION = "{subject} is written by a function"
    WRITTEN_AT_ANY_TIME = "{subject} is written by a trap routine or an error handler"
    WRITTEN_ELSEWHERE = "code outside of these files writes {subject}, or declares it with another value"
    UNCERTAIN = "{subject} is not certain here"
    UNDECIDED = "{subject} depends on a condition that is not known"
    CHANGED_IN_LOOP = "{subject} is changed in a loop"
    CHANGED_BY_CYCLE = "{subject} has another value from the second cycle of the program on"
    CHANGED_TOO_DEEPLY = "{subject} is changed in blocks that are nested too deeply"
    CHANGED_UNFOLLOWED = "{subject} is changed in a routine that is not followed here"
    CHANGED_BEFORE_JUMP = "{subject} may have changed before the jump to here"
    SEARCH_RESULT = "{subject} is found by a search"
    STATE_UNKNOWN = "{subject} is not known here"
    COUNTER = "a counter has no certain value here"
    # Names.
    NOT_DECLARED = "`{subject}` is not declared in these files"
    NO_VALUE = "`{subject}` has no value in this file"
    CIRCULAR = "the value of `{subject}` depends on itself"
    TOO_LARGE = "`{subject}` is too large to follow"
    NO_ELEMENT = "`{subject}` has no element {cause}"
    NO_SUCH_ELEMENT = "the array has no element {subject}"
    PARAMETER = "the parameter `{subject}` is not known"
    LOOP_INDEX = "the loop index `{subject}` is not known"
    WRONG_TYPE = "`{subject}` is {cause}"
    NO_NUMBER = "`{subject}` is no number"
    # Routines.
    NOT_FOLLOWED = "`{subject}` is not followed here"
    GIVES_NOTHING = "`{subject}` gives no known value"
    RESULT_UNDECIDED = "the result depends on a condition that is not known"
    ACTS = "`{subject}` does more than calculate: assign what it gives before the move"
    # Calculation.
    RUN_TIME_FUNCTION = "`{subject}` is known only at run time"
    UNKNOWN_FUNCTION = "`{subject}` is a function this version does not know"
    CONTROLLER_FUNCTION = (
        "`{subject}` is worked out by the controller; here only for an arm that is known, a tool that it holds and work"
        " beside it"
    )
    UNDEFINED = "`{subject}` has no value for these arguments"
    UNDEFINED_OPERATOR = "`{subject}` has no value for these operands"
    NEEDS_NUMBER = "`{subject}` needs a number"
    NEEDS_TRUTH = "NOT needs a truth value"
    TYPES = "the types of the expression do not fit each other"
    NESTED = "the calculation is nested too deeply"
    TEXT_TOO_LONG = "a text is longer than the 80 characters that a string holds"
    NOT_INTEGER = "an array index is not a whole number"
    NO_COMPONENT = "`.{subject}` is not a known component"
    NO_PART = "the part that is written does not exist"
    NOT_ASSIGNABLE = "this cannot be assigned to"
    UNREADABLE = "{subject} cannot be read: {cause}"
    UNREADABLE_ARGUMENTS = "the arguments of `{subject}` cannot be read"
    # Data that is no target, no tool ...
    STAR = "the position is stored without a name (`*`) and not visible in the text"
    NUMBER_TOO_LARGE = "a number in the data is too large"
    NUMBER_EXPECTED = "a number is expected in the data"
    NUMBERS_EXPECTED = "{subject} numbers are expected in the data"
    NOT_A = "the value is not a {subject}"
    CONFIGURATION = "a number in the configuration data is too large"
    IMPOSSIBLE = "the arm cannot run it as it is programmed: see the finding at this place"
    IN_SEAM = "the arm cannot run another statement of its seam as it is programmed: the whole seam stays"
    NEVER_TAUGHT = "the orientation is [0,0,0,0]: the position was never taught"
    NO_FRAME = "the orientation is [0,0,0,0], which no frame has"
    NOT_UNIT = "the orientation is no unit quaternion: its length is {subject}, not 1"
    # Motion statements.
    NO_TARGET = "it names no target"
    ARGUMENTS = "its arguments cannot be read"
    UNSUPPORTED = "{subject}"
    PAYLOAD = "the payload is not known: {cause}"
    DISPLACEMENT = "the program displacement is not known: {cause}"
    ADDED_TURN = "`PDispAdd` adds displacements of which one turns"
    DISPLACED_FROM_POSITION = "the displacement depends on where the arm stands at PDispOn"
    SOFT_SERVO = "`SoftAct` makes axes soft: the arm stands off by far more than the model says"
    EXTERNAL_OFFSET = "an offset of the external axes may be active"
    MOVED_OBJECT = "the work object `{subject}` is moved by `{cause}`, and no cell describes that unit"
    WORK_NOWHERE = "where the work object `{subject}` stands is not known: {cause}"
    BASE_NOWHERE = "where `{subject}` has carried the arm is not known: {cause}"
    MOVED_BY_NOBODY = (
        "the work object `{subject}` is moved by a mechanical unit that it does not name: ufprog of a fixed frame is"
        " TRUE"
    )


class Unknown(Exception):
    """A value that the text alone does not give.

    Args:
        kind: why; subject: of what, in the words that ``kind`` has a place for.
        cause: what stands behind it: another reason, or words for the place that ``kind`` has for it.
        missing: name that is declared nowhere, with the span where it is used.
        key: of the data or state (as ``WriteEffects`` names it).
    """

    def __init__(
        self,
        kind: Kind,
        subject: str = "",
        cause: Unknown | str = "",
        missing: str | None = None,
        span: Span | None = None,
        *,
        key: str = "",
    ) -> None:
        """Make a reason ``kind`` about ``subject``.

        Args:
            cause: another reason, or words for the place that the kind's text has for it.
            missing: name that is declared nowhere; span: where it is used; key: of the data or state.
        """
        super().__init__(kind, subject, cause, missing, span)
        self.kind = kind
        self.subject = subject
        self.cause = cause
        self.missing = missing
        self.span = span
        self.key = key
        self.stored_in: tuple[str, ...] = ()  # keys of the data that it was written to since

    def kept(self) -> Self:
        """The exception itself, to be stored as a value: its traceback, which holds memory, is dropped."""
        self.__traceback__ = self.__context__ = self.__cause__ = None
        return self

    def renewed(self) -> Unknown:
        """A copy with the same reason that counts as another unknown value (identity tells unknown values apart)."""
        other = type(self).__new__(type(self), *self.args)
        other.__dict__.update(self.__dict__)
        return other

    @property
    def reason(self) -> str:
        """The phrase for people that the kind of the reason makes of subject and cause."""
        cause = self.cause.reason if isinstance(self.cause, Unknown) else self.cause
        return self.kind.value.format(subject=self.subject, cause=cause)

    @property
    def root(self) -> Unknown:
        """The last reason in the chain of causes; itself if its cause is no other reason."""
        return self.cause.root if isinstance(self.cause, Unknown) else self

    def __str__(self) -> str:
        """The reason as a phrase for people."""
        return self.reason


class Invalid(Unknown):
    """Data that the controller itself refuses: a typing error."""


class PartlyUnknown(Unknown):
    """A record or an array of which some parts are known; ``data`` has an Unknown in the place of every other.

    Args:
        assumed: why the known parts are not certain.
    """

    def __init__(self, unknown: Unknown, data: Data, assumed: Causes = ()) -> None:
        """Take the reason from ``unknown`` and the known parts from ``data``, with an Unknown for each other."""
        super().__init__(unknown.kind, unknown.subject, unknown.cause, unknown.missing, unknown.span, key=unknown.key)
        self.data = data
        self.assumed = assumed


Causes = tuple[Unknown, ...]
MOST_CAUSES = 4  # that are kept of one value


@dataclass(frozen=True, slots=True)
class Assumed:
    """The last value seen in the text of data that something may have changed since."""

    data: Data
    causes: Causes

    def __eq__(self, other: object) -> bool:
        """Whether the other is assumed, too, and has the same data; the causes do not count."""
        return isinstance(other, Assumed) and self.data == other.data

    __hash__ = None  # type: ignore[assignment]


def joined_causes(*causes: Causes) -> Causes:
    """Join the causes of several values: each kind, subject and cause once, at most ``MOST_CAUSES`` in all."""
    causes_by_kind = {(cause.kind, cause.subject, str(cause.cause)): cause for part in causes for cause in part}
    return tuple(causes_by_kind.values())[:MOST_CAUSES]


def assumed_for(data: Data, causes: Causes) -> Data:
    """The data marked as assumed for these and its own causes; unchanged if there are none or it is unknown."""
    if not causes or (isinstance(data, Unknown) and not isinstance(data, PartlyUnknown)):
        return data
    if isinstance(data, PartlyUnknown):
        return PartlyUnknown(data, data.data, joined_causes(data.assumed, causes))
    data, before = without_causes(data)
    return Assumed(data, joined_causes(before, causes))


def without_causes(data: Data) -> tuple[Data, Causes]:
    """Split data into the bare value (perhaps Unknown) and the causes why it is only assumed; () if certain."""
    return (data.data, data.causes) if isinstance(data, Assumed) else (data, ())


def unknown_part(data: Data) -> Unknown | None:
    """The first Unknown found in data, itself or inside nested tuples; None if all of it is known."""
    if isinstance(data, tuple):
        kinds = set(map(type, data))  # an array may be long
        if not kinds.isdisjoint((Unknown, PartlyUnknown, Invalid)):
            return next(item for item in data if isinstance(item, Unknown))
        inside = data if tuple in kinds else ()
        return next((unknown for item in inside if (unknown := unknown_part(item)) is not None), None)
    return data if isinstance(data, Unknown) else None


def set_first(unknowns: Iterable[Unknown]) -> str | None:
    """Advice for people, if the first reason is data that nothing sets before it is read; else None."""
    unknown = next(iter(unknowns), None)
    if unknown is None or unknown.root.kind is not Kind.UNSET:
        return None
    name = unknown.root.subject.strip("`")
    return f"it has what the last run left: set it before this, as in `{name}:={name}0;` with a CONST"
