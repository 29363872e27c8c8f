"""Mutational fuzzing: ``python -m tests.fuzz [--programs N] [--models N] [--tables N] [--seed S] [--seconds T]``.

Every program is read and followed, some are inspected, converted, and taken through the command line; models and tables
are read. A traceback, a hang, a lost byte or half an output is a failure: its input is kept in the folder of ``--save``
and the exit code is 1.
"""

from __future__ import annotations

import os

os.environ.update({"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"})

import argparse
import sys
import time
import traceback
import warnings
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from random import Random

from tests.fuzz import checks, seeds

Check = Callable[[bytes], bool]


@dataclass
class Tally:
    """What came out of one kind of input."""

    kind: str
    inputs: int = 0
    good: int = 0
    extra: dict[str, int] = field(default_factory=dict)
    failures: dict[str, int] = field(default_factory=dict)
    hangs: int = 0
    seconds: float = 0.0
    slowest: float = 0.0
    slowest_size: int = 0

    def render(self) -> str:
        rate = self.inputs / self.seconds if self.seconds else 0.0
        extra = "".join(f", {count} {name}" for name, count in self.extra.items())
        failed = sum(self.failures.values())
        return (
            f"{self.kind:9} {self.inputs:8} inputs ({self.good} without errors{extra}), {failed} failures, {self.hangs} hangs, "
            f"{rate:.0f} per second, slowest {self.slowest:.2f} s ({self.slowest_size} bytes)"
        )


def main(arguments: list[str]) -> int:
    given = _options().parse_args(arguments)
    warnings.simplefilter("error")
    tallies = fuzz(given.programs, given.models, given.tables, given.seed, given.seconds, given.save, given.status)
    failed = sum(sum(t.failures.values()) + t.hangs for t in tallies)
    print("\n".join(t.render() for t in tallies))
    for tally in tallies:
        for place, count in sorted(tally.failures.items(), key=lambda item: -item[1]):
            print(f"  {tally.kind}: {count} x {place}")
    print(f"{sum(t.inputs for t in tallies)} inputs, {failed} failed; seed {given.seed}")
    return int(failed > 0)


def fuzz(
    programs: int, models: int, tables: int, seed: int = 0, seconds: float | None = None, save: Path | None = None,
    status: float = 60.0,
) -> list[Tally]:  # fmt: skip
    """So many inputs of each kind, in turn, or as many as fit into ``seconds``; the same seed gives the same inputs."""
    random = Random(seed)
    model = checks.shipped_model()
    makers = {
        "program": seeds.program_mutator(random),
        "model": seeds.model_mutator(random),
        "table": seeds.table_mutator(random),
    }
    wanted = {"program": programs, "model": models, "table": tables}
    every: dict[str, tuple[Check, list[tuple[int, str, Check]]]] = {
        "program": (checks.check_program, [
            (200, "inspected", lambda d: checks.check_inspection(d, model)),
            (1000, "converted", lambda d: checks.check_conversion(d, model)),
            (5000, "by command", lambda d: checks.check_command("program", d)),
        ]),
        "model": (checks.check_model, [
            (20, "written", lambda d: checks.check_model(d, rendered=True)),
            (1000, "by command", lambda d: checks.check_command("model", d)),
        ]),
        "table": (lambda d: checks.check_table(d, model), [(1000, "by command", lambda d: checks.check_command("table", d))]),
    }  # fmt: skip
    tallies = {kind: Tally(kind) for kind in wanted}
    end = time.monotonic() + seconds if seconds is not None else float("inf")
    said, total = time.monotonic(), max(1, sum(wanted.values()))
    for number in range(total):
        now = time.monotonic()
        if now > end:
            break
        if now - said > status:
            said = now
            print("\n".join(t.render() for t in tallies.values()), flush=True)
        # The kind that is furthest behind its share comes next.
        kind = min((k for k in wanted if wanted[k]), key=lambda k: tallies[k].inputs / wanted[k], default=None)
        if kind is None:
            break
        tally, data = tallies[kind], makers[kind].make()
        main_check, more = every[kind]
        tally.good += _try(main_check, data, tally, save, number)
        for interval, name, check in more:
            if tally.inputs % interval == 0:
                _try(check, data, tally, save, number)
                tally.extra[name] = tally.extra.get(name, 0) + 1
        tally.inputs += 1
        tally.seconds += time.monotonic() - now
    return list(tallies.values())


def _try(check: Check, data: bytes, tally: Tally, save: Path | None, number: int) -> bool:
    begin = time.process_time()
    try:
        with checks.limited(checks.SECONDS):
            return check(data)
    except checks.Hang:
        tally.hangs += 1
        _keep(data, "a hang", tally, save, number)
    except Exception as error:
        last = traceback.extract_tb(error.__traceback__)[-1]
        place = f"{type(error).__name__} at {Path(last.filename).name}:{last.lineno} {str(error)[:80]}"
        tally.failures[place] = tally.failures.get(place, 0) + 1
        if tally.failures[place] <= 3:
            _keep(data, "".join(traceback.format_exception(error, limit=-8))[-3000:], tally, save, number)
    finally:
        spent = time.process_time() - begin
        if spent > tally.slowest:
            tally.slowest, tally.slowest_size = spent, len(data)
    return False


def _keep(data: bytes, reason: str, tally: Tally, save: Path | None, number: int) -> None:
    print(f"{tally.kind} {number}: {reason}", file=sys.stderr, flush=True)
    if save is not None:
        save.mkdir(parents=True, exist_ok=True)
        (save / f"{tally.kind}-{number}").write_bytes(data)


def _options() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz", description=(__doc__ or "").split("\n\n")[1])
    parser.add_argument("--programs", type=int, default=8000, help="mutated programs (default 8000)")
    parser.add_argument("--models", type=int, default=1000, help="mutated model files (default 1000)")
    parser.add_argument("--tables", type=int, default=1000, help="mutated measurement tables (default 1000)")
    parser.add_argument("--seed", type=int, default=0, help="repeats a run (default 0)")
    parser.add_argument("--seconds", type=float, help="stop after so long")
    parser.add_argument("--save", type=Path, help="folder for inputs that failed")
    parser.add_argument("--status", type=float, default=60.0, help="seconds between lines of progress")
    return parser


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
