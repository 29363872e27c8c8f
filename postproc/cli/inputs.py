"""Reading the files that the user names."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from postproc.cli.report import STDIN, show
from postproc.diagnostics import PostprocError, Source

if TYPE_CHECKING:
    from postproc.effects.base import Effect
    from postproc.measure.measurements import Measurements
    from postproc.model.arm import Model
    from postproc.robot.arm import Robot


def read_source(name: str, lent: bool = False) -> Source:
    """The bytes of a file; ``-`` on the command line is stdin.

    Args:
        lent: it is read along with others and never changed.

    Raises:
        PostprocError: no such file (CLI002), a folder (CLI003), not readable (CLI004), empty (CLI005).
    """
    if name == STDIN:
        source = Source(name, sys.stdin.buffer.read(), lent)
    else:
        source = Source(name, _read(name), lent)
    if not source.data.strip():
        raise PostprocError.of("CLI005", f"`{source.path}` is empty", help="name the file that was meant")
    return source


def load_model(path: Path | None, robot: str | None = None, effects: Sequence[Path] = ()) -> Model:
    """The model in a file, or the shipped one; with another arm where one is named.

    Args:
        path: model file, None for the shipped model.
        robot: library name or file of the arm that takes the place of the model's.
        effects: Python files with effects that the model may use.

    Raises:
        PostprocError: what is wrong with one of the files.
    """
    from postproc.batch.discover import MODULES
    from postproc.effects.registry import effect_library
    from postproc.model.file import DEFAULT_ROBOT, default_model, parse_model
    from postproc.robot.catalogue import load_robot

    library = effect_library(effects)
    if path is None:
        return default_model(robot or DEFAULT_ROBOT)
    if path.suffix.lower() == ".csv":
        raise PostprocError.of(
            "CLI012", f"`{path}` is a table, not a model", help="the model comes first, then the table"
        )
    if path.suffix.lower() in MODULES:
        raise PostprocError.of(
            "CLI012", f"`{path}` is a program, not a model", help="name the TOML file that `postproc fit` wrote"
        )
    model = parse_model(read_source(str(path)), library)
    return model if robot is None else replace(model, robot=load_robot(robot), robot_name=robot)


def load_measurements(
    data: Sequence[str],
    robot: Robot,
    program: str | None = None,
    columns: str | None = None,
    measured: bool = True,
    beside: Sequence[Path] = (),
) -> Measurements:
    """The tables of measured poses as one, their findings printed.

    Args:
        data: CSV files; ``-`` is stdin.
        robot: the arm that was measured.
        program: RAPID module that was run, for tables that name targets.
        columns: TOML file that maps the columns of another layout.
        measured: False where the table need not say what was measured.
        beside: RAPID modules that are read along with the program.

    Raises:
        PostprocError: what is wrong with one of the files.
    """
    from postproc.measure.together import read_tables

    run = [read_source(program), *(read_source(str(path), lent=True) for path in beside)] if program else None
    layout = read_source(columns) if columns else None
    table = read_tables([read_source(name) for name in data], robot, run, layout, measured)
    show(table.diagnostics)
    return table


def short_names(*files: str | Path) -> str:
    """What was compared with what, in a line: files without their folders."""
    return " ".join(Path(file).name for file in files)


def own_effects(files: Sequence[Path]) -> list[type[Effect]]:
    """Effects that the user's files define."""
    from postproc.effects.loading import load_effect_file

    return [cls for file in files for cls in load_effect_file(file)]


def _read(name: str) -> bytes:
    try:
        return Path(name).read_bytes()
    except FileNotFoundError:
        raise PostprocError.of(
            "CLI002", f"there is no file `{name}`", help="check the spelling and the folder"
        ) from None
    except IsADirectoryError:
        raise PostprocError.of("CLI003", f"`{name}` is a folder", help="name one file") from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise PostprocError.of(
            "CLI004", f"cannot read `{name}`: {reason}", help="check the rights of the file"
        ) from None
