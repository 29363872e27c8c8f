"""What names mean while the program is walked: data with their present values, parameters, loop variables."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

from postproc.rapid.data.arm import call_by_arm
from postproc.rapid.data.builtins import PREDEFINED
from postproc.rapid.data.events import Turn
from postproc.rapid.data.records import Pose
from postproc.rapid.data.values import Data, Fields, Value
from postproc.rapid.evaluation.declared import DeclaredValues
from postproc.rapid.evaluation.evaluate import as_integer, component, evaluate, pick
from postproc.rapid.evaluation.teaching import Teaching
from postproc.rapid.program.late_binding import LATE
from postproc.rapid.program.program import Program
from postproc.rapid.program.write_effects import WriteEffects
from postproc.rapid.syntax.nodes import Declaration, Routine
from postproc.rapid.syntax.trees import Call, Component, Expression, Index, Name
from postproc.rapid.unknown import (
    Causes,
    Kind,
    PartlyUnknown,
    Unknown,
    assumed_for,
    joined_causes,
    unknown_part,
    without_causes,
)

Path = tuple[int | str, ...]  # indices, from 1, and components


@dataclass(frozen=True, slots=True)
class Reference:
    """A parameter that stands for the caller's data: its declaration, and indices and components of a part of it."""

    declaration: Declaration
    path: Path = ()
    assumed: Causes = ()  # why it is not certain which part


Binding = Value | Unknown | Reference


NOWHERE = -1  # where the arm stands is not known
LOST = frozenset({NOWHERE})


@dataclass(frozen=True, slots=True)
class Exit:
    """A way by which a routine is left.

    Args:
        changed: values of data by key; ends: indices of the events after one of which the arm stands.
        value: what it returns.
        goes_on: what called the routine goes on; not behind EXIT, an error, or where the way never ends.
    """

    changed: dict[str, Data]
    ends: frozenset[int]
    value: Value | Unknown | None = None
    goes_on: bool = True


@dataclass(slots=True)
class CallFrame:
    """One call: the routine, its parameters and loop variables by lower-case name.

    Args:
        caller: the frame of the caller; conditional: how many conditions were not known there.
        exits: the ways that have left the routine so far.
        supposed: it has run before as far as its calls tell: only what is new in it counts.
    """

    routine: Routine
    bindings: dict[str, Binding] = field(default_factory=dict)
    present: set[str] = field(default_factory=set)
    caller: CallFrame | None = None
    conditional: int = 0
    exits: list[Exit] = field(default_factory=list)
    supposed: bool = False

    def running(self) -> list[CallFrame]:
        """This call and the calls that led to it, from the innermost to the outermost."""
        frames, frame = list[CallFrame](), self
        while True:
            frames.append(frame)
            if frame.caller is None:
                return frames
            frame = frame.caller

    def varying(self) -> set[str]:
        """Lower-case names of parameters and loop indices, which may differ in another call or turn of a loop."""
        names = {*self.bindings}
        for parameter in self.routine.parameters:
            names.add(parameter.name)
        return names


@dataclass(slots=True)
class Memory:
    """The state of a program on one way through it: values of data by key, the call, where the arm stands.

    A copy is cheap and independent: it is another way from here.

    Args:
        changed: only what has been assigned or forgotten, over the initial values.
        reads, noted: causes of doubt of what was read in the present expression, and in all since ``noted`` was
            emptied.
        ends: indices of the events after one of which the arm stands now, and ``NOWHERE``.
        conditional: how many of the conditions in force are not known.
        turns: of the loops that are being run, the outermost first, as far as their turns are counted.
        trial: nothing moves; returning: from the end of a loop to the first motion of its next turn.
    """

    program: Program
    changes: WriteEffects
    constants: DeclaredValues
    frame: CallFrame
    function: Callable[[Call, Memory], Value | None]
    changed: dict[str, Data] = field(default_factory=dict)
    ends: frozenset[int] = LOST
    conditional: int = 0
    turns: tuple[Turn, ...] = ()
    trial: bool = False
    returning: bool = False
    teaching: Teaching = field(default_factory=Teaching)
    reads: list[Unknown] = field(default_factory=list)
    noted: list[Unknown] = field(default_factory=list)

    @property
    def records(self) -> Mapping[str, Fields]:
        """Fields (name, type) of each record type, by lower-case type name."""
        return self.constants.records

    def trial_copy(self) -> Memory:
        """A copy to try something out in: writes to it do not reach the original, motions in it are not recorded."""
        frame = replace(self.frame, bindings=dict(self.frame.bindings), exits=[])
        return replace(self, frame=frame, changed=dict(self.changed), trial=True)

    def branch(self) -> Memory:
        """A copy for another way from here, which depends on one more condition that is not known."""
        frame = replace(self.frame, bindings=dict(self.frame.bindings))
        return replace(self, frame=frame, changed=dict(self.changed), conditional=self.conditional + 1)

    def doubt(self) -> None:
        """Note that the arm may stand somewhere else than the recorded motions say: adds ``NOWHERE`` to ``ends``."""
        self.ends |= LOST

    def leave(self, value: Value | Unknown | None = None, goes_on: bool = True) -> None:
        """Record that the routine ends here on this way, with its data now and the value that it returns.

        Args:
            goes_on: the caller continues; False behind EXIT, an error or an endless loop.
        """
        self.frame.exits.append(Exit(dict(self.changed), self.ends, value, goes_on))

    # -- Scope ---------------------------------------------------------------------------------------------------

    def lookup(self, name: Name) -> Value:
        """The value of a name: parameters and loop indices first, then declared data, then what every controller has.

        Raises:
            Unknown: it has none.
        """
        bound = self.frame.bindings.get(name.name)
        if isinstance(bound, Unknown):
            raise bound.kept()
        if isinstance(bound, Value):
            return bound
        if isinstance(bound, Reference):
            value = self.value(bound.declaration)
            for step in bound.path:
                value = component(value, step, self.records) if isinstance(step, str) else pick(value, (step,))
            return replace(value, assumed=joined_causes(value.assumed, bound.assumed)) if bound.assumed else value
        declaration = self.find(name.name)
        if declaration is not None:
            return self.value(declaration)
        if name.name == "c_progdisp":
            return self.program_displacement()
        if name.name in PREDEFINED:
            kind, data = PREDEFINED[name.name]
            return Value(data, kind)
        raise Unknown(Kind.NOT_DECLARED, name.text, "", name.text, name.span)

    def program_displacement(self) -> Value:
        """The value of ``C_PROGDISP``: the displacement that PDispSet, PDispOn and EOffsSet have set.

        Raises:
            Unknown: it is not known.
        """
        pose, causes = without_causes(self.changed.get("@pdisp", Pose()))
        offset, offset_causes = without_causes(self.changed.get("@eoffs", (0.0,) * 6))
        for state in (pose, offset):
            if isinstance(state, Unknown):
                raise state.kept()
        if not isinstance(pose, Pose):
            raise Unknown(Kind.EXTERNAL_OFFSET)
        data = ((pose.trans, pose.rot), offset)
        return Value(data, "progdisp", assumed=joined_causes(causes, offset_causes))

    def element(self, name: Name, indices: tuple[int, ...]) -> Value:
        """The value of an element of an array, indices from 1; read alone from the text if nothing writes the array.

        Raises:
            Unknown: it has none.
        """
        bound = self.frame.bindings.get(name.name)
        declaration = self.find(name.name) if bound is None else None
        if isinstance(bound, Reference) and all(isinstance(step, int) for step in bound.path):
            indices = (*(step for step in bound.path if isinstance(step, int)), *indices)
            declaration = bound.declaration if not bound.assumed else None
        if declaration is None:
            return pick(self.lookup(name), indices)
        written = len(indices) <= len(declaration.dims) and self.is_initial(declaration)
        span = self.constants.part_span(declaration, indices) if written else None
        if span is None:
            try:
                return pick(self.value(declaration), indices)
            except PartlyUnknown as partly:
                array = Value(partly.data, declaration.type, len(declaration.dims), assumed=partly.assumed)
                element = pick(array, indices)
                if (unknown := unknown_part(element.data)) is not None:
                    raise unknown from None
                return element
        data = self.constants.initial(declaration, span, self._home).data
        rank = max(0, len(declaration.dims) - len(indices))
        return Value(data, declaration.type, rank, declaration.key, indices)

    def call(self, call: Call) -> Value | None:
        """The result of a function that the program defines, which is run; None if it defines none of that name."""
        return self.function(call, self)

    def present(self, name: str) -> bool:
        """Whether the present call passes this optional parameter (lower-case name)."""
        return name in self.frame.present

    def by_arm(self, name: str, arguments: tuple[Data, ...], options: Mapping[str, Data]) -> Value:
        """The result of CalcRobT or CalcJointT under the displacement, axis offset and units that are in force.

        Args:
            arguments: values of the positional arguments; options: of the optional ones, by lower-case name.

        Raises:
            Unknown: there is no arm, or that state is not known.
        """
        causes: list[Unknown] = []

        def state(key: str) -> Data:
            """Present value of state by its ``@`` key; notes causes of doubt; raises Unknown if it is not known."""
            data, why = without_causes(self.changed.get(key, Unknown(Kind.STATE_UNKNOWN, key)))
            if isinstance(data, Unknown):
                raise data.kept()
            causes.extend(why)
            return data

        kind, data = call_by_arm(self.program.arm, name, arguments, options, state)
        return Value(data, kind, assumed=tuple(causes))

    # -- declared data -------------------------------------------------------------------------------------------

    def find(self, name: str) -> Declaration | None:
        """The declaration that a name means in the present routine: its own, the module's, the task's, or None."""
        routine, module, task = self.frame.routine.scopes
        names, low = self.program.names, name.lower()
        return names.get(routine + low) or names.get(module + low) or names.get(task + low)

    def keys_of(self, name: str) -> list[str]:
        """The key of the parameter (``%name``) or variable that a name means in the present routine; [] for others."""
        if name in self.frame.bindings:
            return ["%" + name]
        declaration = self.find(name)
        return [] if declaration is None or declaration.storage == "CONST" else [declaration.key]

    def is_initial(self, declaration: Declaration) -> bool:
        """Whether the declaration's own value holds: it is CONST, or nothing writes it while the program runs."""
        key = declaration.key
        return declaration.storage == "CONST" or (key not in self.changed and key not in self.changes.may_be_written)

    def value(self, declaration: Declaration) -> Value:
        """The present value of declared data.

        If nothing has set it so far but something may, the declared value is assumed; data that a trap or a handler
        writes is never certain.

        Raises:
            Unknown: it has none.
        """
        key = declaration.key
        causes: Causes = ()
        if declaration.storage == "CONST":
            return self.declared(declaration)
        taught = self.teaching.covers(declaration)
        if not taught and self.changes.may_be_written_any_time(key):
            kind = Kind.WRITTEN_ELSEWHERE if key in self.changes.written_by_others else Kind.WRITTEN_AT_ANY_TIME
            causes = (Unknown(kind, f"`{declaration.name}`", key=key),)
        if key not in self.changed:
            if taught or key not in self.changes.may_be_written:
                return self.declared(declaration)
            why = causes or (self._writer(declaration),)
            if declaration.init is None:
                raise why[0]
            value = self.declared(declaration)
            return replace(value, assumed=joined_causes(value.assumed, why))
        data = assumed_for(self.changed[key], causes)
        if isinstance(data, Unknown):
            raise data.kept()
        data, causes = without_causes(data)
        return Value(data, declaration.type, len(declaration.dims), assumed=causes)

    def _writer(self, declaration: Declaration) -> Unknown:
        """The reason why data that nothing has set so far is not certain: what writes it later, or may write it."""
        name, key = f"`{declaration.name}`", declaration.key
        writers = self.changes.direct.writers.get(key, set())
        if "" in writers:
            return Unknown(Kind.UNSET, name, key=key)
        first = sorted(writers or self.changes.unseen)[:2]
        cause = " and ".join(writer if writer == LATE else f"`{writer}`" for writer in first)
        return Unknown(Kind.MAY_BE_WRITTEN, name, cause, key=key)

    def declared(self, declaration: Declaration) -> Value:
        """The value that the declaration itself gives.

        Raises:
            Unknown: it gives none.
        """
        return self.constants.value(declaration, self._home)

    def initialise(self, declaration: Declaration) -> None:
        """Set a routine's own variable to its initial value, as every call does, if the program writes it at all."""
        if declaration.storage == "CONST" or declaration.key not in self.changes.everything:
            return
        try:
            value = self.constants.initial(declaration, declaration.init, self._home)
            self.changed[declaration.key] = assumed_for(value.data, value.assumed)
        except Unknown as error:
            self.changed[declaration.key] = error.kept()

    def _home(self, declaration: Declaration) -> Memory:
        """New memory in the scope of a declaration with nothing assigned: its expression sees declared values only."""
        routine = self.program.routine(declaration.routine, declaration.module) if declaration.routine else None
        if routine is None:
            routine = Routine(declaration.source, (0, 0), declaration.module, "PROC", "", False, "", (), (), ())
        frame = CallFrame(routine, caller=self.frame)
        return Memory(self.program, self.changes, self.constants, frame, self.function, {}, trial=True)


def part_of(tree: Expression, memory: Memory) -> tuple[str, Path, Causes] | None:
    """Lower-case name, path and causes of doubt about the path of the data that an expression names, whole or in part.

    None if the expression is anything else than a name with indices and components.

    Raises:
        Unknown: an index is not known.
    """
    path: Path = ()
    causes: Causes = ()
    while not isinstance(tree, Name):
        if isinstance(tree, Component):
            path = (tree.name, *path)
        elif isinstance(tree, Index):
            values = [evaluate(index, memory) for index in tree.indices]
            causes = joined_causes(*(value.assumed for value in values), causes)
            path = (*(as_integer(value.data) for value in values), *path)
        else:
            return None
        tree = tree.base
    return tree.name, path, causes
