"""Options that name data of a program: a name that no file declares is refused."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import TYPE_CHECKING

from postproc.cli.options import split_names
from postproc.diagnostics import PostprocError, Source, did_you_mean, joined

if TYPE_CHECKING:
    from postproc.cli.program_options import ProgramOptions

_DECLARED = re.compile(rb"(?i)\b(?:(?:PERS|CONST|VAR)\s+(\w+)|(wobjdata))\s+([\w\x80-\xff]+)")
"""Data with their types, and parameters that are work objects."""


def check_names(stated: ProgramOptions, sources: Iterable[Source]) -> None:
    """Refuse options of the command line that name data which no file declares.

    Args:
        sources: all that is read of the programs; files near them that are read along may be missing.

    Raises:
        PostprocError: CLI019, with the names that are near.
    """
    names = {option: split_names(getattr(stated, option, ())) for option in ("taught", "wobj_taught")}
    if not any(names.values()):
        return
    from postproc.compensation.correction.rigid_shift import UNTAUGHT, WORLD

    matches = {match.groups() for source in sources for match in _DECLARED.finditer(source.data)}
    data = {name.decode("latin-1"): (kind or wobj).lower() for kind, wobj, name in sorted(matches, key=str)}
    objects = [name for name, kind in data.items() if kind == b"wobjdata"]
    for option, stated_names in names.items():
        other = {"all"} if option == "wobj_taught" else set[str]()
        for name in stated_names:
            if other and name.lower() == WORLD:
                help_ = "name the work object that was taught; targets that were jogged need no correction"
                raise PostprocError.of("CLI019", f"`--wobj-taught {name}`: {UNTAUGHT}", help=help_)
            if name.lower() in other.union(map(str.lower, data)):
                continue
            kind, near = ("a work object", objects) if other else ("data", list(data))
            help_ = did_you_mean(name, near)
            if not help_ and other and objects:
                help_ = f"the work objects are {joined([f'`{one}`' for one in objects])}"
            text = f"`--{option.replace('_', '-')} {name}`: no file declares {kind} of this name"
            raise PostprocError.of("CLI019", text, help=help_ or "name the file that declares it, `--with FILE`")
