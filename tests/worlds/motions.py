"""Motion instructions: arguments (RL signatures), goals in the base, searches, triggers and synchronised procedures."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

import numpy as np

from tests.worlds.geometry import flange
from tests.worlds.outside import later
from tests.worlds.state import plain, with_offsets
from tests.worlds.syntax import Arg
from tests.worlds.values import Fault, RapidError, matrix_pose, pose_matrix, predefined

if TYPE_CHECKING:
    from tests.worlds.interpreter import Interpreter

ERR_WHLSEARCH = predefined()["err_whlsearch"][1]
TYPES = {
    "to": "robtarget",
    "cir": "robtarget",
    "joints": "jointtarget",
    "speed": "speeddata",
    "zone": "zonedata",
    "tool": "tooldata",
}


def _roles() -> dict[str, list[str]]:
    line, out = "to speed zone tool", {}
    for shape, start in (("l", line), ("j", line), ("c", f"cir {line}")):
        out[f"move{shape}"] = start
        for signal in ("do", "ao", "go"):
            out[f"move{shape}{signal}"] = f"{start} signal value"
        out[f"move{shape}sync"] = f"{start} procedure"
        out[f"trigg{shape}"] = start.replace("speed", "speed trigger")
        out[f"search{shape}"] = start.replace("cir", "signal point cir") if shape == "c" else f"signal point {start}"
        out[f"search{shape}"] = out[f"search{shape}"].replace(" zone", "")
    for shape, start in (("l", line), ("c", f"cir {line}")):
        for end in ("", "start", "end"):
            out[f"arc{shape}{end}"] = start.replace("speed", "speed seam weld")
        out[f"cap{shape}"] = start.replace("speed", "speed cap weavestart weave")
    out["moveabsj"] = "joints speed zone tool"
    out["moveextj"] = "joints speed zone"
    return {name: roles.split() for name, roles in out.items()}


ROLES = _roles()


def family(name: str) -> str:
    """J, L, C, A: the way on which the instruction leads the tool."""
    if name in ("moveabsj", "moveextj"):
        return "A"
    return re.sub(r"^(move|trigg|search|arc|cap)", "", name)[0].upper()


def move(task: Interpreter, name: str, arguments: tuple[Arg, ...], line: int) -> None:
    given = [a.value for a in arguments if a.kind in ("pos", "named")]
    roles = ROLES[name]
    if len(given) != len(roles):
        raise Fault(f"line {line}: `{name}` has {len(given)} arguments, not {len(roles)}")
    at = dict(zip(roles, given, strict=True))
    if at.get("to", ("",))[0] == "star":
        raise Fault("a target `*` has no value in the text")
    value = {role: task.evaluate(at[role], TYPES[role]) for role in roles if role in TYPES and at[role] is not None}
    state, options = task.motion, {a.name: a for a in arguments if a.kind in ("opt", "cond")}
    wobj = predefined()["wobj0"][1]
    if "wobj" in options and (given_wobj := options["wobj"].value) is not None and not _absent(task, options["wobj"]):
        wobj = task.evaluate(given_wobj, "wobjdata")
    tool = value.get("tool", state.tool)
    said: dict[str, Any] = {
        "family": family(name),
        "speed": value["speed"],
        "zone": value.get("zone"),
        "tool": tool,
        "wobj": wobj,
    }
    frame = state.frame(task, wobj)
    start = state.pose @ pose_matrix(tool[1])
    if "joints" in value:
        goal = flange(value["joints"][0]) @ pose_matrix(tool[1])
        said |= {"joints": value["joints"][0], "extax": value["joints"][1], "conf": None}
    else:
        goal = frame @ pose_matrix(value["to"])
        said |= {"conf": value["to"][2], "extax": with_offsets(task, value["to"][3])}
        if "cir" in value:
            said["via"] = frame @ pose_matrix(value["cir"])
    if name.startswith("search"):
        goal = _search(task, at, start, goal, frame, value["to"])
    said |= {"start": start, "goal": goal, "frame": frame}
    for extra in ("value", "signal"):
        if extra in at and not name.startswith("search"):
            said[extra] = at[extra][1] if extra == "signal" else task.evaluate(at[extra])  # type: ignore[index, arg-type]
    said["options"] = {k: plain(task, a) for k, a in options.items() if k != "wobj" and not _absent(task, a)}
    for role in ("seam", "weld"):
        if role in at and at[role] is not None:
            said[role] = plain(task, Arg("pos", "", at[role]))
    task.log(name, line, said, motion=True)
    state.pose, state.tool, state.wobj = goal @ np.linalg.inv(pose_matrix(tool[1])), tool, wobj
    if said["conf"] is not None:
        state.conf = list(said["conf"])
    state.extax = list(said["extax"])
    _meanwhile(task, at, options, line)


def _absent(task: Interpreter, a: Arg) -> bool:
    return a.kind == "cond" and a.value is not None and a.value[1] in task.frames[-1].absent


def _meanwhile(task: Interpreter, at: dict[str, Any], options: dict[str, Arg], line: int) -> None:
    """What happens underway: MoveLSync's procedure (its name in a string), the interrupts of TriggL."""
    if "procedure" in at:
        name = str(task.evaluate(at["procedure"], "string")).lower()
        if task.inserted:
            raise Fault("an added motion calls a procedure")
        later(task, lambda: task.call(name, (), line), name)
    for e in [at.get("trigger"), *(options[k].value for k in sorted(options) if re.fullmatch(r"t\d", k))]:
        if e is not None and e[0] == "ref":
            ref = task.ref(e)
            run = task.motion.trigger.get(f"{ref.name}/{ref.key}")
            if run is not None and task.world.traps and not task.inserted:
                later(task, run, "trigger")


def _search(task: Interpreter, at: dict[str, Any], start: Any, goal: Any, frame: Any, to: Any) -> Any:
    """The arm stops where it meets the work: a plane across the way, at one place in space for both programs.

    Without contact: ERR_WHLSEARCH, and the arm has gone the whole way.
    """
    key = (str(at["signal"][1]), task.here)
    if key not in task.world.found:
        r = task.world.random("search", *key)
        missed = task.world.unknown and r.random() < 0.25
        where = start[:3, 3] + r.uniform(0.2, 0.9) * (goal[:3, 3] - start[:3, 3])
        task.world.found[key] = None if missed else (where, goal[:3, 3] - start[:3, 3])
    plane = task.world.found[key]
    way = goal[:3, 3] - start[:3, 3]
    t = 2.0 if plane is None else float((plane[0] - start[:3, 3]) @ plane[1]) / max(1e-9, float(way @ plane[1]))
    if not 0 <= t <= 1:
        task.log("search", -1, {"missed": True})
        task.motion.pose = goal @ np.linalg.inv(pose_matrix(task.evaluate(at["tool"], "tooldata")[1]))
        raise RapidError(ERR_WHLSEARCH)
    hit = goal.copy()
    hit[:3, 3] = start[:3, 3] + t * way
    task.ref(at["point"]).set([*matrix_pose(np.linalg.inv(frame) @ hit), to[2], to[3]], task.records)
    return hit
