"""A program followed concretely, in a world in which everything that the text leaves open has some value.

What the worlds of an original and of its corrected program draw depends on the thing: of data on how often something
may have written it, of inputs on how often they were asked for. An added target that reads data once more changes
nothing: both programs meet the same inputs, operators and unseen routines.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import partial

from postproc.diagnostics import Span
from postproc.rapid.data.arm import BY_ARM
from postproc.rapid.data.builtins import FUNCTIONS, RUN_TIME
from postproc.rapid.data.records import RobTarget
from postproc.rapid.data.values import Data, Fields, Value, part_types, single, zero
from postproc.rapid.evaluation.declared import DeclaredValues, Home
from postproc.rapid.evaluation.evaluate import evaluate
from postproc.rapid.evaluation.memory import Memory
from postproc.rapid.program.program import Program
from postproc.rapid.syntax.nodes import Declaration
from postproc.rapid.syntax.trees import Call, Name
from postproc.rapid.unknown import Assumed, PartlyUnknown, Unknown

TOUCHED_UP_MM = 3.0  # that an operator moves a taught position by, along each axis
PLAIN = ("bool", "num", "dnum", "string")  # types of VAR data that an operator sets
BESIDE_MM = 200.0
FEW = 9  # the largest number that an input gives
ON_OR_OFF = frozenset({"dinput", "doutput"})
TRUTHS = frozenset({"ispers", "present", "strmemb"})  # of those that are no run-time functions
PLACES = {
    "crobt": "robtarget", "calcrobt": "robtarget", "cpos": "pos", "cjointt": "jointtarget", "calcjointt": "jointtarget",
}  # fmt: skip


class World:
    """A choice of all that the text of a program leaves open: conditions, inputs, what operators and others write.

    Each value is drawn from the seed and the name of what it is the value of, so that an original and a corrected
    program get the same.

    Args:
        seed: of this world.
        taught: keys of the declarations that an operator may touch up or set: those of the original program.
        words: values that a string may have: those of the program's text.
        chosen: values of declared data that are not those of the text, by key.
    """

    def __init__(
        self, seed: int, taught: frozenset[str], words: Sequence[str] = (), chosen: Mapping[str, Data] | None = None
    ) -> None:
        """Make a world from its seed; nothing is drawn yet.

        Args:
            taught: keys of data that an operator may change; words: that a string may be; chosen: values by key.
        """
        self.seed = seed
        self.taught = taught
        self.words = words
        self.chosen = chosen or {}
        self.counts: dict[str, int] = {}
        self.left: dict[tuple[str, int, bool], Data] = {}
        """What the last run or something unseen has left in data, by how often that may have been and which it was."""

    def generator(self, thing: str) -> random.Random:
        """A random generator that depends only on the world's seed and a name: alike at every call.

        Args:
            thing: name of what is drawn.
        """
        return random.Random(f"{self.seed} {thing}")

    def next(self, thing: str) -> random.Random:
        """A random generator that depends on the world's seed, a name, and how often it was asked for by that name.

        Args:
            thing: name of what is drawn.
        """
        count = self.counts[thing] = self.counts.get(thing, 0) + 1
        return self.generator(f"{thing} {count}")

    def beside(self, target: RobTarget) -> RobTarget:
        """The target moved at random by up to ``BESIDE_MM`` along each axis: where something else took the arm."""
        drawn = self.next("beside")
        x, y, z = (axis + drawn.uniform(-BESIDE_MM, BESIDE_MM) for axis in target.trans)
        return replace(target, trans=(x, y, z))

    def varied(self, data: Data, kind: str, records: Mapping[str, Fields], drawn: random.Random) -> Data:
        """Data with other values drawn at random; an Unknown counts as zero.

        Positions move by up to 3 mm along each axis, whole numbers by up to 6, others by up to 20 %; orientations and
        configurations stay.

        Args:
            kind: type of the data, in lower case; records: fields of each record type; drawn: gives the random numbers.
        """
        if isinstance(data, Unknown):
            data = zero(kind, records)
        if isinstance(data, tuple):
            if kind == "orient":  # known as a whole, or not at all
                known = any(data) and not any(isinstance(x, Unknown) for x in data)
                return data if known else (1.0, 0.0, 0.0, 0.0)
            kinds = part_types(kind, len(data), records)
            data = tuple(zero(k, records) if isinstance(x, Unknown) else x for x, k in zip(data, kinds, strict=True))
            if kind in ("confdata", "extjoint"):
                return data
            if kind == "pos":
                return tuple(x + drawn.uniform(-TOUCHED_UP_MM, TOUCHED_UP_MM) for x in data)
            # what a record is does not change: robhold, finep
            return tuple(
                x if isinstance(x, bool) else self.varied(x, part, records, drawn)
                for x, part in zip(data, kinds, strict=True)
            )
        if isinstance(data, bool):
            return drawn.random() < 0.5
        if isinstance(data, str) and self.words:
            return drawn.choice(self.words)
        if not isinstance(data, float) or not math.isfinite(data) or abs(data) > 1e6:
            return data
        if data == int(data):
            return data + drawn.randint(-1, 2) * drawn.choice((1, 1, 2, 3))
        return single(data * drawn.uniform(0.8, 1.2))


def each(change: Callable[[Data], Data], data: Data, rank: int) -> Data:
    """Apply ``change`` to the data, or to every element of an array of ``rank`` dimensions."""
    if rank and isinstance(data, tuple):
        return tuple(each(change, item, rank - 1) for item in data)
    return change(data)


def of_one(data: Data, rank: int) -> Data:
    """An array of ``rank`` dimensions that has ``data`` as its only element."""
    return of_one((data,), rank - 1) if rank else data


class WorldDeclared(DeclaredValues):
    """Declarations as they are in a world: targets touched up, data that nothing writes set by an operator."""

    def __init__(self, program: Program, world: World, written: frozenset[str]) -> None:
        """Read a program's declarations in a world; ``written`` are the keys of data that the program may write."""
        super().__init__(program)
        self.world = world
        self.written = written

    def initial(self, declaration: Declaration, span: Span | None, home: Home) -> Value:
        """The value that a declaration gives in this world, in which an operator may have changed it.

        Args:
            span: of the value in the text, None if there is none; home: gives the scope in which it is evaluated.

        Raises:
            Unknown: the declaration gives none.
        """
        value = super().initial(declaration, span, home)
        if declaration.key in self.world.chosen and span == declaration.init:
            return replace(value, data=self.world.chosen[declaration.key])
        if declaration.routine or declaration.key not in self.world.taught or span != declaration.init:
            return value
        drawn = self.world.generator(declaration.key)
        open_ = declaration.storage == "PERS" or (declaration.storage == "VAR" and value.type in PLAIN)
        if open_ and declaration.key not in self.written and value.type != "robtarget":
            change = self.world.varied
        else:
            change = self._touched_up
        changed = partial(change, kind=value.type, records=self.records, drawn=drawn)
        return replace(value, data=each(changed, value.data, value.rank))

    def _touched_up(self, data: Data, kind: str, records: Mapping[str, Fields], drawn: random.Random) -> Data:
        """Data in which the position of every robtarget is moved by up to 3 mm along each axis.

        Args:
            kind: type of the data, in lower case; records: fields of each record type; drawn: gives the random numbers.
        """
        if not isinstance(data, tuple):
            return data
        if kind == "robtarget" and len(data) == len(records[kind]):
            return (self.world.varied(data[0], "pos", records, drawn), *data[1:])
        kinds = part_types(kind, len(data), records)
        return tuple(self._touched_up(item, part, records, drawn) for item, part in zip(data, kinds, strict=True))

    def part_span(self, declaration: Declaration, indices: tuple[int, ...]) -> Span | None:
        """Return None, so that an element is taken from the whole value, in which every part has been varied."""
        return None


@dataclass(slots=True)
class WorldMemory(Memory):
    """Data in a world: it always has a value."""

    world: World = field(default_factory=lambda: World(0, frozenset()))

    def value(self, declaration: Declaration) -> Value:
        """Present value of declared data: drawn at random if unknown and, in half of the cases, if assumed."""
        key, rank = declaration.key, len(declaration.dims)
        if declaration.storage == "CONST" or (key not in self.changed and key not in self.changes.may_be_written):
            return self._declared(declaration)
        data = self.changed.get(key, self)
        if data is self or (isinstance(data, Unknown) and not isinstance(data, PartlyUnknown)):
            data = self._left(declaration, unseen=data is not self)
        elif isinstance(data, PartlyUnknown):
            data = self._drawn(declaration, data.data)
        elif isinstance(data, Assumed):
            kept = self.world.generator(f"{key}? {self.invalidated(key)}").random() < 0.5
            data = data.data if kept else self._drawn(declaration, data.data)
        return Value(data, declaration.type, rank)

    def _left(self, declaration: Declaration, unseen: bool) -> Data:
        """Value that the last run left in data not set so far or, if ``unseen``, that code in no file has written."""
        at = declaration.key, self.invalidated(declaration.key), unseen
        if at not in self.world.left:
            data = self._declared(declaration).data
            stays = not unseen and declaration.storage != "PERS"
            self.world.left[at] = data if stays else self._drawn(declaration, data)
        return self.world.left[at]

    def _declared(self, declaration: Declaration) -> Value:
        """The declared value of data; if there is none, a value of its type drawn at random, the same at every call."""
        try:
            return self.declared(declaration)
        except Unknown:
            drawn = self.world.generator(declaration.key)
            change = partial(self.world.varied, kind=declaration.type, records=self.records, drawn=drawn)
            rank = len(declaration.dims)
            try:
                data = self.constants.unset(declaration, self._home)
            except Unknown:  # of a size that only the running program knows
                data = of_one(zero(declaration.type, self.records), rank)
            return Value(each(change, data, rank), declaration.type, rank)

    def _drawn(self, declaration: Declaration, data: Data) -> Data:
        """The data varied at random; the draw depends on its key and on how often something may have written it."""
        key, kind, rank = declaration.key, declaration.type, len(declaration.dims)
        drawn = self.world.generator(f"{key} {self.invalidated(key)}")
        return each(partial(self.world.varied, kind=kind, records=self.records, drawn=drawn), data, rank)

    def lookup(self, name: Name) -> Value:
        """The value of a name; a signal (0 or 1) and a parameter without argument have one drawn at random."""
        try:
            return Memory.lookup(self, name)  # super() does not know a class with slots
        except Unknown:  # a signal, or a parameter that nobody gave
            bound = next((p for p in self.frame.routine.parameters if p.name == name.name), None)
            drawn = self.world.next(name.name)
            if bound is None:
                return Value(float(drawn.randint(0, 1)), "num")
            data = self.world.varied(zero(bound.type, self.records), bound.type, self.records, drawn)
            value = self.frame.bindings[name.name] = Value(of_one(data, bound.rank), bound.type, bound.rank)
            return value

    def call(self, call: Call) -> Value | None:
        """The result of a call: of the program's own function, which is run, or drawn for one that cannot be evaluated.

        None for a built-in function, which is then evaluated from its arguments.
        """
        own = self.function(call, self)
        if own is not None or call.name in FUNCTIONS:
            return own
        drawn = self.world.next(f"{call.name}(")
        if call.name in ON_OR_OFF:
            return Value(float(drawn.randint(0, 1)), "num")
        kind = RUN_TIME.get(call.name, "")
        if call.name in TRUTHS or kind == "bool":
            return Value(drawn.random() < 0.5, "bool")
        if kind == "string":
            return Value(self.world.varied("", kind, self.records, drawn), kind)
        if call.name in BY_ARM:
            with suppress(Unknown):
                arguments = tuple(evaluate(argument, self).data for argument in call.arguments)
                options = {name: True if value is None else evaluate(value, self).data for name, value in call.options}
                return self.by_arm(call.text, arguments, options)
        if call.name in PLACES:
            kind = PLACES[call.name]
            return Value(self.world.varied(zero(kind, self.records), kind, self.records, drawn), kind)
        return Value(float(drawn.randint(0, FEW)), "num")
