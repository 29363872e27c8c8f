"""How long fit and diagnose take: ``python -m tests.bench.identify [ROWS ..]``; one thread, all effects of the library.

Each size twice: positions with lost motion and a mass on the arm, then positions and orientations with a map of joint
errors, the effect with most parameters.
"""

from __future__ import annotations

import os
import sys
import time
from dataclasses import replace

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(name, "1")

TURN = 5e-5  # [rad] noise of the orientations


def main(rows: list[int]) -> None:
    import numpy as np
    from scipy.spatial.transform import Rotation

    from postproc.model.equilibrium import predict
    from tests.identify.cells import base_fit, cell
    from tests.independent import library_effects as kinds

    for n in rows:
        data, _ = cell(kinds.backlash, kinds.arm_load, seed=222, poses=round(n * 0.86))
        timed(data, "positions")
        data, _ = cell(kinds.joint_error_map, kinds.backlash, seed=223, poses=round(n * 0.86))
        whole = base_fit(data, more=("backlash", "joint_error_map"))
        seen = predict(whole.model, data.state)[:, :3, :3]
        noise = Rotation.from_rotvec(np.random.default_rng(5).normal(0, TURN, (len(data), 3))).as_matrix()
        timed(replace(data, rotation=noise @ seen), "positions and orientations")


def timed(data, what: str) -> None:
    from postproc.identify.diagnose import diagnose
    from tests.identify.cells import base_fit

    start, busy = time.perf_counter(), time.process_time()
    plain = base_fit(data)
    fitted = time.perf_counter()
    base_fit(data, more=("link_geometry",))
    geometry, before = time.perf_counter(), time.process_time()
    found = diagnose(plain.model, data)
    done, after = time.perf_counter(), time.process_time()
    print(
        f"{len(data):6d} rows, {what}: fit {fitted - start:.2f} s, with link geometry {geometry - fitted:.2f} s, "
        f"diagnose {done - geometry:.2f} s ({after - before:.1f} s of processor, {after - busy:.1f} s in all) "
        f"-> {found.verdict} {[m.candidate.key for m in found.missing]}",
        flush=True,
    )


if __name__ == "__main__":
    main([int(x) for x in sys.argv[1:]] or [174, 1500, 12000])
