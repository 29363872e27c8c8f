"""How near the module for run time brings the real TCP, over many targets: ``python -m tests.bench.runtime [COUNT [ARM..]]``.

The module is run by the interpreter of the worlds, the arm is the independent one. 50 ms a target.
"""

from __future__ import annotations

import sys
import time

import numpy as np

from tests.independent import arm as A
from tests.runtime.arms import CENTER, FORCE, mapped, soft_bodies, springs
from tests.runtime.test_accuracy import misses


def main(count: int, arms: list[str]) -> None:
    for make, force, routine in (
        (springs, FORCE, "weld"),
        (soft_bodies, FORCE, "weld"),
        (mapped, np.zeros(3), "object"),
    ):
        if arms and make.__name__ not in arms:
            continue
        real, start = make(), time.process_time()
        module = real.written(force=force)
        found, returned = misses(real, module.text, count, routine, A.Load(real.mass, CENTER, force), seed=101)
        print(
            f"{make.__name__:12} {len(found)} corrected, {returned} returned: largest {found.max():.4f} mm, "
            f"rms {np.sqrt(np.mean(found**2)):.4f} mm; {time.process_time() - start:.0f} s",
            flush=True,
        )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 1000, sys.argv[2:])
