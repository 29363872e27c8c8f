"""Options of commands on programs, made of `USER_OPTIONS`, and the settings that come of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar, get_args

from cyclopts import Parameter

from postproc.cli.options import (
    GROUPS,
    LISTED,
    Flag,
    FreeAxes,
    Tolerance,
    VectorText,
    parse_channel,
    parse_vector,
    split_names,
)
from postproc.rapid.data.records import Vec3
from postproc.settings import USER_OPTIONS, Settings
from postproc.user_options import UserOption

Fields = TypeVar("Fields")


def _words(option: UserOption) -> tuple[Any, object]:
    """Return the type of an option's words, and what stands where the option is not given."""
    kind = option.type
    if kind is bool:
        return (Literal["on", "off"] | None, None) if option.default else (Flag, False)
    if isinstance(option.default, tuple) and kind != Vec3:
        words: Any = tuple[Path, ...] if Path in get_args(kind) else tuple[str, ...]
        return Annotated[words, LISTED], ()
    return (FreeAxes, "") if kind is str else ({float: Tolerance, Vec3: VectorText}.get(kind, kind) | None, None)


def _read(option: UserOption, word: Any) -> Any:
    """Return what the words of an option state, as a file has it."""
    if option.type == Vec3:
        return parse_vector(f"--{option.key}", word)
    if option.key == "channel":
        return dict(map(parse_channel, word))
    if isinstance(word, tuple):
        return word if Path in get_args(option.type) else tuple(split_names(word))
    if option.type is bool:
        return word in (True, "on")
    return word.lower() if option.type is str else word


def _takes(group: str) -> Callable[[type[Fields]], type[Fields]]:
    """Return what gives a class a field for each option that a group of commands takes beside those of its base."""

    def declared(cls: type[Fields]) -> type[Fields]:
        """Return the class with its fields."""
        for option in (option for option in USER_OPTIONS if option.commands == group):
            kind, absent = _words(option)
            names = [f"--{option.key.removesuffix('_mm').replace('_', '-')}"]
            names += [option.also if option.also.startswith("-") else f"--{option.also}"] if option.also else []
            parameter = Parameter(name=names, help=option.description(command_line=True), group=GROUPS[option.group])
            cls.__annotations__[option.name] = Annotated[kind, parameter]
            setattr(cls, option.name, absent)
        return Parameter(name="*")(dataclass(frozen=True, kw_only=True)(cls))

    return declared


@_takes("arm")
class RobotOptions:
    """The real arm. What is not given stands in ``postproc.toml``, or has a default."""

    def settings_at(self, place: Path) -> Settings:
        """Return the settings of programs in a folder: its ``postproc.toml``, then these options."""
        from postproc.settings_files import settings_at, with_choices

        words = {field.name: getattr(self, field.name) for field in fields(self)}  # type: ignore[arg-type]
        absent = {field.name: field.default for field in fields(self)}  # type: ignore[arg-type]
        stated_options = [option for option in USER_OPTIONS if words.get(option.name) != absent.get(option.name)]
        stated = {option.name: _read(option, words[option.name]) for option in stated_options}
        return with_choices(settings_at(place), {name: v for name, v in stated.items() if v != ()}, Path())


@_takes("program")
class ProgramOptions(RobotOptions):
    """The same, and how a program is read."""


@_takes("convert")
class ConvertOptions(ProgramOptions):
    """The same, what acts on the arm, and how near it has to come."""


@_takes("task")
class TaskOptions(ConvertOptions):
    """The same, and what is corrected while the program runs."""
