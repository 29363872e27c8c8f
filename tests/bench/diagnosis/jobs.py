"""One line of the results: a set, a method, the rules that are switched off; run in a process of the pool."""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

THINNED = ("library", "four", "pairs")
"""Kinds whose sets are thinned in turn where stability is counted."""
ROWS = {176: 150, 1316: 1290, 2000: 1974}
"""Rows of the tables whose cost is measured, and the poses that give so many."""


@dataclass(frozen=True)
class Job:
    """One line of the results. Args: kind, index: of the set; method: ``postproc`` or a baseline; without: rules;
    true_error: of the true model refitted, where it is known."""

    kind: str
    index: int
    method: str
    without: str
    label: str
    real: str
    thinnings: int
    true_error: float | None = None

    @property
    def key(self) -> tuple[str, int, str, str, str]:
        return self.kind, self.index, self.method, self.without, self.label


def run(job: Job) -> dict[str, Any]:
    """The figures of a set; an error is one of them."""
    from tests.bench.diagnosis import rules, sets
    from tests.bench.diagnosis.bad_rows import named_rows

    begin = time.process_time()
    line = {"kind": job.kind, "index": job.index, "method": job.method, "without": job.without, "label": job.label}
    with rules.without(job.without):
        try:
            line |= _figures(job)
        except sets.Refused as refused:
            named = named_rows(str(refused))
            word = "refused" if named >= refused.wrong else "error"
            line |= {"set": f"{job.kind} #{job.index}", "word": word, "error": str(refused)[:300]}
        except Exception as error:
            line |= {"set": line.get("set", ""), "word": "error", "error": f"{type(error).__name__}: {error}"[:300]}
    return {k: _short(v) for k, v in (line | {"cpu_s": time.process_time() - begin}).items()}


def _figures(job: Job) -> dict[str, Any]:
    from tests.bench.diagnosis import addition, baselines, judge, octants, sets
    from tests.independent import library_effects as K

    if job.kind == "real":
        one = sets.real(list(sets.REAL)[job.index % 2], Path(job.real), job.index // 2)
    elif job.kind == "size":
        recipe = sets.Recipe((K.backlash, K.arm_load), poses=list(ROWS.values())[job.index])
        one = sets.drawn("size", job.index, recipe, 222)
    elif job.kind == "stability":
        kind, i = THINNED[job.index % len(THINNED)], job.index // len(THINNED)
        one = sets.drawn(kind, i, sets.KINDS[kind][1](i), sets.seed_of(kind, i))
        names = judge.first_names(one, 0.7, job.thinnings, job.index)
        base = judge.base_fit(one)
        assert one.noise is not None
        strong = base.rms > (3.0**2 + 1) ** 0.5 * one.noise
        return {"set": f"{kind}: {one.name}", "names": names, "strong": bool(strong)}
    elif job.kind == "octants":
        one = octants.octant_set(job.index, Path(job.real))
        return {"set": f"{one.kind}: {one.name}", **octants.run(one)}
    elif job.kind in addition.KINDS:
        one = addition.KINDS[job.kind][1](job.kind, job.index)
        return {"set": f"{one.kind}: {one.name}", **addition.run(one, job.true_error)}
    elif job.kind in sets.CELLS:
        one = sets.cell_set(job.kind, job.index)
    else:
        one = sets.drawn(job.kind, job.index, sets.KINDS[job.kind][1](job.index), sets.seed_of(job.kind, job.index))
    found = judge.run(one, job.true_error) if job.method == "postproc" else baselines.run(job.method, one)
    return {"set": f"{one.kind}: {one.name}", **found}


def _short(value: Any) -> Any:
    return float(f"{value:.4g}") if isinstance(value, float) else value
