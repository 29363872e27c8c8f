"""What statements do, whichever way a program takes: data assigned, routines called, instructions carried out."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

from postproc.diagnostics import Span
from postproc.rapid.data.events import MotionStatement, StatementKey
from postproc.rapid.data.values import Data, Value, as_type, single
from postproc.rapid.evaluation.accessor import Accessor, bound_frame
from postproc.rapid.evaluation.assign import assume, forget
from postproc.rapid.evaluation.declared import DeclaredValues
from postproc.rapid.evaluation.memory import CallFrame, Memory, Reference
from postproc.rapid.evaluation.state import run_state_instruction
from postproc.rapid.program.arguments import BY_REFERENCE, Piece, argument_name, paired, read_arguments
from postproc.rapid.program.late_binding import BY_NAME, LATE, LateCall, late_call
from postproc.rapid.program.program import Program
from postproc.rapid.program.signatures import COUNTING, KNOWN_INSTRUCTIONS, MOVING, READ_ONLY, STATE_OF_INSTRUCTION
from postproc.rapid.program.statement_effects import NO_EFFECT, StatementEffect
from postproc.rapid.program.write_effects import WriteEffects
from postproc.rapid.syntax.nodes import Routine, Statement
from postproc.rapid.syntax.trees import Call
from postproc.rapid.unknown import Assumed, Kind, Unknown, without_causes

MAX_CALLS = 30  # depth
MAX_TURNS = 10_000  # of one loop; a loop with more is treated as one that runs nobody knows how often


@dataclass(frozen=True, slots=True)
class AddedMotions:
    """Motions and routines, by their keys, that were written into a program.

    Executing them counts no steps, so that the written program is followed as far as the original. In these routines a
    value that is only assumed decides which way is taken.
    """

    motions: frozenset[StatementKey] = frozenset()
    routines: frozenset[str] = frozenset()

    @classmethod
    def between(cls, program: Program, written: Program, motions: Iterable[StatementKey]) -> AddedMotions:
        """Return motions that were added, by their keys, and the routines that ``program`` does not have."""
        originals = {routine.key for routine in program.all_routines()}
        return cls(frozenset(motions), frozenset(routine.key for routine in written.all_routines()) - originals)


class Interpreter(ABC):
    """Runs statements: each changes a ``Memory`` from the state before it to the state behind it.

    A subclass says what happens where the text leaves open how the program goes on (a condition that no data decides,
    code in none of the files) and where a jump leads: it follows all ways at once, or one.

    Args:
        data: evaluates and assigns data by its text in the routine that runs.
        assumed_decides: whether a value that is only assumed counts as certain in conditions and loop bounds.
        followed: places of the calls that have been run.
        passed_over: keys of routines of which some call was not run.
    """

    assumed_decides = False

    def __init__(self, program: Program, added: AddedMotions | None = None) -> None:
        """Set up the run of a program, with nothing executed yet; ``added`` was written into it."""
        self.program = program
        self.added = added or AddedMotions()
        self.changes = WriteEffects(program)
        self.constants = DeclaredValues(program)
        self.data = Accessor()
        self.followed: set[StatementKey] = set()
        self.passed_over: set[str] = set()

    # -- what a subclass decides ---------------------------------------------------------------------------------------

    @abstractmethod
    def enter(self, routine: Routine, memory: Memory) -> Value | Unknown | None:
        """Run a routine's body on ``memory`` and return its value: Unknown if not known, None if it returns nothing."""

    @abstractmethod
    def body(self, statements: Sequence[Statement], memory: Memory) -> bool:
        """Run statements on ``memory``; True if their end is reached, False if RETURN, EXIT or a jump leaves them."""

    @abstractmethod
    def branches(self, statement: Statement, memory: Memory) -> bool:
        """Run IF or TEST; True if the statement behind it may run next, False if the body is left."""

    @abstractmethod
    def turns(self, loop: Statement, memory: Memory) -> bool:
        """Run all turns of a FOR loop; True if its end is reached, False if its body is left."""

    @abstractmethod
    def while_loop(self, loop: Statement, memory: Memory) -> bool:
        """Run a WHILE loop; True if its end is reached, False if its body is left or it never ends."""

    @abstractmethod
    def jump(self, statement: Statement, memory: Memory) -> bool:
        """Run a GOTO or a label; True if the statement behind it in the text is run next."""

    # -- statements ----------------------------------------------------------------------------------------------------

    def statement(self, statement: Statement, memory: Memory) -> bool:
        """Run one statement on ``memory``; False if it leaves the body in which it stands."""
        if memory.frame.routine.source.path in self.changes.direct.calling:
            functions = self.changes.direct.functions(statement, memory.frame.routine)
            if functions is not NO_EFFECT:
                self.forget_written(statement, functions, memory)
        match statement.kind:
            case "call":
                self.call(statement, memory)
            case "assign":
                data = self.data.value_or_not(statement.parts[1], memory)
                self.data.assign(statement.parts[0], data, memory)
            case "if" | "test":
                return self.branches(statement, memory)
            case "for" | "while":
                outer = memory.turns
                reached = (self.for_loop if statement.kind == "for" else self.while_loop)(statement, memory)
                memory.turns = outer
                return reached
            case "label" | "goto":
                return self.jump(statement, memory)
            case "return":
                start, end = statement.parts[0]
                memory.leave(self.data.evaluated((start, end), memory) if start < end else None)
                return False
            case "leave":
                memory.leave(goes_on=False)
                return False
            case "opaque":
                forget(memory, self.changes.of_one(statement, memory.frame.routine), Kind.UNCERTAIN)
        return True

    def forget_written(self, statement: Statement, functions: StatementEffect, memory: Memory) -> None:
        """Make data unknown that functions in none of the files may write in the expressions of a statement.

        Args:
            functions: effect of the functions in these expressions.
        """
        if functions.unseen:
            forget(memory, functions.keys, Kind.MAY_BE_WRITTEN, f"`{functions.unseen[-1]}`")

    def for_loop(self, loop: Statement, memory: Memory) -> bool:
        """Run a FOR loop on ``memory``; in it the loop index hides data of the same name. False if its body is left."""
        bindings = memory.frame.bindings
        hidden = bindings.get(loop.word)
        reached = self.turns(loop, memory)
        bindings.pop(loop.word, None)
        if hidden is not None:
            bindings[loop.word] = hidden
        return reached

    def indices(self, loop: Statement, memory: Memory) -> list[float] | None:
        """Values of the index of a FOR loop, in single precision; None without known bounds, or of too many turns."""
        bounds = [self.deciding(span, memory) for span in loop.parts]
        numbers = [single(bound) for bound in bounds if isinstance(bound, float)]
        if len(numbers) < len(bounds):
            return None
        index, last = numbers[:2]
        step = numbers[2] if len(numbers) > 2 else 1.0 if last >= index else -1.0
        turns: list[float] = []
        while index <= last if step >= 0 else index >= last:
            if len(turns) == MAX_TURNS:
                return None
            turns.append(index)
            index = single(index + step)
        return turns

    # -- conditions ----------------------------------------------------------------------------------------------------

    def truth(self, condition: Span, memory: Memory) -> bool | None:
        """Whether a condition holds; None if it is not known."""
        data = self.deciding(condition, memory)
        return data if isinstance(data, bool) else self.decide(condition, memory)

    def deciding(self, span: Span, memory: Memory) -> Data:
        """Value of the expression at a span, by which a way is chosen: ``Assumed`` or ``Unknown`` if not certain.

        With ``assumed_decides``, and in added routines, an assumed value counts as certain.
        """
        data = self.data.value_or_not(span, memory)
        if self.assumed_decides or memory.frame.routine.key in self.added.routines:
            return without_causes(data)[0]  # in what is added, a place is worked out of places that are assumed
        return data

    def decide(self, condition: Span, memory: Memory) -> bool | None:
        """Whether a condition holds that no data decides; None: both are possible, so that both ways are followed.

        Args:
            condition: its span.
        """
        return None

    def subject(self, statement: Statement, memory: Memory) -> Data:
        """Value of the expression of a TEST, which is evaluated once for all its arms; empty for IF."""
        return self.deciding(statement.parts[0], memory) if statement.kind == "test" else ()

    def chosen(self, statement: Statement, conditions: tuple[Span, ...], subject: Data, memory: Memory) -> bool | None:
        """Whether an arm of IF or TEST is taken; None if that is not known.

        Args:
            subject: from ``subject``.
            conditions: span of the IF condition, or spans of the values of a CASE, one of which must equal the TEST
                expression; empty for ELSE and DEFAULT.
        """
        if not conditions:
            return True
        if statement.kind == "if":
            return self.truth(conditions[0], memory)
        verdict: bool | None = False
        for condition in conditions:
            case = self.deciding(condition, memory)
            taken: bool | None = as_type(subject, "num") == as_type(case, "num")
            if isinstance(subject, Unknown | Assumed) or isinstance(case, Unknown | Assumed):
                taken = self.decide(condition, memory)
            if taken:
                return True
            verdict = None if taken is None else verdict
        return verdict

    # -- calls ---------------------------------------------------------------------------------------------------------

    def call(self, statement: Statement, memory: Memory) -> None:
        """Run a statement that begins with a name on ``memory``: a motion, a call of a routine, or an instruction."""
        source = memory.frame.routine.source
        motion = self.program.motions.get((source.path, statement.span[0]))
        if motion is not None:
            self.move(motion, memory)
            return
        word, module = statement.word, memory.frame.routine.module
        late = late_call(statement, source.data, self.program, module)
        if late is not None:
            name, pieces = self.late_name(late, memory), late.pieces
            routine = self.program.routine(name, module) if name else None
        else:
            pieces = read_arguments(source.data, statement.span[0] + len(word), statement.span[1])
            routine = self.program.routine(word, module)
        if routine is not None:
            place = source.path, statement.span[0]
            again = place in self.followed
            self.followed.add(place)
            self.call_routine(routine, pieces, memory, again)
        elif late is not None:
            self.forget_arguments(statement, f"`{name}`" if name else LATE, memory)
            self.run_unseen(statement, None, memory)
        elif word in STATE_OF_INSTRUCTION:
            self.set_state(word, pieces, memory)
        elif word in COUNTING:
            self.data.count(word, pieces, memory)
        elif word in READ_ONLY:
            self.forget_arguments(statement, f"`{word}`", memory)
        elif not (word in BY_NAME and self.data.by_name(word, pieces, memory)):
            begin = statement.span[0]
            self.forget_arguments(statement, f"`{source.data[begin : begin + len(word)].decode('latin-1')}`", memory)
            if word not in KNOWN_INSTRUCTIONS:
                self.run_unseen(statement, len(pieces), memory)
            elif word in MOVING:
                memory.doubt()

    def forget_arguments(self, statement: Statement, writer: str, memory: Memory) -> None:
        """Make data unknown that a call of an instruction, or of code in none of the files, may write.

        Args:
            writer: name of what is called, in backticks, for messages.
        """
        forget(memory, self.changes.of_one(statement, memory.frame.routine), Kind.MAY_BE_WRITTEN, writer)

    def set_state(self, word: str, pieces: Sequence[Piece], memory: Memory) -> None:
        """Carry out an instruction that sets load, displacement or the like.

        Args:
            word: the instruction in lower case, a key of ``STATE_OF_INSTRUCTION``; pieces: its arguments.
        """
        run_state_instruction(word, pieces, memory, lambda span: self.data.value(span, memory))

    def late_name(self, call: LateCall, memory: Memory) -> str:
        """The name of the routine that a call by name (``%name%``, ``CallByVar``) means; empty if it is not known."""
        name = self.data.value_or_not(call.name, memory)
        number = self.data.value_or_not(call.number, memory) if call.number is not None else None
        word = name.split(":")[-1].strip() if isinstance(name, str) else ""
        if isinstance(number, float) and number == int(number):
            return f"{word}{int(number)}"
        return word if call.number is None else ""

    def move(self, motion: MotionStatement, memory: Memory) -> None:
        """Run a motion: data in which a search stores the position that it finds becomes unknown."""
        for result in motion.results:
            self.data.assign(result.span, Unknown(Kind.SEARCH_RESULT, f"`{result.text}`"), memory)

    def run_unseen(self, statement: Statement, arguments: int | None, memory: Memory) -> None:
        """Note that a call of code in none of the files may have moved the arm.

        What it may write has become unknown before.

        Args:
            statement: the call; arguments: how many it has, None if a text names the routine.
        """
        memory.doubt()

    def call_routine(
        self, routine: Routine, pieces: Sequence[Piece], memory: Memory, again: bool = True
    ) -> Value | Unknown | None:
        """Run a routine with these arguments and return its value: None if it returns nothing.

        A call that is too deep or may recur for ever is not run: what it writes becomes unknown, and so does its value.

        Args:
            pieces: arguments of the call, as ``read_arguments`` gives them, in the file of the calling routine.
            again: this call has been run before.
        """
        frame = bound_frame(routine, pieces, memory, self.data.tree)
        frame.supposed &= again
        running = memory.frame.running()
        before = next((call for call in running if call.routine.key == routine.key), None)
        if self.beyond(routine, len(running)) or (before is not None and _endless(frame, before)):
            keys = (k for k in self.changes.of_routine.get(routine.key, ()) if not k.startswith("%"))
            forget(memory, keys, Kind.CHANGED_UNFOLLOWED)
            self.passed_over.add(routine.key)
            memory.doubt()
            return Unknown(Kind.NOT_FOLLOWED, routine.name)
        inner = replace(memory, frame=frame)
        local_keys = [d.key for d in routine.declarations if d.storage == "VAR" and d.key in memory.changed]
        outer = {key: memory.changed[key] for key in local_keys if before is not None}
        result = self.enter(routine, inner)
        memory.changed = {**inner.changed, **outer} if outer else inner.changed
        memory.ends = inner.ends
        self.forget_passed(routine, pieces, frame, memory)
        return result

    def beyond(self, routine: Routine, depth: int) -> bool:
        """Whether a call of a routine is not run because more than ``MAX_CALLS`` calls are in progress.

        Args:
            depth: number of calls in progress.
        """
        return depth > MAX_CALLS and routine.key not in self.added.routines

    def forget_passed(self, routine: Routine, pieces: Sequence[Piece], frame: CallFrame, memory: Memory) -> None:
        """Make data unknown, or assumed, that a call may have written through a parameter that is no sure reference.

        Such a parameter got an element with an unknown index, or data that the caller itself got by value.

        Args:
            pieces: arguments of the call; frame: of the call, with its parameters; memory: of the caller.
        """
        written, data = self.changes.of_routine.get(routine.key, frozenset()), memory.frame.routine.source.data
        for parameter, span in paired(routine.parameters, pieces):
            bound = frame.bindings.get(parameter.name)
            if parameter.mode not in BY_REFERENCE or "%" + parameter.name not in written or span[0] == span[1]:
                continue
            keys = memory.keys_of(argument_name(data, span))
            if not isinstance(bound, Reference):
                forget(memory, keys, Kind.MAY_BE_WRITTEN, f"`{routine.name}`")
            elif bound.assumed:
                assume(memory, keys, f"`{routine.name}`")

    def function(self, call: Call, memory: Memory) -> Value | None:
        """The result of a function of the program, which is run; None if the program has no function of that name.

        Raises:
            Unknown: the result is not known, or the function ends without one.
        """
        routine = self.program.routine(call.name, memory.frame.routine.module)
        if routine is None or routine.kind != "FUNC":
            return None
        pieces = [("", a.span, a.span) for a in call.arguments]
        pieces += [("\\" + name, value.span if value else (0, 0), (0, 0)) for name, value in call.options]
        result = self.call_routine(routine, pieces, memory)
        if isinstance(result, Value):
            return Value(as_type(result.data, routine.type), routine.type, assumed=result.assumed)
        raise result.kept() if isinstance(result, Unknown) else Unknown(Kind.GIVES_NOTHING, call.text)


def _endless(frame: CallFrame, before: CallFrame) -> bool:
    """Whether a call of a routine that is running already may recur for ever.

    That is assumed if it has no arguments, gets the routine's own data by reference, or stands under more unknown
    conditions than the call before.

    Args:
        frame: the new call; before: the call of that routine which has not ended.
    """
    references = (bound for bound in frame.bindings.values() if isinstance(bound, Reference))
    by_reference = any(bound.declaration.routine.lower() == frame.routine.name.lower() for bound in references)
    return by_reference or not frame.bindings or frame.conditional > before.conditional
