"""Programs with targets that a person may teach: parameters, arrays, records, functions, arcs, tracks, positioners."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from tests.cells import world as W
from tests.independent import arm as A
from tests.independent import inverse as I
from tests.independent import rapid as R

ARM = A.irb4600()
TOOL = A.transform(A.rotation(np.array([0.0, 1, 0]), np.radians(35.0)), np.array([0.05, 0.0, 0.35]))
DOWN = np.diag([1.0, -1.0, -1.0])
STRAIGHT = np.radians(20.0)
"""Nearer than that to a straight wrist no target is taught: the posture there is nobody's choice."""
STAND = A.transform(A.rotation(np.array([1.0, 0, 0]), np.radians(10)), np.array([1.15, 0.15, 0.45]))
DATA = f"""  PERS tooldata tTorch:=[TRUE,[[50,0,350],[{",".join(f"{v:.9f}" for v in R.matrix_quaternion(TOOL[:3, :3]))}]],[6,[20,0,140],[1,0,0,0],0,0,0]];
  PERS seamdata sm:=[0.3,0.2,[0,0,24,8,0,0,0,0,0],0,0,0,0,0,[0,0,0,0,0,0,0,0,0],0,0.3,[0,0,22,6.5,0,0,0,0,0],0,0,[0,0,0,0,0,0,0,0,0],0.5];
  PERS welddata wd:=[9,0,[0,0,26,9,0,0,0,0,0],[0,0,0,0,0,0,0,0,0]];
"""


@dataclass(frozen=True)
class Cell:
    """A cell in plain numpy and as a model file states it; the letter's number of its axis, how far that is moved."""

    name: str
    world: W.World
    axes: str = ""
    axis: int | None = None
    rest: float = 0.0
    reach: float = 0.0
    unit: str = ""


def _placed(T: np.ndarray) -> str:
    quat = [round(float(v), 12) for v in R.matrix_quaternion(T[:3, :3])]
    return f"xyz_mm = {[float(1000 * v) for v in T[:3, 3]]}\nquat = {quat}\n"


CELLS = (
    Cell("still", W.World()),
    Cell(
        "track", W.World(base=W.slide(0, (1.0, 0.0, 0.0))), axis=0, rest=600.0, reach=70.0,
        axes='[[external_axes]]\naxis = "a"\nkind = "linear"\ncarries = "robot"\nunit = "TRACK_1"\n',
    ),
    Cell(
        "positioner", W.World(units={"STN1": W.turn(1, (0, 0, 1.0), STAND)}), axis=1, rest=12.0, reach=8.0, unit="STN1",
        axes='[[external_axes]]\naxis = "b"\nkind = "rotary"\ncarries = "work"\nunit = "STN1"\nspeed = 90\n' + _placed(STAND),
    ),
)  # fmt: skip


@dataclass(frozen=True)
class Taught:
    """A target as it was taught: T (4, 4) [m] in the work object, external axes (6,) as RAPID states them, joints (6,)."""

    T: np.ndarray
    axes: np.ndarray
    q: np.ndarray

    @property
    def text(self) -> str:
        place = ",".join(f"{1000 * v:.3f}" for v in self.T[:3, 3])
        turn = ",".join(f"{v:.9f}" for v in R.matrix_quaternion(self.T[:3, :3]))
        conf = ",".join(str(int(c)) for c in I.confdata(ARM, self.q)[0])
        return f"[[{place}],[{turn}],[{conf}],[{','.join('9E9' if v > 8e9 else f'{v:.3f}' for v in self.axes)}]]"


def joints(cell: Cell, T: np.ndarray, axes: np.ndarray, near: np.ndarray | None) -> np.ndarray | None:
    """(6,) joint angles at a target, next to others where these are given; None where the arm has none to be taught."""
    frame = cell.world.work(axes[None], cell.unit)[0]
    every = I.inverse(ARM, (frame @ T @ np.linalg.inv(TOOL))[None])[0]
    every = every[np.isfinite(every).all(axis=1)]
    if near is None:
        every = every[(every[:, 4] > 0)]
    else:
        every = near + I.wrap(every - near)
    every = [
        q for q in every if (q > ARM.lower).all() and (q < ARM.upper).all() and abs(np.sin(q[4])) > np.sin(STRAIGHT)
    ]
    if not every:
        return None
    return min(every, key=lambda q: float(np.abs(q - (0.0 if near is None else near)).max()))


@dataclass
class Task:
    """A program in its cell.

    Args:
        targets: by the name under which the interpreter knows them: data, elements of arrays, parts of records.
    """

    name: str
    cell: Cell
    text: str = ""
    targets: dict[str, Taught] = field(default_factory=dict)


class Bench:
    """Draws targets for one program: each next to the last, all in one posture."""

    def __init__(self, name: str, cell: Cell, seed: int) -> None:
        self.task, self.cell, self.draw = Task(name, cell), cell, np.random.default_rng(seed)
        self.data: list[str] = []
        self.last: np.ndarray | None = None
        along = self.draw.uniform(-350, 350)
        if cell.name == "positioner":
            self.place = np.array([self.draw.uniform(-100, 150), along / 2, 150.0])
        else:
            self.place = np.array([self.draw.uniform(1000, 1250), along, self.draw.uniform(550, 850)])
            self.place[0] += cell.rest if cell.name == "track" else 0.0
        self.heading = self.draw.uniform(-60, 60)

    def teach(self, *offset: float, heading: float = 0.0, axis: float = 0.0) -> Taught:
        """A target beside the place of this program [mm], turned about the vertical [deg], the axis moved by a share of its reach."""
        axes = np.full(6, 9e9)
        if self.cell.axis is not None:
            axes[self.cell.axis] = round(self.cell.rest + axis * self.cell.reach, 2)
        turn = A.rotation(np.array([0, 0, 1.0]), np.radians(self.heading + heading)) @ DOWN
        T = A.transform(turn, np.round(self.place + np.array(offset), 2) / 1000)
        q = joints(self.cell, T, axes, self.last)
        if q is None:
            raise ValueError("out of reach")
        self.last = q
        return Taught(T, axes, q)

    def at_edge(self, target: Taught, angle: float) -> Taught:
        """The target turned about axis 1 until that stands at an angle [rad]: beside zero a correction carries it over."""
        frame = self.cell.world.work(target.axes[None], self.cell.unit)[0]
        turn = A.transform(A.rotation(np.array([0, 0, 1.0]), np.array(angle - target.q[0])), np.zeros(3))
        T = np.linalg.inv(frame) @ turn @ frame @ target.T
        T[:3, 3] = np.round(T[:3, 3], 6)
        q = joints(self.cell, T, target.axes, target.q + np.array([angle - target.q[0], 0, 0, 0, 0, 0]))
        if q is None:
            raise ValueError("out of reach")
        return Taught(T, target.axes, q)

    def declare(self, storage: str = "PERS", **targets: Taught) -> None:
        for name, target in targets.items():
            self.data.append(f"  {storage} robtarget {name}:={target.text};")
            self.task.targets[name.lower()] = target

    def array(self, name: str, targets: list[Taught], storage: str = "PERS") -> None:
        self.data.append(f"  {storage} robtarget {name}{{{len(targets)}}}:=[{','.join(t.text for t in targets)}];")
        for i, target in enumerate(targets, 1):
            self.task.targets[f"{name.lower()}/{i}"] = target

    def done(self, body: str, more: str = "", head: str = "") -> Task:
        wobj = f'  PERS wobjdata wWork:=[FALSE,{"FALSE" if self.cell.unit else "TRUE"},"{self.cell.unit}",[[0,0,0],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];'
        body = "".join(f"    {line.strip()}\n" for line in body.strip().splitlines())
        self.task.text = (
            f"MODULE Taught\n{head}{DATA}{wobj}\n"
            + "\n".join(self.data)
            + f"\n  PROC main()\n{body}  ENDPROC\n{more}ENDMODULE\n"
        )
        self.task.text = self.task.text.replace("$", "tTorch\\WObj:=wWork")
        return self.task


def routine(head: str, body: str) -> str:
    end = "ENDFUNC" if head.startswith("FUNC") else "ENDPROC"
    lines = "".join(f"    {line.strip()}\n" for line in body.strip().splitlines())
    return f"  {head}\n{lines}  {end}\n"


def parameter(b: Bench) -> Task:
    s = b.draw.uniform(100, 260, 4)
    b.declare(pA=b.teach(0, 0, 0), pB=b.teach(0, s[0], 0, heading=10, axis=0.5), pC=b.teach(40, -s[1], 30, axis=-0.5))
    go = "MoveJ Offs(p,0,0,15),v200,z5,$;\nMoveL p,v100,fine,$;\nMoveJ Offs(p,0,0,60),v200,z5,$;"
    return b.done("rGo pA;\nrGo pB;\nrGo pC;", routine("PROC rGo(robtarget p)", go))


def at_a_quadrant(b: Bench) -> Task:
    """Axis 1 stands half a milliradian beside zero, on either side: the correction carries it over on one of them."""
    b.declare(pA=b.at_edge(b.teach(0, 0, 0), 5e-4), pB=b.at_edge(b.teach(0, 60, 40, heading=10, axis=0.5), -5e-4))
    b.data.append("  VAR robtarget pNow;")
    go = "MoveJ Offs(p,0,0,15),v200,fine,$;\nMoveL p,v100,fine,$;\nMoveJ p,v200,fine,$;\nMoveL Offs(p,0,0,n),v100,fine,$;"
    copied = "pNow:=pA;\nMoveJ pNow,v200,fine,$;\nMoveL Offs(pNow,0,0,40),v100,fine,$;"
    return b.done(f"rGo pA,20;\nrGo pB,30;\n{copied}", routine("PROC rGo(robtarget p,num n)", go))


def array(b: Bench) -> Task:
    b.array("pRow", [b.teach(0, 90 * k, 10 * k, heading=4 * k, axis=0.3 * k) for k in range(4)])
    loop = "FOR i FROM 1 TO 4 DO\nMoveJ Offs(pRow{i},0,0,50),v300,z10,$;\nMoveL pRow{i},v100,fine,$;\nMoveL Offs(pRow{i},0,0,50),v100,z5,$;\nENDFOR"
    return b.done(loop)


def record(b: Bench) -> Task:
    targets = [b.teach(0, 0, 0), b.teach(60, b.draw.uniform(120, 300), 0, heading=12, axis=0.6)]
    for name, target in zip(("stA", "stB"), targets, strict=True):
        b.data.append(f"  PERS station {name}:=[{target.text},35];")
        b.task.targets[f"{name.lower()}.at"] = target
    head = "  RECORD station\n    robtarget at;\n    num up;\n  ENDRECORD\n"
    go = "MoveJ Offs(s.at,0,0,s.up),v300,z10,$;\nMoveL s.at,v100,fine,$;"
    return b.done("rGo stA;\nrGo stB;\nMoveL stA.at,v100,fine,$;", routine("PROC rGo(station s)", go), head)


def plain(b: Bench) -> Task:
    b.declare(
        pA=b.teach(0, 0, 0),
        pB=b.teach(0, b.draw.uniform(200, 400), 20, heading=20, axis=1),
        pC=b.teach(90, 100, 60, axis=0.5),
    )
    return b.done(
        "MoveJ Offs(pA,0,0,80),v300,z10,$;\nMoveL pA,v100,fine,$;\nMoveL pB,v50,fine,$;\nMoveL Offs(pB,0,0,70),v100,z5,$;\nMoveJ pC,v200,fine,$;"
    )


def function(b: Bench) -> Task:
    b.declare(pA=b.teach(0, 0, 0), pB=b.teach(30, b.draw.uniform(150, 300), 20, heading=-15, axis=0.7))
    up = routine("FUNC robtarget fUp(robtarget p,num z)", "RETURN Offs(p,0,0,z);")
    near = routine(
        "FUNC robtarget fShift(robtarget p,num k)", "VAR robtarget r;\nr:=p;\nr.trans.x:=r.trans.x+20*k;\nRETURN r;"
    )
    return b.done(
        "FOR i FROM 0 TO 2 DO\nMoveJ fUp(fShift(pA,i),60),v300,z10,$;\nMoveL fShift(pA,i),v100,fine,$;\nMoveL fShift(pB,i),v80,fine,$;\nMoveL fUp(pB,60),v300,z10,$;\nENDFOR",
        up + near,
    )


def unseen(b: Bench) -> Task:
    b.declare(pA=b.teach(0, 0, 0), pB=b.teach(20, b.draw.uniform(150, 300), 0, heading=15, axis=0.5))
    seam = (
        "MoveJ Offs(p,0,0,50),v300,z10,$;\nMoveL p,v100,fine,$;\nMoveL q,v60,fine,$;\nMoveL Offs(q,0,0,50),v300,z10,$;"
    )
    return b.done(
        "rElsewhere;\nrSeam pA,pB;\nrElsewhere;\nrSeam pB,pA;", routine("PROC rSeam(robtarget p,robtarget q)", seam)
    )


def _ring(b: Bench, size: float, axis: float = 0.6) -> list[Taught]:
    """Start, circle point and goal of an arc, and those of the next one, which ends where the first began."""
    angles = np.radians([0, 90, 180, 270])
    turned = (0, 12, 25, 12)
    moved = (0, axis / 2, axis, axis / 2)
    return [
        b.teach(size * np.cos(a), size * np.sin(a), 0, heading=t, axis=m)
        for a, t, m in zip(angles, turned, moved, strict=True)
    ]


def arcs(b: Bench) -> Task:
    p, q, r, s = _ring(b, b.draw.uniform(70, 160))
    b.declare(p1=p, p2=q, p3=r, p4=s)
    return b.done(
        "MoveJ Offs(p1,0,0,60),v300,z10,$;\nMoveL p1,v100,fine,$;\nMoveC p2,p3,v50,z1,$;\nMoveC p4,p1,v50,fine,$;\nMoveL Offs(p1,0,0,60),v100,z5,$;"
    )


def welded_arcs(b: Bench) -> Task:
    p, q, r, s = _ring(b, b.draw.uniform(80, 100))
    end = b.teach(0.5 * b.draw.uniform(70, 100), -b.draw.uniform(75, 95), 10, heading=20, axis=-0.3)
    b.declare(p1=p, p2=q, p3=r, p4=s, pEnd=end)
    return b.done(
        "MoveJ Offs(p1,0,0,60),v300,z10,$;\nArcLStart p1,v100,sm,wd,fine,$;\nArcC p2,p3,v20,sm,wd,z1,$;\nArcCEnd p4,pEnd,v20,sm,wd,fine,$;\nMoveL Offs(pEnd,0,0,60),v100,z5,$;"
    )


def arc_of_offsets(b: Bench) -> Task:
    b.declare(pMid=b.teach(0, 0, 0), pOther=b.teach(30, b.draw.uniform(180, 260), 0, heading=10, axis=0.5))
    size = round(float(b.draw.uniform(60, 110)))
    ring = "MoveJ Offs(p,r,0,40),v300,z10,$;\nArcLStart Offs(p,r,0,0),v100,sm,wd,fine,$;\nArcC Offs(p,0,r,0),Offs(p,-r,0,0),v20,sm,wd,z1,$;\nArcCEnd Offs(p,0,-r,0),Offs(p,r,0,0),v20,sm,wd,fine,$;\nMoveL Offs(p,r,0,40),v100,z5,$;"
    return b.done(f"rRing pMid,{size};\nrRing pOther,{size};", routine("PROC rRing(robtarget p,num r)", ring))


def arc_of_elements(b: Bench) -> Task:
    b.array("pRing", _ring(b, b.draw.uniform(90, 170)))
    return b.done(
        "MoveJ Offs(pRing{1},0,0,60),v300,z10,$;\nMoveL pRing{1},v100,fine,$;\nMoveC pRing{2},pRing{3},v50,z1,$;\nMoveC pRing{4},pRing{1},v50,fine,$;"
    )


def arc_of_parameters(b: Bench) -> Task:
    p, q, r, s = _ring(b, b.draw.uniform(90, 170))
    b.declare(p1=p, p2=q, p3=r, p4=s)
    go = "MoveL a,v100,fine,$;\nMoveC b,c,v50,fine,$;\nMoveL Offs(c,0,0,30),v100,z5,$;"
    return b.done(
        "MoveJ Offs(p1,0,0,60),v300,z10,$;\nrBow p1,p2,p3;\nrBow p3,p4,p1;",
        routine("PROC rBow(robtarget a,robtarget b,robtarget c)", go),
    )


def changed_copy(b: Bench) -> Task:
    b.declare(pA=b.teach(0, 0, 0), pB=b.teach(0, b.draw.uniform(200, 350), 10, heading=10, axis=0.5))
    b.data.append("  VAR robtarget pNow;\n  VAR num n;")
    return b.done(
        "FOR i FROM 0 TO 2 DO\npNow:=pA;\npNow.trans.z:=pNow.trans.z+25*i;\nMoveJ Offs(pNow,0,0,60),v300,z10,$;\nMoveL pNow,v100,fine,$;\nMoveL Offs(pB,0,0,25*i),v60,fine,$;\nENDFOR"
    )


def displaced(b: Bench) -> Task:
    p, q, r, _ = _ring(b, b.draw.uniform(80, 140))
    b.declare(p1=p, p2=q, p3=r)
    b.data.append("  PERS pose peRow:=[[10,30,5],[1,0,0,0]];")
    go = "MoveJ RelTool(p1,0,0,-50),v300,z10,$;\nMoveL p1,v100,fine,$;\nMoveC p2,p3,v50,fine,$;\nMoveL p1,v80,fine,$;"
    return b.done("rGo;\nPDispSet peRow;\nrGo;\nPDispOff;", routine("PROC rGo()", go))


FAMILIES: dict[str, Callable[[Bench], Task]] = {
    f.__name__: f
    for f in (
        parameter, array, record, plain, function, unseen, arcs, welded_arcs, arc_of_offsets, arc_of_elements,
        arc_of_parameters, changed_copy, displaced, at_a_quadrant,
    )
}  # fmt: skip


def generate(each: int, names: list[str] | None = None) -> list[Task]:
    """So many programs of each family, in turn on a floor, on a track and at a positioner."""
    found = []
    for f, name in enumerate(FAMILIES):
        if names and name not in names:
            continue
        seed = 1000 * f
        for k in range(each):
            task, seed = one(name, CELLS[k % len(CELLS)], seed)
            found.append(task)
    return found


def one(name: str, cell: Cell, seed: int) -> tuple[Task, int]:
    """The first program of a family behind a seed whose targets the arm reaches, and its seed."""
    # Code in no file may move external axes, too: the product then knows no place and corrects nothing.
    cell = CELLS[0] if name == "unseen" else cell
    while True:
        seed += 1
        try:
            return FAMILIES[name](Bench(f"{name}_{cell.name}_{seed % 1000}", cell, seed)), seed
        except ValueError:
            continue
