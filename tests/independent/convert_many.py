"""Generated programs through the product's command line and the checker: ``python -m tests.independent.convert_many DIR``."""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tests.independent import arm as A
from tests.independent import generate_programs, untidy, verify

FORCE = "200,-200,-200"


@dataclass
class Outcome:
    seed: int
    code: int
    said: str
    seconds: float
    report: verify.Report | None
    claimed: float | None = None
    air: float = 0.01

    @property
    def faults(self) -> list[str]:
        """What breaks the promise: 0.01 mm along what welds, ``air`` [mm] along other lines and arcs and at goals, 15
        added targets per metre, a clean diff.
        """
        if self.report is None:
            return [f"exit {self.code}: {self.said[:300]}"]
        r, found = self.report, list(self.report.violations)
        weld = max((s.after for s in r.segments if s.counted and s.welding), default=0.0)
        if r.after > self.air or weld > 0.01:
            found.append(f"path {r.after:.4f} mm, {weld:.4f} mm while the arc burns")
        if r.goal_after > self.air:
            found.append(f"goal {r.goal_after:.4f} mm")
        if r.added_per_metre > 15:
            found.append(f"{r.added_per_metre:.1f} added per metre")
        if self.claimed is not None and r.after > 1.2 * self.claimed + 0.002:
            found.append(f"claims {self.claimed:.4f} mm")
        return found


def convert(source: Path, output: Path, *options: str, timeout: float = 300) -> tuple[int, str, str]:
    command = [
        sys.executable,
        "-m",
        "postproc",
        "compensate",
        str(source),
        "-o",
        str(output),
        "--inertia",
        "off",
        *options,
    ]
    env = {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    r = subprocess.run(command, capture_output=True, text=True, timeout=timeout, env=env, check=False)
    return r.returncode, r.stdout, r.stderr


def run(
    folder: Path,
    seed: int,
    geometry: str = "irb4600_60_205",
    force: str = FORCE,
    hard: bool = False,
    wild: bool = False,
    air: float = 0.01,
) -> Outcome:
    """Convert one generated program; ``air``: tolerance of the ways in the air [mm]."""
    folder.mkdir(parents=True, exist_ok=True)
    source, output = folder / f"weld{seed:05d}.mod", folder / f"weld{seed:05d}.out.mod"
    ranges = generate_programs.WILD if wild else generate_programs.Ranges()
    text = generate_programs.generate(seed, geometry, ranges=ranges)
    text = untidy.complicate(text, seed) if hard else text
    source.write_bytes(text.encode("latin-1"))
    output.unlink(missing_ok=True)
    start = time.perf_counter()
    code, out, err = convert(
        source, output, "--force", force, "--air-tolerance", str(air), "--json", "--robot", geometry
    )
    seconds = time.perf_counter() - start
    if not output.exists():
        return Outcome(seed, code, err.strip() or out.strip(), seconds, None, air=air)
    try:
        claimed = float(json.loads(out)["max_error_after_mm"])
    except (ValueError, KeyError, TypeError):
        claimed = None
    push = np.array([float(x) for x in force.split(",")])
    report = verify.check(verify.read_text(source), verify.read_text(output), A.ARMS[geometry](), push)
    return Outcome(seed, code, err.strip(), seconds, report, claimed, air)


def main(argv: list[str] | None = None) -> int:
    o = argparse.ArgumentParser()
    o.add_argument("folder", type=Path)
    o.add_argument("--seed", type=int, default=1)
    o.add_argument("--count", type=int, default=20)
    o.add_argument("--geometry", default="irb4600_60_205")
    o.add_argument("--force", default=FORCE)
    o.add_argument("--wild", action="store_true")
    o.add_argument("--hard", action="store_true")
    a = o.parse_args(argv)
    good = 0
    for seed in range(a.seed, a.seed + a.count):
        x = run(a.folder, seed, a.geometry, a.force, a.hard, a.wild)
        good += not x.faults
        r = x.report
        figures = (
            f"{r.before:.3f} -> {r.after:.4f} (goals {r.goal_after:.4f}, cut {r.cut_after:.4f}) claimed {x.claimed}, +{r.added} "
            f"{r.added_per_metre:.1f}/m (worst {r.worst_seam_per_metre:.1f})"
            if r
            else "no output"
        )
        print(f"{seed:5d} exit {x.code} {x.seconds:4.1f} s {figures} {'; '.join(x.faults[:6])}", flush=True)
    print(f"{good} of {a.count} as promised")
    return 0 if good == a.count else 1


if __name__ == "__main__":
    raise SystemExit(main())
