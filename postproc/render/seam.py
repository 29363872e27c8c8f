"""A weld module out of seam points: approach, arc on, seam, arc off, departure.

Axes 1 to 3 stand as far from joint limits and a straight wrist as they can. Of the two wrists that go with them the one
whose axes 4 and 6 turn fewer quarters from zero is taken: the hose is laid out with both at zero.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array, full_turns
from postproc.compensation.text.values import TargetValue
from postproc.diagnostics import Diagnostic, PostprocError, Source, has_errors
from postproc.rapid.data.events import MotionEvent
from postproc.rapid.data.records import NO_AXIS, Pose
from postproc.rapid.execution.walk import walk
from postproc.rapid.motions.units import flange_matrix, matrix_pose
from postproc.rapid.program.program import read_program
from postproc.render.seampoints import SeamPoints
from postproc.render.templates import environment, fill, load_template
from postproc.robot.arm import Robot
from postproc.robot.closed_form import inverse
from postproc.robot.configuration import QUARTER, TURNING, confdata
from postproc.robot.pose import transform
from postproc.robot.track import track

ROUTINE_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,31}")
ARCDATA = "[0,0,0,0,0,0,0,0,0]"  # arcdata
SAME_POSTURE = 1e-6  # [rad]


@dataclass(frozen=True)
class SeamOptions:
    """What the module states besides its points; data as ``name:=value``, or a name alone if declared elsewhere.

    Args:
        tool, wobj, seam, weld: RAPID data; None takes a default that is stated in the module.
        speed_mm_s: welding speed where the table gives none.
        clearance_mm: how far in front of the seam, against the tool's z, the arm arrives and leaves.
    """

    module: str = "Seam"
    routine: str = "main"
    tool: str | None = None
    wobj: str | None = None
    seam: str | None = None
    weld: str | None = None
    speed_mm_s: float = 8.0
    clearance_mm: float = 50.0


@dataclass(frozen=True, slots=True)
class _SeamData:
    """A RAPID data declaration: storage class, type, name, and value text, None if it is declared elsewhere."""

    storage: str
    type: str
    name: str
    value: str | None


def seam_module(
    points: SeamPoints,
    robot: Robot,
    T_flange_tcp: Array,
    options: SeamOptions,
    side_files: Sequence[Source] = (),
    *,
    templates: Path | None = None,
) -> tuple[bytes, tuple[str, ...]]:
    """The RAPID module that welds a seam, not yet compensated, and notes on the defaults that were used.

    Args:
        T_flange_tcp: (4, 4) tool frame [m] where the options name no tool.
        side_files: modules that declare data which the options name.
        templates: folder with templates of the user.

    Raises:
        PostprocError: SEA007 data that cannot be used, SEA008 points out of reach, SEA009 no configuration for all of
            them; what the reader finds in the data.
    """
    data, notes = _data(options, T_flange_tcp)
    welds, speed_index = _welds(data["weld"], points, side_files)
    placed = _placed(points, options.clearance_mm)
    template = load_template(environment(templates), "seam_module.j2")
    gaps = np.linalg.norm(np.diff(points.place_mm, axis=0), axis=1)
    zone = "z1" if gaps.min() >= 2.0 else "z0"

    def text(conf: Sequence[Sequence[int]]) -> bytes:
        """The module's text with these configurations (n, 4) of approach, points and departure."""
        targets = [
            TargetValue(pose, (c[0], c[1], c[2], c[3]), (NO_AXIS,) * 6) for pose, c in zip(placed, conf, strict=True)
        ]
        count = len(points.place_mm)
        return fill(template, {
            "module": options.module, "routine": options.routine, "origin": Path(points.source.path).name,
            "notes": notes, "declarations": [d for d in (data["tool"], data["wobj"], data["seam"], *welds) if d.value],
            "tool": data["tool"].name, "wobj": data["wobj"].name, "seam": data["seam"].name,
            "approach": targets[0], "depart": targets[-1],
            "points": [
                {
                    "name": f"p{10 * (i + 1)}", "target": targets[i + 1], "weld": welds[speed_index[i]].name,
                    "instruction": "ArcLStart" if i == 0 else "ArcLEnd" if i == count - 1 else "ArcL",
                    "zone": "fine" if i in (0, count - 1) else zone,
                }
                for i in range(count)
            ],
        }).encode("latin-1", "replace") + b"\n"  # fmt: skip

    events = _read(Source(f"{options.module}.mod", text([(0, 0, 0, 0)] * len(placed))), side_files, len(placed))
    T_base_flange = np.stack([flange_matrix(event) for event in events])
    conf = seam_configuration(robot, T_base_flange)
    if conf is None:
        raise PostprocError(_no_way(points, robot, T_base_flange), exit_code=1)
    return text(conf.tolist()), tuple(notes)


def _data(options: SeamOptions, T_flange_tcp: Array) -> tuple[dict[str, _SeamData], list[str]]:
    """The data declarations of the module by role (tool, wobj, seam, weld), and a note on each default.

    SEA007 where there is no tool, or a text is no such data. T_flange_tcp: (4, 4) [m], for options without a tool.
    """
    if options.tool is None and np.allclose(T_flange_tcp, np.eye(4)):
        text, help_ = (
            "no tool is given, and the model has none",
            "give --tool ROUTINE_NAME:=[..], or a tool in the model file",
        )
        raise PostprocError.of("SEA007", text, help=help_)
    frame = matrix_pose(T_flange_tcp)
    numbers = [",".join(f"{v:.{d}f}" for v in part) for part, d in ((frame.trans, 3), (frame.rot, 7))]
    frame_text = f"[[{numbers[0]}],[{numbers[1]}]]"
    defaults = {
        "tool": ("PERS", "tooldata", f"tTorch:=[TRUE,{frame_text},[0.001,[0,0,0.001],[1,0,0,0],0,0,0]]",
                 "tool: frame of the model, its weight is not known"),
        "wobj": ("TASK PERS", "wobjdata", "wobj0", "work object: wobj0, points in the base frame"),
        "seam": ("PERS", "seamdata", f"sm1:=[0.5,0.5,{ARCDATA},0,0,0,0,0,{ARCDATA},0,0,{ARCDATA},0,0,{ARCDATA},0.5]",
                 "seam data: half a second of gas before and after, the rest is to be set"),
        "weld": ("PERS", "welddata", f"wd1:=[{options.speed_mm_s:g},0,{ARCDATA},{ARCDATA}]",
                 "weld data: speed alone, current and voltage are to be set"),
    }  # fmt: skip
    data, notes = {}, []
    for role, (storage, type_, default, note) in defaults.items():
        stated = getattr(options, role)
        if stated is None:
            notes.append(note)
        name, assigned, value = (default if stated is None else stated).partition(":=")
        name, value = name.strip(), value.strip().rstrip(";").strip()
        if not ROUTINE_NAME.fullmatch(name) or (assigned and not value.startswith("[")):
            text, help_ = f"`{stated}` is not a {type_}", f"write it as in RAPID: {default}"
            raise PostprocError.of("SEA007", text, help=help_)
        data[role] = _SeamData(storage, type_, name, value or None)
    return data, notes


def _welds(weld: _SeamData, points: SeamPoints, side_files: Sequence[Source]) -> tuple[list[_SeamData], list[int]]:
    """Weld data declarations, one for each speed of the table, and for each point the index of the one that it uses.

    The value of ``weld`` is copied with other speeds; SEA007 where it is not known, or the name is too long.
    """
    if points.speed_mm_s is None:
        return [weld], [0] * len(points.place_mm)
    speeds, index = np.unique(points.speed_mm_s, return_inverse=True)
    declared = read_program(side_files).declaration(weld.name) if weld.value is None else None
    value = weld.value
    if declared is not None and declared.init is not None:
        value = declared.source.data[slice(*declared.init)].decode("latin-1")
    if value is None:
        text = f"the table gives speeds, and the value of `{weld.name}`, which has one too, is not known"
        help_ = "give its value, or the file that declares it (`--with`), or take the column out"
        raise PostprocError.of("SEA007", text, points.source, help=help_)
    if len(weld.name) + len(f"_{len(speeds)}") > 32:
        text = f"the name `{weld.name}` leaves no room for a number"
        raise PostprocError.of("SEA007", text, help="RAPID names have at most 32 characters")
    alone = len(speeds) == 1 and weld.value is not None
    names = [weld.name] if alone else [f"{weld.name}_{i + 1}" for i in range(len(speeds))]
    values = [re.sub(r"^\[\s*[^,\]]+", f"[{speed:g}", value, count=1) for speed in speeds]
    return [_SeamData(weld.storage, weld.type, n, v) for n, v in zip(names, values, strict=True)], index.tolist()


def _placed(points: SeamPoints, clearance_mm: float) -> list[Pose]:
    """Approach, points and departure as poses [mm] in the frame of the work object.

    Approach and departure lie ``clearance_mm`` back along the tool's z from the first and the last point.
    """
    T = transform(points.place_mm * 1e-3, points.rotation)
    ends = T[[0, -1]].copy()
    ends[:, :3, 3] -= clearance_mm * 1e-3 * ends[:, :3, 2]
    return [matrix_pose(pose) for pose in (ends[0], *T, ends[1])]


def _read(source: Source, side_files: Sequence[Source], count: int) -> list[MotionEvent]:
    """The motion events of a draft of the module, run as a program; they must be ``count``.

    Raises:
        PostprocError: findings of the reader, without a place in the module, as the draft is not written.
    """
    program = read_program([source, *side_files])
    events = [e for e in walk(program) if e.statement.source is source]
    findings = [*program.diagnostics, *(d for event in events for d in event.diagnostics)]
    if has_errors(findings) or len(events) != count:
        # Nobody can look into a module that is never written: its findings are about what the options name.
        without_place = [replace(d, source=None, span=None) if d.source is source else d for d in findings]
        raise PostprocError(dict.fromkeys(without_place))
    return events


def _no_way(points: SeamPoints, robot: Robot, T_base_flange: Array) -> list[Diagnostic]:
    """SEA008 for each pose out of reach, or SEA009 if all can be reached but not in one configuration.

    Args:
        T_base_flange: (n + 2, 4, 4) poses of approach, points and departure.
    """
    last = len(points.rows)
    ways = []
    for i in unreachable(robot, T_base_flange).tolist():
        index = min(max(i - 1, 0), last - 1)
        what = f"`{robot.name}` cannot reach it"
        if i in (0, last + 1):
            what = f"`{robot.name}` cannot reach the {'approach' if i == 0 else 'departure'} in front of it"
        ways.append(points.finding("SEA008", index, what, "check the work object, the tool and the unit of the points"))
    if ways:
        return ways
    text = f"no configuration of `{robot.name}` holds for the whole seam"
    return [Diagnostic("SEA009", "error", text, points.source, help="divide the seam, or turn the part or the torch")]


def seam_configuration(robot: Robot, T_base_flange: Array) -> NDArray[np.int64] | None:
    """Confdata (n, 4) for flange poses (n, 4, 4) passed one after the other; None if no configuration suits all.

    Of those that do, axes 1 to 3 are farthest from joint limits and a straight wrist, and axes 4 and 6 turned least.

    Raises:
        PostprocError: KIN005, the arm does not stand as ABB arms do at zero.
    """
    postures: list[tuple[float, Array]] = []  # with the smallest distance from a joint limit or a straight wrist
    middle = (robot.lower + robot.upper) / 2
    for start in inverse(robot, T_base_flange[:1])[0]:
        if np.isnan(start).any():
            continue
        try:
            q = track(robot, T_base_flange, start)
        except PostprocError:  # this branch ends on the way
            continue
        # Axes 1, 4 and 6 by whole turns so that the path lies nearest to mid-range.
        q[:, TURNING] += full_turns((q.min(axis=0) + q.max(axis=0)) / 2, near=middle)[TURNING]
        limits = np.minimum(q - robot.lower, robot.upper - q).min()
        room = float(min(limits, np.abs(np.sin(q[:, 4])).min()))
        if room > 0.0:
            postures.append((room, q))
    if not postures:
        return None
    roomy = max(postures, key=lambda way: way[0])[1]
    wrists = [(room, q) for room, q in postures if np.allclose(q[:, :3], roomy[:, :3], atol=SAME_POSTURE)]
    return confdata(robot, min(wrists, key=lambda way: (_quarters(way[1]), -way[0]))[1])


def unreachable(robot: Robot, T_base_flange: Array) -> NDArray[np.int64]:
    """Indices of flange poses (n, 4, 4) that the arm cannot take within its limits in any configuration."""
    q = inverse(robot, T_base_flange)
    turned = q.copy()
    turned[..., TURNING] += full_turns(q, near=(robot.lower + robot.upper) / 2)[..., TURNING]
    inside = np.all((turned >= robot.lower) & (turned <= robot.upper), axis=-1)
    return np.flatnonzero(~np.any(inside, axis=1))


def _quarters(q: Array) -> int:
    """Largest turn of axis 4 and of axis 6 from zero in q (n, 6) [rad], each in quarter turns rounded up, added."""
    return int(np.ceil(np.abs(q[:, [3, 5]]).max(axis=0) / QUARTER).sum())
