"""One task's program: its modules, declarations and motion statements, with names resolved as the controller does."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

from postproc.diagnostics import Diagnostic, Matter, Source
from postproc.rapid.data.arm import ControllerArm
from postproc.rapid.data.events import MotionStatement, StatementKey
from postproc.rapid.data.values import Data
from postproc.rapid.program.arguments import MotionReader
from postproc.rapid.program.scopes import (
    all_declarations,
    check_taught,
    declared_names,
    named_routines,
    without_aliases,
)
from postproc.rapid.program.signatures import SIGNATURES
from postproc.rapid.syntax.modules import parse
from postproc.rapid.syntax.nodes import Declaration, Module, Routine, Statement

ENDINGS = frozenset({".mod", ".sys", ".prg", ".modx", ".sysx"})  # of files that hold a module


@dataclass(frozen=True)
class OtherTaskData:
    """Data that code outside of the program has, too.

    Args:
        shared: lower-case (name, type) of global PERS data that other tasks of the controller declare, too.
        written: of these, what another task may write at any time, or declares with another value.
        read_along: keys of data that is read along and that code outside of the program may write.
    """

    shared: frozenset[tuple[str, str]] = frozenset()
    written: frozenset[tuple[str, str]] = frozenset()
    read_along: frozenset[str] = frozenset()


@dataclass(frozen=True, eq=False)
class Program:
    """What was read from the files of one task.

    Args:
        sources: the files, as given.
        modules: in the order of the files and of the text.
        declarations: data of modules and routines, in text order.
        statements: every motion statement in text order.
        diagnostics: findings about the files: what is wrong or not understood.
        motions: the same motion statements by their key.
        names: data by its key (``Declaration.key``); what the whole task sees also by ``..name``.
        routines: by lower-case (module, name); what the whole task sees also by ("", name).
        taught: lower-case names of data that calibration routines set to the value in the text, as the user states.
        arm: the arm that runs the program, for functions that need its kinematics; None where it is not known.
        other_tasks: which of its data other tasks of the controller share or write.
        chosen: values of declared data that are not those of the text, by key.
    """

    sources: tuple[Source, ...]
    modules: tuple[Module, ...]
    declarations: tuple[Declaration, ...]
    statements: tuple[MotionStatement, ...]
    diagnostics: tuple[Diagnostic, ...]
    motions: Mapping[StatementKey, MotionStatement] = field(repr=False)
    names: Mapping[str, Declaration] = field(repr=False)
    routines: Mapping[tuple[str, str], Routine] = field(repr=False)
    taught: frozenset[str] = frozenset()
    arm: ControllerArm | None = field(default=None, repr=False)
    other_tasks: OtherTaskData = OtherTaskData()
    chosen: Mapping[str, Data] = field(default_factory=dict, repr=False)

    def declaration(self, name: str, module: str = "", routine: str = "") -> Declaration | None:
        """The data that ``name`` (any case) means inside a routine: its own, the module's, the task's, or None."""
        low, where = name.lower(), module.lower()
        return (
            (self.names.get(f"{where}.{routine.lower()}.{low}") if routine else None)
            or self.names.get(f"{where}..{low}")
            or self.names.get(f"..{low}")
        )

    def routine(self, name: str, module: str = "") -> Routine | None:
        """The routine that ``name`` (any case) means inside a module; None if the program has none."""
        low = name.lower()
        return self.routines.get((module.lower(), low)) or self.routines.get(("", low))

    def hides(self, name: str, module: str, routine: str) -> bool:
        """Whether the program itself gives the name a meaning in this routine or module, so that it is no built-in."""
        inside = self.routine(routine, module) if routine else None
        local_names = () if inside is None else names_of(inside)
        return (
            name.lower() in local_names
            or self.declaration(name, module, routine) is not None
            or self.routine(name, module) is not None
        )

    def place(self, source: Source, offset: int) -> tuple[str, str]:
        """Names of the module and the routine that contain a byte of a file; empty where it lies outside of them.

        Args:
            offset: of the byte, from the beginning of the file.
        """
        for module in self.modules:
            if module.source.path == source.path and module.span[0] <= offset < module.span[1]:
                inside = (r.name for r in module.routines if r.span[0] <= offset < r.span[1])
                return module.name, next(inside, "")
        return "", ""

    def motion(self, source: Source, statement: Statement) -> MotionStatement | None:
        """The motion statement that this statement of a file is; None if it is no motion."""
        return self.motions.get((source.path, statement.span[0]))

    def all_routines(self) -> Iterator[Routine]:
        """The routines of all modules, in the order of the text."""
        for module in self.modules:
            yield from module.routines


def names_of(routine: Routine) -> frozenset[str]:
    """Lower-case names that a routine itself declares: parameters, data, labels and loop variables."""
    parameters = [parameter.name for parameter in routine.parameters]
    parameters += [declared.name for declared in routine.declarations]
    parameters += [s.word for s in statements_of(routine) if s.kind in ("label", "for")]
    return frozenset(name.lower() for name in parameters)


def statements_in(body: Sequence[Statement]) -> Sequence[Statement]:
    """Every statement of a body in text order, those inside of its branches and loops too."""
    statements: list[Statement] = []
    done = 0
    for i, statement in enumerate(body):
        if statement.branches:
            statements += body[done : i + 1]
            done = i + 1
            for branch in statement.branches:
                statements += statements_in(branch.body)
    return [*statements, *body[done:]] if statements else body


def statements_of(routine: Routine) -> Sequence[Statement]:
    """Every statement of a routine and of its handlers in text order, those inside of branches and loops too."""
    if not routine.handlers:
        return statements_in(routine.body)
    return [statement for body in (routine.body, *routine.handlers) for statement in statements_in(body)]


def is_encrypted(data: bytes) -> bool:
    """Whether the bytes of a file are an encrypted module: the first begins no text, and control bytes follow."""
    return data[:1] >= b"\xf8" and not is_utf16(data) and any(byte < 9 for byte in data[:256])


def is_utf16(data: bytes) -> bool:
    """Whether bytes are UTF-16 text: a byte order mark, and zeros in at least a third of the next 64 bytes."""
    return data[:2] in (b"\xff\xfe", b"\xfe\xff") and data[2:66].count(0) >= len(data[2:66]) // 3


def read_program(
    sources: Sequence[Source] | Source,
    taught: Collection[str] = (),
    arm: ControllerArm | None = None,
    other_tasks: OtherTaskData = OtherTaskData(),
) -> Program:
    """Read the files of one task; nothing is raised, findings are collected in ``diagnostics``.

    Args:
        taught: names of data that calibration routines set to the value in the text, as the user states.
        arm: the arm that runs the program, for functions that need its kinematics.
        other_tasks: data of this task that other tasks of its controller share or write.
    """
    files = (sources,) if isinstance(sources, Source) else tuple(sources)
    modules: list[Module] = []
    diagnostics: list[Diagnostic] = []
    for source in files:
        module_part, problems = _read_source(source)
        modules += module_part
        diagnostics += problems
    diagnostics += _named_twice(modules)
    modules = without_aliases(modules)
    names = declared_names(modules, diagnostics)
    diagnostics += check_taught(taught, names)
    routines = named_routines(modules)
    motions = _read_motions(modules, routines)
    statements = tuple(motions.values())
    diagnostics += [_incomplete(statement) for statement in statements if not statement.shape.complete]
    declarations = tuple(all_declarations(modules))
    findings, stated = tuple(diagnostics), frozenset(name.lower() for name in taught)
    fields = (files, tuple(modules), declarations, statements, findings, motions, names, routines)
    return Program(*fields, stated, arm, other_tasks)


def read_again(program: Program, text: Mapping[str, bytes]) -> Program:
    """Read the program again with the same settings from other contents of its files.

    Args:
        text: new bytes of each file, by path.
    """
    files = [replace(source, data=text[source.path]) for source in program.sources]
    return replace(read_program(files, program.taught, program.arm, program.other_tasks), chosen=program.chosen)


def _read_motions(
    modules: Sequence[Module], routines: Mapping[tuple[str, str], Routine]
) -> dict[StatementKey, MotionStatement]:
    """The motion statements of all files in text order, without calls of own routines with the name of an instruction.

    Args:
        routines: by lower-case (module, name).
    """
    motions: dict[StatementKey, MotionStatement] = {}
    for module in modules:
        reader = MotionReader(module.source)
        # A routine of the user's with that name wins over the instruction.
        names = {name for home, name in routines if home in ("", module.name.lower())}
        for routine in module.routines:
            for statement in statements_of(routine):
                if statement.kind == "call" and statement.word in SIGNATURES and statement.word not in names:
                    motion = reader.read(statement.span, statement.word, module.name, routine.name)
                    motions[motion.key] = motion
    return motions


def _read_source(source: Source) -> tuple[list[Module], list[Diagnostic]]:
    """Modules of one file and the findings about it; no modules if it is empty, encrypted, binary or no RAPID text."""
    data = source.data
    if not data.strip():
        return [], [_no_module("RAP001", "the file is empty", source, "give a RAPID module")]
    if is_utf16(data):
        help = "save it as UTF-8 or ISO 8859-1, as controllers read it"
        return [], [Diagnostic("RAP016", "error", "the file is UTF-16 text", source, None, help)]
    if is_encrypted(data):
        return [], [
            Diagnostic(
                "RAP013", "info", "the module is encrypted: nothing in it is visible, it is kept as it stands", source
            )
        ]
    if b"\0" in data[:4096] or data[:2] == b"PK":
        return [], [_no_module("RAP002", "the file is binary, not RAPID text", source, "give a RAPID module")]
    if data.lstrip().startswith((b"<?xml", b"<Program")):
        return [], []  # a .pgf lists the modules of a task
    if b"\n" not in data and b"\r" in data.strip():
        text, help = "the lines end in carriage returns alone", "save it with CR LF or LF at the end of lines"
        return [], [Diagnostic("RAP017", "error", text, source, None, help)]
    modules, problems = parse(source)
    if not modules:
        help = "give a file with MODULE .. ENDMODULE"
        problems.append(_no_module("RAP011", "there is no MODULE in the file", source, help))
    return modules, problems


def _named_twice(modules: Sequence[Module]) -> Iterator[Diagnostic]:
    """Yield RAP012, an error, at each module of the program that has the name of one before it, whatever its case."""
    first: dict[str, Module] = {}
    for module in modules:
        if module.source.read_only or not module.name:
            continue
        known = first.setdefault(module.name.lower(), module)
        if known is not module:
            text = f"the module `{module.name}` stands in `{known.source.path}` too: a controller loads one of them"
            help_ = "leave one of the two out, or give it a name of its own"
            yield Diagnostic("RAP012", "error", text, module.source, module.head, help_)


def _no_module(code: str, text: str, source: Source, help_: str) -> Diagnostic:
    """An error finding that a file holds no module that can be read."""
    return Diagnostic(code, "error", text, source, None, help_, Matter.NO_MODULE)


def _incomplete(motion: MotionStatement) -> Diagnostic:
    """The finding RAP014: a motion statement lacks arguments, or has more than its instruction takes."""
    wanted = ", ".join(motion.signature.roles)
    text, help = f"does not have the arguments it needs: {wanted}", "check commas and backslashes of this statement"
    return Diagnostic("RAP014", "error", f"`{motion.instruction}` {text}", motion.source, motion.span, help)
