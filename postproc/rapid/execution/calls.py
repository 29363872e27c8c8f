"""Expressions evaluated and routines called while a program is walked."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

from postproc.diagnostics import Diagnostic, Matter, Source
from postproc.rapid.data.events import MotionStatement, StatementKey
from postproc.rapid.data.values import Data, Value, as_type
from postproc.rapid.evaluation.accessor import Accessor
from postproc.rapid.evaluation.assign import assume, forget
from postproc.rapid.evaluation.call_binding import bound_frame
from postproc.rapid.evaluation.declared import DeclaredValues
from postproc.rapid.evaluation.memory import CallFrame, Memory, Reference
from postproc.rapid.evaluation.state import run_state_instruction
from postproc.rapid.evaluation.teaching import Teaching
from postproc.rapid.execution.oracle import Oracle
from postproc.rapid.execution.path_splitting import Place, SplitBranches
from postproc.rapid.motions.events_of import EventMaker
from postproc.rapid.motions.missing import undeclared
from postproc.rapid.motions.recorder import Recorder
from postproc.rapid.program.arguments import BY_REFERENCE, Piece, argument_name, paired, read_arguments
from postproc.rapid.program.instructions import COUNTING, KNOWN, MOVING, READ_ONLY, STATE
from postproc.rapid.program.late_binding import BY_NAME, LATE, LateCall, late_call
from postproc.rapid.program.program import Program
from postproc.rapid.program.signatures import MOVE, meant_instruction
from postproc.rapid.program.spelling import if_not, meant_name, meant_routine
from postproc.rapid.program.write_effects import WriteEffects
from postproc.rapid.syntax.nodes import Routine, Statement
from postproc.rapid.syntax.trees import Call
from postproc.rapid.unknown import Kind, Unknown

MAX_CALLS = 30  # depth
MAX_STEPS = 100_000  # statements executed; from there on every loop runs once and calls are passed over
MOTION_STEPS = 5  # that an execution of a motion counts as


@dataclass(frozen=True, slots=True)
class AddedMotions:
    """Motions and routines (by their keys) that were written into a program.

    Executing them counts no steps, so that the written program is followed as far as the original. In these routines a
    value that is only assumed decides which way is taken.
    """

    motions: frozenset[StatementKey] = frozenset()
    routines: frozenset[str] = frozenset()

    @classmethod
    def between(cls, program: Program, written: Program, motions: Iterable[StatementKey] = ()) -> AddedMotions:
        """Return the given added motions, and the routines that ``written`` has and ``program`` has not.

        Args:
            motions: keys of the motion statements that were added.
        """
        own = {routine.key for routine in program.all_routines()}
        return cls(frozenset(motions), frozenset(routine.key for routine in written.all_routines()) - own)


class Execution(ABC):
    """Executes calls, motions and functions of a program.

    The ``recorder`` keeps every motion as an event, ``diagnostics`` the findings.
    """

    def __init__(
        self,
        program: Program,
        changes: WriteEffects | None = None,
        added: AddedMotions | None = None,
        oracle: Oracle | None = None,
    ) -> None:
        """Set up the walk of a program, with nothing executed yet.

        Args:
            changes: write effects of the program, worked out if None; added: motions and routines written into the
                program.
            oracle: answers what the text leaves open; by default nothing.
        """
        self.program = program
        self.oracle = oracle or Oracle()
        self.added = added or AddedMotions()
        self.changes = changes or WriteEffects(program)
        self.constants = DeclaredValues(program)
        self.diagnostics: list[Diagnostic] = []
        self.teaching = Teaching(program.taught)
        self.maker = EventMaker(program, self.diagnostics, named=added is None and not self.oracle.decides)
        self.recorder = Recorder(self.maker)
        self.entered: set[str] = set()  # routines
        self.followed: set[tuple[str, int]] = set()  # calls
        self.elsewhere: set[str] = set()  # names of routines in none of the files
        self.passed_over: set[str] = set()  # routines that some call means that is not followed
        self.reported: set[tuple[str, str]] = set()
        self.jumps: dict[str, Mapping[str, int]] = {}
        self.jump: str | None = None  # label that the one way goes on at
        self.choices = SplitBranches()
        self.told: set[Place] = set()  # branches
        self.spare = 10 * (len(program.statements) - len(self.added.motions))  # long programs may take more steps
        self.steps = -self.spare
        self.depth = 0
        self.data = Accessor()

    def exhausted(self, source: Source) -> bool:
        """Whether more than ``MAX_STEPS`` steps are taken, so that no more turns and calls are followed (warns once).

        Args:
            source: the file at which the warning RAP033 is reported.
        """
        if self.steps <= MAX_STEPS:
            return False
        text, help = "the program is too long to be followed to its end", "choose the routine to start with"
        self.report_once(Diagnostic("RAP033", "warning", text, source, None, help))
        return True

    @abstractmethod
    def enter(self, routine: Routine, memory: Memory) -> Value | Unknown | None:
        """Run a routine's body on ``memory`` and return its value: Unknown if not known, None if it returns nothing."""

    def call(self, statement: Statement, memory: Memory) -> None:
        """Run a statement that begins with a name on ``memory``: a motion, a call of a routine, or an instruction."""
        source = memory.frame.routine.source
        motion = self.program.motions.get((source.path, statement.span[0]))
        if motion is not None:
            self.move(motion, memory)
            return
        word, start = statement.word, statement.span[0] + len(statement.word)
        late = late_call(statement, source.data, self.program, memory.frame.routine.module)
        if late is not None:
            routine = self.late_bound(late, statement, memory)
            if routine is None:
                return
            pieces = late.pieces
        else:
            routine = self.program.routine(word, memory.frame.routine.module)
            pieces = read_arguments(source.data, start, statement.span[1])
        if routine is not None:
            place = source.path, statement.span[0]
            again = place in self.followed
            self.followed.add(place)
            self.call_routine(routine, pieces, memory, again)
        elif word in STATE:
            run_state_instruction(word, pieces, memory, lambda span: self.data.value(span, memory))
            self.report_undeclared(memory.changed.get(STATE[word]), source)
        elif word in COUNTING:
            self.data.count(word, pieces, memory)
        elif word in READ_ONLY:
            forget(memory, self.changes.of_one(statement, memory.frame.routine), Kind.MAY_BE_WRITTEN, f"`{word}`")
        elif not (word in BY_NAME and self.data.by_name(word, pieces, memory)):
            self.from_elsewhere(statement, len(pieces), memory)

    def move(self, motion: MotionStatement, memory: Memory) -> None:
        """Record a motion as events and count its steps; the data that a search writes becomes unknown."""
        self.steps += 0 if motion.key in self.added.motions else MOTION_STEPS
        more = self.recorder.move(motion, memory)  # functions in its arguments take steps, too
        self.steps += more
        if "found" in motion.roles:
            self.search(motion, memory)

    def search(self, motion: MotionStatement, memory: Memory) -> None:
        """Make the data unknown to which a search instruction writes the position that it finds."""
        found = motion.argument("found")
        if found is not None:
            self.data.assign(found.span, Unknown(Kind.FOUND_BY_SEARCH, f"`{found.text}`"), memory)

    def from_elsewhere(self, statement: Statement, arguments: int, memory: Memory) -> None:
        """Carry out an instruction of the controller, or a routine that is in none of the files, by what it may write.

        Data that it is given becomes unknown. A routine in no file is reported once (RAP031) and taken not to move the
        arm.

        Args:
            arguments: how many arguments the call has.
        """
        source, word = memory.frame.routine.source, statement.word
        span = statement.span[0], statement.span[0] + len(word)
        name = source.data[slice(*span)].decode("latin-1")
        forget(memory, self.changes.of_one(statement, memory.frame.routine), Kind.MAY_BE_WRITTEN, f"`{name}`")
        if word in KNOWN:
            if word in MOVING:
                memory.doubt()
            return
        memory.doubt()  # taken not to move the arm, but nothing may be added to the way from here
        if name in self.elsewhere:
            return
        self.elsewhere.add(name)
        instruction = meant_instruction(word) if arguments >= len(MOVE) else ""
        meant = f"did you mean `{instruction}`?" if instruction else meant_routine(self.program, name)
        help_ = if_not(meant, "give the file that defines it too if it moves the arm or sets a load")
        text = f"the routine `{name}` is called, is in none of the files, and is taken not to move the arm"
        if meant:
            self.report_once(Diagnostic("RAP031", "warning", text, source, span, help_))
        else:
            self.report_once(Diagnostic("RAP031", "info", text, source, span, help_, Matter.UNSEEN, name))

    def report_undeclared(self, data: Data, source: Source) -> None:
        """Report once a name without declaration if that is why a load or displacement is not known.

        Args:
            data: the load or displacement. source: the file of the statement that sets it.
        """
        if isinstance(data, Unknown) and data.missing and data.span and self.maker.missing.is_news(data.missing):
            meant = meant_name(data.missing, (d.name for d in self.program.declarations))
            self.diagnostics.append(undeclared("data", data.missing, source, data.span, meant))

    def late_bound(self, call: LateCall, statement: Statement, memory: Memory) -> Routine | None:
        """Routine that a call by name (``%name%``, ``CallByVar``) means; None if the name or the routine is not known.

        If None, what it may write becomes unknown, and RAP032 is reported.
        """
        name = self.data.value_or_not(call.name, memory)
        number = self.data.value_or_not(call.number, memory) if call.number is not None else None
        word = name.split(":")[-1].strip() if isinstance(name, str) else ""
        if isinstance(number, float) and number == int(number):
            word = f"{word}{int(number)}"
        elif call.number is not None:
            word = ""
        routine = self.program.routine(word, memory.frame.routine.module) if word else None
        if routine is not None:
            return routine
        keys = self.changes.of_one(statement, memory.frame.routine)
        forget(memory, keys, Kind.MAY_BE_WRITTEN, f"`{word}`" if word else LATE)
        memory.doubt()
        self.report_once(Diagnostic(
            "RAP032", "warning", "which routine is called here is known only at run time",
            memory.frame.routine.source, statement.span, "the routines it may call are followed on their own",
        ))  # fmt: skip
        return None

    def call_routine(
        self, routine: Routine, pieces: Sequence[Piece], memory: Memory, again: bool = True
    ) -> Value | Unknown | None:
        """Run a routine with these arguments and return its value: None if it returns nothing.

        A call that is too deep or may recur for ever is not run: what it writes becomes unknown, and so does its value.

        Args:
            pieces: arguments of the call (option, span of expression, span of whole) in the file of the calling
                routine.
            again: the call has been followed before.
        """
        frame = bound_frame(routine, pieces, memory, self.data.tree)
        frame.supposed &= again
        running = memory.frame.running()
        before = next((call for call in running if call.routine.key == routine.key), None)
        counted = routine.key not in self.added.routines
        beyond = counted and (len(running) > MAX_CALLS or self.exhausted(routine.source))
        if beyond or (before is not None and _endless(frame, before)):
            keys = (k for k in self.changes.of_routine.get(routine.key, ()) if not k.startswith("%"))
            forget(memory, keys, Kind.CHANGED_UNFOLLOWED)
            memory.doubt()
            self.passed_over.add(routine.key)
            return Unknown(Kind.NOT_FOLLOWED, routine.name)
        inner, steps = replace(memory, frame=frame), self.steps
        own = [d.key for d in routine.declarations if d.storage == "VAR" and d.key in memory.changed]
        outer = {key: memory.changed[key] for key in own if before is not None}
        result = self.enter(routine, inner)
        self.steps = self.steps if counted else steps
        memory.changed = {**inner.changed, **outer} if outer else inner.changed
        memory.ends = inner.ends
        self.forget_passed(routine, pieces, frame, memory)
        return result

    def forget_passed(self, routine: Routine, pieces: Sequence[Piece], frame: CallFrame, memory: Memory) -> None:
        """Make data unknown, or assumed, that a call may have written through a parameter that is no sure reference.

        Such a parameter got an element with an unknown index, or one that the caller itself got by value.

        Args:
            pieces: arguments of the call. frame: of the call, with its parameters. memory: of the caller.
        """
        written, data = self.changes.of_routine.get(routine.key, frozenset()), memory.frame.routine.source.data
        for parameter, span in paired(routine.parameters, pieces):
            bound = frame.bindings.get(parameter.name)
            if parameter.mode not in BY_REFERENCE or "%" + parameter.name not in written or span[0] == span[1]:
                continue
            name = argument_name(data, span)
            if name in memory.frame.bindings:
                keys = ["%" + name]
            else:
                declaration = memory.find(name)
                keys = [declaration.key] if declaration is not None and declaration.storage != "CONST" else []
            if not isinstance(bound, Reference):
                forget(memory, keys, Kind.MAY_BE_WRITTEN, f"`{routine.name}`")
            elif bound.assumed:
                for key in keys:
                    memory.invalidate(key)
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

    def report_once(self, found: Diagnostic) -> None:
        """Add a finding unless one with the same code and message was added before."""
        if (found.code, found.message) not in self.reported:
            self.reported.add((found.code, found.message))
            self.diagnostics.append(found)


def _endless(frame: CallFrame, before: CallFrame) -> bool:
    """Whether a call of a running routine may never end: no arguments, its own data by reference, or a new condition.

    Args:
        frame: the new call; before: the call of that routine which has not ended.
    """
    references = (bound for bound in frame.bindings.values() if isinstance(bound, Reference))
    own = any(bound.declaration.routine.lower() == frame.routine.name.lower() for bound in references)
    return own or not frame.bindings or frame.conditional > before.conditional
