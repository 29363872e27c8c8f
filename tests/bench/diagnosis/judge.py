"""One set, diagnosed and judged."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any

import numpy as np

from postproc.diagnostics import PostprocError
from postproc.effects.registry import effect_library
from postproc.estimation.fitted import Fit
from postproc.estimation.least_squares import fit_model
from postproc.estimation.recorded import recorded_model
from postproc.identification.add import grown
from postproc.identification.diagnose import diagnose
from postproc.identification.diagnosis import Diagnosis
from postproc.measure.errors import rms
from postproc.measure.measurements import Measurements
from postproc.model.arm import Model
from postproc.model.equilibrium import predict
from postproc.model.uncertainty.prediction import predict_sigma
from tests.bench.diagnosis.real import held_out
from tests.bench.diagnosis.sets import Set, Truth
from tests.cost import peak_mb

HARMLESS = 1.2
"""Error, in that of the true model refitted, up to which leaving an effect unnamed costs nobody anything."""
HARMED = 1.5
"""The same from which on rows that cannot be right have harmed a model."""
RIGHTLY = {"missed": "abstained rightly", "abstained": "abstained rightly", "part": "part, harmless"}
"""What a silence is called that costs nobody anything."""
ABOUT_DATA = {"outlier"}


def base_fit(one: Set, data: Measurements | None = None) -> Fit:
    library = effect_library()
    return fit_model(one.start, one.data if data is None else data, [library[key].null() for key in one.base])


def error(model: Model, true: Measurements) -> float:
    """Root mean square error per axis [m] at poses that the fit has not seen; [rad] of joints where these were measured."""
    if true.joint is not None:
        e = model_joints(model, true) - true.joint
    else:
        e = predict(model, true.state)[:, :3, 3] - true.position
    return float(np.sqrt(np.nanmean(e**2)))


def model_joints(model: Model, true: Measurements) -> np.ndarray:
    """(n, 6) [rad] where the joints of the model stand."""
    from postproc.model.equilibrium import equilibrium

    return np.asarray(true.state.q + equilibrium(model, true.state).deflection.joint)


def inside(fit: Fit, true: Measurements) -> float:
    """Share of true coordinates inside the 95 % intervals of the prediction."""
    model = recorded_model(fit)
    e = predict(model, true.state)[:, :3, 3] - true.position
    return float(np.nanmean(np.abs(e) < 1.96 * predict_sigma(model, true.state)[:, None]))


def judge(
    truth: Truth, said: str, named: Sequence[str], alike: Sequence[Sequence[str]], suspects: Sequence[str]
) -> dict:
    """What an answer is worth: a word, and which names were right (`hits`, one boolean a name), found and hidden effects.

    Words: right, inseparable (right only by what it says it cannot be told from), part (right, but something is missing),
    needless (right, and more), wrong, false alarm, missed (called complete), abstained (called unknown, no name),
    wrong channel. Beside these: refused (a table whose wrong rows were named), harmed (by rows that cannot be right).
    """
    left, hits, exact = list(truth.accept), [], True
    for key, others in zip(named, alike, strict=True):
        hit = next((a for a in left if key == a[0]), None) or next((a for a in left if key in a), None)
        if hit is None:
            hit = next((a for a in left if set(a) & set(others)), None)
            exact &= hit is None
        if hit is not None:
            left.remove(hit)
        hits.append(hit is not None or (truth.outside and key in truth.tolerated))
    found = len(truth.accept) - len(left)
    told = said == "unknown" and bool(set(suspects[:3]) & truth.channels)
    told |= truth.outside and any(key in truth.tolerated for key in named)
    if not truth.accept and not truth.outside:
        word = "right" if said == "complete" and not named else "false alarm"
    elif not all(hits):
        word = "needless" if found or told else "wrong"
    elif truth.outside and not told:
        word = "wrong channel" if said == "unknown" else "part" if found else "missed"
    elif not named and truth.accept and not truth.outside:
        word = "abstained" if said == "unknown" else "missed"
    elif left:
        word = "part"
    else:
        word = "right" if exact else "inseparable"
    return {"word": word, "hits": hits, "found": found, "hidden": len(truth.accept)}


def run(one: Set, true_error: float | None = None) -> dict[str, Any]:
    """All figures of one set; times are those of the processor [s]. Args: true_error: where it is known already."""
    begin = time.process_time()
    base = base_fit(one)
    fitted = time.process_time()
    d = diagnose(base.model, one.data)
    found = time.process_time()
    result: dict[str, Any] = {"fit_s": fitted - begin, "diagnose_s": found - fitted, "rows": len(one.data)}
    result |= answer(d)
    before, after = error(base.model, one.true), error(d.final.model, one.true)
    result |= {
        "before": before,
        "after": after,
        "unnamed": None if d.regions is None else rms(d.regions.after),
        "claimed": d.final.held_out_rms,
    }
    result["memory_mb"] = peak_mb()
    if one.whole is not None:
        result |= held_out(d.final, one.true, one.whole)
    if one.truth is None or one.noise is None:
        return result
    named = [k for k in result["named"] if k not in ABOUT_DATA]
    result |= judge(one.truth, d.verdict, named, result["alike"], result["suspects"])
    result["noise"] = one.noise
    result["structure"] = float(np.sqrt(max(base.rms**2 / one.noise**2 - base.freedom / len(base.problem.residual), 0)))
    if one.true.joint is None and not one.truth.outside and d.verdict != "unknown":
        result["inside"] = inside(d.final, one.true)
    if not one.truth.outside:
        if one.wrong:
            right = one.data.rows(~np.isin(one.data.row, list(one.wrong)))
            base = base_fit(one, right)
            left_out = {row for row in one.data.row} - {d.final.data.row[i] for i in kept_rows(d.final)}
            result["bad"] = [len(one.wrong), len(left_out), len(left_out & one.wrong)]
        if true_error is None and (refitted := true_model(one, base)) is not None:
            true_error = error(refitted.model, one.true)
        result["true_error"] = true_error
        if true_error is not None and after <= HARMLESS * true_error:
            result["word"] = RIGHTLY.get(result["word"], result["word"])
        if one.wrong and true_error is not None and after > HARMED * true_error:
            result["word"] = "harmed"
    return result


def kept_rows(fit: Fit) -> list[int]:
    """Index of the rows that a fit uses."""
    return [i for i in range(len(fit.data)) if i not in fit.excluded]


def answer(d: Diagnosis) -> dict[str, Any]:
    """What a diagnosis says."""
    some = d.missing
    return {
        "said": d.verdict,
        "named": [c.key for c in some],
        "labels": [c.label for c in some],
        "evidence": [round(float(c.evidence), 2) for c in some],
        "alike": [list(m.not_separable) for m in d.missing],
        "suspects": [s.channel for s in d.remaining],
        "pattern": d.remaining[0].pattern if d.remaining else "",
    }


def true_model(one: Set, base: Fit) -> Fit | None:
    """The base with the effects that are hidden, each in the form that suits the data; None where that does not settle."""
    assert one.truth is not None
    library, fit = effect_library(), base
    try:
        for key in dict.fromkeys(a[0] for a in one.truth.accept):
            fit = grown(fit, library[key])
    except PostprocError:
        return None
    return fit


def first_names(one: Set, share: float, times: int, seed: int) -> list[str]:
    """The first name on the whole table, then on random parts of its poses (repeats stay together)."""
    g, groups = np.random.default_rng(seed), one.data.repeats
    every = np.unique(groups)
    parts = [one.data]
    for _ in range(times):
        kept = g.choice(every, round(share * len(every)), replace=False)
        parts.append(one.data.rows(np.isin(groups, kept)))
    names = []
    for data in parts:
        d = diagnose(base_fit(one, data).model, data)
        names.append(d.missing[0].key if d.missing else d.verdict)
    return names
