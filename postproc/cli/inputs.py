"""Reading the files that the user names."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from postproc import files
from postproc.cli.printing import STDIN, say_next
from postproc.diagnostics import PostprocError, Source

if TYPE_CHECKING:
    from postproc.model.arm import Model


def read_source(name: str, read_only: bool = False) -> Source:
    """Return a file that the user names; ``-`` on the command line is stdin.

    Args:
        read_only: it is read along with others and never changed.

    Raises:
        PostprocError: no such file (CLI002), a folder (CLI003), not readable (CLI004), empty (CLI005).
    """
    if name == STDIN:
        data = sys.stdin.buffer.read(files.LARGEST_FILE_BYTES + 1)
        if len(data) > files.LARGEST_FILE_BYTES:
            text = f"stdin holds more than {files.LARGEST_FILE_BYTES // 1_000_000} MB, the most that is read"
            raise PostprocError.of("CLI004", text, help="give less")
        source = Source(STDIN, data, read_only)
    else:
        source = files.read_source(name, read_only=read_only)
    if not source.data.strip():
        raise PostprocError.of("CLI005", f"`{source.path}` is empty", help="name the file that was meant")
    return source


def load_model(path: Path, effects: Sequence[Path] = (), cell: Path | None = None) -> Model:
    """Load the model in a file.

    Args:
        effects: Python files with effects that the model may use.
        cell: file of what carries the arm and its work, in place of what the model file says of that.

    Raises:
        PostprocError: what is wrong with one of the files.
    """
    from postproc.effects.registry import effect_library
    from postproc.model.file import parse_model
    from postproc.rapid.program.program import ENDINGS
    from postproc.robot.cells.cell_file import restated
    from postproc.settings import read_station

    library, kind = effect_library(effects), path.suffix.lower()
    if kind == ".csv" or kind in ENDINGS:
        what, help_ = "program", "name the TOML file that `postproc fit` wrote"
        if kind == ".csv":
            what, help_ = (
                "table",
                f"the model comes first, then the table; `postproc fit {path} -o MODEL.toml` makes a model of it",
            )
        raise PostprocError.of("CLI012", f"`{path}` is a {what}, not a model", help=help_)
    model = parse_model(read_source(str(path)), library)
    return model if cell is None else model.at_station(restated(read_station(cell)))


def assumed(robot: str, effects: Iterable[str], sigma: float | None, weighed: bool = True) -> str:
    """Return a line on arm, effects and noise, from which a command starts.

    Args:
        robot: name of the arm. effects: their keys.
        sigma: stated noise [m], None where the table tells it. weighed: False leaves the noise out.
    """
    noise = "; noise " + ("from the table" if sigma is None else f"{1e3 * sigma:g} mm")
    return f"arm `{robot}`; effects {', '.join(effects) or 'none'}{noise * weighed}"


def short_names(*compared: str | Path) -> str:
    """Return the names of files without their folders, joined by blanks, for a title."""
    return " ".join(Path(file).name for file in compared)


def say_uses(model: Path, tables: Iterable[object], effects: Iterable[object], correct_first: bool = False) -> None:
    """Print the commands in which a new model may be used: `diagnose`, and `compensate`.

    Args:
        model: its file. tables: words of ``diagnose`` behind it; effects: options with the user's own effects.
        correct_first: after a few readings of a shop, which hardly tell what is missing, ``compensate`` comes first.
    """
    program = ("corrects a program with it", ("compensate", "PROGRAM", "-m", model, *effects, "-o", "OUT"))
    uses = [("says whether an effect is missing", ("diagnose", model, *tables)), program]
    for lead, (what, words) in zip(("next", "or"), uses[::-1] if correct_first else uses, strict=True):
        say_next(what, *words, lead=lead)
