"""A program followed in the order in which it runs, as far as the text tells.

A branch whose condition is not known is followed both ways; what the ways leave different is not known afterwards.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from postproc.diagnostics import Diagnostic, PostprocError, Source, Span
from postproc.rapid.changes import READ_ONLY, STATE, Changes, paired
from postproc.rapid.evaluate import evaluate
from postproc.rapid.events import MotionEvent, MotionStatement
from postproc.rapid.expressions import (
    Call,
    Component,
    Expression,
    ExpressionError,
    Index,
    Name,
    read_whole_expression,
)
from postproc.rapid.memory import Binding, Constants, Frame, Memory, Reference
from postproc.rapid.motion import read_arguments
from postproc.rapid.program import Program, bodies, statements_in
from postproc.rapid.state import State, run_state_instruction
from postproc.rapid.steps import EventMaker
from postproc.rapid.syntax import Routine, Statement
from postproc.rapid.values import Data, NotKnown, Value

MAX_TURNS = 10_000  # of one loop; more are treated as "not known how often"
MAX_EVENTS = 2_000_000
MAX_CALLS = 60


@dataclass(frozen=True)
class Walk:
    """The events in program order and what was found on the way."""

    events: list[MotionEvent]
    diagnostics: tuple[Diagnostic, ...]


def walk(program: Program, entry: str | None = None) -> list[MotionEvent]:
    """Every motion of a program in the order in which it runs.

    ``main`` is executed if there is one, else every routine that nobody calls, in text order; routines that are never
    reached that way are walked one by one, so that every motion statement has at least one event.

    Raises:
        PostprocError: there is no routine ``entry``.
    """
    return walk_program(program, entry).events


def walk_program(program: Program, entry: str | None = None) -> Walk:
    """As ``walk``, with the findings."""
    walker = _Walker(program)
    walker.run(entry)
    return Walk(walker.events, tuple(walker.diagnostics))


class _Walker:
    def __init__(self, program: Program) -> None:
        self.program = program
        self.changes = Changes(program)
        self.constants = Constants(program)
        self.events: list[MotionEvent] = []
        self.diagnostics: list[Diagnostic] = []
        self.reported: set[tuple[str, str]] = set()
        self.visited: dict[str, set[int]] = {}
        self.maker = EventMaker(program, self.diagnostics)
        self.stack: list[str] = []
        self.conditional = 0
        self.detached = True
        self.only_new = False

    # -- which routines --------------------------------------------------------------------------------------------

    def run(self, entry: str | None) -> None:
        if entry is not None:
            routine = self.program.routine(entry)
            if routine is None:
                names = ", ".join(sorted({r.name for r in self.program.all_routines()}))
                raise PostprocError(
                    Diagnostic("RAP030", "error", f"there is no routine `{entry}`", help=f"the routines are: {names}")
                )
            starts = [routine]
        else:
            main = self.program.routine("main")
            starts = [main] if main is not None else self.uncalled()
        for routine in starts:
            self.start(routine, State.initial())
        if entry is not None:
            return
        self.only_new = True
        forgotten = State.initial().forgotten(self.changes.everything)
        for routine in [*self.uncalled(), *self.program.all_routines()]:
            if self.has_new(routine):
                self.start(routine, forgotten, handlers=True)

    def uncalled(self) -> list[Routine]:
        """Procedures that nothing in the program names."""
        named: set[str] = set()
        for routine in self.program.all_routines():
            for body in bodies(routine):
                for statement in statements_in(body):
                    if statement.kind in ("call", "connect", "assign", "return"):
                        self._named(routine.source, statement, named)
        return [r for r in self.program.all_routines() if r.kind == "PROC" and r.name.lower() not in named]

    def _named(self, source: Source, statement: Statement, named: set[str]) -> None:
        if statement.kind == "call" and self.program.motion(source, statement) is None:
            named.add(statement.word)
        if statement.word in ("%", "callbyvar") or statement.kind == "connect":
            text = source.data[statement.span[0] : statement.span[1]].decode("latin-1").lower()
            named |= set(text.replace('"', " ").replace("%", " ").replace(":", " ").replace(";", " ").split())

    def has_new(self, routine: Routine) -> bool:
        known = self.program.motions.get(routine.source.path, {})
        seen = self.visited.get(routine.source.path, set())
        return any(s.span[0] in known and s.span[0] not in seen for b in bodies(routine) for s in statements_in(b))

    def start(self, routine: Routine, state: State, handlers: bool = False) -> None:
        """Run a routine as if somebody had started it; its parameters are not known."""
        self.detached = True
        frame = Frame(routine)
        for parameter in routine.parameters:
            frame.bindings[parameter.name] = NotKnown(f"the parameter `{parameter.name}` is not known")
        memory = Memory(self.program, self.changes, self.constants, frame, self.function)
        memory.changed.update(state.entries())
        self.enter(routine, memory)
        if not handlers:
            return
        # Handlers and code that no known way leads to.
        for body in self.unreached(routine):
            self.detached = True
            self.conditional += 1
            self.forget(memory, self.changes.everything, "what ran before is not known")
            self.body(body, memory)
            self.conditional -= 1

    def unreached(self, routine: Routine) -> Iterator[Sequence[Statement]]:
        known = self.program.motions.get(routine.source.path, {})
        seen = self.visited.setdefault(routine.source.path, set())
        for body in bodies(routine):
            for statement in statements_in(body):
                if statement.span[0] in known and statement.span[0] not in seen:
                    yield (statement,)

    # -- statements ------------------------------------------------------------------------------------------------

    def enter(self, routine: Routine, memory: Memory) -> Data:
        """Run a routine's body; the value it returns, if it is known."""
        for declaration in routine.declarations:
            memory.initialise(declaration)
        self.stack.append(routine.key)
        self.returned: Value | NotKnown | None = None
        conditional = self.conditional
        self.body(routine.body, memory)
        self.conditional = conditional
        self.stack.pop()
        result, self.returned = self.returned, None
        return result

    def body(self, statements: Iterable[Statement], memory: Memory) -> bool:
        """Run statements; whether the end of them is reached."""
        return all(self.statement(statement, memory) for statement in statements)

    def statement(self, statement: Statement, memory: Memory) -> bool:
        match statement.kind:
            case "call":
                self.call(statement, memory)
            case "assign":
                self.assign(statement, memory)
            case "if" | "test":
                return self.branches(statement, memory)
            case "for":
                return self.for_loop(statement, memory)
            case "while":
                return self.while_loop(statement, memory)
            case "label":
                self.label(statement, memory)
            case "goto":
                # The jump may skip what follows; its label is where the ways meet again.
                self.conditional += 1
            case "return":
                self.leave_with(statement, memory)
                return False
            case "leave":
                return False
            case "opaque":
                self.forget(memory, self.changes.of([statement], memory.frame.routine), "it is not certain here")
        return True

    def value(self, span: Span, memory: Memory) -> Value:
        """Value of the expression at a span of the present routine's file.

        Raises:
            NotKnown: the text alone does not give it.
        """
        return evaluate(self.tree(span, memory), memory)

    def tree(self, span: Span, memory: Memory) -> Expression:
        try:
            return read_whole_expression(memory.frame.routine.source.data, *span)
        except ExpressionError as error:
            raise NotKnown(f"the expression cannot be read: {error}") from error

    def truth(self, span: Span, memory: Memory) -> bool | None:
        try:
            data = self.value(span, memory).data
        except NotKnown:
            return None
        return data if isinstance(data, bool) else None

    def assign(self, statement: Statement, memory: Memory) -> None:
        target, value = statement.parts
        try:
            data: Data = self.value(value, memory).data
        except NotKnown as error:
            data = error
        self.store(target, data, memory)

    def store(self, span: Span, data: Data, memory: Memory) -> None:
        """Write ``data`` (or that it is not known) to the variable, element or component at ``span``."""
        try:
            tree = self.tree(span, memory)
            path, name = _path(tree, memory)
        except NotKnown:
            words = memory.frame.routine.source.data[span[0] : span[1]]
            name = words.decode("latin-1").split("{")[0].split(".")[0].strip().lower()
            path, data = [], NotKnown(f"`{name}` is not certain here")
        bound = memory.frame.bindings.get(name)
        if isinstance(bound, Reference):
            declaration, path = bound.declaration, [*bound.indices, *path]
        elif bound is not None:
            memory.frame.bindings[name] = _bind(bound, path, data, memory)
            return
        else:
            found = memory.find(name)
            if found is None or found.storage == "CONST":
                return
            declaration = found
        if path:
            try:
                whole = memory.value(declaration)
                data = data if isinstance(data, NotKnown) else _replaced(whole, path, data, memory)
            except NotKnown as error:
                data = error
        memory.changed[declaration.key] = data

    def forget(self, memory: Memory, keys: Iterable[str], reason: str) -> None:
        """The data and state of these keys may have any value from here on."""
        for key in keys:
            if key.startswith("%"):
                bound = memory.frame.bindings.get(key[1:])
                if isinstance(bound, Reference):
                    memory.changed[bound.declaration.key] = NotKnown(f"`{bound.declaration.name}` {reason}")
                elif bound is not None:
                    memory.frame.bindings[key[1:]] = NotKnown(f"`{key[1:]}` {reason}")
            elif key != "@moves":
                shown = key.rsplit(".", 1)[-1].lstrip("@")
                memory.changed[key] = NotKnown(f"`{shown}` {reason}")

    # -- flow --------------------------------------------------------------------------------------------------------

    def branches(self, statement: Statement, memory: Memory) -> bool:
        routine = memory.frame.routine
        before = dict(memory.changed), dict(memory.frame.bindings)
        ends: list[dict[str, Data]] = []
        uncertain = False
        for branch in statement.branches:
            verdict = self.chosen(statement, branch.conditions, memory) if branch.conditions else True
            if verdict is False:
                continue
            if verdict is True and not uncertain:
                return self.body(branch.body, memory)
            uncertain = True
            emitted, detached = len(self.events), self.detached
            self.conditional += 1
            if self.body(branch.body, memory):
                ends.append(memory.changed)
            self.conditional -= 1
            memory.changed, memory.frame.bindings = dict(before[0]), dict(before[1])
            self.detached = detached or len(self.events) > emitted
            if verdict is True:
                break
        else:
            ends.append(memory.changed)  # none of the conditions holds
        if not uncertain:
            return True
        if not ends:
            return False
        parameters = {k for k in self.changes.of([statement], routine) if k.startswith("%")}
        memory.changed = _joined(ends, before[0])
        self.forget(memory, parameters, "depends on a condition that is not known")
        return True

    def chosen(self, statement: Statement, conditions: tuple[Span, ...], memory: Memory) -> bool | None:
        """Whether a branch is taken; None if that is not known."""
        if statement.kind == "if":
            return self.truth(conditions[0], memory)
        verdict: bool | None = False
        for condition in conditions:
            try:
                if self.value(statement.parts[0], memory).data == self.value(condition, memory).data:
                    return True
            except NotKnown:
                verdict = None
        return verdict

    def for_loop(self, statement: Statement, memory: Memory) -> bool:
        bindings = memory.frame.bindings
        hidden = bindings.get(statement.word)
        try:
            numbers = [self.value(span, memory).data for span in statement.parts]
            first, last = numbers[0], numbers[1]
            step = numbers[2] if len(numbers) > 2 else (1.0 if last >= first else -1.0)
            turns = int((last - first) / step + 1e-9) + 1 if step and (last - first) / step >= 0 else 0
        except (NotKnown, TypeError):
            turns, first, step = MAX_TURNS + 1, 0.0, 0.0
        reached = True
        if turns <= MAX_TURNS and len(self.events) < MAX_EVENTS:
            for turn in range(turns):
                memory.frame.bindings[statement.word] = Value(first + turn * step, "num")
                if not self.body(statement.branches[0].body, memory):
                    reached = False
                    break
        else:
            index = NotKnown(f"the loop index `{statement.word}` is not known")
            self.unknown_turns(statement, memory, {statement.word: index})
        memory.frame.bindings.pop(statement.word, None)
        if hidden is not None:
            memory.frame.bindings[statement.word] = hidden
        return reached

    def unknown_turns(
        self, loop: Statement, memory: Memory, bindings: dict[str, Binding], certain: bool = False
    ) -> bool:
        """A loop that runs nobody knows how often: its body once, with everything it changes unknown."""
        keys = self.changes.of([loop], memory.frame.routine)
        self.forget(memory, keys, "is changed in a loop")
        memory.frame.bindings.update(bindings)
        self.detached |= "@moves" in keys
        self.conditional += not certain
        reached = self.body(loop.branches[0].body, memory)
        self.conditional -= not certain
        self.forget(memory, keys, "is changed in a loop")
        self.detached |= "@moves" in keys
        return reached

    def while_loop(self, statement: Statement, memory: Memory) -> bool:
        condition = statement.parts[0]
        source = memory.frame.routine.source
        endless = source.data[condition[0] : condition[1]].strip(b"() ").lower() == b"true"
        if endless:
            self.unknown_turns(statement, memory, {}, certain=True)
            return False
        for _ in range(MAX_TURNS):
            verdict = self.truth(condition, memory)
            if verdict is False:
                return True
            if verdict is None or len(self.events) > MAX_EVENTS:
                break
            if not self.body(statement.branches[0].body, memory):
                return False
        self.unknown_turns(statement, memory, {})
        return True

    def label(self, statement: Statement, memory: Memory) -> None:
        routine = memory.frame.routine
        jumps = any(s.kind == "goto" and s.word == statement.word for b in bodies(routine) for s in statements_in(b))
        if jumps:
            self.forget(memory, self.changes.of(routine.body, routine), "may have changed before the jump to here")
            self.detached = True

    def leave_with(self, statement: Statement, memory: Memory) -> None:
        span = statement.parts[0]
        if span[0] == span[1]:
            return
        try:
            value: Value | NotKnown = self.value(span, memory)
        except NotKnown as error:
            value = error
        if self.returned is not None:  # another way returns too
            value = NotKnown("the result depends on a condition that is not known")
        self.returned = value

    # -- calls -------------------------------------------------------------------------------------------------------

    def call(self, statement: Statement, memory: Memory) -> None:
        source = memory.frame.routine.source
        motion = self.program.motion(source, statement)
        if motion is not None:
            self.motion(motion, memory)
            return
        word, start = statement.word, statement.span[0] + len(statement.word)
        if word == "%":
            word, start = self.late(statement, memory)
            if not word:
                return
        routine = self.program.routine(word, memory.frame.routine.module)
        end = statement.span[1] - (source.data[statement.span[1] - 1 : statement.span[1]] == b";")
        pieces = read_arguments(source.data, start, end)
        if routine is not None:
            self.call_routine(routine, pieces, memory)
        elif word in STATE:
            run_state_instruction(word, pieces, memory, lambda span: self.value(span, memory).data)
        elif word in ("incr", "decr", "add", "clear"):
            self.count(word, pieces, memory)
        elif word not in READ_ONLY:
            self.forget(memory, self.changes.of([statement], memory.frame.routine), f"may be written by `{word}`")
            self.report_once(
                "RAP031", "info", f"`{word}` is not in these files and is taken not to move the arm", source,
                (statement.span[0], start), "give the file it stands in too if it moves the arm or changes tool or load",
            )  # fmt: skip

    def late(self, statement: Statement, memory: Memory) -> tuple[str, int]:
        """Routine named by ``%text%`` and where its arguments begin."""
        data = memory.frame.routine.source.data
        close = data.find(b"%", statement.span[0] + 1, statement.span[1])
        try:
            name = self.value((statement.span[0] + 1, close), memory).data
        except NotKnown:
            name = ""
        word = str(name).split(":")[-1].strip().lower()
        if not word or self.program.routine(word, memory.frame.routine.module) is None:
            self.forget(memory, self.changes.everything, "may be changed by a routine that is chosen at run time")
            self.detached = True
            self.report_once(
                "RAP032", "warning", "which routine is called here is known only at run time",
                memory.frame.routine.source, statement.span, "what this routine moves is walked on its own",
            )  # fmt: skip
            return "", 0
        return word, close + 1

    def call_routine(self, routine: Routine, pieces: Sequence[tuple[str, Span, Span]], memory: Memory) -> Data:
        if routine.key in self.stack or len(self.stack) > MAX_CALLS or len(self.events) > MAX_EVENTS:
            keys = self.changes.of_routine.get(routine.key, frozenset())
            self.forget(memory, (k for k in keys if not k.startswith("%")), "is changed in a routine that calls itself")
            self.detached = True
            return NotKnown(f"`{routine.name}` calls itself")
        frame = Frame(routine)
        for parameter in routine.parameters:
            if not parameter.optional:
                frame.bindings[parameter.name] = NotKnown(f"the parameter `{parameter.name}` is not known")
        data = memory.frame.routine.source.data
        for parameter, span in paired(routine.parameters, pieces):
            if parameter.optional and data[: span[0]].rstrip().endswith(b"?") and not self.passed_on(span, memory):
                continue
            frame.present.add(parameter.name)
            if span[0] < span[1]:
                by_reference = parameter.mode in ("VAR", "PERS", "INOUT")
                frame.bindings[parameter.name] = self.bind(span, by_reference, memory)
        inner = Memory(self.program, self.changes, self.constants, frame, self.function, memory.changed)
        result = self.enter(routine, inner)
        memory.changed = inner.changed
        return result

    def passed_on(self, span: Span, memory: Memory) -> bool:
        r"""``\Opt?name``: whether the caller got that parameter itself."""
        words = memory.frame.routine.source.data[span[0] : span[1]].decode("latin-1")
        return words.strip().lower() in memory.frame.present

    def bind(self, span: Span, by_reference: bool, memory: Memory) -> Binding:
        try:
            tree = self.tree(span, memory)
            if by_reference:
                reference = self.reference(tree, memory)
                if reference is not None:
                    return reference
            return evaluate(tree, memory)
        except NotKnown as error:
            return error

    def reference(self, tree: Expression, memory: Memory) -> Reference | None:
        indices: tuple[int, ...] = ()
        if isinstance(tree, Index) and isinstance(tree.base, Name):
            indices = tuple(int(evaluate(i, memory).data) for i in tree.indices)
            tree = tree.base
        if not isinstance(tree, Name):
            return None
        bound = memory.frame.bindings.get(tree.name)
        if isinstance(bound, Reference):
            return Reference(bound.declaration, (*bound.indices, *indices))
        if bound is not None:
            return None
        declaration = memory.find(tree.name)
        return Reference(declaration, indices) if declaration is not None else None

    def function(self, call: Call, memory: Memory) -> Value | None:
        """Value of a function of the program's own."""
        routine = self.program.routine(call.name, memory.frame.routine.module)
        if routine is None or routine.kind != "FUNC":
            return None
        pieces = [("", a.span, a.span) for a in call.arguments]
        pieces += [("\\" + n, v.span if v else (0, 0), (0, 0)) for n, v in call.options]
        outer = self.returned if self.stack else None
        result = self.call_routine(routine, pieces, memory)
        self.returned = outer
        if isinstance(result, Value):
            return Value(result.data, routine.type)
        raise result if isinstance(result, NotKnown) else NotKnown(f"`{call.name}` gives no known value")

    def count(self, word: str, pieces: Sequence[tuple[str, Span, Span]], memory: Memory) -> None:
        if not pieces:
            return
        try:
            now = self.value(pieces[0][1], memory).data
            more = self.value(pieces[1][1], memory).data if word == "add" else 1.0
            data: Data = {"incr": now + more, "decr": now - more, "add": now + more, "clear": 0.0}[word]
        except (NotKnown, IndexError, TypeError):
            data = 0.0 if word == "clear" else NotKnown("a counter has no certain value here")
        self.store(pieces[0][1], data, memory)

    # -- motion ------------------------------------------------------------------------------------------------------

    def motion(self, statement: MotionStatement, memory: Memory) -> None:
        seen = self.visited.setdefault(statement.source.path, set())
        new = statement.span[0] not in seen
        seen.add(statement.span[0])
        if new or not self.only_new:
            event = self.maker.event(statement, memory, self.conditional > 0, self.detached)
            self.detached = False
            self.events.append(event)
        else:
            self.detached = True
        for argument in statement.arguments:
            if argument.role == "found":
                self.store(argument.span, NotKnown(f"`{argument.text}` is found by a search"), memory)

    def report_once(self, code: str, severity: str, message: str, source: Source, span: Span, help: str) -> None:
        if (code, message) not in self.reported:
            self.reported.add((code, message))
            self.diagnostics.append(Diagnostic(code, severity, message, source, span, help))  # type: ignore[arg-type]


def _joined(ends: Sequence[dict[str, Data]], before: dict[str, Data]) -> dict[str, Data]:
    """What holds where several ways meet: a value only if all of them agree."""
    joined = dict(ends[0])
    for end in ends[1:]:
        for key in joined.keys() | end.keys():
            if key not in joined or key not in end or (joined[key] is not end[key] and joined[key] != end[key]):
                shown = key.rsplit(".", 1)[-1].lstrip("@")
                joined[key] = NotKnown(f"`{shown}` depends on a condition that is not known")
    return joined


def _path(tree: Expression, memory: Memory) -> tuple[list[int | str], str]:
    """Indices and components that lead from a variable to the part that is written, and the variable's name."""
    match tree:
        case Name(_, name):
            return [], name
        case Index(_, base, indices):
            path, name = _path(base, memory)
            return [*path, *(int(evaluate(i, memory).data) for i in indices)], name
        case Component(_, base, field):
            path, name = _path(base, memory)
            return [*path, field], name
    raise NotKnown("this cannot be assigned to")


def _replaced(value: Value, path: Sequence[int | str], data: Data, memory: Memory) -> Data:
    """A copy of the value's data with one part replaced."""
    if not path:
        return data
    step, rest = path[0], path[1:]
    if isinstance(step, int):
        at, kind = step - 1, value.type
    else:
        names = [name for name, _ in memory.records.get(value.type, ())]
        if step not in names:
            raise NotKnown(f"`.{step}` is not a known component")
        at = names.index(step)
        kind = memory.records[value.type][at][1]
    items = value.data
    if not isinstance(items, tuple) or not 0 <= at < len(items):
        raise NotKnown("the part that is written does not exist")
    return (*items[:at], _replaced(Value(items[at], kind), rest, data, memory), *items[at + 1 :])


def _bind(bound: Value | NotKnown, path: Sequence[int | str], data: Data, memory: Memory) -> Binding:
    """A parameter by value after an assignment to it."""
    if isinstance(data, NotKnown):
        return data
    if isinstance(bound, NotKnown):
        return bound if path else Value(data)
    try:
        return Value(_replaced(bound, path, data, memory), bound.type, bound.rank)
    except NotKnown as error:
        return error
