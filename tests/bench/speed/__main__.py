"""``python -m tests.bench.speed [--quick] [--json FILE] [--against FILE] [--write PAGE] [--only PART..]``.

Prints the table; exit code 1 where ``--against`` finds something slower by more than the noise.
"""

from __future__ import annotations

# ruff: noqa: E402 - threads are counted when numpy is first imported
import os

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(_name, "1")
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)  # programs start with their bytecode, as for users

import argparse
import json
import platform
import subprocess
import sys
from collections.abc import Iterable, Sequence
from dataclasses import asdict
from pathlib import Path
from statistics import median

from tests.bench.speed.figures import QUICK, Sizes, parts
from tests.bench.speed.table import CALIBRATION, Figure, Run, compared, growth, load, markdown, save

OTHERS = "others used the machine"
BUSY = 1.0  # load average beside the run itself above which the figures say so


def main(arguments: Sequence[str] | None = None) -> int:
    o = argparse.ArgumentParser(prog="python -m tests.bench.speed")
    o.add_argument("--quick", action="store_true", help="small sizes in one process: a test that all of it works")
    o.add_argument("--json", type=Path, help="file to save the figures in")
    o.add_argument("--against", type=Path, help="saved figures to compare with")
    o.add_argument("--write", type=Path, help="page of the documentation to write")
    o.add_argument("--only", nargs="*", help="parts to measure")
    o.add_argument("--one", help=argparse.SUPPRESS)
    a = o.parse_args(arguments)
    sizes = QUICK if a.quick else Sizes()
    if a.one:
        print(json.dumps([asdict(f) for f in parts(sizes)[a.one]()]))
        return 0
    load_before = os.getloadavg()[0]
    names = [name for name in parts(sizes) if a.only is None or name in (*a.only, "calibration")]
    figures = list(measured(names, sizes, a.quick))
    run = Run(tuple([*figures, *derived(figures, sizes)]), machine(load_before))
    print("\n".join(line for line in markdown(run).splitlines() if line.startswith("|")))
    if a.json is not None:
        save(run, a.json)
    if a.write is not None:
        a.write.write_text(markdown(run), "utf-8")
    if a.against is None:
        return 0
    saved = load(a.against)
    worse, better = compared(run, saved)
    if any(OTHERS in words for found in (run, saved) for words in found.machine.values()):
        print("others used the machine in one of the runs: differences of a tenth mean little")
    for what, lines in (("slower or larger", worse), ("better", better)):
        print(f"{what} by more than the noise: {'; '.join(lines) or 'nothing'}")
    return int(bool(worse))


def measured(names: Iterable[str], sizes: Sizes, quick: bool) -> Iterable[Figure]:
    """Figures of every part; the machine is measured again at the end, so that its unevenness shows."""
    found: list[Figure] = []
    for name in [*names, "calibration"]:
        print(f"{name} ..", file=sys.stderr, flush=True)
        found += parts(sizes)[name]() if quick else _apart(name)
    first, *between, last = found
    values = first.values + last.values
    return [Figure(CALIBRATION, "s", values), *between]


def _apart(name: str) -> list[Figure]:
    """Figures of one part, measured in a process of its own."""
    command = [sys.executable, "-m", "tests.bench.speed", "--one", name]
    done = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True)
    lists = ("values", "peer_values")
    rows = json.loads(done.stdout.splitlines()[-1])
    return [Figure(**{k: tuple(v) if k in lists else v for k, v in row.items()}) for row in rows]


def derived(figures: Sequence[Figure], sizes: Sizes) -> list[Figure]:
    """Growth of time with the number of targets, and memory for each."""
    by_name = {f.name: f for f in figures}
    times = [by_name.get(f"`compensate` {n:,} targets") for n in sizes.targets]
    peaks = [by_name.get(f"`compensate` {n:,} targets, peak memory") for n in sizes.targets]
    known = [(n, f.values) for n, f in zip(sizes.targets, times, strict=True) if f is not None]
    memory = [f.median for f in peaks if f is not None]
    if not len(known) == len(memory) == len(sizes.targets):
        return []
    each = [Figure(f"CPU time a target, {n:,} targets", "ms", tuple(1e3 * t / n for t in v)) for n, v in known]
    (few, first), (many, last) = known[0], known[-1]
    ends = ((max(first), min(last)), (median(first), median(last)), (min(first), max(last)))
    added = 1e3 * (memory[-1] - memory[-2]) / (sizes.targets[-1] - sizes.targets[-2])
    return [
        *each,
        Figure("growth of CPU time with the targets", "exponent", tuple(growth((few, many), pair) for pair in ends)),
        Figure("memory a target", "kB", (added,), 6.0),
    ]


def machine(load_before: float) -> dict[str, str]:
    """What the figures were measured on."""
    words = {"processor": platform.processor() or platform.machine(), "cores": str(os.cpu_count())}
    info = Path("/proc/cpuinfo")
    if info.exists():
        named = (
            line.split(":", 1)[1].strip() for line in info.read_text().splitlines() if line.startswith("model name")
        )
        words["processor"] = next(named, words["processor"])
    words["Python"] = platform.python_version()
    after = os.getloadavg()[0]
    busy = max(load_before, after - 1) > BUSY
    told = f"; {OTHERS}: times are upper bounds, and the ratio of two workers says little" if busy else ""
    words["load average before and after"] = f"{load_before:.1f}, {after:.1f} (of which 1 is the run itself){told}"
    return words


if __name__ == "__main__":
    raise SystemExit(main())
