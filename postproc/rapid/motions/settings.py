"""What a motion statement names beside its target, read once where it cannot change: tool, frame, speed, zone, weld."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, TypeVar

from postproc.diagnostics import Diagnostic
from postproc.rapid.data.builtins import PREDEFINED
from postproc.rapid.data.events import Argument, MotionStatement, StatementShape
from postproc.rapid.data.records import LoadData, SpeedData, ToolData, Weld, WobjData, ZoneData
from postproc.rapid.data.values import Data, Value, to_load, to_speed, to_tool, to_wobj, to_zone
from postproc.rapid.evaluation.accessor import passed_on
from postproc.rapid.evaluation.evaluate import evaluate
from postproc.rapid.evaluation.memory import Memory
from postproc.rapid.motions.missing import UNKNOWN_SPEED, UNKNOWN_ZONE, Missing
from postproc.rapid.program.program import Program
from postproc.rapid.syntax.expressions import read_full_expression
from postproc.rapid.unknown import Invalid, Kind, Unknown

T = TypeVar("T")
_KINDS: Mapping[str, str] = {"tool": "tooldata", "\\wobj": "wobjdata", "\\tload": "loaddata", "speed": "speeddata"}
_SETTINGS = frozenset({"tool", "\\wobj", "speed", "zone", "\\v", "\\t", "\\z", "\\tload", "weld"})
"""Roles of the arguments that settings are made of."""


@dataclass(frozen=True, slots=True)
class MotionSettings:
    """What one statement names beside its target."""

    tool: ToolData
    wobj: WobjData
    speed: SpeedData
    zone: ZoneData
    duration: float | None
    total: LoadData | None
    weld: Weld | None


class SettingsReader:
    """Reads settings; values of names that cannot change are read once."""

    def __init__(self, program: Program, missing: Missing) -> None:
        """Start with nothing read; names without a value are reported to ``missing``."""
        self.program = program
        self.missing = missing
        self.fixed: dict[tuple[str, str, str, str], Any] = {}
        self.settled: dict[StatementShape, MotionSettings] = {}

    def read(
        self, statement: MotionStatement, memory: Memory, reasons: list[Unknown], findings: list[Diagnostic]
    ) -> MotionSettings:
        """Tool, work object, speed, zone, duration, load and weld of a motion; kept by its shape if they cannot
        change.

        Args:
            reasons: gets why some of them have no value; findings: gets the findings about it.
        """
        shape, routine = statement.shape, memory.frame.routine
        lasting = shape.words.isdisjoint(memory.frame.varying())
        if lasting and shape in self.settled:
            return self.settled[shape]
        arguments = {a.role: a for a in statement.arguments}
        count = len(reasons)

        def known(role: str, convert: Callable[[str, Data], T], default: T, times: bool = False) -> T:
            """The converted value of the argument with this role; the default if there is none or it has no value.

            Args:
                times: only the timing depends on it, so that a missing value is reported but no reason to skip the
                    statement.
            """
            argument = arguments.get(role)
            if argument is None or (role.startswith("\\") and not passed_on(argument.span, memory)):
                return default
            try:
                return self.constant(argument, convert, memory)
            except Unknown as error:
                if times and not isinstance(error, Invalid):
                    self.missing.say_untimed(error, argument, statement.source, findings)
                else:
                    self.missing.explain(error, argument, statement, findings)
                    reasons.append(error.kept())
                return default

        tool = known("tool", to_tool, ToolData())
        wobj = known("\\wobj", to_wobj, WobjData())
        speed = known("speed", _data(to_speed), UNKNOWN_SPEED, times=True)
        zone = known("zone", _data(to_zone), ZoneData(True) if "zone" not in arguments else UNKNOWN_ZONE, times=True)
        v_tcp = known("\\v", _number, None, times=True)
        duration = known("\\t", _number, None)
        size = known("\\z", _number, None)
        total = known("\\tload", _data(to_load), None)
        if v_tcp is not None:
            speed = replace(speed, v_tcp=v_tcp)
        if size is not None:
            zone = replace(zone, pzone_tcp=size)
        settings = MotionSettings(tool, wobj, speed, zone, duration, total, self.weld(statement, memory, findings))
        used = [a for role, a in arguments.items() if role in _SETTINGS]
        names = [(a.role, a.text, routine.module, routine.name) for a in used]
        if lasting and len(reasons) == count and all(name in self.fixed for name in names):
            self.settled[shape] = settings
        return settings

    def constant(self, argument: Argument, convert: Callable[[str, Data], T], memory: Memory) -> T:
        """The converted value of an argument; kept for the next time if it is a name whose value cannot change.

        Args:
            convert: makes it from name and data.

        Raises:
            Unknown: it has no value, or one of another type.
        """
        routine = memory.frame.routine
        key = (argument.role, argument.text, routine.module, routine.name)
        low = argument.text.strip().lower()
        if key in self.fixed and low not in memory.frame.bindings:
            return self.fixed[key]
        tree = read_full_expression(routine.source.data, *argument.span, f"`{argument.text}`")
        value = evaluate(tree, memory)
        wanted = _KINDS.get(argument.role)
        if wanted is not None and value.type not in ("", wanted) and value.type in _KINDS.values():
            raise Unknown(Kind.WRONG_TYPE, argument.text, f"{value.type}, not {wanted}")
        result = convert(self.name(value, argument), value.data)
        if low.isidentifier() and low not in memory.frame.bindings:
            declaration = memory.find(low)
            if low in PREDEFINED if declaration is None else memory.is_initial(declaration):
                self.fixed[key] = result
        return result

    def name(self, value: Value, argument: Argument) -> str:
        """Declared name of the data or element that an argument's value comes from; else the argument's text."""
        if value.declaration is None:
            return argument.text.strip()
        declared = self.program.names[value.declaration]
        if len(value.at) > len(declared.dims):
            return argument.text.strip()  # a component
        return declared.name + ("{" + ",".join(map(str, value.at)) + "}" if value.at else "")

    def weld(self, statement: MotionStatement, memory: Memory, findings: list[Diagnostic]) -> Weld | None:
        """Phase of the seam and welding speed [mm/s], the first number of welddata; None if it does not weld.

        Args:
            findings: gets the finding if the speed is not known.
        """
        signature = statement.signature
        if not signature.phase:
            return None
        roles = statement.roles
        phase: Any = "start" if "\\on" in roles else "end" if "\\off" in roles else signature.phase
        argument = statement.argument("weld")
        if argument is None:
            return Weld(phase, None)
        try:
            return Weld(phase, self.constant(argument, _first, memory))
        except Unknown as error:
            self.missing.say_untimed(error, argument, statement.source, findings)
            return Weld(phase, None)


def _data(convert: Callable[[Data], T]) -> Callable[[str, Data], T]:
    """Make a converter of data take a name, too, which it ignores: `SettingsReader.constant` passes both."""
    return lambda name, data: convert(data)


def _number(name: str, data: Data) -> float | None:
    """The data of this name as a float; raises Unknown, with the name, if it is no number."""
    if isinstance(data, bool) or not isinstance(data, (int, float)):
        raise Unknown(Kind.NO_NUMBER, name)
    return float(data)


def _first(name: str, data: Data) -> float | None:
    """The first number of a record if it is positive, else None; the name is ignored."""
    if isinstance(data, tuple) and data and isinstance(data[0], float) and data[0] > 0:
        return data[0]
    return None
