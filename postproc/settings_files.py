"""Settings from files: what ``postproc.toml``, the command line, a jobs file or a job of it states; the inner wins."""

from __future__ import annotations

import json
import os
import stat
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Literal

from pydantic import AliasChoices, ConfigDict, Field

from postproc.diagnostics import PostprocError
from postproc.files import read_source, real
from postproc.rapid.data.records import Vec3
from postproc.settings import NAME, Settings
from postproc.tomlfile import FileTable, Positive, check, parse_toml, span_of

CONTROLLER_MODEL = "controller"
"""What names the controller's own numbers in place of a model file."""
SAME = ("force", "moment", "force_on", "inertia", "scope", "run_time", "free_axes", "allow_partial")
LENGTHS = ("tolerance", "air_tolerance", "largest_correction")
"""Keys that are options under the same name, and those that are options in metres."""


class StatedSettings(FileTable):
    """What one layer states; None is left to the layers around it. Paths start at the file that states them.

    Args:
        model: model file of the real arm, or `controller`: the joint compliances in the backup's configuration.
        robot: arm of the library, or its file.
        side_files: modules that are read along for what they declare, never changed.
        alone: whether no data is read along that a program lacks and a file near it declares.
        force, moment: on the TCP in base axes [N], [N m].
        force_on: along the whole program, or while the arc burns.
        inertia: whether the deflection under sustained acceleration is compensated.
        tolerance_mm, air_tolerance_mm: largest distance from the programmed path, while it welds and elsewhere.
        scope: correct all motions, or those that weld.
        allow_partial: write a program although statements that the arm cannot run as programmed stay as they are, or a
            weld between corrected ones does.
        largest_correction_mm: beyond it nothing is written.
        template: folder of Jinja templates in place of the shipped ones.
        taught: names of tools, work objects, targets and other data that calibration and teach routines of the program
            set to the value in the file.
        wobj_taught: names of work objects that this arm has taught, or `all`.
        already: parts of the arm's error that its controller corrects by itself (Absolute Accuracy).
        channel: what effects read and a program does not tell, by name.
        cell: file that describes tracks, gantries and positioners, or a controller's backup.
        free_axes: letters of external axes that carry neither the robot nor its work.
        run_time: which statements a function beside the program corrects while it runs.
        run_time_module: file with that function.
    """

    model_config = ConfigDict(protected_namespaces=(), populate_by_name=True)
    model: str | None = None
    robot: str | None = None
    side_files: Annotated[list[str] | None, Field(alias="with")] = None
    alone: bool | None = None
    force: Vec3 | None = None
    moment: Vec3 | None = None
    force_on: Literal["all", "arc"] | None = None
    inertia: bool | None = None
    tolerance_mm: Positive | None = None
    air_tolerance_mm: Positive | None = None
    scope: Literal["all", "welds"] | None = None
    run_time: Literal["off", "where-needed", "all"] | None = None
    run_time_module: str | None = None
    allow_partial: bool | None = None
    largest_correction_mm: Positive | None = None
    template: str | None = None
    taught: Annotated[list[str] | None, Field(validation_alias=AliasChoices("taught", "constant"))] = None
    wobj_taught: list[str] | Literal["all"] | None = None
    already: list[Literal["geometry", "gravity", "force", "tool", "inertia"]] | None = None
    channel: dict[str, float] | None = None
    cell: str | None = None
    free_axes: Annotated[str, Field(pattern="^[a-f]*$")] | None = None


class FitChoices(FileTable):
    """What ``fit`` takes.

    Args:
        effects: keys of the effects to fit.
        mounting: roll, pitch, yaw of the base in the world [deg].
    """

    effects: list[str] | None = None
    mounting: Vec3 | None = None


class BatchChoices(FileTable):
    """What ``batch`` takes.

    Args:
        workers: processes on this machine.
    """

    workers: Annotated[int, Field(ge=1)] | None = None


class SettingsFile(StatedSettings):
    """The keys of ``postproc.toml``: those of a jobs file, except what runs code, and tables of single commands.

    Args:
        fit: for ``postproc fit``.
        batch: for ``postproc batch``.
    """

    fit: FitChoices = FitChoices()
    batch: BatchChoices = BatchChoices()


def with_choices(settings: Settings, choices: StatedSettings, root: Path, origin: str = "") -> Settings:
    """Return the settings overridden by what an inner layer states.

    A layer that names an arm, by its name or with a model, replaces all that outer layers say of the arm.

    Args:
        choices: what the inner layer states. root: folder at which its relative paths start.
        origin: its name for people; empty for the command line.
    """
    named = {key: value for key in StatedSettings.model_fields if (value := getattr(choices, key)) is not None}
    given = {key: named[key] for key in SAME if key in named}
    given |= {f"{key}_m": 1e-3 * named[f"{key}_mm"] for key in LENGTHS if f"{key}_mm" in named}
    lists = ((key, named[key]) for key in ("taught", "wobj_taught", "already") if key in named)
    given |= {key: (value,) if isinstance(value, str) else tuple(value) for key, value in lists}
    paths = (("template", "template_dir"), ("run_time_module", "run_time_module"))
    given |= {option: root / named[key] for key, option in paths if key in named}
    given |= {"channels": tuple(named["channel"].items())} if "channel" in named else {}
    options = replace(settings.options, **given)
    chosen = replace(settings, options=options)
    if choices.model == CONTROLLER_MODEL and choices.robot is None:
        chosen = replace(chosen, model=None, from_controller=True)
    elif choices.model is not None or choices.robot is not None:
        own = choices.model == CONTROLLER_MODEL
        chosen = replace(
            chosen,
            model=None if choices.model is None or own else root / choices.model,
            from_controller=own,
            robot=None if choices.robot is None else in_folder(root, choices.robot),
            robot_from=origin or ("--model" if choices.robot is None else "--robot"),
        )
    stated = {StatedSettings.model_fields[key].alias or key for key in named}
    stated |= {"model", "robot"} if stated & {"model", "robot"} else set()
    chosen = replace(chosen, inherited=tuple((key, text) for key, text in settings.inherited if key not in stated))
    if choices.cell is not None:
        chosen = replace(chosen, cell=root / choices.cell)
    if choices.alone is not None:
        chosen = replace(chosen, alone=choices.alone)
    if choices.side_files is not None:
        chosen = replace(chosen, side_files=tuple(root / path for path in choices.side_files))
    return chosen


def in_folder(root: Path, name: str) -> str:
    """Return the path of an arm's file in a folder if there is one; else the name as it is, for the library."""
    return str(root / name) if (root / name).suffix and (root / name).is_file() else name


def find_settings(place: Path) -> tuple[Path, SettingsFile] | None:
    """Return path and content of the nearest ``postproc.toml``, from a folder upwards; None where there is none.

    Args:
        place: the folder.

    Raises:
        PostprocError: CLI014, it cannot be read, or a key or value in it does not fit.
    """
    for folder in _searched(place.absolute()):
        path = folder / NAME
        if os.path.lexists(path):
            shown = Path(os.path.relpath(path)) if path.is_relative_to(Path.cwd()) else path
            source = read_source(shown, "CLI014")
            content = parse_toml(source, "CLI014")
            batch = content.get("batch")
            if isinstance(batch, dict) and "scheduler" in batch:
                text = "`scheduler` is taken from the command line alone: its machines run code as you"
                at = span_of(source, ("batch", "scheduler"))
                raise PostprocError.of("CLI014", text, source, at, "take it out, and write `--scheduler ADDRESS`")
            return shown, check(SettingsFile, content, source, "CLI014")
    return None


def _searched(here: Path) -> Iterator[Path]:
    """Yield a folder and those above it, up to the root of its repository or the user's home.

    Folders above it that anybody may write to are left out.

    Args:
        here: the folder.
    """
    home = real(Path.home())
    for folder in (here, *here.parents):
        if folder == here or not _anybody_writes(folder):
            yield folder
        if os.path.lexists(folder / ".git") or real(folder) == home:
            return


def _anybody_writes(folder: Path) -> bool:
    """Tell whether every user may write to a folder."""
    try:
        return bool(folder.stat().st_mode & stat.S_IWOTH)
    except OSError:
        return False


def settings_at(place: Path) -> Settings:
    """Return the settings that the nearest ``postproc.toml`` states for a folder; defaults where there is none.

    Args:
        place: the folder.
    """
    found = find_settings(place)
    if found is None:
        return Settings()
    path, choices = found
    stated = choices.model_dump(mode="json", exclude={"fit", "batch"}, exclude_none=True)
    keys = {key: field.alias or key for key, field in StatedSettings.model_fields.items()}
    inherited = tuple((keys[key], json.dumps(value, ensure_ascii=False)) for key, value in stated.items())
    return replace(with_choices(Settings(stated_in=(path,)), choices, path.parent, str(path)), inherited=inherited)
