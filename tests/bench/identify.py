"""How long fit and diagnose take: ``python -m tests.bench.identify [ROWS ..]``; one thread, all effects of the library."""

from __future__ import annotations

import os
import sys
import time

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(name, "1")


def main(rows: list[int]) -> None:
    from postproc.identify.diagnose import diagnose
    from tests.identify.cells import base_fit, cell
    from tests.independent import library_effects as kinds

    for n in rows:
        data, _ = cell(kinds.backlash, kinds.arm_load, seed=222, poses=round(n * 0.86))
        start = time.perf_counter()
        plain = base_fit(data)
        fitted = time.perf_counter()
        base_fit(data, more=("link_geometry",))
        geometry = time.perf_counter()
        found = diagnose(plain.model, data)
        done = time.perf_counter()
        print(
            f"{len(data):6d} rows: fit {fitted - start:.2f} s, with link geometry {geometry - fitted:.2f} s, "
            f"diagnose {done - geometry:.2f} s -> {found.verdict} {[m.candidate.key for m in found.missing]}"
        )


if __name__ == "__main__":
    main([int(x) for x in sys.argv[1:]] or [174, 1500, 12000])
