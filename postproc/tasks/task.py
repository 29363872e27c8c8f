"""A task of a controller, or files that run together without one, and the settings that its arm completes."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from postproc.diagnostics import Diagnostic, Source
from postproc.robot.controller import Drive, read_quietly
from postproc.settings import Settings, corrected_twice

if TYPE_CHECKING:
    from postproc.rapid.data.records import Ax6
    from postproc.robot.cells.station import Station

CONTROLLER = "the controller's configuration"


@dataclass(frozen=True, slots=True)
class OtherTask:
    """Another task of the same controller, with which a task shares PERS data.

    Args:
        files: relative to the root. units: names, in lower case, of the mechanical units that it moves.
    """

    files: tuple[str, ...]
    units: frozenset[str] = frozenset()


@dataclass(frozen=True, slots=True)
class Task:
    """Files that run together; all paths are relative to ``root``, with forward slashes.

    Args:
        name: its folder or file.
        files: its program files. shared: files it reads and must not change. others: other tasks of its controller.
        backup: the controller's backup that it is part of.
        drive: what it moves, where a controller's configuration says so.
        station: the arm of that in its cell, without positions of units that other tasks move.
        findings: what is wrong with it as it was read; an error keeps it from being converted.
    """

    name: str
    files: tuple[str, ...]
    root: Path = Path()
    shared: tuple[str, ...] = ()
    others: tuple[OtherTask, ...] = ()
    backup: Path | None = None
    drive: Drive | None = None
    station: Station | None = None
    findings: tuple[Diagnostic, ...] = ()

    @property
    def robot(self) -> str | None:
        """Library name of the arm that it drives; None where nothing says which."""
        return None if self.drive is None else self.drive.arm

    @property
    def unknown(self) -> Diagnostic | None:
        """Why that arm is not known: an error where the settings name neither an arm nor a model."""
        return None if self.drive is None else self.drive.unknown

    @property
    def paths(self) -> list[Path]:
        """Its files and those that it shares."""
        return [self.root / name for name in (*self.files, *self.shared)]


def with_arm(settings: Settings, task: Task, bare: bool = False) -> Settings:
    """Return the settings with the arm of the task's controller where they name none, and with its station.

    The programs of other tasks are executed for the places of their units, unless the task is refused because its
    controller already corrects the arm.

    Args:
        bare: the program is only inspected, so it is not refused.
    """
    if not settings.names_arm and task.robot is not None:
        settings = replace(settings, robot=task.robot, robot_from=CONTROLLER)
    if task.station is None:
        return settings
    refused = not bare and corrected_twice(settings, task.station)
    return replace(settings, station=task.station if refused else _with_units_of_others(task.station, task))


def _with_units_of_others(station: Station, task: Task) -> Station:
    """Return the station with the positions of other tasks' units that the task's files name.

    A unit has a position if the programs that move it leave it at only one.
    """
    from postproc.motion.path.places import resting_place
    from postproc.rapid.execution.walk import walk
    from postproc.rapid.program.program import read_program

    foreign = station.cell.units.keys() - {name.lower() for name in station.units} if station.connected else set()
    text = b"".join(read_quietly(task.root / name).lower() for name in task.files) if foreign else b""
    named = {unit for unit in foreign if f'"{unit}"'.encode("latin-1", "replace") in text}
    standing: dict[str, Ax6] = {}
    for other in task.others:
        if units := named & other.units:
            sources = [Source(str(task.root / name), read_quietly(task.root / name)) for name in other.files]
            standing |= dict.fromkeys(units, resting_place(walk(read_program(sources))))
    return replace(station, standing=standing)
