"""The executed motion of a weld program, by the interpreter of ``tests/worlds``; metres and radians leave it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from tests.independent.rapid_text import MOVES, split_arguments
from tests.worlds.geometry import matrix_of_quaternion, quaternion_of_matrix
from tests.worlds.interpreter import Interpreter, load
from tests.worlds.syntax import Module, SyntaxFault
from tests.worlds.task import Event
from tests.worlds.values import Fault, pose_matrix
from tests.worlds.world import World


@dataclass(frozen=True)
class Motion:
    """One executed motion statement, in base coordinates [m].

    Args:
        name: instruction in small letters; kind: J, L, C or A; line: of the statement.
        goal, via: (4, 4) T_base_tcp, of a stationary tool T_flange_tcp; q: (6,) [rad] for MoveAbsJ; conf of the goal.
        tool: (4, 4) T_flange_tcp, of a stationary tool T_base_tcp.
        mass [kg] and center (3,) [m] in tool0 of tool (or of the gripper that holds the work) plus grip load.
        zone: corner radius [m], 0 at stop points; fine; weld: the arc burns on the way to this goal.
        positional, optional: argument texts.
        axes: (6,) external axes of the target as it states them; unit: that moves the work object, empty for none. The
            work then stands in the frame of the unit, not in the base.
    """

    name: str
    kind: str
    line: int
    goal: np.ndarray
    via: np.ndarray | None
    q: np.ndarray | None
    conf: tuple[int, ...]
    tool: np.ndarray
    mass: float
    center: np.ndarray
    zone: float
    fine: bool
    weld: bool
    positional: tuple[str, ...]
    optional: dict[str, str] = field(default_factory=dict)
    stationary: bool = False
    axes: np.ndarray = field(default_factory=lambda: np.full(6, 9e9))
    unit: str = ""


def quaternion_matrix(q: Any) -> np.ndarray:
    return matrix_of_quaternion(q)


def matrix_quaternion(r: np.ndarray) -> np.ndarray:
    """(w, x, y, z) with w >= 0."""
    return np.array(quaternion_of_matrix(r))


def pose(p: Any) -> np.ndarray:
    """(4, 4) [m] from a RAPID pose or robtarget in mm."""
    return metres(pose_matrix(p))


def metres(mm: np.ndarray) -> np.ndarray:
    return np.vstack([np.hstack([mm[:3, :3], mm[:3, 3:] / 1000]), mm[3:]])


def motions(text: str) -> tuple[list[Motion], list[tuple[int, str]]]:
    """Executed motion of a module's text from `main`, or from all routines that nothing calls; what cannot be run (line, why)."""
    found: list[Motion] = []
    lost: list[tuple[int, str]] = []
    try:
        modules = load([text])
        task = Interpreter(modules, World(0))
        for entry in ["main"] if "main" in task.routines else _uncalled(modules):
            task.frames = []
            task.run(entry)
        if task.stopped not in ("", "EXIT"):
            lost.append((0, task.stopped))
    except (Fault, SyntaxFault) as error:
        return [], [(0, str(error))]
    texts = {(r.name, s.index): s.words for m in modules for r in m.routines for s in r.flat}
    grip: Any = None
    for e in task.events:
        if e.name == "gripload":
            grip = e.values["load"]
        elif e.motion and MOVES.fullmatch(e.name):
            if bool(e.values["tool"][0]) == bool(e.values["wobj"][0]):
                lost.append((e.line, "tool and work object are both held, or neither is"))
            else:
                found.append(motion_of(e, texts[e.identity[1:]], grip))
    return found, lost


def _uncalled(modules: list[Module]) -> list[str]:
    routines = [r for m in modules for r in m.routines]
    called = {s.parts["name"] for r in routines for s in r.flat if s.kind == "call"}
    return [r.name for r in routines if r.kind == "proc" and r.name not in called and not r.parameters]


def motion_of(e: Event, text: str = "", grip: Any = None) -> Motion:
    """A motion event; text: of its statement; grip: load that the gripper holds."""
    tool, wobj, zone = e.values["tool"], e.values["wobj"], e.values["zone"]
    kind = e.values["family"]
    tframe, mass, center = pose(tool[1]), float(tool[2][0]), np.asarray(tool[2][1], float) / 1000
    unit = "" if wobj[1] else str(wobj[2])
    stands = np.linalg.inv(pose(wobj[3])) if unit else np.eye(4)
    if grip is not None and grip[0] > 0.001:
        holds = tframe if tool[0] else stands @ pose(wobj[3]) @ pose(wobj[4])
        extra = (holds @ np.array([*(np.asarray(grip[1], float) / 1000), 1.0]))[:3]
        center, mass = (mass * center + grip[0] * extra) / (mass + grip[0]), mass + grip[0]
    positional, optional = split_arguments(text.rstrip(" ;").partition(" ")[2])
    return Motion(
        e.name, kind, e.line,
        np.eye(4) if kind == "A" else stands @ metres(e.values["goal"]),
        stands @ metres(e.values["via"]) if "via" in e.values else None,
        np.radians(e.values["joints"]) if kind == "A" else None,
        tuple(int(c) for c in e.values["conf"] or (0, 0, 0, 0)),
        tframe, mass, center, 0.0 if zone[0] else float(zone[1]) / 1000, bool(zone[0]),
        e.name.startswith("arc") and not e.name.endswith("start"),
        tuple(positional), optional, not tool[0], np.array([9e9 if x > 8e9 else x for x in e.values["extax"]]), unit,
    )  # fmt: skip
