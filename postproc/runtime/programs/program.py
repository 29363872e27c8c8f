"""What is written into a program for the function: the payload that it is told, and what would not go with it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from postproc.compensation.text.marks import CORRECTING
from postproc.diagnostics import Diagnostic, Source
from postproc.model.arm import Model
from postproc.rapid.program.arguments import read_arguments
from postproc.rapid.program.program import Program, names_of, statements_of
from postproc.rapid.syntax.expressions import read_full_expression
from postproc.rapid.syntax.modules import parse
from postproc.rapid.syntax.nodes import Routine, Statement
from postproc.rapid.syntax.spans import Edit
from postproc.rapid.syntax.tokens import names_at
from postproc.rapid.syntax.trees import Call
from postproc.rapid.unknown import Unknown
from postproc.render.text import line_style

PAYLOAD = "ppPayload"
TRIED, LEVEL = 64, 0.01  # positions of external axes, change of gravity [m/s2] that is none
Edits = tuple[tuple[Source, Edit], ...]


def payload_edits(program: Program) -> list[Edits]:
    """The edits for each `GripLoad` in files that may change: behind it, its load is assigned to `ppPayload`."""
    return [
        edits
        for routine in program.all_routines()
        if not routine.source.read_only
        for body in (routine.body, *routine.handlers)
        for edits in _in_body(program, routine, body, None)
    ]


def reset_edits(program: Program) -> Edits:
    """The edit that starts `main` with an empty payload, as the controller does at PP to Main; none without `main`."""
    main = next((r for r in program.all_routines() if r.name.lower() == "main" and not r.source.read_only), None)
    if main is None or not main.body:
        return ()
    start = main.body[0].span[0]
    lead, newline = line_style(main.source.data, start)
    return ((main.source, Edit(start, start, f"{PAYLOAD}:=load0;".encode() + newline + lead)),)


def say_unfit(program: Program, model: Model, module: Source) -> list[Diagnostic]:
    """What does not go with the function: RUN008 names, RUN010 loads in read-only files, RUN011 an arm that is tilted.

    Args:
        module: its file.
    """
    return [*_name_findings(program, module), *_lent_loads(program), *_tilted(model, program.sources[0])]


def reads_back(drafts: Program, written: Program, count: int) -> bool:
    """Whether the written program differs from its draft only by calls of the correcting function around arguments.

    Args:
        drafts: the program before the calls were put in; written: after.
        count: number of motion statements that have to differ.
    """
    pairs = [[s for s in program.statements if not s.source.read_only] for program in (drafts, written)]
    if len(pairs[0]) != len(pairs[1]):
        return False
    changed = 0
    for old, new in zip(*pairs, strict=True):
        texts = [[a.text for a in statement.arguments] for statement in (old, new)]
        if (old.instruction, old.roles) != (new.instruction, new.roles):
            return False
        if not all(a == b or _calls(b, a) for a, b in zip(*texts, strict=True)):
            return False
        changed += texts[0] != texts[1]
    return changed == count


def _calls(text: str, argument: str) -> bool:
    """Whether a text is a call of the correcting function whose first argument is ``argument``."""
    data = text.encode("latin-1")
    try:
        tree = read_full_expression(data, 0, len(data))
    except Unknown:
        return False
    if not isinstance(tree, Call) or tree.name not in CORRECTING:
        return False
    return data[slice(*tree.arguments[0].span)].decode("latin-1") == argument


def _tilted(model: Model, source: Source) -> Iterator[Diagnostic]:
    """RUN011, an error, if external axes tilt the arm: the module has one constant direction of gravity."""
    station = model.station
    pull = None if station is None else station.gravity(np.random.default_rng(1).uniform(-1.0, 1.0, (TRIED, 6)))
    if pull is not None and np.ptp(pull, axis=0).max() > LEVEL:
        text = "an external axis tilts the arm, and the function for run time knows one direction of gravity"
        yield Diagnostic("RUN011", "error", text, source, None, "convert with `--run-time off`")


def _in_body(
    program: Program, routine: Routine, body: Sequence[Statement], around: Statement | None
) -> Iterator[Edits]:
    """The edits of `payload_edits` in a list of statements and in their branches.

    Args:
        body: the statements.
        around: the one-line IF whose only statement ``body`` holds; it gets THEN and ENDIF, to hold two. None if there
            is none.
    """
    source = routine.source
    for statement in body:
        if _grips(program, routine, statement):
            assignment = f"{PAYLOAD}:={_loaded(source, statement)};"
            start, end = statement.span
            lead, newline = line_style(source.data, start)
            if around is None:
                yield ((source, Edit(end, end, newline + lead + assignment.encode("latin-1"))),)
            else:
                yield (
                    (source, Edit(start, start, b"THEN ")),
                    (source, Edit(end, end, b" " + assignment.encode("latin-1") + b" ENDIF")),
                )
        for branch in statement.branches:
            alone = statement.kind == "if" and [s.span[1] for s in branch.body] == [statement.span[1]]
            yield from _in_body(program, routine, branch.body, statement if alone else None)


def _grips(program: Program, routine: Routine, statement: Statement) -> bool:
    """Whether a statement is a call of the built-in `GripLoad`."""
    called = program.routine(statement.word, routine.module)
    return statement.kind == "call" and statement.word == "gripload" and called is None


def _loaded(source: Source, statement: Statement) -> str:
    """The load argument of a `GripLoad` statement as text, `load0` without one."""
    pieces = read_arguments(source.data, statement.span[0] + len(statement.word), statement.span[1])
    return source.data[slice(*pieces[0][1])].decode("latin-1") if pieces else "load0"


def _lent_loads(program: Program) -> Iterator[Diagnostic]:
    """RUN010, a warning, at the first `GripLoad` in a read-only file: the run-time function is not told that load."""
    for routine in program.all_routines():
        if not routine.source.read_only:
            continue
        for statement in statements_of(routine):
            if _grips(program, routine, statement):
                text = "`GripLoad` stands in a file that is only read along: the function is not told what it takes up"
                help_ = f"write `{PAYLOAD}:={_loaded(routine.source, statement)};` behind it"
                yield Diagnostic("RUN010", "warning", text, routine.source, statement.span, help_)
                return


def _name_findings(program: Program, source: Source) -> Iterator[Diagnostic]:
    """RUN008 for each declaration whose name clashes with the run-time module in a file.

    What a routine of the module declares itself, loop variables and labels too, means its own there.
    """
    (made,), _ = parse(source)
    public = {made.name.lower(), *(r.name.lower() for r in made.routines if not r.local)}
    public |= {d.name.lower() for d in made.declarations if d.scope != "LOCAL"}
    hiding = {d.name.lower() for d in made.declarations} | {r.name.lower() for r in made.routines}
    used = {word for d in made.declarations for word, _ in names_at(source, d.span)}
    used |= {word for r in made.routines for word, _ in names_at(source, r.span) if word not in names_of(r)}
    used = (used - hiding) | public
    for module in program.modules:
        if module.name.lower() in public:
            yield _clash(module.name, module.source, module.head)
        for declared in module.declarations:
            if declared.name.lower() in (public if declared.scope == "LOCAL" else used):
                yield _clash(declared.name, declared.source, declared.span)
        for routine in module.routines:
            if routine.name.lower() in (public if routine.local else used):
                yield _clash(routine.name, routine.source, routine.span)
            inner = [(d.name, d.source, d.span) for d in routine.declarations]
            inner += [(p.name, routine.source, routine.span) for p in routine.parameters]
            yield from (_clash(*one) for one in inner if one[0].lower() in public)


def _clash(name: str, source: Source, span: tuple[int, int]) -> Diagnostic:
    """RUN008, an error: the program declares a name that the run-time module uses."""
    text = f"`{name}` is a name that the module for run time uses, too"
    return Diagnostic("RUN008", "error", text, source, span, "give it another name, or convert with `--run-time off`")
