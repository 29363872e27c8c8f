"""What a user gets who follows the commands: `fit`, `diagnose`, then `add` of what was named, on rows nobody measured."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from postproc.diagnostics import PostprocError
from postproc.effects.registry import effect_library
from postproc.estimation.recorded import recorded_model
from postproc.identification.add import add_effects, fit_effects
from postproc.identification.diagnose import diagnose
from postproc.identification.diagnosis import Diagnosis
from postproc.identification.predict import predict_rows
from postproc.model.arm import Model
from tests.bench.diagnosis import in_order
from tests.bench.diagnosis.in_order import ordered_set
from tests.bench.diagnosis.judge import ABOUT_DATA, HARMLESS, RIGHTLY, answer, base_fit, judge, true_model
from tests.bench.diagnosis.regions import COUNT, region_set
from tests.bench.diagnosis.sets import Set

KINDS: dict[str, tuple[int, Callable[[str, int], Set]]] = {
    "regions": (COUNT, region_set),
    **{kind: (count, ordered_set) for kind, count in in_order.KINDS.items()},
}
"""How many different sets there are of each kind that is judged after `add`, and what draws them."""
PLACES = {"region": "outside", "near": "inside", "unseen": "later"}
"""Where a model is worse, by the name of the rows: outside of what was measured, inside, in other rows of its history."""
WORSE = 1.1
"""Error after `add`, in that of the first model, above which a model has become worse."""


def run(one: Set, true_error: float | None = None) -> dict[str, Any]:
    """All figures of one set; times are those of the processor [s]. Args: true_error: where it is known already.

    `asked`: by the name of a group of rows, the error of the first model and the improved one, the share of coordinates
    inside their 95 % intervals, and the stated standard deviation. `added`: right, or where the improved one is worse;
    declined where `predict` refuses the improved model for these rows, and the first one stays. `accepted`: the figures
    of one who accepts what it refuses.
    """
    assert one.truth is not None and one.noise is not None
    begin = time.process_time()
    fit = fit_effects(one.start, one.data, [effect_library()[key] for key in one.base])
    first = recorded_model(fit)
    fitted = time.process_time()
    d = diagnose(first, one.data)
    found = time.process_time()
    result: dict[str, Any] = {"fit_s": fitted - begin, "diagnose_s": found - fitted, "rows": len(one.data)}
    result |= answer(d)
    improved, result["refused"] = added(first, one, d)
    try:
        predict_rows(improved, one.true)
        declined = ""
    except PostprocError as why:
        codes = {x.code for x in why.diagnostics}
        told = replace(one, true=replace(one.true, accepted=frozenset(codes)))
        result["accepted"] = {name: compared(first, improved, told, mask) for name, mask in one.asked.items()}
        improved, declined = first, " ".join(sorted(codes))
    result |= {"add_s": time.process_time() - found, "half": "outside" if one.truth.outside else "library"}
    result["asked"] = {name: compared(first, improved, one, mask) for name, mask in one.asked.items()}
    worse = [PLACES[name] for name, x in result["asked"].items() if x["improved"] > WORSE * x["first"]]
    result["added"] = f"declined {declined}" if declined else "worse " + " and ".join(worse) if worse else "right"
    named = [k for k in result["named"] if k not in ABOUT_DATA]
    result |= judge(one.truth, d.verdict, named, result["alike"], result["suspects"])
    result["noise"] = one.noise
    base = base_fit(one)
    freedom = base.freedom / len(base.problem.residual)
    result["structure"] = float(np.sqrt(max(base.rms**2 / one.noise**2 - freedom, 0)))
    result["after"] = error(improved, one)
    if not one.truth.outside:
        if true_error is None and (refitted := true_model(one, base)) is not None:
            true_error = error(refitted.model, one)
        result["true_error"] = true_error
        if true_error is not None and result["after"] <= HARMLESS * true_error:
            result["word"] = RIGHTLY.get(result["word"], result["word"])
    return result


def added(first: Model, one: Set, d: Diagnosis) -> tuple[Model, str]:
    """The model that `add` writes with all that was named, and why it wrote none; the first one where nothing was named.

    Where `add` finds no curve to add, the names alone are added.
    """
    names = [m.key for m in d.missing]
    curve = ["curve"] if d.verdict == "unknown" and d.remaining else []
    refused = ""
    for keys in ([*names, *curve], names if curve else []):
        if keys:
            try:
                return add_effects(first, one.data, keys).model, refused
            except PostprocError as why:
                refused = refused or " ".join(d.code for d in why.diagnostics)
    return first, refused


def error(model: Model, one: Set) -> float:
    """Root mean square error per axis [m] of all rows that are asked."""
    rows = np.any(list(one.asked.values()), axis=0)
    return float(np.sqrt(np.mean((predict_rows(model, one.true).position - one.true.position)[rows] ** 2)))


def compared(first: Model, improved: Model, one: Set, rows: np.ndarray) -> dict[str, float]:
    """Errors, intervals and stated standard deviations of two models on some rows of ``one.true``, predicted together."""
    found: dict[str, float] = {"rows": int(rows.sum())}
    for name, tail, model in (("first", "_first", first), ("improved", "", improved)):
        predicted = predict_rows(model, one.true)
        away, sigma = (predicted.position - one.true.position)[rows], predicted.sigma[rows]
        found[name] = float(np.sqrt(np.mean(away**2)))
        found["inside" + tail] = float(np.mean(np.abs(away) < 1.96 * sigma[:, None]))
        found["stated" + tail] = float(np.sqrt(np.mean(sigma**2)))
    return {k: float(f"{x:.4g}") for k, x in found.items()}
