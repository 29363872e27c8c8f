"""Folders with small programs, and what a batch made of them."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

from postproc.batch.executors import Pool
from postproc.batch.jobs import Ready, get_ready
from postproc.batch.jobsfile import read_plan
from postproc.batch.run import run_batch
from postproc.batch.values import Batch, BatchPlan, Shard, TaskOutcome
from postproc.compensation.options import Options
from postproc.settings import Settings

HERE = Pool(lambda count: ThreadPoolExecutor(1), 1)  # no processes: quick
AXES = "[9E9,9E9,9E9,9E9,9E9,9E9]"
TOOL = "PERS tooldata tTorch:=[TRUE,[[0,0,350],[1,0,0,0]],[5,[0,0,120],[1,0,0,0],0,0,0]];"
ARM = "irb4600_60_205"
ROUGH = Settings(robot=ARM, options=Options(tolerance_m=1e-4))
UNNAMED = replace(ROUGH, robot=None)

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


def target(x: float, y: float = 0.0) -> str:
    return f"[[{x},{100 + y},900],[0.092296,0.701057,0.701057,-0.092296],[0,-1,1,0],{AXES}]"


def program(name: str, x: float = 1200, tool: str = TOOL) -> str:
    """Three short moves; the tool may be declared elsewhere."""
    return (
        f"MODULE {name}\n  {tool}\n  CONST robtarget pStart:={target(x)};\n  PROC r{name}()\n"
        f"    MoveJ pStart,v500,fine,tTorch;\n    MoveL {target(x, 40)},v100,z1,tTorch;\n"
        f"    MoveL {target(x + 10, 80)},v100,fine,tTorch;\n  ENDPROC\nENDMODULE\n"
    )


def write(root: Path, files: dict[str, str | bytes]) -> Path:
    for name, content in files.items():
        path = root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content if isinstance(content, bytes) else content.encode("latin-1"))
    return root


def programs(root: Path, count: int) -> Path:
    """A folder with programs that differ."""
    return write(
        root,
        {f"line{i % 3}/Seam{i}.mod": program(f"Seam{i}", 1150 + 7 * (i % 50) + i // 50 / 10) for i in range(count)},
    )


def convert(
    folder: Path, out: Path, settings: Settings = ROUGH, pool: Pool = HERE, shard: Shard = Shard()
) -> tuple[Batch, list[TaskOutcome]]:
    """Run a batch; its result, and the outcomes in the order in which they were told."""
    told: list[TaskOutcome] = []
    return run_batch(ready(folder, out, settings, shard), pool, told.append), told


def planned(folder: Path, out: Path, settings: Settings = ROUGH) -> BatchPlan:
    return read_plan(folder, lambda place: settings, out)


def ready(folder: Path, out: Path, settings: Settings = ROUGH, shard: Shard = Shard()) -> Ready:
    return get_ready(planned(folder, out, settings), shard, out)


def statuses(batch: Batch) -> dict[str, str]:
    return {o.task.name: o.status for o in batch.outcomes}


def cached(batch: Batch) -> set[str]:
    return {o.task.name for o in batch.outcomes if o.cached}


def codes(batch: Batch, name: str) -> list[str]:
    return [f.code for o in batch.outcomes if o.task.name == name for f in o.findings]


def tree(root: Path, without: Sequence[str] = ()) -> dict[str, str]:
    """Every file below a folder, what stands beside the tree of outputs included, with the hash of its bytes."""
    names = {p.relative_to(root).as_posix(): p for p in root.rglob("*") if p.is_file()}
    return {
        name: hashlib.sha256(path.read_bytes()).hexdigest()
        for name, path in sorted(names.items())
        if not name.startswith(tuple(without))
    }
