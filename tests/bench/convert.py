"""Speed of a whole conversion: ``python -m tests.bench.convert [N]``, N targets (20000).

Writes a program of ArcL seams (50 targets 8 mm apart, zone z1, MoveL between them), converts it with the command line
and prints wall and CPU time, memory, and beside it the speed of reading alone, of a small program and of ``--help``.
``python -m tests.bench.model`` sets the batched inverse beside a plain pose-by-pose loop.
"""

from __future__ import annotations

# ruff: noqa: E402 - threads are counted when numpy is first imported
import os

THREADS = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
os.environ.update(THREADS)

import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from postproc.arrays import invert
from postproc.diagnostics import Source
from postproc.rapid.execution.walk import walk
from postproc.rapid.program.program import read_program
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
SAMPLE = Path(__file__).resolve().parents[2] / "samples" / "hull_seam.mod"


def targets(n: int) -> tuple[np.ndarray, np.ndarray]:
    """Places (n, 3) [m] and confdata (n, 4): slightly bent seams to and fro across a plate in front of the arm."""
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
    lines = []
    for i, (place, conf) in enumerate(zip(*targets(n), strict=True)):
        at = i % PER_SEAM
        name = {0: "MoveL", 1: "ArcLStart", PER_SEAM - 1: "ArcLEnd"}.get(at, "ArcL")
        numbers = ",".join(f"{v:.2f}" for v in 1e3 * place)
        pose = f"[[{numbers}],[0,1,0,0],[{','.join(map(str, conf))}],[9E9,9E9,9E9,9E9,9E9,9E9]]"
        weld = "" if at == 0 else "sm1,wd1,"
        lines.append(f"    {name} {pose},v100,{weld}{'fine' if at in (1, PER_SEAM - 1) else 'z1'},tTorch;")
    return (HEAD + "\n".join(lines) + "\n  ENDPROC\nENDMODULE\n").encode()


def run(*arguments: str) -> tuple[float, float, float, str]:
    """Wall time [s], CPU time [s] and peak memory [MB] of one command, and what it printed."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    begin = time.perf_counter()
    command = [sys.executable, "-m", "postproc", *arguments]
    done = subprocess.run(command, env={**os.environ, **THREADS}, capture_output=True, text=True)
    wall = time.perf_counter() - begin
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode:
        raise SystemExit(done.stderr)
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return wall, cpu, after.ru_maxrss / 1024, done.stderr


def report(what: str, measured: tuple[float, float, float, str]) -> None:
    wall, cpu, memory, _ = measured
    print(f"{what:32s} {wall:8.2f} s   cpu {cpu:8.2f} s   peak {memory:6.0f} MB", flush=True)


def main(argv: list[str] | None = None) -> None:
    arguments = sys.argv[1:] if argv is None else argv
    n = int(arguments[0]) if arguments else 20_000
    with tempfile.TemporaryDirectory() as folder:
        report("postproc --help", run("--help"))
        report("compensate hull_seam.mod", run("compensate", str(SAMPLE), "-o", str(Path(folder, "hull.mod"))))
        path = Path(folder, "long.mod")
        path.write_bytes(program(n))
        measured = run("compensate", str(path), "--robot", "irb4600_60_205", "-o", str(Path(folder, "out.mod")))
        report(f"compensate {n:,} targets", measured)
        print(f"{'':32s} {n / measured[1]:8.0f} targets per CPU second; {measured[3].strip()}")
        source = Source(str(path), path.read_bytes())
        begin = time.process_time()
        read = read_program(source)
        middle = time.process_time()
        events = walk(read)
        end = time.process_time()
        size = len(source.data) / 1e6
        print(f"{'reading':32s} {size / (middle - begin):8.1f} MB/s")
        print(f"{'reading and following':32s} {size / (end - begin):8.1f} MB/s   {len(events):,} motions")


if __name__ == "__main__":
    main()
