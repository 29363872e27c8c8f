"""Settings from files: what ``postproc.toml``, the command line, a jobs file or a job of it states; the inner wins."""

from __future__ import annotations

import json
import os
import stat
from collections.abc import Iterator, Mapping
from dataclasses import fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import AliasChoices, ConfigDict, Field, create_model

from postproc.compensation.options import Options
from postproc.diagnostics import PostprocError
from postproc.files import read_source, real, short_path
from postproc.rapid.data.records import Vec3
from postproc.settings import NAME, USER_OPTIONS, Settings
from postproc.tomlfile import FileTable, Positive, check, parse_toml, span_of

CONTROLLER_MODEL = "controller"
"""What names the controller's own numbers in place of a model file."""
IN_FILES: Mapping[Any, Any] = {
    float: Positive,
    str: Annotated[str, Field(pattern="^[a-f]*$")],
    Path | None: str,
    tuple[Path, ...]: tuple[str, ...],
}
"""Types of keys where they are not those of the fields: lengths [mm], letters of axes, paths."""


class _Layer(FileTable):
    """What one layer states; None is left to the layers around it. Paths start at the file that states them."""

    model_config = ConfigDict(protected_namespaces=(), defer_build=True)  # most programs have no such file

    def stated(self) -> dict[str, Any]:
        """Return what the layer states of a conversion, by the names of `USER_OPTIONS`."""
        values = {option.name: getattr(self, option.name, None) for option in USER_OPTIONS}
        return {name: value for name, value in values.items() if value is not None}


def _keys(files: str) -> dict[str, Any]:
    """Return the keys of settings files, or those of jobs files beside them, as ``create_model`` takes them."""
    keys = {}
    for option in (option for option in USER_OPTIONS if option.files == files):
        kind = option.in_files or IN_FILES.get(option.type, option.type)
        former = (option.also,) if option.also.isidentifier() else ()
        names = AliasChoices(option.key, *former) if former else option.key
        text = " ".join(option.description(command_line=False).split())
        declared = Field(alias=option.key, validation_alias=names, description=text)
        keys[option.name] = (Annotated[kind | None, declared], None)
    return keys


if TYPE_CHECKING:
    StatedSettings = _Layer
    StatedJob = _Layer
else:
    StatedSettings = create_model("StatedSettings", __base__=_Layer, **_keys("settings"))
    StatedJob = create_model("StatedJob", __base__=StatedSettings, **_keys("jobs"))


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


def with_choices(settings: Settings, stated: Mapping[str, Any], root: Path, origin: str = "") -> Settings:
    """Return the settings overridden by what an inner layer states.

    A layer that names an arm, by its name or with a model, replaces all that outer layers say of the arm.

    Args:
        stated: what the inner layer states, by the names of `USER_OPTIONS`. root: where its relative paths start.
        origin: its name for people; empty for the command line.
    """
    chosen = {o.name: o.value(stated[o.name], root) for o in USER_OPTIONS if o.name in stated}
    keys = {o.key for o in USER_OPTIONS if o.name in stated}
    if keys & {"model", "robot"}:
        keys |= {"model", "robot"}
        chosen["from_controller"] = str(stated.get("model")) == CONTROLLER_MODEL
        chosen["model"] = None if chosen["from_controller"] else chosen.get("model")
        if "robot" in stated or not chosen["from_controller"]:
            chosen["robot"] = in_folder(root, stated["robot"]) if "robot" in stated else None
            chosen["robot_from"] = origin or ("--robot" if "robot" in stated else "--model")
    chosen["inherited"] = tuple((key, text) for key, text in settings.inherited if key not in keys)
    inner = {field.name: chosen.pop(field.name) for field in fields(Options) if field.name in chosen}
    return replace(settings, options=replace(settings.options, **inner), **chosen)


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


def _searched(place: Path) -> Iterator[Path]:
    """Yield a folder and those above it, up to the root of its repository or the user's home.

    Folders above it that anybody may write to are left out.

    Args:
        place: the folder.
    """
    home = real(Path.home())
    for folder in (place, *place.parents):
        if folder == place or not _anybody_writes(folder):
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
    nearest = find_settings(place)
    if nearest is None:
        return Settings()
    path, file = nearest
    stated = file.stated()
    inherited = [(o.key, json.dumps(stated[o.name], ensure_ascii=False)) for o in USER_OPTIONS if o.name in stated]
    chosen = with_choices(Settings(stated_in=(path,)), stated, path.parent, short_path(path, place))
    return replace(chosen, inherited=tuple(inherited))
