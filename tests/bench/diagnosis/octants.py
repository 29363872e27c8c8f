"""Real tables with an octant of joints 1, 2, 3 held out as a whole: ``python -m tests.bench.diagnosis --only octants``."""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from postproc.diagnostics import PostprocError
from postproc.effects.registry import effect_library
from postproc.estimation.least_squares import fit_model
from postproc.estimation.recorded import recorded_model
from postproc.identification.add import fit_effects
from postproc.identification.diagnose import diagnose
from postproc.identification.predict import predict_rows
from postproc.model.arm import Model
from tests.bench.diagnosis.addition import added
from tests.bench.diagnosis.judge import answer
from tests.bench.diagnosis.sets import REAL, Set, real

COUNT = 8 * len(REAL)
FEWEST = 30
"""Rows of an octant that are judged; an arm whose elbow bends one way has octants with hardly any."""


def octant_set(index: int, folder: Path) -> Set:
    """The set of a number: tables in turn, of each the octants of joints 1, 2, 3 about their medians."""
    name, octant = list(REAL)[index % len(REAL)], index // len(REAL)
    one = real(name, folder, 0)
    assert one.whole is not None
    q = one.whole.state.q[:, :3]
    held = ((q > np.median(q, axis=0)) == [bool(octant >> j & 1) for j in range(3)]).all(axis=1)
    signs = "".join("+" if octant >> j & 1 else "-" for j in range(3))
    return replace(one, kind="octants", name=f"{name} {signs}", data=one.whole.rows(~held), true=one.whole.rows(held))


def run(one: Set) -> dict[str, Any]:
    """Figures of the first model and of the improved one in the octant; distances in space [m], times [s] of the processor.

    `held`: number of rows, and of those that a fit of the whole table can reach, which are judged.
    """
    assert one.whole is not None
    if len(one.true) < FEWEST:
        return {"held": [len(one.true), 0]}
    begin = time.process_time()
    fit = fit_effects(one.start, one.data, [effect_library()[key] for key in one.base])
    first = recorded_model(fit)
    d = diagnose(first, one.data)
    found = time.process_time()
    improved, refused = added(first, one, d)
    result = {"diagnose_s": found - begin, "add_s": time.process_time() - found, "rows": len(one.data), **answer(d)}
    # A row that lies far off though the same model was fitted to it is a bad reading.
    every = fit_model(improved, one.whole)
    reached = ~np.isin(one.true.pose_id, [every.data.pose_id[i] for i in every.excluded])
    result |= {"refused": refused, "held": [len(one.true), int(reached.sum())]}
    try:
        return {**result, "first": _figures(first, one, reached), "improved": _figures(improved, one, reached)}
    except PostprocError as why:
        return {**result, "error": "; ".join(x.message for x in why.diagnostics)}


def _figures(model: Model, one: Set, rows: np.ndarray) -> list[float]:
    """Rms error in space [m], the stated one, share of coordinates inside 95 % intervals of a measurement."""
    predicted = predict_rows(model, one.true)
    away = (predicted.position - one.true.position)[rows]
    sigma = np.where(np.isfinite(predicted.measured), predicted.measured, predicted.sigma)[rows]
    inside = np.abs(away) < 1.96 * sigma[:, None]
    found = (np.sqrt(np.mean(np.sum(away**2, axis=1))), np.sqrt(3 * np.mean(sigma**2)), inside.mean())
    return [float(f"{x:.4g}") for x in found]
