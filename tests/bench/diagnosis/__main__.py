"""The scorecard: ``python -m tests.bench.diagnosis [--seeds N] [--without RULE] [--only KIND] ..``; writes docs/scorecard.md.

Every set is one line of a JSON-lines file under the revision of the code, the method and the rules switched off; what
stands there is not run again, so that a run can be stopped and taken up, and two revisions can be compared.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path
from typing import Any

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(name, "1")

from tests.bench.diagnosis.jobs import ROWS, Job, run  # noqa: E402

ROOT = Path(__file__).parents[3]
RESULTS = Path(__file__).parent / "results.jsonl"


def jobs(a: argparse.Namespace) -> list[Job]:
    """All that is asked for, the kinds in turn, so that a run that is stopped has some of each."""
    from tests.bench.diagnosis import addition, octants, sets

    every = {kind: number for kind, (number, _) in sets.KINDS.items()}
    if a.method == "postproc":
        every |= {kind: number for kind, (number, _) in addition.KINDS.items()}
        every |= sets.CELLS | {"real": 5 * len(sets.REAL), "octants": octants.COUNT, "size": len(ROWS), "stability": 9}
    else:
        every.pop("encoder")
    found: list[tuple[float, Job]] = []
    for kind in a.only.split(",") if a.only else every:
        count = min(every[kind], a.most) if a.most else round(every[kind] * a.seeds)
        for i in range(a.start, count):
            job = Job(kind, i, a.method, a.without, a.label, a.real, a.thinnings)
            found.append((i / max(count, every[kind]), job))
    return [job for _, job in sorted(found, key=lambda pair: pair[0])]


def main(argv: list[str] | None = None) -> int:
    o = argparse.ArgumentParser(description=__doc__)
    o.add_argument("--seeds", type=float, default=1.0, help="how many times all sets of a kind; 0.5 is half of them")
    o.add_argument("--most", type=int, default=0, help="at most so many sets of every kind")
    o.add_argument("--start", type=int, default=0, help="first set of every kind")
    o.add_argument(
        "--only", default="", help="kinds, joined by commas; those that cost time alone: real,octants,size,stability"
    )
    o.add_argument("--without", default="", help="rules of the search that are switched off, joined by +")
    o.add_argument("--method", default="postproc", choices=["postproc", "bic", "gp", "sparse"])
    o.add_argument("--label", default="", help="of the code; the revision where none is given")
    o.add_argument("--workers", type=int, default=1)
    o.add_argument("--thinnings", type=int, default=20)
    o.add_argument("--real", default=str(ROOT / "samples" / "measurements"), help="folder of the real tables")
    o.add_argument("--results", type=Path, default=RESULTS)
    o.add_argument("--again", action="store_true", help="run what stands in the results, too")
    o.add_argument("--card", action="store_true", help="only write the page from the results")
    o.add_argument("--against", default="", help="labels to compare with on the terminal, joined by commas")
    o.add_argument("--rest", default="", help="label whose results stand in the page for sets that were not run")
    a = o.parse_args(argv)
    a.label = a.label or revision()
    if not a.card:
        measured(a)
    from tests.bench.diagnosis.card import compared, page, read, summary

    every = read(a.results)
    if a.card:
        (ROOT / "docs" / "scorecard.md").write_text(page(every, a.label, a.rest))
    elif a.against:
        print(compared(every, a.label, a.against))
    else:
        print(summary([x for x in every if (x["label"], x["without"], x["method"]) == (a.label, a.without, a.method)]))
    return 0


def measured(a: argparse.Namespace) -> None:
    from tests.bench.diagnosis.card import read

    every = read(a.results)
    known = {(x["kind"], x["index"], x["method"], x["without"], x["label"]) for x in every}
    # The true model is refitted once for each set, so that all revisions are measured by the same.
    true = {(x["kind"], x["index"]): x["true_error"] for x in every if x.get("true_error")}
    left = [
        replace(job, true_error=true.get((job.kind, job.index))) for job in jobs(a) if a.again or job.key not in known
    ]
    # What a process has held before is in its peak, so that a size is measured in a process of its own.
    parts = [[job] for job in left if job.kind == "size"] + [[job for job in left if job.kind != "size"]]
    for some in parts:
        with ProcessPoolExecutor(a.workers, get_context("spawn")) as pool, a.results.open("a") as out:
            for line in pool.map(run, some):
                out.write(json.dumps(line) + "\n")
                out.flush()
                print(_told(line), flush=True)


def _told(x: dict[str, Any]) -> str:
    ratio = x["after"] / x["noise"] if "after" in x and x.get("noise") else float("nan")
    said = f"{x.get('said', '')} {x.get('named', x.get('names', ''))} {x.get('suspects', [])[:3]}"
    return f"{x.get('set', '')[:60]:60s} {x.get('word', ''):16s} {ratio:6.2f} {x['cpu_s']:6.1f} s  {said} {x.get('error', '')}"


def revision() -> str:
    """The revision of the code, with a plus where files differ from it."""

    def git(*words: str) -> str:
        return subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True, check=False).stdout.strip()

    return git("rev-parse", "--short", "HEAD") + ("+" if git("status", "--porcelain", "--", "postproc") else "")


if __name__ == "__main__":
    sys.exit(main())
