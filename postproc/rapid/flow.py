"""Statements executed in program order, with both ways taken where a condition is not known."""

from __future__ import annotations

from collections.abc import Iterable
from math import floor, inf

from postproc.diagnostics import Span
from postproc.rapid.assign import forget, joined
from postproc.rapid.evaluate import evaluate, names_in
from postproc.rapid.execution import Execution
from postproc.rapid.memory import Binding, Memory
from postproc.rapid.program import bodies, statements_in
from postproc.rapid.syntax import Routine, Statement
from postproc.rapid.values import Data, NotKnown, Value

MAX_TURNS = 10_000  # of one loop; a loop with more is treated as one that runs nobody knows how often
MAX_IDLE_TURNS = 300  # of one loop that moves nothing
MAX_DEPTH = 80  # blocks and calls inside one another


class Flow(Execution):
    """Executes statements."""

    def enter(self, routine: Routine, memory: Memory) -> Value | NotKnown | None:
        """Run a routine's body; what it returns."""
        for declaration in routine.declarations:
            memory.initialise(declaration)
        outer, self.returned = self.returned, None
        conditional, exits = self.conditional, self.ways.exits
        self.ways.exits = frozenset()
        self.stack.append(routine.key)
        self.body(routine.body, memory)
        self.stack.pop()
        self.conditional = conditional
        self.ways.ends, self.ways.exits = self.ways.ends | self.ways.exits, exits
        result, self.returned = self.returned, outer
        return result

    def body(self, statements: Iterable[Statement], memory: Memory) -> bool:
        """Run statements; whether the end of them is reached."""
        if self.depth > MAX_DEPTH:
            forget(memory, self.changes.everything, "is changed in blocks that are nested too deeply")
            self.steps += 100
            return True
        self.steps += 1  # an empty body costs time too
        self.depth += 1
        reached = all(self.statement(statement, memory) for statement in statements)
        self.depth -= 1
        return reached

    def statement(self, statement: Statement, memory: Memory) -> bool:
        self.steps += 1
        match statement.kind:
            case "call":
                self.call(statement, memory)
            case "assign":
                self.assign(statement.parts[0], self.value_or_not(statement.parts[1], memory), memory)
            case "if" | "test":
                return self.branches(statement, memory)
            case "for":
                return self.for_loop(statement, memory)
            case "while":
                return self.while_loop(statement, memory)
            case "label":
                self.label(statement, memory)
            case "goto":
                # The jump may skip what follows; at its label the ways meet again.
                self.conditional += 1
            case "return":
                self.leave_with(statement.parts[0], memory)
                return False
            case "leave":
                return False
            case "opaque":
                forget(memory, self.changes.of_one(statement, memory.frame.routine), "is not certain here")
        return True

    def branches(self, statement: Statement, memory: Memory) -> bool:
        changed, bindings = dict(memory.changed), dict(memory.frame.bindings)
        begin, stands = self.ways.ends, frozenset[int]()
        ends: list[dict[str, Data]] = []
        uncertain = False
        for branch in statement.branches:
            verdict = self.chosen(statement, branch.conditions, memory) if branch.conditions else True
            if verdict is False:
                continue
            if verdict is True and not uncertain:
                return self.body(branch.body, memory)
            uncertain = True
            self.conditional += 1
            if self.body(branch.body, memory):
                ends.append(memory.changed)
                stands |= self.ways.ends
            else:
                self.ways.leave()
            self.conditional -= 1
            memory.changed, memory.frame.bindings = dict(changed), dict(bindings)
            self.ways.ends = begin
            if verdict is True:
                break
        else:
            if not uncertain:
                return True
            ends.append(memory.changed)  # none of the conditions holds
            stands |= begin
        self.ways.ends = stands
        if not ends:
            return False
        memory.changed = joined(ends)
        parameters = (k for k in self.changes.of_one(statement, memory.frame.routine) if k.startswith("%"))
        forget(memory, parameters, "depends on a condition that is not known")
        return True

    def chosen(self, statement: Statement, conditions: tuple[Span, ...], memory: Memory) -> bool | None:
        """Whether a branch is taken; None if that is not known."""
        if statement.kind == "if":
            return self.truth(conditions[0], memory)
        verdict: bool | None = False
        for condition in conditions:
            try:
                if self.value(statement.parts[0], memory) == self.value(condition, memory):
                    return True
            except NotKnown:
                verdict = None
        return verdict

    def truth(self, condition: Span, memory: Memory) -> bool | None:
        data = self.value_or_not(condition, memory)
        return data if isinstance(data, bool) else None

    def for_loop(self, loop: Statement, memory: Memory) -> bool:
        hidden = memory.frame.bindings.get(loop.word)
        bounds = [self.value_or_not(span, memory) for span in loop.parts]
        turns, step = MAX_TURNS + 1, 1.0
        if all(isinstance(bound, float) for bound in bounds):
            step = bounds[2] if len(bounds) > 2 else 1.0 if bounds[1] >= bounds[0] else -1.0
            count = (bounds[1] - bounds[0]) / step + 1e-9 if step else inf
            turns = max(0, floor(count) + 1) if abs(count) <= MAX_TURNS else 0 if count < 0 else MAX_TURNS + 1
        reached, turn = True, 0
        while reached and turn < turns <= MAX_TURNS and not self.exhausted(memory.frame.routine.source):
            memory.frame.bindings[loop.word] = Value(bounds[0] + turn * step, "num")
            reached = self.body(loop.branches[0].body, memory)
            turn += 1
        if reached and turn < turns:
            index = NotKnown(f"the loop index `{loop.word}` is not known")
            self.unknown_turns(loop, memory, {loop.word: index})
        memory.frame.bindings.pop(loop.word, None)
        if hidden is not None:
            memory.frame.bindings[loop.word] = hidden
        return reached

    def while_loop(self, loop: Statement, memory: Memory) -> bool:
        condition = loop.parts[0]
        words = memory.frame.routine.source.data[condition[0] : condition[1]]
        if words.strip(b"() \t\r\n").lower() == b"true":
            self.unknown_turns(loop, memory, {}, certain=True)
            return False
        keys = self.changes.of_one(loop, memory.frame.routine)
        turns = MAX_TURNS if "@moves" in keys else MAX_IDLE_TURNS
        if not self.can_end(condition, keys, memory):
            turns = 1
        for _ in range(turns):
            verdict = self.truth(condition, memory)
            if verdict is False:
                return True
            if verdict is None or self.exhausted(memory.frame.routine.source) or turns == 1:
                break
            if not self.body(loop.branches[0].body, memory):
                return False
        self.unknown_turns(loop, memory, {})
        return True

    def can_end(self, condition: Span, keys: frozenset[str], memory: Memory) -> bool:
        """Whether the loop itself changes what its condition depends on."""
        try:
            names = names_in(self.tree(condition, memory))
        except NotKnown:
            return False
        found = (memory.find(name) for name in names)
        return any("%" + name in keys for name in names) or any(d.key in keys for d in found if d is not None)

    def unknown_turns(
        self, loop: Statement, memory: Memory, bindings: dict[str, Binding], certain: bool = False
    ) -> None:
        """A loop that runs nobody knows how often: its body once, with everything it changes unknown."""
        keys = self.changes.of_one(loop, memory.frame.routine)
        forget(memory, keys, "is changed in a loop")
        memory.frame.bindings.update(bindings)
        begin = self.ways.ends
        if "@moves" in keys:
            self.ways.doubt()  # in the second turn it comes from the end of the first
        self.conditional += not certain
        if not self.body(loop.branches[0].body, memory):
            self.ways.leave()
        self.conditional -= not certain
        forget(memory, keys, "is changed in a loop")
        self.ways.ends |= begin

    def label(self, statement: Statement, memory: Memory) -> None:
        routine = memory.frame.routine
        jumps = self.jumps.get(routine.key)
        if jumps is None:
            every = (s for body in bodies(routine) for s in statements_in(body))
            jumps = self.jumps[routine.key] = frozenset(s.word for s in every if s.kind == "goto")
        if statement.word in jumps:
            forget(memory, self.changes.of_routine[routine.key], "may have changed before the jump to here")
            self.ways.doubt()

    def leave_with(self, span: Span, memory: Memory) -> None:
        if span[0] == span[1]:
            return
        value: Value | NotKnown
        try:
            value = evaluate(self.tree(span, memory), memory)
        except NotKnown as error:
            value = error
        if self.returned is not None:  # another way returns too
            value = NotKnown("the result depends on a condition that is not known")
        self.returned = value
