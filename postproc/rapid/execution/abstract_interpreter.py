"""All paths of control through a program at once: data that they leave different is not known behind their join.

Branches are followed arm by arm, and meet again. Loops run turn by turn where the text tells how many turns there are,
else once for all turns.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace

from postproc.diagnostics import Source, Span
from postproc.rapid.data.events import MotionStatement, Turn
from postproc.rapid.data.values import Data, Value
from postproc.rapid.evaluation.assign import differing, forget, joined, present
from postproc.rapid.evaluation.evaluate import names_in
from postproc.rapid.evaluation.memory import Exit, Memory
from postproc.rapid.execution.findings import WalkFindings
from postproc.rapid.execution.interpreter import MAX_TURNS, AddedMotions, Interpreter
from postproc.rapid.execution.jumps import UNTIL, structured
from postproc.rapid.execution.path_splitting import Ends, Place, SplitBranches
from postproc.rapid.motions.events_of import EventMaker
from postproc.rapid.motions.recorder import Recorder
from postproc.rapid.program.arguments import Piece
from postproc.rapid.program.program import Program, statements_of
from postproc.rapid.program.signatures import STATE_OF_INSTRUCTION
from postproc.rapid.program.statement_effects import UNSEEN, StatementEffect
from postproc.rapid.syntax.nodes import Routine, Statement
from postproc.rapid.unknown import Kind, Unknown

MAX_STEPS = 100_000  # statements executed; from there on every loop runs once and calls are passed over
MOST_STEPS_ABOVE = 2  # times MAX_STEPS: from there on what is in a loop is not followed at all
MOTION_STEPS = 5  # that an execution of a motion counts as
MAX_DEPTH = 80  # blocks and calls inside one another
MAX_IDLE_TURNS = 300  # of one loop that moves nothing
MAX_TRIALS = 4  # turns to find out what every turn of a loop leaves as it was; after them all it changes is unknown


class AbstractInterpreter(Interpreter):
    """Follows all paths of control through a program; the ``recorder`` keeps every motion as an event.

    Args:
        entered: keys of the routines that have been entered.
        choices: branches of which only one arm is run, and what is known of the arms of others.
        steps: steps taken so far; counted from ``-spare``, since a program may take more steps the longer it is.
        depth: how many bodies (of routines, branches and loops) are being run inside one another.
    """

    def __init__(self, program: Program, added: AddedMotions | None = None) -> None:
        """Set up the walk of a program, with nothing executed yet; arguments as of ``Interpreter``."""
        super().__init__(program, added)
        self.findings = WalkFindings(program, self.data)
        self.maker = EventMaker(program, self.findings.all, named=added is None)
        self.recorder = Recorder(self.maker)
        self.choices = SplitBranches()
        self.entered: set[str] = set()
        self.spare = 10 * (len(program.statements) - len(self.added.motions))
        self.steps = -self.spare
        self.depth = 0
        self._jumps: dict[str, Mapping[str, int]] = {}  # by routine

    def exhausted(self, source: Source) -> bool:
        """Whether more than ``MAX_STEPS`` steps are taken, so that no more turns and calls are followed (warns once).

        Args:
            source: the file at which the warning is reported.
        """
        if self.steps <= MAX_STEPS:
            return False
        self.findings.too_long(source)
        return True

    def beyond(self, routine: Routine, depth: int) -> bool:
        """Whether a call inside ``depth`` others is not run, for too many calls or steps; added routines always are."""
        counted = routine.key not in self.added.routines
        return counted and (super().beyond(routine, depth) or self.exhausted(routine.source))

    # -- routines and statements ---------------------------------------------------------------------------------------

    def enter(self, routine: Routine, memory: Memory) -> Value | Unknown | None:
        """Run a routine's body on ``memory``; data that its ways out leave different is unknown there afterwards.

        Returns:
            The value that the routine returns: Unknown if several RETURN statements may give it, None if there is none.
        """
        self.entered.add(routine.key)
        steps = self.steps
        for declaration in routine.declarations:
            memory.initialise(declaration)
        reached = self.body(routine.body, memory)
        if routine.key in self.added.routines:
            self.steps = steps
        exits = memory.frame.exits
        if not exits:
            return None
        paths = [*([Exit(memory.changed, memory.ends)] if reached else ()), *exits]
        memory.changed = joined([path.changed for path in paths if path.goes_on] or [memory.changed], self.program)
        memory.ends = self.recorder.either(*(path.ends for path in paths))
        values = [path.value for path in exits if path.value is not None]
        return Unknown(Kind.RESULT_UNDECIDED) if len(values) > 1 else next(iter(values), None)

    def body(self, statements: Sequence[Statement], memory: Memory) -> bool:
        """Run statements on ``memory``; True if their end is reached, False if RETURN or EXIT leaves them.

        Inside more than ``MAX_DEPTH`` bodies they are not run: all that any routine may change becomes unknown.
        """
        if self.depth > MAX_DEPTH:
            forget(memory, self.changes.everything, Kind.CHANGED_TOO_DEEPLY)
            self.steps += 100
            return True
        self.steps += 1  # an empty body costs time too
        self.depth += 1
        reached = True
        for statement in structured(tuple(statements), self.jumps_of(memory.frame.routine)):
            if not self.statement(statement, memory):
                reached = False
                break
        self.depth -= 1
        return reached

    def statement(self, statement: Statement, memory: Memory) -> bool:
        """Run one statement on ``memory`` and count it; False if it leaves the body in which it stands."""
        self.steps += (memory.frame.routine.source.path, statement.span[0]) not in self.added.motions
        if self.program.taught:
            self.findings.taught_moves(statement, memory)
        return super().statement(statement, memory)

    def forget_written(self, statement: Statement, functions: StatementEffect, memory: Memory) -> None:
        """Make data unknown that functions in a statement's expressions may write, except where these are run with it.

        Args:
            functions: effect of these functions.
        """
        super().forget_written(statement, functions, memory)
        routine = memory.frame.routine
        if statement.kind in ("assign", "return"):
            return
        if statement.kind == "call":
            moves = self.program.motion(routine.source, statement) is not None
            still = memory.trial or memory.returning
            if not still if moves else self.program.routine(statement.word, routine.module) is not None:
                return
        forget(memory, self.changes.through(functions, routine), Kind.WRITTEN_BY_FUNCTION)

    def move(self, motion: MotionStatement, memory: Memory) -> None:
        """Record a motion as events and count its steps; the data that a search writes becomes unknown."""
        self.steps += 0 if motion.key in self.added.motions else MOTION_STEPS
        extra = self.recorder.move(motion, memory)  # functions in its arguments take steps, too
        self.steps += extra
        if motion.signature.results:
            super().move(motion, memory)

    def set_state(self, word: str, pieces: Sequence[Piece], memory: Memory) -> None:
        """Carry out an instruction that sets load, displacement or the like; a name declared nowhere in it is reported.

        Args:
            word: the instruction in lower case, a key of ``STATE_OF_INSTRUCTION``; pieces: its arguments.
        """
        super().set_state(word, pieces, memory)
        source = memory.frame.routine.source
        self.findings.undeclared_state(memory.changed.get(STATE_OF_INSTRUCTION[word]), source, self.maker.missing)

    def run_unseen(self, statement: Statement, arguments: int | None, memory: Memory) -> None:
        """Report a call of code in none of the files, which is taken not to move the arm.

        Args:
            statement: the call; arguments: how many it has, None if a text names the routine.
        """
        super().run_unseen(statement, arguments, memory)
        if arguments is None:
            self.findings.late(statement, memory.frame.routine.source)
        else:
            self.findings.unseen(statement, arguments, memory.frame.routine.source)

    # -- jumps ---------------------------------------------------------------------------------------------------------

    def jumps_of(self, routine: Routine) -> Mapping[str, int]:
        """How many GOTO statements lead to each label of a routine, by lower-case label (only those with one)."""
        if routine.key not in self._jumps:
            self._jumps[routine.key] = Counter(s.word for s in statements_of(routine) if s.kind == "goto")
        return self._jumps[routine.key]

    def jump(self, statement: Statement, memory: Memory) -> bool:
        """Go on with what follows a GOTO or a label in the text; always True.

        What follows a GOTO is conditional. At a label that a GOTO leads to, what the routine may write becomes unknown.
        """
        routine = memory.frame.routine
        if statement.kind == "goto":
            memory.conditional += 1
        elif statement.word in self.jumps_of(routine):
            forget(memory, self.changes.of_routine[routine.key], Kind.CHANGED_BEFORE_JUMP)
            memory.doubt()
        return True

    # -- branches ------------------------------------------------------------------------------------------------------

    def branches(self, statement: Statement, memory: Memory) -> bool:
        """Run IF or TEST: the arm known to be taken, else each that may be; what these leave different is unknown.

        False if each way is left by RETURN or EXIT.
        """
        place = (memory.frame.routine.source.path, statement.span[0])
        if place in self.choices.forced and self.may_take(statement, self.choices.forced[place], memory):
            return self.forced(statement, place, memory)
        self.findings.relied_on(statement, memory)
        paths, arms, exits = list[Memory](), dict[int, dict[str, Data] | None](), memory.frame.exits
        out, uncertain = len(exits), False
        subject = self.subject(statement, memory)
        for arm, branch in enumerate(statement.branches):
            verdict = self.chosen(statement, branch.conditions, subject, memory)
            if verdict is False:
                continue
            if verdict is True and not uncertain:
                return self.body(branch.body, memory)
            uncertain = True
            path, exits_before = memory.branch(), len(exits)
            if self.body(branch.body, path):
                paths.append(path)
                arms[arm] = path.changed
            elif returned := [exit_ for exit_ in exits[exits_before:] if exit_.goes_on]:
                arms[arm] = returned[-1].changed
            if verdict is True:
                break
        else:
            if not uncertain:
                return True
            paths.append(memory)  # none of the conditions holds
            arms[len(statement.branches)] = None
        if not memory.trial and len(arms) > 1:
            self.choose(statement, arms, any(path.goes_on for path in exits[out:]), memory)
        if not paths:
            return False
        conditional = [path.conditional - 1 for path in paths if path is not memory]
        memory.ends = self.recorder.either(*(path.ends for path in paths))
        memory.changed = joined([path.changed for path in paths], self.program)
        memory.conditional = max([memory.conditional, *conditional])
        parameters = (k for k in self.changes.of_one(statement, memory.frame.routine) if k.startswith("%"))
        forget(memory, parameters, Kind.UNDECIDED)
        return True

    def choose(self, statement: Statement, arms: Ends, may_return: bool, memory: Memory) -> None:
        """Record a branch that moves nothing in ``choices``, so that each of its arms can be followed on its own later.

        Args:
            arms: data at the end of each arm, by its number; None for the way on which no arm is taken.
            may_return: whether an arm may end the routine by RETURN.
        """
        routine, changes = memory.frame.routine, self.changes
        keys = changes.of_one(statement, routine)
        if "@moves" not in keys:
            written = [
                frozenset[str]().union(*(changes.of_one(inner, routine) for inner in branch.body))
                for branch in statement.branches
            ]
            self.choices.met((routine.source.path, statement.span[0]), arms, keys, written, may_return)

    def may_take(self, statement: Statement, arm: int, memory: Memory) -> bool:
        """Whether the conditions of a branch do not decide which arm is taken, and arm number ``arm`` is possible.

        Arms count from 0; the number of arms stands for the way on which none is taken.
        """
        subject = self.subject(statement, memory)
        verdicts = [self.chosen(statement, branch.conditions, subject, memory) for branch in statement.branches]
        possible = arm == len(verdicts) or verdicts[arm] is not False
        return possible and next((verdict for verdict in verdicts if verdict is not False), False) is None

    def forced(self, statement: Statement, place: Place, memory: Memory) -> bool:
        """Run only the arm that ``choices.forced`` names for a branch; False if it does not reach its end.

        What not every arm sets, or sets to different values in different runs, becomes unknown.
        """
        if not memory.trial and self.choices.again(place):
            memory.doubt()  # the arm may have come here by another choice
        arm, choice = self.choices.forced[place], self.choices.choices[place]
        reached = arm == len(statement.branches) or self.body(statement.branches[arm].body, memory)
        forget(memory, choice.keys - choice.certain, Kind.UNDECIDED)
        return reached

    # -- loops ---------------------------------------------------------------------------------------------------------

    def turns(self, loop: Statement, memory: Memory) -> bool:
        """Run a FOR loop turn by turn; if its bounds are not known or its turns too many, once for all turns.

        False if its body is left.
        """
        indices = self.indices(loop, memory)
        known, outer, source = indices is not None, memory.turns, memory.frame.routine.source
        for number, index in enumerate(indices or (), 1):
            if self.exhausted(source):
                known, memory.turns = False, outer
                break
            memory.turns = (*outer, Turn(source, loop.span[0], "FOR", number, (loop.word, index)))
            memory.frame.bindings[loop.word] = Value(index, "num")
            if not self.body(loop.branches[0].body, memory):
                return False
        if not known:
            memory.frame.bindings[loop.word] = Unknown(Kind.LOOP_INDEX, loop.word)
            self.unknown_turns(loop, memory)
        return True

    def while_loop(self, loop: Statement, memory: Memory) -> bool:
        """Run a WHILE loop turn by turn while its condition is known, else once for all turns.

        True if its end is reached, False if its body is left or it never ends.
        """
        condition = loop.parts[0] if loop.parts else (0, 0)
        source, outer = memory.frame.routine.source, memory.turns
        words = source.data[condition[0] : condition[1]]
        if loop.word != UNTIL and words.strip(b"() \t\r\n").lower() in (b"true", b""):
            self.unknown_turns(loop, memory, certain=True)
            memory.leave(goes_on=False)
            return False
        keys = self.changes.of_one(loop, memory.frame.routine)
        turns = MAX_TURNS if "@moves" in keys else MAX_IDLE_TURNS
        if not self.can_end(condition, keys, memory):
            turns = 1
        for number in range(1, turns + 1):
            verdict = self.truth(condition, memory)
            if verdict is (loop.word == UNTIL):
                return True
            if verdict is None or self.exhausted(source) or turns == 1:
                break
            memory.turns = (*outer, Turn(source, loop.span[0], "GOTO" if loop.word == UNTIL else "WHILE", number))
            before = present(memory, keys)
            if not self.body(loop.branches[0].body, memory):
                return False
            if not differing(before, present(memory, keys)):
                break  # nor will it in the next turn: what ends the loop is not known
        memory.turns = outer
        self.unknown_turns(loop, memory)
        return True

    def can_end(self, condition: Span, keys: frozenset[str], memory: Memory) -> bool:
        """Whether the loop may change data that its condition names; False if the condition cannot be read.

        Args:
            keys: of the data that the loop may change.
        """
        try:
            names = names_in(self.data.tree(condition, memory))
        except Unknown:
            return False
        declarations = (memory.find(name) for name in names)
        return any("%" + name in keys for name in names) or any(d.key in keys for d in declarations if d is not None)

    def unknown_turns(self, loop: Statement, memory: Memory, certain: bool = False) -> None:
        """Run the body of a loop once for all its turns, with all data unknown that may differ between turns.

        If it moves the arm, its beginning is followed again from its end, up to the first motion, as in a second turn.
        After far too many steps the body is not run: all that it may change becomes unknown.

        Args:
            certain: the body is known to run at least once.
        """
        routine = memory.frame.routine
        keys = self.changes.of_one(loop, routine)
        if self.steps > MOST_STEPS_ABOVE * MAX_STEPS:
            forget(memory, keys, Kind.CHANGED_UNFOLLOWED)
            memory.doubt()
            return
        body, moves = loop.branches[0].body, "@moves" in keys
        functions = self.changes.through(self.changes.direct.functions(loop, routine), routine)
        keys = self.varying(body, memory, keys) | functions | (keys & {UNSEEN})
        forget(memory, keys, Kind.CHANGED_IN_LOOP)
        begin = memory.ends
        memory.conditional += not certain
        if not self.body(body, memory):
            memory.ends = frozenset()
        elif moves and not memory.trial and not memory.returning and not self.recorder.only_new:
            next_turn = replace(memory.trial_copy(), trial=False, returning=True)
            forget(next_turn, keys, Kind.CHANGED_IN_LOOP)
            self.body(body, next_turn)
        memory.conditional -= not certain
        forget(memory, keys, Kind.CHANGED_IN_LOOP)
        memory.ends = self.recorder.either(memory.ends, begin)

    def varying(self, body: Sequence[Statement], memory: Memory, keys: frozenset[str]) -> frozenset[str]:
        """Keys of data that may differ from one turn of a loop to the next, found by trial turns that leave no trace.

        Args:
            keys: of the data that the loop may change; all are returned if the trials do not settle.
        """
        differing_keys: set[str] = {UNSEEN} & keys
        if memory.trial or self.exhausted(memory.frame.routine.source):
            return keys
        for _ in range(MAX_TRIALS):
            trial = memory.trial_copy()
            forget(trial, differing_keys, Kind.CHANGED_IN_LOOP)
            before = present(trial, keys)
            self.body(body, trial)
            changed = differing(before, present(trial, keys))
            if changed <= differing_keys:
                return frozenset(differing_keys)
            differing_keys |= changed
        return keys
