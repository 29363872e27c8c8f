"""Folders with small programs, the backup of a controller, and what a batch makes of them."""

from __future__ import annotations

import hashlib
import os
import signal
import subprocess
import sys
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from postproc.batch.executors import Pool
from postproc.batch.jobs import Ready, get_ready
from postproc.batch.jobsfile import read_plan
from postproc.batch.run import run_batch
from postproc.batch.values import Batch, BatchPlan, Shard, TaskOutcome
from postproc.compensation.options import Options
from postproc.diagnostics import Diagnostic, Finding
from postproc.settings import Settings
from tests.build import refused

ROOT = Path(__file__).resolve().parents[2]
IN_PROCESS = Pool(lambda count: ThreadPoolExecutor(1), 1)  # no processes: quick
AXES = "[9E9,9E9,9E9,9E9,9E9,9E9]"
TOOL = "PERS tooldata tTorch:=[TRUE,[[0,0,350],[1,0,0,0]],[5,[0,0,120],[1,0,0,0],0,0,0]];"
ARM = "irb4600_60_205"
ROUGH = Settings(robot=ARM, options=Options(tolerance_m=1e-4))
UNNAMED = replace(ROUGH, robot=None)
RUN_TIME = replace(ROUGH, options=replace(ROUGH.options, run_time="all"))
EFFECT = """
import numpy as np
from postproc.effects.base import Effect, param


class Sag(Effect, reads=("q",)):
    \"\"\"Joint 2 sags by an angle.\"\"\"

    offset_rad: float = param(unit="rad", low=-0.01, high=0.01, typical=1e-4)

    def displacement(self, state):
        dq = np.zeros((len(state), 6))
        dq[:, 1] = self.offset_rad
        return dq
"""
BACKINFO = ">>SYSTEM_ID:\nCell\n\n>>TASK1: (T_MAIN,,)\nPROGMOD/Seam.mod @ \nPROGMOD/Main.mod @ \n\n>>TASK2: (T_BACK,,)\n\n>>EOF:\n"
SYS = """SYS:CFG_1.0:6:0::
#
CAB_TASKS:

      -Name "T_BACK" -Type "SEMISTATIC"

      -Name "T_MAIN" -Type "NORMAL" -UseMechanicalUnitGroup "rob2" -MotionTask
#
MECHANICAL_UNIT_GROUP:

      -Name "rob1" -Robot "ROB_1"

      -Name "rob2" -Robot "ROB_2"\\
      -UseMotionPlanner "motion_planner_2"
#
"""
MOC = """MOC:CFG_1.0:6:0::
#
ROBOT:

      -name "ROB_1" -use_robot_serial_number "rob_1"\\
      -use_robot_type "ROB1_6700_LeanID_2.65_220" -use_robot_calib "r1_uncalib"

      -name "ROB_2" -use_robot_serial_number "rob_2"\\
      -use_robot_type "ROB2_4600_2.05_60" -base_frame_orient_u0 1 {base}
#
"""
ENCRYPTED = b"\xfe\x01\x02\x03secret\x00\x05"


def target(x: float, y: float = 0.0) -> str:
    return f"[[{x},{100 + y},900],[0.092296,0.701057,0.701057,-0.092296],[0,-1,1,0],{AXES}]"


def module(name: str, data: str = "", *body: str) -> str:
    """A module with data and, where there are statements, a main routine."""
    lines = [f"  {data}"] if data else []
    lines += ["  PROC main()", *(f"    {line}" for line in body), "  ENDPROC"] if body else []
    return "\n".join([f"MODULE {name}", *lines, "ENDMODULE\n"])


def program(name: str, x: float = 1200, tool: str = TOOL) -> str:
    """Three short moves; the tool may be declared elsewhere."""
    return (
        f"MODULE {name}\n  {tool}\n  CONST robtarget pStart:={target(x)};\n  PROC r{name}()\n"
        f"    MoveJ pStart,v500,fine,tTorch;\n    MoveL {target(x, 40)},v100,z1,tTorch;\n"
        f"    MoveL {target(x + 10, 80)},v100,fine,tTorch;\n  ENDPROC\nENDMODULE\n"
    )


def write(root: Path, files: Mapping[str, str | bytes]) -> Path:
    for name, content in files.items():
        path = root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content if isinstance(content, bytes) else content.encode("latin-1"))
    return root


def programs(root: Path, count: int) -> Path:
    """A folder with programs that differ, `line0/Seam0.mod`, `line1/Seam1.mod`, `line2/Seam2.mod`, `line0/Seam3.mod`.."""
    x = {i: 1150 + 7 * (i % 50) + i // 50 / 10 for i in range(count)}
    return write(root, {f"line{i % 3}/Seam{i}.mod": program(f"Seam{i}", x[i]) for i in range(count)})


def backup(root: Path, base: str = "", **more: str) -> Path:
    """A controller's backup: two modules and a system module share data, a background task, a copy in HOME."""
    main = module("Main", "", "rSeam;", "MoveJ pShared,v500,fine,tTorch;")
    return write(
        root,
        {
            "BACKINFO/backinfo.txt": BACKINFO,
            "SYSPAR/SYS.cfg": SYS,
            "SYSPAR/MOC.cfg": MOC.replace("{base}", base),
            "HOME/Main.mod": main,
            "RAPID/TASK1/PROGMOD/Main.mod": main,
            "RAPID/TASK1/PROGMOD/Seam.mod": program("Seam", tool=""),
            "RAPID/TASK1/PROGMOD/Prog.pgf": "<Program><Module>Main.mod</Module></Program>",
            "RAPID/TASK1/SYSMOD/user.sys": module(
                "user(SYSMODULE)", f"{TOOL}\n  CONST robtarget pShared:={target(1180)};"
            ),
            "RAPID/TASK1/SYSMOD/Hidden.sys": ENCRYPTED,
            "RAPID/TASK2/PROGMOD/Back.mod": module("Back", "", "WaitTime 1;"),
            **more,
        },
    )


def tree(root: Path) -> dict[str, str]:
    """Every file below a folder, what stands beside the tree of outputs included, with the hash of its bytes."""
    names = {p.relative_to(root).as_posix(): p for p in root.rglob("*") if p.is_file()}
    return {name: hashlib.sha256(path.read_bytes()).hexdigest() for name, path in sorted(names.items())}


@dataclass(frozen=True)
class Made:
    """What a batch made: its result, and its outcomes in the order in which they were told."""

    batch: Batch
    told: list[TaskOutcome]

    @property
    def statuses(self) -> dict[str, str]:
        return {o.task.name: o.status for o in self.batch.outcomes}

    @property
    def cached(self) -> set[str]:
        return {o.task.name for o in self.batch.outcomes if o.cached}

    def findings(self, name: str) -> tuple[Finding, ...]:
        return next(o.findings for o in self.batch.outcomes if o.task.name == name)

    def codes(self, name: str) -> list[str]:
        return [f.code for f in self.findings(name)]


@dataclass(frozen=True)
class Work:
    """A folder with an input `in`, a folder or a jobs file, and an output folder `out`."""

    root: Path
    source: Path
    out: Path

    def write(self, files: Mapping[str, str | bytes]) -> Path:
        return write(self.source, files)

    def remove(self, *names: str) -> None:
        """Take files of the input away, or empty folders."""
        for name in names:
            (self.source / name).rmdir() if (self.source / name).is_dir() else (self.source / name).unlink()

    def convert(self, settings: Settings = ROUGH, pool: Pool = IN_PROCESS, **more: Any) -> Made:
        """Run a batch; further arguments are those of `ready`."""
        told: list[TaskOutcome] = []
        return Made(run_batch(self.ready(settings, **more), pool, told.append), told)

    def ready(self, settings: Settings = ROUGH, shard: Shard = Shard(), report: Path | None = None) -> Ready:
        return get_ready(self.plan(settings), shard, self.out, report)

    def plan(self, settings: Settings = ROUGH) -> BatchPlan:
        return read_plan(self.source, lambda place: settings, self.out)

    def refusal(self, settings: Settings = ROUGH, **more: Any) -> Diagnostic:
        """The only finding for which nothing is converted."""
        (finding,) = refused(lambda: self.convert(settings, **more))
        return finding

    def outputs(self) -> dict[str, str]:
        """The tree of outputs alone, with the hash of each file."""
        return {name: hash_ for name, hash_ in tree(self.out).items() if not name.startswith(".postproc")}

    def edited(self) -> list[str]:
        """Edited files that were put aside, by their path in the tree."""
        folder = self.out / ".postproc" / "edited"
        return sorted(Path(*p.relative_to(folder).parts[1:]).as_posix() for p in folder.rglob("*") if p.is_file())

    def into(self, out: str) -> Work:
        """The same input with another output folder."""
        return replace(self, out=self.root / out)


def work_in(root: Path, source: str = "in") -> Work:
    return Work(root, root / source, root / "out")


def start(source: Path, out: Path, *options: str) -> subprocess.Popen[bytes]:
    """A batch in a process of its own."""
    words = ["batch", str(source), "-o", str(out), "--tolerance", "0.1", "--robot", ARM, *options]
    return subprocess.Popen(
        [sys.executable, "-m", "postproc", *words],
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        # A shell starts what runs in its background deaf to SIGINT, and children inherit that.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
