"""What people may state: declared once, at the field that holds it. Files, command line and schema are made of that."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any, get_args, get_origin, get_type_hints


@dataclass(frozen=True)
class UserOption:
    """What people may state for a field of a dataclass. Lengths are millimetres for people, metres in the field.

    Args:
        name, type, default: of the field.
        text: its description in the docstring of the dataclass; `{}` stands for the default, angle brackets surround
            what holds on the command line alone.
        key: in files. Default: the name of the field, in `_mm` for `_m`.
        commands: that take it: on the ``arm``, those that read a ``program``, ``convert`` or run a ``task``, or none.
        files: that take it: ``settings`` and jobs files, ``jobs`` files alone, or none.
        also: short flag, or former key of files and of the command line.
        in_files: type there, if that does not follow from the field's.
        last: it stands behind all others.
        group: heading under which help lists it.
    """

    name: str
    type: Any
    default: Any
    text: str
    key: str
    commands: str = "convert"
    files: str = "settings"
    also: str = ""
    in_files: Any = None
    last: bool = False
    group: str = "Common"

    def description(self, *, command_line: bool) -> str:
        """Return the text with the default, for the command line or for files."""
        default = f"{1e3 * self.default:g}" if self.type is float else {True: "on"}.get(self.default, self.default)
        return re.sub("[<>]" if command_line else "<[^>]*>", "", self.text).replace("{}", str(default))

    def value(self, stated: Any, folder: Path) -> Any:
        """Return the value of the field.

        Args:
            stated: the value as files have it. folder: where relative paths start.
        """
        if self.type is float:
            return 1e-3 * stated
        if isinstance(stated, Mapping):
            return tuple(stated.items())
        if get_origin(self.type) is not tuple:
            return folder / stated if Path in get_args(self.type) else stated
        listed = (stated,) if isinstance(stated, str) else stated
        return tuple(folder / path for path in listed) if Path in get_args(self.type) else tuple(listed)


def option(default: object, **declaration: Any) -> Any:
    """Return a field of a dataclass that people may state; arguments are those of `UserOption`."""
    return field(default=default, metadata={"option": declaration})


def described(declared: type) -> dict[str, str]:
    """Return the descriptions of fields that the ``Args`` of a class's docstring give, by name, with their lines."""
    entries = re.findall(r"^ {8}([\w, ]+): (.*(?:\n {12}.*)*)", declared.__doc__ or "", re.MULTILINE)
    return {name.strip(): re.sub("\n *", "\n", text) for names, text in entries for name in names.split(",")}


def options_of(declared: type, **names: object) -> list[UserOption]:
    """Return what people may state of a dataclass, in the order of its fields.

    Args:
        names: of its annotations that are imported for types alone.
    """
    hints, texts = get_type_hints(declared, localns=names), described(declared)
    return [
        UserOption(
            **{"key": re.sub("_m$", "_mm", each.name), **each.metadata["option"]},
            name=each.name,
            type=hints[each.name],
            default=each.default,
            text=texts.get(each.name, ""),  # without docstrings, ``python -OO``
        )
        for each in fields(declared)
        if "option" in each.metadata
    ]
