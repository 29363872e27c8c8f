"""Statements executed in program order, with both ways taken where a condition is not known."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from postproc.diagnostics import Diagnostic, Matter, Source, Span
from postproc.rapid.data.values import Data, Value, as_type
from postproc.rapid.evaluation.assign import forget, joined
from postproc.rapid.evaluation.evaluate import names_in
from postproc.rapid.evaluation.memory import Exit, Memory, Reference
from postproc.rapid.execution.jumps import jumps_in, structured
from postproc.rapid.execution.loops import Loops
from postproc.rapid.execution.path_splitting import Ends, Place
from postproc.rapid.program.arguments import argument_name, read_arguments
from postproc.rapid.program.statement_effects import NO_EFFECT, StatementEffect
from postproc.rapid.syntax.nodes import Declaration, Routine, Statement
from postproc.rapid.syntax.tokens import identifiers
from postproc.rapid.unknown import Assumed, Kind, Unknown, without_causes

MAX_DEPTH = 80  # blocks and calls inside one another


class Flow(Loops):
    """Executes statements in program order.

    Where a condition is not known, each arm of the IF or TEST is run, and what they leave is joined; of a branch in
    ``choices.forced`` only one arm is run.
    """

    def enter(self, routine: Routine, memory: Memory) -> Value | Unknown | None:
        """Run a routine's body on ``memory``, which then holds what is common to all ways out of the routine.

        Returns:
            Its value; Unknown if several RETURN statements may decide it, None if it returns nothing.
        """
        self.entered.add(routine.key)
        for declaration in routine.declarations:
            memory.initialise(declaration)
        reached = self.body(routine.body, memory)
        self.jump = None
        exits = memory.frame.exits
        if not exits:
            return None
        ways = [*([Exit(memory.changed, memory.ends)] if reached else ()), *exits]
        memory.changed = joined([way.changed for way in ways if way.goes_on] or [memory.changed], self.program)
        memory.ends = self.recorder.either(*(way.ends for way in ways))
        values = [way.value for way in exits if way.value is not None]
        return Unknown(Kind.RESULT_UNDECIDED) if len(values) > 1 else next(iter(values), None)

    def body(self, statements: Iterable[Statement], memory: Memory) -> bool:
        """Run statements on ``memory``; True if their end is reached, False if RETURN, EXIT or a jump leaves it."""
        if self.oracle.decides:
            return self.one_way(tuple(statements), memory)
        if self.depth > MAX_DEPTH:
            forget(memory, self.changes.everything, Kind.CHANGED_TOO_DEEPLY)
            self.steps += 100
            return True
        self.steps += 1  # an empty body costs time too
        self.depth += 1
        steps = structured(tuple(statements), self.jumps_of(memory.frame.routine))
        reached = all(self.statement(statement, memory) for statement in steps)
        self.depth -= 1
        return reached

    def one_way(self, steps: Sequence[Statement], memory: Memory) -> bool:
        """Run statements on ``memory`` and follow every GOTO to its label, for a world that decides all conditions.

        Returns:
            Whether their end is reached; False with ``jump`` set if a GOTO leads to a label outside of them.
        """
        at, labels = 0, dict[str, int]()
        while at < len(steps):
            if self.statement(steps[at], memory):
                at += 1
                continue
            if self.jump is not None and not labels:
                labels = {s.word: i for i, s in reversed([*enumerate(steps)]) if s.kind == "label"}
            if self.jump is None or self.jump not in labels:
                return False
            at, self.jump = labels[self.jump], None
        return True

    def statement(self, statement: Statement, memory: Memory) -> bool:
        """Run one statement on ``memory``; False if it leaves the body in which it stands."""
        path, span = memory.frame.routine.source.path, statement.span
        self.steps += (path, span[0]) not in self.added.motions
        if path in self.changes.calling:
            functions = self.changes.of_functions(statement, memory.frame.routine)
            if functions is not NO_EFFECT:
                self.forget_written(statement, functions, memory)
        if self.program.taught:
            self.check_taught(statement, memory)
        match statement.kind:
            case "call":
                self.call(statement, memory)
            case "assign":
                data = self.data.value_or_not(statement.parts[1], memory)
                self.data.assign(statement.parts[0], data, memory)
            case "if" | "test":
                return self.branches(statement, memory)
            case "for":
                return self.for_loop(statement, memory)
            case "while":
                return self.while_loop(statement, memory)
            case "label" if not self.oracle.decides:
                self.label(statement, memory)
            case "goto" if self.oracle.decides:
                self.jump = statement.word
                return False
            case "goto":
                # The jump may skip what follows; at its label the ways meet again.
                memory.conditional += 1
            case "return":
                memory.leave(self.result(statement.parts[0], memory))
                return False
            case "leave":
                memory.leave(goes_on=False)
                return False
            case "opaque":
                forget(memory, self.changes.of_one(statement, memory.frame.routine), Kind.UNCERTAIN)
        return True

    def forget_written(self, statement: Statement, functions: StatementEffect, memory: Memory) -> None:
        """Make data unknown that functions in a statement's expressions write, unless running the statement runs them.

        Args:
            functions: effect of these functions.
        """
        self.forget_unseen(functions, memory)
        routine = memory.frame.routine
        if statement.kind in ("assign", "return"):
            return
        if statement.kind == "call":
            moves = self.program.motion(routine.source, statement) is not None
            still = memory.trial or memory.returning
            if not still if moves else self.program.routine(statement.word, routine.module) is not None:
                return
        forget(memory, self.changes.through(functions, routine), Kind.WRITTEN_BY_FUNCTION)

    def forget_unseen(self, functions: StatementEffect, memory: Memory) -> None:
        """Make data unknown that functions in none of the files may write in a statement's expressions.

        Args:
            functions: effect of the functions in these expressions.
        """
        if functions.unseen:
            forget(memory, functions.keys, Kind.MAY_BE_WRITTEN, f"`{functions.unseen[-1]}`")

    def say_followed(self, statement: Statement, place: Place, memory: Memory) -> None:
        """Report RAP036 for PERS data in a branch's conditions which nothing in these files writes, once per branch.

        Only branches that move the arm or write data count.

        Args:
            statement: IF or TEST. place: its file and byte offset.
        """
        if place in self.told or not self.changes.of_one(statement, memory.frame.routine):
            return
        self.told.add(place)
        for span in (*statement.parts, *(span for branch in statement.branches for span in branch.conditions)):
            try:
                names = names_in(self.data.tree(span, memory)) - memory.frame.bindings.keys()
            except Unknown:
                continue
            for declaration in filter(None, map(memory.find, sorted(names))):
                if declaration.storage == "PERS" and memory.is_initial(declaration):
                    text = f"`{declaration.name}` decides here: it is followed with its value in the file"
                    help_ = "give the file that writes it (`--with FILE`) if there is one"
                    self.report_once(Diagnostic("RAP036", "info", text, memory.frame.routine.source, span, help_))

    def check_taught(self, statement: Statement, memory: Memory) -> None:
        """Report RAP035 if a statement changes ``--taught`` data relative to itself, as in ``p.x:=p.x+1``."""
        source = memory.frame.routine.source
        self.teaching.place = (source, statement.span)
        if statement.kind == "assign":
            name, words = statement.word, identifiers(source.data[slice(*statement.parts[1])])
        elif statement.kind == "call" and statement.word in ("incr", "decr", "add"):
            pieces = read_arguments(source.data, statement.span[0] + len(statement.word), statement.span[1])
            name = argument_name(source.data, pieces[0][1]) if pieces else ""
            words = {name}
        else:
            return
        bound = memory.frame.bindings.get(name)
        declaration = bound.declaration if isinstance(bound, Reference) else memory.find(name)
        if declaration is None or name not in words or not self.teaching.covers(declaration):
            return
        same = False
        if statement.kind == "assign":
            now, data = (without_causes(self.data.value_or_not(span, memory.aside()))[0] for span in statement.parts)
            same = now == data
        if not same:
            self.report_moved(declaration, source, statement.span)

    def report_moved(self, declaration: Declaration, source: Source, span: Span) -> None:
        """Report RAP035: the program moves ``--taught`` data, so that the value in the file is not what runs."""
        text = f"`{declaration.name}`, which is to be taught, is moved by the program"
        help_ = f"leave `--taught {declaration.name}` out, and set it from a CONST before the first motion"
        name = declaration.name
        self.report_once(Diagnostic("RAP035", "error", text, source, span, help_, Matter.TAUGHT_MOVED, name))

    def check_end(self, memory: Memory) -> None:
        """Report RAP035 for ``--taught`` data whose value at the end of a run is not that in the file.

        The next run begins with that value.
        """
        moved = set(self.teaching.mixed())
        for key, data in memory.changed.items():
            declaration = self.program.names.get(key)
            if declaration is None or key not in self.teaching.moved:
                continue
            if self.teaching.away(memory.declared(declaration).data, data):
                moved.add(key)
        for key in sorted(moved):
            self.report_moved(*self.teaching.moved[key])

    def branches(self, statement: Statement, memory: Memory) -> bool:
        """Run IF or TEST: the arm that is known to be taken, else each that may be; False if none reaches its end."""
        place = (memory.frame.routine.source.path, statement.span[0])
        if place in self.choices.forced and self.open(statement, self.choices.forced[place], memory):
            return self.forced(statement, place, memory)
        self.say_followed(statement, place, memory)
        ways, arms, exits = list[Memory](), dict[int, dict[str, Data] | None](), memory.frame.exits
        out, uncertain = len(exits), False
        for arm, branch in enumerate(statement.branches):
            verdict = self.chosen(statement, branch.conditions, memory) if branch.conditions else True
            if verdict is False:
                continue
            if verdict is True and not uncertain:
                return self.body(branch.body, memory)
            uncertain = True
            way, left = memory.branch(), len(exits)
            if self.body(branch.body, way):
                ways.append(way)
                arms[arm] = way.changed
            elif returned := [exit_ for exit_ in exits[left:] if exit_.goes_on]:
                arms[arm] = returned[-1].changed
            if verdict is True:
                break
        else:
            if not uncertain:
                return True
            ways.append(memory)  # none of the conditions holds
            arms[len(statement.branches)] = None
        if not memory.trial and len(arms) > 1:
            self.choose(statement, arms, any(way.goes_on for way in exits[out:]), memory)
        if not ways:
            return False
        self.meet(ways, memory)
        parameters = (k for k in self.changes.of_one(statement, memory.frame.routine) if k.startswith("%"))
        forget(memory, parameters, Kind.UNDECIDED)
        return True

    def meet(self, ways: Sequence[Memory], memory: Memory) -> None:
        """Set ``memory`` to what is common to the ends of several ways that began from it and meet here."""
        conditional = [way.conditional - 1 for way in ways if way is not memory]
        memory.changed, memory.ends, memory.conditional = (
            joined([way.changed for way in ways], self.program),
            self.recorder.either(*(way.ends for way in ways)),
            max([memory.conditional, *conditional]),
        )

    def choose(self, statement: Statement, arms: Ends, left: bool, memory: Memory) -> None:
        """Record in ``choices`` a branch that moves nothing, so that each of its arms can be followed on its own later.

        Args:
            statement: IF or TEST. left: an arm ends the routine.
            arms: data at the end of each arm, by its number; None for the way on which no arm is taken.
        """
        routine, changes = memory.frame.routine, self.changes
        keys = changes.of_one(statement, routine)
        if "@moves" not in keys:
            written = [
                frozenset[str]().union(*(changes.of_one(inner, routine) for inner in branch.body))
                for branch in statement.branches
            ]
            self.choices.met((routine.source.path, statement.span[0]), arms, keys, written, left)

    def open(self, statement: Statement, arm: int, memory: Memory) -> bool:
        """Whether nothing decides which arm of an IF or TEST is taken, and a certain one may be.

        Args:
            arm: number of that arm; as many as there are arms: none of them is taken.
        """
        verdicts = [self.chosen(statement, b.conditions, memory) if b.conditions else True for b in statement.branches]
        possible = arm == len(verdicts) or verdicts[arm] is not False
        return possible and next((verdict for verdict in verdicts if verdict is not False), False) is None

    def forced(self, statement: Statement, place: Place, memory: Memory) -> bool:
        """Run only the arm of a branch that ``choices.forced`` names; False if it does not reach its end.

        Data that not every arm sets, or not always to the same value, becomes unknown.

        Args:
            statement: IF or TEST. place: its file and byte offset.
        """
        if not memory.trial and self.choices.again(place):
            memory.doubt()  # the arm may have come here by another choice
        arm, choice = self.choices.forced[place], self.choices.found[place]
        reached = arm == len(statement.branches) or self.body(statement.branches[arm].body, memory)
        forget(memory, choice.keys - choice.certain, Kind.UNDECIDED)
        return reached

    def chosen(self, statement: Statement, conditions: tuple[Span, ...], memory: Memory) -> bool | None:
        """Whether an arm of IF or TEST is taken; None if that is not known.

        Args:
            conditions: spans of the IF condition, or of the values of a CASE, one of which must equal the TEST
                expression.
        """
        if statement.kind == "if":
            return self.truth(conditions[0], memory)
        verdict: bool | None = False
        subject = self.deciding(statement.parts[0], memory)
        for condition in conditions:
            case = self.deciding(condition, memory)
            taken: bool | None = as_type(subject, "num") == as_type(case, "num")
            if isinstance(subject, Unknown | Assumed) or isinstance(case, Unknown | Assumed):
                taken = self.asked(condition, memory)
            if taken:
                return True
            verdict = None if taken is None else verdict
        return verdict

    def jumps_of(self, routine: Routine) -> Mapping[str, int]:
        """How many GOTO statements lead to each label of a routine, by lower-case label (only those with one)."""
        if routine.key not in self.jumps:
            self.jumps[routine.key] = jumps_in(routine)
        return self.jumps[routine.key]

    def label(self, statement: Statement, memory: Memory) -> None:
        """At a label with a GOTO, make all unknown that the routine may write: it may have changed before the jump."""
        routine = memory.frame.routine
        if statement.word in self.jumps_of(routine):
            forget(memory, self.changes.of_routine[routine.key], Kind.CHANGED_BEFORE_JUMP)
            memory.doubt()

    def result(self, span: Span, memory: Memory) -> Value | Unknown | None:
        """The value of the expression behind RETURN at this span; Unknown if not known, None without expression."""
        return self.data.evaluated(span, memory) if span[0] < span[1] else None
