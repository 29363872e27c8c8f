"""Random but realistic weld programs.

Every target is reachable on the nominal arm, every line and arc keeps one branch inside the joint limits and away from
the wrist singularity, and confdata comes from this folder's own inverse kinematics.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from tests.independent import arm as A
from tests.independent import inverse as I
from tests.independent import paths as P
from tests.independent import rapid as R

MARGIN = np.radians(4.0)


class Retry(Exception):
    """The random draw leads where the arm cannot go."""


@dataclass
class Style:
    """How one programmer writes."""

    decimals: int
    digits: int
    comma: str
    no_axis: str
    eol: str
    indent: str
    upper: bool
    wobj: str
    header: bool
    attributes: str
    blank_before_wobj: str

    @staticmethod
    def draw(g: np.random.Generator) -> Style:
        return Style(
            decimals=int(g.choice([1, 2, 3, 4], p=[0.05, 0.5, 0.35, 0.1])),
            digits=int(g.choice([5, 6, 7, 9])),
            comma=str(g.choice([",", ", "])),
            no_axis=str(g.choice(["9E9", "9E+09", "9e9", "9E+9"], p=[0.5, 0.4, 0.05, 0.05])),
            eol=str(g.choice(["\n", "\r\n"])),
            indent=str(g.choice(["    ", "  ", "\t"], p=[0.6, 0.3, 0.1])),
            upper=bool(g.random() < 0.9),
            wobj="",
            header=bool(g.random() < 0.3),
            attributes=str(g.choice(["", "(SYSMODULE)", "(NOSTEPIN)"], p=[0.8, 0.1, 0.1])),
            blank_before_wobj=str(
                g.choice(["\\WObj:=", " \\WObj:=", ",\\WObj:=", "\\wobj:="], p=[0.6, 0.25, 0.1, 0.05])
            ),
        )


@dataclass(frozen=True)
class Ranges:
    """How far programs go: the pieces of a seam, turning per piece [deg], arcs, tool masses, the wrist's least angle [deg]."""

    pieces: tuple[int, ...] = (1, 1, 2, 3, 5, 8)
    turning: tuple[float, ...] = (0.0, 0.0, 3.0, 12.0)
    radius: tuple[float, float] = (0.03, 0.25)
    bend: tuple[float, float] = (25, 110)
    mass: tuple[float, float] = (1.5, 18)
    zones: tuple[str, ...] = ("z1", "z1", "z5", "z5", "z10", "z0", "fine")
    wrist: float = 10.0
    reach: tuple[float, float] = (0.85, 1.75)


@dataclass
class Program:
    """Declarations and statements as they grow, and the joint angles at the end of them."""

    g: np.random.Generator
    style: Style
    arm: A.Arm
    ranges: Ranges = field(default_factory=Ranges)
    data: list[str] = field(default_factory=list)
    routines: dict[str, list[str]] = field(default_factory=dict)
    q: np.ndarray | None = None
    counter: int = 10
    info: list[str] = field(default_factory=list)
    arrays: dict[str, list[str]] = field(default_factory=dict)

    def number(self, x: float, digits: int) -> str:
        text = f"{x:.{digits}f}"
        if self.style.digits != 9:
            text = text.rstrip("0").rstrip(".") if "." in text else text
        return "0" if float(text) == 0 else text

    def numbers(self, values: np.ndarray | list[float], digits: int) -> str:
        return "[" + self.style.comma.join(self.number(float(v), digits) for v in values) + "]"

    def robtarget(self, place: np.ndarray, turn: np.ndarray, conf: list[int] | np.ndarray) -> str:
        axes = "[" + self.style.comma.join([self.style.no_axis] * 6) + "]"
        cf = "[" + self.style.comma.join(str(int(c)) for c in conf) + "]"
        c = self.style.comma
        return f"[{self.numbers(place, self.style.decimals)}{c}{self.numbers(turn, self.style.digits)}{c}{cf}{c}{axes}]"

    def fresh(self, prefix: str = "p") -> str:
        self.counter += int(self.g.choice([1, 10]))
        return f"{prefix}{self.counter}"


def unit(v: np.ndarray) -> np.ndarray:
    return v / np.linalg.norm(v)


def random_turn(g: np.random.Generator, most_deg: float) -> np.ndarray:
    return A.rotation_vector(unit(g.normal(size=3)) * np.radians(g.uniform(0, most_deg)))


@dataclass
class Tool:
    name: str
    text: str
    frame: np.ndarray


@dataclass
class Fixture:
    name: str
    text: str
    frame: np.ndarray


def draw_tool(p: Program, k: int) -> Tool:
    g = p.g
    place = np.round([g.uniform(-80, 80), g.uniform(-60, 60), g.uniform(150, 480)], 2)
    turn = R.matrix_quaternion(
        A.rotation(np.array([0, 1.0, 0]), np.array(np.radians(g.choice([0, 22, 36, 45])))) @ random_turn(g, 10)
    )
    turn = np.round(turn, 7)
    mass = round(float(g.uniform(*p.ranges.mass)), 2)
    cog = np.round([g.uniform(-40, 40), g.uniform(-30, 30), g.uniform(40, 200)], 1)
    name = str(g.choice(["tTorch", "tWeldGun", "toolMig", "tGun_"])) + str(k)
    storage = str(g.choice(["PERS", "TASK PERS", "CONST"]))
    text = (
        f"{storage} tooldata {name}:=[TRUE,[{p.numbers(place, 2)},{p.numbers(turn, 7)}],"
        f"[{mass},{p.numbers(cog, 1)},[1,0,0,0],{p.number(g.uniform(0, 0.2), 3)},0,0]];"
    )
    return Tool(name, text, R.pose([place, turn]))


def draw_fixture(p: Program, k: int) -> Fixture:
    g = p.g
    kind = g.choice(["world", "plain", "both"], p=[0.25, 0.35, 0.4])
    if kind == "world":
        return Fixture("wobj0", "", np.eye(4))

    def frame(reach: float, lean: float) -> tuple[str, np.ndarray]:
        place = np.round([g.uniform(-reach, reach), g.uniform(-reach, reach), g.uniform(-300, 300)], 2)
        turn = A.rotation(np.array([0, 0, 1.0]), np.array(g.uniform(-np.pi, np.pi))) @ random_turn(g, lean)
        quaternion = np.round(R.matrix_quaternion(turn), 8)
        return f"[{p.numbers(place, 2)},{p.numbers(quaternion, 8)}]", R.pose([place, quaternion])

    u_text, u = frame(1200, 20)
    o_text, o = frame(150, 5) if kind == "both" else ("[[0,0,0],[1,0,0,0]]", np.eye(4))
    name = str(g.choice(["wHull", "wobjPanel", "wFix_", "wobj"])) + str(k)
    storage = str(g.choice(["PERS", "TASK PERS", "LOCAL PERS", "CONST"]))
    return Fixture(name, f'{storage} wobjdata {name}:=[FALSE,TRUE,"",{u_text},{o_text}];', u @ o)


@dataclass
class Target:
    """A rounded target: its text parts and its place in the base."""

    place: np.ndarray
    turn: np.ndarray
    base: np.ndarray
    conf: np.ndarray = field(default_factory=lambda: np.zeros(4, dtype=int))
    q: np.ndarray = field(default_factory=lambda: np.zeros(6))
    name: str = ""


def make_target(p: Program, t: np.ndarray, fixture: Fixture) -> Target:
    local = np.linalg.inv(fixture.frame) @ t
    place = np.array([float(p.number(v, p.style.decimals)) for v in local[:3, 3] * 1000])
    turn = np.array([float(p.number(v, p.style.digits)) for v in R.matrix_quaternion(local[:3, :3])])
    return Target(place, turn, fixture.frame @ R.pose([place, turn]))


def inside(arm: A.Arm, q: np.ndarray, wrist: float = 10.0) -> bool:
    q = np.atleast_2d(q)
    ok = (q > arm.lower + MARGIN).all() and (q < arm.upper - MARGIN).all()
    tip = np.abs(np.sin(q[:, 4])) > np.sin(np.radians(wrist))
    elbow = np.abs(np.arctan2(arm.lengths["d4"], arm.lengths["a3"]) + q[:, 2])
    straight = (elbow > np.radians(12)) & (elbow < np.radians(168))
    center = arm.forward(q, np.eye(4)).body[5][:, :2, 3]
    return bool(ok and tip.all() and straight.all() and (np.linalg.norm(center, axis=1) > 0.3).all())


def travel(p: Program, start: Target, goal: Target, tool: Tool, via: np.ndarray | None = None) -> None:
    """Fills in the goal's joints and confdata by following the line or arc from start."""
    kind = "L" if via is None else "C"
    m = R.Motion("", kind, 0, goal.base, via, None, (), tool.frame, 0, np.zeros(3), 0, False, False, ())
    _, command = P.shape(start.base, m, 0.01)
    q = I.follow(p.arm, command @ np.linalg.inv(tool.frame), start.q)
    if (
        q is None
        or not inside(p.arm, q, p.ranges.wrist)
        or np.abs(np.diff(np.vstack([start.q, q]), axis=0)).max() > 0.2
    ):
        raise Retry
    goal.q, goal.conf = q[-1], I.confdata(p.arm, q[-1])[0]
    if np.abs(q[-1][[0, 3, 5]]).max() > np.radians(358):
        raise Retry


def first_target(p: Program, t: Target, tool: Tool) -> None:
    flange = t.base @ np.linalg.inv(tool.frame)
    wrists = [0, 1] if p.g.random() < 0.5 else [1, 0]
    for w in wrists:
        q = I.inverse(p.arm, flange[None])[0, w]
        if not np.isfinite(q).all() or not inside(p.arm, q, p.ranges.wrist):
            continue
        conf = I.confdata(p.arm, q)[0]
        again = I.solve_target(p.arm, flange, tuple(conf))
        if again is None or np.abs(again - q).max() > 1e-6:
            continue
        t.q, t.conf = q, conf
        return
    raise Retry


def write_target(p: Program, t: Target, base: tuple[str, Target] | None, array: list[str] | None) -> str:
    """The argument text: declared name, inline aggregate, array element, or Offs of a declared target."""
    if t.name:
        return t.name
    text = p.robtarget(t.place, t.turn, t.conf)
    choice = p.g.random()
    if base is not None and (base[1].conf == t.conf).all() and (base[1].turn == t.turn).all() and choice < 0.6:
        d = t.place - base[1].place
        word = "Offs" if p.style.upper else "offs"
        return f"{word}({base[0]}," + ",".join(p.number(v, p.style.decimals) for v in d) + ")"
    if array is not None and choice < 0.8:
        array.append(text)
        return f"{{ARRAY}}{{{len(array)}}}"
    if choice < 0.45:
        return text
    name = p.fresh()
    storage = str(p.g.choice(["CONST", "LOCAL CONST", "PERS", "VAR"], p=[0.7, 0.2, 0.05, 0.05]))
    p.data.append(f"{storage} robtarget {name}:={text};")
    t.name = name
    return name


def seam(p: Program, k: int, tools: list[Tool], fixtures: list[Fixture]) -> list[str]:
    """Statements of one seam: joint move, approach, weld start, lines and arcs, weld end, retract."""
    g, s = p.g, p.style
    tool, fixture = tools[int(g.integers(len(tools)))], fixtures[int(g.integers(len(fixtures)))]
    azimuth, reach, height = np.radians(g.uniform(-75, 75)), g.uniform(*p.ranges.reach), g.uniform(0.0, 1.3)
    middle = np.array([reach * np.cos(azimuth), reach * np.sin(azimuth), height])
    out = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
    lean = np.radians(g.uniform(10, 80))
    z = unit(random_turn(g, 25) @ (np.cos(lean) * np.array([0, 0, -1.0]) + np.sin(lean) * out))
    x = unit(np.cross(np.cross(z, unit(g.normal(size=3))), z))
    turn0 = np.column_stack([x, np.cross(z, x), z])
    along = unit(np.cross(z, unit(g.normal(size=3))))
    across = np.cross(z, along)
    total = float(g.choice([g.uniform(0.3, 0.8), g.uniform(0.8, 1.6), g.uniform(1.6, 2.5)], p=[0.4, 0.4, 0.2]))
    n = int(g.choice(p.ranges.pieces))
    with_arcs = g.random() < 0.45
    turning = g.choice(p.ranges.turning)
    straight_z = total / n
    spot = middle - along * total / 2
    # Way points: straight pieces, corner arcs between them, orientation drifting along the seam.
    steps: list[tuple[str, np.ndarray, np.ndarray | None]] = []
    r = turn0
    pos = spot
    heading = along
    start_pose = A.transform(r, pos)
    for i in range(n):
        if i and with_arcs and g.random() < 0.7:
            radius = g.uniform(*p.ranges.radius)
            bend = np.radians(g.uniform(*p.ranges.bend)) * g.choice([-1, 1])
            # The circle lies near the seam plane.
            side = np.cross(z, heading) * np.sign(bend)
            center = pos + radius * side
            axis = z * np.sign(bend)
            w = abs(bend)
            via_p = center + A.rotation(axis, np.array(w / 2)) @ (pos - center)
            end_p = center + A.rotation(axis, np.array(w)) @ (pos - center)
            heading = A.rotation(axis, np.array(w)) @ heading
            r2 = A.rotation(axis, np.array(w)) @ r if g.random() < 0.5 else r @ random_turn(g, float(turning))
            half = A.rotation(axis, np.array(w / 2))
            on_way = half @ P.slerp(r, A.rotation(axis, np.array(-w)) @ r2, np.array([0.5]))[0]
            steps.append(("C", A.transform(r2, end_p), A.transform(on_way, via_p)))
            pos, r = end_p, r2
        elif i and g.random() < 0.6:
            heading = unit(A.rotation(z, np.array(np.radians(g.uniform(-35, 35)))) @ heading + z * g.normal(0, 0.05))
        piece = straight_z * g.uniform(0.6, 1.4) if n > 1 else total
        pos = pos + heading * piece
        r = r @ random_turn(g, float(turning))
        steps.append(("L", A.transform(r, pos), None))
    del across
    array: list[str] | None = [] if g.random() < 0.2 else None
    lines: list[str] = []
    burn = g.random() < 0.85
    zone_mid = str(g.choice(p.ranges.zones))
    weld_speed = str(g.choice(["v5", "v8w", "v10", "v20"]))
    if weld_speed == "v8w":
        weld_speed = "vWeld"
    weave = str(g.choice(["", "\\Weave:=weave1", "\\Weave:=weave1"], p=[0.7, 0.2, 0.1]))
    track = "\\Track:=track1" if g.random() < 0.1 else ""
    air = str(g.choice(["v100", "v200", "v500", "v1000", "vAir"]))
    wobj = "" if fixture.name == "wobj0" and g.random() < 0.7 else f"{s.blank_before_wobj}{fixture.name}"

    def move(word: str, targets: list[str], speed: str, zone: str, process: bool) -> str:
        args = [*targets, speed]
        if process:
            args += ["seam1", "weld1" + weave]
        args += [zone, tool.name]
        tail = wobj + (track if process else "")
        word = word if s.upper else word.lower() if g.random() < 0.5 else word
        return f"{word} " + s.comma.join(args) + tail + ";"

    first = make_target(p, start_pose, fixture)
    approach_pose = first.base @ A.shift(0, 0, -round(float(g.uniform(0.03, 0.15)), 3))
    above = make_target(p, approach_pose, fixture)
    above.turn = first.turn
    above.base = fixture.frame @ R.pose([above.place, above.turn])
    first_target(p, above, tool)
    travel(p, above, first, tool)
    name = p.fresh()
    start_text = name
    p.data.append(f"CONST robtarget {name}:={p.robtarget(first.place, first.turn, first.conf)};")
    first.name = name
    # The approach: an offset of the start where its configuration is the same, else a target of its own.
    if (above.conf == first.conf).all() and g.random() < 0.7:
        d = above.place - first.place
        if g.random() < 0.5:
            above_text = f"Offs({name}," + ",".join(p.number(v, s.decimals) for v in d) + ")"
        else:
            depth = -float(g.choice([30, 50, 80, 100, 120]))
            above.base = first.base @ A.shift(0, 0, depth / 1000)
            declared = first.conf
            first_target(p, above, tool)
            travel(p, above, first, tool)
            if (above.conf != declared).any() or (first.conf != declared).any():
                raise Retry
            above_text = f"RelTool({name},0,0,{depth:g})"
    else:
        above_text = write_target(p, above, None, None)
    lines.append(move("MoveJ", [above_text], air, str(g.choice(["z10", "z50", "fine", "z5"])), False))
    stop = "fine"
    if burn:
        lines.append(move("ArcLStart", [start_text], air if g.random() < 0.7 else "v50", stop, True))
    else:
        lines.append(move("MoveL", [start_text], str(g.choice(["v50", "v100"])), stop, False))
    at = first
    for i, (kind, t, via) in enumerate(steps):
        last = i == len(steps) - 1
        goal = make_target(p, t, fixture)
        if kind == "L" and g.random() < 0.6 and turning == 0.0:
            goal.turn = at.turn
            goal.base = fixture.frame @ R.pose([goal.place, goal.turn])
        zone = "fine" if last else zone_mid
        word = ("ArcLEnd" if kind == "L" else "ArcCEnd") if last else ("ArcL" if kind == "L" else "ArcC")
        if not burn:
            word = "MoveL" if kind == "L" else "MoveC"
        if kind == "C":
            assert via is not None
            through = make_target(p, via, fixture)
            travel(p, at, goal, tool, through.base)
            through.conf = goal.conf
            texts = [write_target(p, through, None, array), write_target(p, goal, None, array)]
        else:
            travel(p, at, goal, tool)
            texts = [write_target(p, goal, (start_text, first), array)]
        lines.append(move(word, texts, weld_speed, zone, burn))
        p.info.append(kind)
        at = goal
    leave = make_target(p, at.base @ A.shift(0, 0, -round(float(g.uniform(0.05, 0.2)), 3)), fixture)
    leave.turn = at.turn
    leave.base = fixture.frame @ R.pose([leave.place, leave.turn])
    travel(p, at, leave, tool)
    lines.append(move("MoveL", [write_target(p, leave, None, None)], air, str(g.choice(["z10", "z20", "fine"])), False))
    if array is not None and array:
        label = p.fresh("pSeam")
        joined = ("," + s.eol + s.indent * 2).join(array)
        p.data.append(f"CONST robtarget {label}{{{len(array)}}}:=[{joined}];")
        lines = [t.replace("{ARRAY}", label) for t in lines]
    p.q = leave.q
    return lines


def _process_data(p: Program) -> list[str]:
    arcdata = "[0,0,24.5,150,0,0,0,0,0]"
    return [
        f"PERS seamdata seam1:=[0.2,0.3,{arcdata},0,0,0,0,0,{arcdata},0,0.1,{arcdata},0,0,{arcdata},0.5];",
        f"PERS welddata weld1:=[{p.g.choice(['6', '8', '10', '12.5'])},0,{arcdata},[0,0,0,0,0,0,0,0,0]];",
        "PERS weavedata weave1:=[1,0,4,3,0,0,0,0,0,0,0,0,0,0,0];",
        "PERS trackdata track1:=[0,FALSE,50,[0,0,0,0,0,0,0,0,0],[0,0,0,0,0,0,0]];",
        "CONST speeddata vWeld:=[8,50,5000,1000];",
        "CONST speeddata vAir:=[350,120,5000,1000];",
    ]


def generate(seed: int, geometry: str = "irb4600_60_205", seams: int | None = None, ranges: Ranges = Ranges()) -> str:
    """Program text of one seed."""
    g = np.random.default_rng(seed)
    style = Style.draw(g)
    p = Program(g, style, A.ARMS[geometry](), ranges)
    tools = [draw_tool(p, k + 1) for k in range(int(g.choice([1, 2], p=[0.8, 0.2])))]
    fixtures = [draw_fixture(p, k + 1) for k in range(int(g.choice([1, 2], p=[0.7, 0.3])))]
    count = seams or int(g.choice([1, 2, 3, 4], p=[0.4, 0.3, 0.2, 0.1]))
    blocks = []
    for k in range(count):
        for _ in range(4000):
            keep = (len(p.data), p.counter, len(p.info))
            try:
                blocks.append(seam(p, k, tools, fixtures))
                break
            except Retry:
                del p.data[keep[0] :]
                p.counter = keep[1]
                del p.info[keep[2] :]
        else:
            raise RuntimeError(f"seed {seed}: no reachable seam found")
    e, i = style.eol, style.indent
    home = (
        "[" + style.comma.join(p.number(v, 1) for v in [g.uniform(-20, 20), -20, 15, 0, 40, g.uniform(-30, 30)]) + "]"
    )
    axes = "[" + style.comma.join([style.no_axis] * 6) + "]"
    head = ["%%%", "  VERSION:1", "  LANGUAGE:ENGLISH", "%%%", ""] if style.header else []
    seen: set[str] = set()
    lines = [*head, f"MODULE Weld{seed}{style.attributes}"]
    if g.random() < 0.5:
        lines += [i + "! Hull panel, position PA; torch checked; 100% CO2", ""]
    for text in [t.text for t in tools] + [f.text for f in fixtures if f.text] + _process_data(p):
        if text not in seen:
            lines.append(i + text)
            seen.add(text)
    lines.append(i + f"CONST jointtarget jHome:=[{home}{style.comma}{axes}];")
    lines += [i + d for d in p.data]
    lines.append("")
    split = g.random() < 0.5
    absj = f"MoveAbsJ jHome{g.choice(['', chr(92) + 'NoEOffs'])}{style.comma}v500{style.comma}fine{style.comma}{tools[0].name};"
    body: list[str] = [absj]
    routines: list[str] = []
    for k, block in enumerate(blocks):
        notes = [b + (" ! seam" if g.random() < 0.05 else "") for b in block]
        if split:
            routines += ["", i + f"PROC rSeam{k + 1}()", *[i * 2 + b for b in notes], i + "ENDPROC"]
            body.append(f"rSeam{k + 1};")
        else:
            body += (["! seam " + str(k + 1)] if g.random() < 0.5 else []) + notes
    body.append(absj)
    lines += [i + "PROC main()", *[i * 2 + b for b in body], i + "ENDPROC", *routines, "ENDMODULE"]
    return e.join(lines) + (e if g.random() < 0.6 else "")
