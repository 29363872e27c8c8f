"""Batches: ``python -m tests.bench.batch [--count 1000] [--kills 10]``.

Prints how much faster two workers are than one on many small programs, and whether a run that is killed ten times leaves
the same bytes as one that nobody disturbed.
"""

from __future__ import annotations

import argparse
import random
import resource
import tempfile
import time
from pathlib import Path

from tests.batch.folders import programs, tree
from tests.batch.killing import finish, gone, kill_when, outputs, start


def processor_time() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def timed(source: Path, out: Path, workers: int) -> tuple[float, float]:
    """Seconds by the clock, and of processor time in all processes: that counts where others use the machine too."""
    begin, used = time.perf_counter(), processor_time()
    finish(start(source, out, "--workers", str(workers)))
    return time.perf_counter() - begin, processor_time() - used


def main(argv: list[str] | None = None) -> int:
    o = argparse.ArgumentParser()
    o.add_argument("--count", type=int, default=1000)
    o.add_argument("--kills", type=int, default=10)
    o.add_argument("--seed", type=int, default=1)
    a = o.parse_args(argv)
    with tempfile.TemporaryDirectory() as name:
        root = Path(name)
        source = programs(root / "in", a.count)
        one, one_used = timed(source, root / "one", 1)
        two, two_used = timed(source, root / "two", 2)
        same = tree(root / "one") == tree(root / "two")
        print(
            f"{a.count} programs: {one:.1f} s with one worker, {two:.1f} s with two, {one / two:.2f} times", flush=True
        )
        print(
            f"processor time: {one_used:.1f} s and {two_used:.1f} s, on free cores {2 * one_used / two_used:.2f} times"
        )
        again, _ = timed(source, root / "one", 1)
        print(f"a second run: {again:.1f} s; trees equal: {same}", flush=True)
        if not a.kills:
            return 0 if same else 1
        draw, out, left = random.Random(a.seed), root / "killed", []
        for kill in range(a.kills):
            least = outputs(out) + draw.randrange(0, max(2, a.count // (a.kills + 1)))
            pause = draw.uniform(0, 0.1)

            def ripe(least: int = least, pause: float = pause) -> bool:
                reached = outputs(out) >= least
                if reached:
                    time.sleep(pause)
                return reached

            left += kill_when(start(source, out, "--workers", "2"), ripe, limit=600)
            print(f"kill {kill + 1}: {outputs(out)} of {a.count} done", flush=True)
        finish(start(source, out, "--workers", "2"))
        same = tree(out) == tree(root / "one")
        print(f"killed {a.kills} times: trees equal: {same}; workers left behind: {not gone(left)}")
    return 0 if same else 1


if __name__ == "__main__":
    raise SystemExit(main())
