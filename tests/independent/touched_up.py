"""A shop that draws a program offline and then touches up its targets with a real, soft arm: plain numpy alone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tests.independent import arm as A
from tests.independent import inverse as I
from tests.independent import rapid as R

TOOL = A.shift(0.02, 0.0, 0.35)
LOAD = A.Load(5.0, np.array([0.0, 0.0, 0.12]))
DATA = "  PERS tooldata tT:=[TRUE,[[20,0,350],[1,0,0,0]],[5,[0,0,120],[1,0,0,0],0,0,0]];\n"
AXES = "[9E9,9E9,9E9,9E9,9E9,9E9]"
DOWN = R.quaternion_matrix([0.0, 1.0, 0.0, 0.0])


@dataclass(frozen=True)
class Job:
    """Targets of a program: the work object of each (n,), their nominal poses in the base (n, 4, 4), frames (k, 4, 4).

    ``conf`` (n, 4): configuration of each target.
    """

    arm: A.Arm
    which: np.ndarray
    T: np.ndarray
    frames: np.ndarray
    conf: np.ndarray


@dataclass(frozen=True)
class Real:
    """The real arm: compliances of its joints (6,) [rad/(N m)] and what its joint angles are off (6,) [rad]."""

    compliance: np.ndarray
    zero: np.ndarray


def draw_real(g: np.random.Generator, zero: float = 0.0) -> Real:
    """An arm whose springs are off by 0.4 to 2.5; zero: standard deviation of its joint angles' zeros [rad]."""
    factor = np.exp(g.uniform(np.log(0.4), np.log(2.5), 6))
    return Real(A.TABLE_2 * factor, g.normal(0.0, 1.0, 6) * zero)


def draw_job(g: np.random.Generator, arm: A.Arm, count: int, objects: int = 1) -> Job:
    """Targets all over the place in front of the arm, in work objects as they were drawn."""
    frames = [
        A.transform(A.rotation(np.array([0, 0, 1.0]), np.array(g.uniform(-3, 3))), np.array([1.0, 0.3 * k, 0.5]))
        for k in range(objects)
    ]
    poses, confs = [], []
    while len(poses) < count:
        turn = DOWN @ A.rotation_vector(g.uniform(-0.7, 0.7, 3))
        point = np.array([*g.uniform([0.8, -0.9], [1.6, 0.9]), g.uniform(0.2, 1.5)])
        T = A.transform(turn, point)
        q = I.inverse(arm, (T @ np.linalg.inv(TOOL))[None])[0, 0]
        room = np.minimum(q - arm.lower, arm.upper - q) if np.isfinite(q).all() else np.zeros(6)
        if room.min() > 0.2 and abs(q[4]) > 0.3:
            poses.append(T)
            confs.append(I.confdata(arm, q)[0])
    return Job(arm, np.arange(count) % objects, np.array(poses), np.array(frames), np.array(confs))


def joints(job: Job, T: np.ndarray) -> np.ndarray:
    """(n, 6) joint angles for commanded poses of the TCP."""
    found = [I.solve_target(job.arm, t @ np.linalg.inv(TOOL), tuple(c)) for t, c in zip(T, job.conf, strict=True)]
    assert all(q is not None for q in found)
    return np.array(found)


def bent(job: Job, q: np.ndarray, real: Real) -> np.ndarray:
    """(n, 3) where the TCP of the real arm is."""
    return A.equilibrium(job.arm, q + real.zero, TOOL, LOAD, A.joint_springs(real.compliance)).frames.tcp[:, :3, 3]


def touch_up(job: Job, real: Real, moved: np.ndarray, noise: np.ndarray) -> np.ndarray:
    """(n, 4, 4) commanded poses with which the real TCP is at the work, which fixtures have moved (k, 4, 4) in the base.

    ``noise`` (n, 3) [m]: how far beside it the person stops.
    """
    goal = np.einsum("nij,nj->ni", moved[job.which], np.insert(job.T[:, :3, 3], 3, 1.0, axis=1))[:, :3] + noise
    T = job.T.copy()
    for _ in range(6):
        T[:, :3, 3] += goal - bent(job, joints(job, T), real)
    return T


def program(job: Job, T: np.ndarray, digits: int = 3) -> str:
    """The program with its targets at poses (n, 4, 4) of the base, in their work objects; a pendant writes 2 digits."""
    lines, moves = [DATA], []
    for k, frame in enumerate(job.frames):
        lines.append(f'  PERS wobjdata wFix{k}:=[FALSE,TRUE,"",[{place(frame, 6)}],[[0,0,0],[1,0,0,0]]];\n')
    for i, k in enumerate(job.which):
        conf = ",".join(map(str, job.conf[i]))
        target = place(np.linalg.inv(job.frames[k]) @ T[i], digits)
        lines.append(f"  CONST robtarget p{10 * i + 10}:=[{target},[{conf}],{AXES}];\n")
        moves.append(f"    MoveJ p{10 * i + 10},v500,fine,tT\\WObj:=wFix{k};\n")
    return f"MODULE Touch\n{''.join(lines)}  PROC main()\n{''.join(moves)}  ENDPROC\nENDMODULE\n"


def place(T: np.ndarray, digits: int) -> str:
    """Position [mm] and quaternion of a pose as RAPID has them."""
    p = ",".join(f"{v:.{digits}f}" for v in 1e3 * T[:3, 3])
    return f"[{p}],[{','.join(f'{v:.8f}' for v in R.matrix_quaternion(T[:3, :3]))}]"
