"""What names mean while the program is walked: data with their present values, parameters, loop variables."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

from postproc.rapid.evaluation.declared import Declared
from postproc.rapid.evaluation.evaluate import pick
from postproc.rapid.program.predefined import PREDEFINED
from postproc.rapid.program.program import Program
from postproc.rapid.program.records import Pose
from postproc.rapid.program.values import Data, Fields, Value
from postproc.rapid.program.write_effects import WriteEffects
from postproc.rapid.syntax.nodes import Declaration, Routine
from postproc.rapid.syntax.trees import Call, Name
from postproc.rapid.unknown import PartlyUnknown, Unknown, unknown_part

UNSET = "is written by the program and has no certain value here"


def set_first(reason: str) -> str | None:
    """What helps against a reason that says: nothing sets the data on the way to here; None for other reasons."""
    found = re.match(rf"`(\w+)` {UNSET}", reason)
    return found and f"it has what the last run left: set it before this, as in `{found[1]}:={found[1]}0;` with a CONST"


@dataclass(frozen=True, slots=True)
class Reference:
    """A parameter that stands for the caller's data: key of its declaration and element."""

    declaration: Declaration
    indices: tuple[int, ...] = ()


Binding = Value | Unknown | Reference


@dataclass(slots=True)
class Frame:
    """One call: the routine, its parameters and loop variables by lower-case name."""

    routine: Routine
    bindings: dict[str, Binding] = field(default_factory=dict)
    present: set[str] = field(default_factory=set)

    def varying(self) -> set[str]:
        """Names that may mean something else in another call or another turn of a loop."""
        return {*self.bindings, *(p.name for p in self.routine.parameters)}


@dataclass(slots=True)
class Memory:
    """Present values by key, over the initial values; a copy is cheap and independent.

    ``changed`` holds only what the walk has assigned or had to forget.
    """

    program: Program
    changes: WriteEffects
    constants: Declared
    frame: Frame
    function: Callable[[Call, Memory], Value | None]
    changed: dict[str, Data] = field(default_factory=dict)
    trial: bool = False

    @property
    def records(self) -> Mapping[str, Fields]:
        return self.constants.records

    def aside(self) -> Memory:
        """The same to try something out: what functions write and move then does not count."""
        frame = replace(self.frame, bindings=dict(self.frame.bindings))
        return replace(self, frame=frame, changed=dict(self.changed), trial=True)

    # -- Scope ---------------------------------------------------------------------------------------------------

    def lookup(self, name: Name) -> Value:
        bound = self.frame.bindings.get(name.name)
        if isinstance(bound, Unknown):
            raise bound
        if isinstance(bound, Value):
            return bound
        if isinstance(bound, Reference):
            value = self.value(bound.declaration)
            return pick(value, bound.indices) if bound.indices else value
        declaration = self.find(name.name)
        if declaration is not None:
            return self.value(declaration)
        if name.name == "c_progdisp":
            return Value(self.program_displacement(), "progdisp")
        if name.name in PREDEFINED:
            kind, data = PREDEFINED[name.name]
            return Value(data, kind)
        raise Unknown(f"`{name.text}` is not declared in these files", name.text, name.span)

    def program_displacement(self) -> Data:
        """``C_PROGDISP``: what PDispSet, PDispOn and EOffsSet have set."""
        pose, offset = self.changed.get("@pdisp", Pose()), self.changed.get("@eoffs", False)
        for state in (pose, offset):
            if isinstance(state, Unknown):
                raise state
        if not isinstance(pose, Pose) or offset:
            raise Unknown("an offset of the external axes may be active")
        return ((pose.trans, pose.rot), (0.0,) * 6)

    def element(self, name: Name, indices: tuple[int, ...]) -> Value:
        bound = self.frame.bindings.get(name.name)
        if isinstance(bound, Reference):
            indices = (*bound.indices, *indices)
        declaration = bound.declaration if isinstance(bound, Reference) else self.find(name.name)
        if declaration is None or isinstance(bound, Value | Unknown):
            return pick(self.lookup(name), indices)
        written = len(indices) <= len(declaration.dims) and self.is_initial(declaration)
        span = self.constants.part_span(declaration, indices) if written else None
        if span is None:
            try:
                return pick(self.value(declaration), indices)
            except PartlyUnknown as partly:
                found = pick(Value(partly.data, declaration.type, len(declaration.dims)), indices)
                if (unknown := unknown_part(found.data)) is not None:
                    raise unknown from None
                return found
        data = self.constants.initial(declaration, span, self._home).data
        rank = max(0, len(declaration.dims) - len(indices))
        return Value(data, declaration.type, rank, declaration.key, indices)

    def call(self, call: Call) -> Value | None:
        return self.function(call, self)

    def present(self, name: str) -> bool:
        return name in self.frame.present

    # -- declared data -------------------------------------------------------------------------------------------

    def find(self, name: str) -> Declaration | None:
        routine = self.frame.routine
        return self.program.declaration(name, routine.module, routine.name)

    def is_initial(self, declaration: Declaration) -> bool:
        """Whether the declaration's own value holds: it is CONST, or nothing in the program writes it."""
        key = declaration.key
        return declaration.storage == "CONST" or (key not in self.changed and key not in self.changes.everything)

    def value(self, declaration: Declaration) -> Value:
        key = declaration.key
        if declaration.storage != "CONST":
            if key in self.changes.volatile:
                raise Unknown(f"`{declaration.name}` is written by a trap routine or an error handler")
            if key in self.changed:
                data = self.changed[key]
                if isinstance(data, Unknown):
                    raise data
                return Value(data, declaration.type, len(declaration.dims))
            if key in self.changes.everything:
                raise Unknown(f"`{declaration.name}` {self._written(key)}")
        return self.declared(declaration)

    def _written(self, key: str) -> str:
        writers = self.changes.writers.get(key, {""})
        if "" in writers:
            return UNSET
        return f"may be written by {' and '.join(f'`{name}`' for name in sorted(writers))}"

    def declared(self, declaration: Declaration) -> Value:
        """The value that the declaration itself gives.

        Raises:
            Unknown: it gives none.
        """
        return self.constants.value(declaration, self._home)

    def initialise(self, declaration: Declaration) -> None:
        """Give a routine's own variable its initial value, as every call does."""
        if declaration.storage == "CONST" or declaration.key not in self.changes.everything:
            return
        try:
            self.changed[declaration.key] = self.constants.initial(declaration, declaration.init, self._home).data
        except Unknown as error:
            self.changed[declaration.key] = error

    def _home(self, declaration: Declaration) -> Memory:
        """The scope in which a declaration's own expression is read."""
        routine = self.program.routine(declaration.routine, declaration.module) if declaration.routine else None
        if routine is None:
            routine = Routine(declaration.source, (0, 0), declaration.module, "PROC", "", False, "", (), (), ())
        return Memory(self.program, self.changes, self.constants, Frame(routine), self.function, {})
