"""Long programs: ArcL seams to and fro across a plate in front of the arm, 50 targets 8 mm apart, MoveL between them."""

from __future__ import annotations

import numpy as np

from postproc.arrays import invert
from postproc.robot.catalogue import load_robot
from postproc.robot.configuration import confdata
from postproc.robot.track import track

PER_SEAM, STEP = 50, 0.008  # targets of a seam and their distance [m]
HALF = np.radians(45.0) / 2  # the torch stands 45 degrees bent on the flange, so that the wrist is never straight
TOOL = np.array(
    [[np.cos(2 * HALF), 0, np.sin(2 * HALF), 0], [0, 1, 0, 0], [-np.sin(2 * HALF), 0, np.cos(2 * HALF), 0.35],
     [0, 0, 0, 1]]
)  # fmt: skip
HEAD = f"""MODULE Long
  PERS tooldata tTorch:=[TRUE,[[0,0,350],[{np.cos(HALF):.9f},0,{np.sin(HALF):.9f},0]],[5,[0,0,120],[1,0,0,0],0,0,0]];
  CONST seamdata sm1:=[0,0,[0,0,0,0,0,0,0,0,0],0,0,0,0,0,[0,0,0,0,0,0,0,0,0],0,0,[0,0,0,0,0,0,0,0,0],0,0,[0,0,0,0,0,0,0,0,0],0];
  CONST welddata wd1:=[8,0,[0,0,0,0,0,0,0,0,0],[0,0,0,0,0,0,0,0,0]];
  PROC main()
"""


def targets(n: int) -> tuple[np.ndarray, np.ndarray]:
    """Places (n, 3) [m] and confdata (n, 4) of slightly bent seams."""
    seam, at = np.divmod(np.arange(n), PER_SEAM)
    along = STEP * np.where(seam % 2, PER_SEAM - 1 - at, at)
    x = 1.15 + 0.002 * (seam % 100)
    T = np.tile(np.eye(4), (n, 1, 1))
    T[:, :3, :3] = [[1, 0, 0], [0, -1, 0], [0, 0, -1]]
    T[:, :3, 3] = np.stack([x, along - 0.2, 0.5 + 0.02 * np.sin(8 * along) + 0.0004 * (seam // 100)], axis=1)
    robot = load_robot("irb4600_60_205")
    q = track(robot, T @ invert(TOOL), np.radians([-10.0, 20, 10, 0, 45, 0]))
    return T[:, :3, 3], confdata(robot, q)


def program(n: int) -> bytes:
    """A module with n targets, the same whenever it is written."""
    lines = []
    for i, (place, conf) in enumerate(zip(*targets(n), strict=True)):
        at = i % PER_SEAM
        name = {0: "MoveL", 1: "ArcLStart", PER_SEAM - 1: "ArcLEnd"}.get(at, "ArcL")
        numbers = ",".join(f"{v:.2f}" for v in 1e3 * place)
        pose = f"[[{numbers}],[0,1,0,0],[{','.join(map(str, conf))}],[9E9,9E9,9E9,9E9,9E9,9E9]]"
        weld = "" if at == 0 else "sm1,wd1,"
        lines.append(f"    {name} {pose},v100,{weld}{'fine' if at in (1, PER_SEAM - 1) else 'z1'},tTorch;")
    return (HEAD + "\n".join(lines) + "\n  ENDPROC\nENDMODULE\n").encode()
