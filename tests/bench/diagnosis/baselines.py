"""Other methods on the same sets: stepwise BIC over the library, a Gaussian process, sparse regression over functions.

The last two know no physics but the fitted base and its Jacobian. They are written with numpy and scipy alone, for no
further package is a dependency: the kernel is that of scikit-learn's ``RBF`` with a length for every group of channels,
the selection is orthogonal matching pursuit (Pati, Rezaiifar and Krishnaprasad 1993) stopped by BIC.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from itertools import product
from typing import Any

import numpy as np
from scipy.optimize import minimize

from postproc.channels.sight import Site
from postproc.channels.state import State
from postproc.channels.units import recorded
from postproc.diagnostics import PostprocError
from postproc.effects.registry import effect_library
from postproc.estimation.fitted import Fit
from postproc.estimation.least_squares import fit_model
from postproc.estimation.solving.solve import Terms
from postproc.identification.screen.forms import forms_of
from postproc.model.equilibrium import predict
from postproc.model.uncertainty.prediction import derivatives
from tests.bench.diagnosis.judge import base_fit, error, judge
from tests.bench.diagnosis.sets import Set

MOST = 8
"""Effects that stepwise BIC adds at most."""
TERMS = 25
"""Functions that sparse regression adds at most."""
STEP = 1e-6
"""Of central differences [rad]."""


def bic(one: Set) -> dict[str, Any]:
    """The form of the library that lowers n log(RSS / n) + k log(n) most, refitted, and again while it falls."""
    fit = base_fit(one)
    classes = {
        k: c
        for k, c in effect_library().items()
        if k not in ("outlier", "curve") and not c.null().missing(one.data.state)
    }
    named: list[str] = []
    while len(named) < MOST:
        linear, best, chosen = fit.linear, 0.0, None
        n = len(linear.residual)
        for key in (k for k in classes if fit.model.effect(k) is None):
            for form in forms_of(fit.problem, classes[key]):
                inside = linear.project(form.columns(fit.problem))
                left = (
                    linear.projected_residual
                    - inside @ np.linalg.lstsq(inside, linear.projected_residual, rcond=1e-6)[0]
                )
                count = int(form.refit.sum())
                gained = n * np.log(linear.square / float(left @ left)) - count * np.log(n)
                if gained > best:
                    best, chosen = gained, form
        if chosen is None:
            break
        try:
            terms = Terms({**fit.free, chosen.key: chosen.refit})
            fit = fit_model(fit.model, fit.data, [chosen.effect], terms=terms)
        except PostprocError:
            break
        named.append(chosen.key)
    assert one.truth is not None
    result = judge(one.truth, "missing" if named else "complete", named, [()] * len(named), ())
    return {**result, "named": named, "after": error(fit.model, one.true)}


def gaussian_process(one: Set) -> dict[str, Any]:
    """Every coordinate by a process over the channels beside the base, whose parameters stay free (universal kriging)."""
    base = base_fit(one)
    used = np.setdiff1d(np.arange(len(one.data)), base.excluded)
    x, z = _inputs(one, used)
    A, B = _slopes(base, one.data.state.rows(used)), _slopes(base, one.true.state)
    y = base.position_error[used].ravel()
    scale = np.sqrt(np.mean(A**2, axis=0)) + 1e-300
    A, B, unit = A / scale, B / scale, float(np.std(y))
    axes = np.tile(np.arange(3), len(used))

    def kernel(a: np.ndarray, b: np.ndarray, lengths: np.ndarray) -> np.ndarray:
        d = sum(((a[g][:, None] - b[g][None]) ** 2).sum(axis=2) / w**2 for g, w in zip((0, 1), lengths, strict=True))
        return np.exp(-0.5 * d)

    def covariance(p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        K = kernel(x, x, np.exp(p[:2])) * np.exp(2 * p[2])
        whole = np.repeat(np.repeat(K, 3, axis=0), 3, axis=1) * (axes[:, None] == axes)
        whole += 1e4 * unit**2 * A @ A.T
        whole[np.diag_indices(len(whole))] += np.exp(2 * p[3])
        return K, whole

    def cost(p: np.ndarray) -> float:
        try:
            L = np.linalg.cholesky(covariance(p)[1])
        except np.linalg.LinAlgError:
            return 1e12
        h = np.linalg.solve(L, y)
        return float(0.5 * h @ h + np.log(np.diag(L)).sum())

    start = np.array([1.0, 1.0, np.log(unit), np.log(0.3 * unit)])
    limits = [(-1.5, 3), (-1.5, 3), (start[2] - 6, start[2] + 2), (start[3] - 4, start[3] + 2)]
    p = minimize(cost, start, method="L-BFGS-B", bounds=limits, options={"maxiter": 12}).x
    cross = kernel(z, x, np.exp(p[:2])) * np.exp(2 * p[2])
    there = np.tile(np.arange(3), len(one.true))
    cross = np.repeat(np.repeat(cross, 3, axis=0), 3, axis=1) * (there[:, None] == axes)
    cross += 1e4 * unit**2 * B @ A.T
    foretold = (cross @ np.linalg.solve(covariance(p)[1], y)).reshape(-1, 3)
    return {"after": _left(base, one, foretold)}


def sparse(one: Set) -> dict[str, Any]:
    """Functions of single channels at every joint and along every axis of the instrument, while BIC falls."""
    base = base_fit(one)
    used = np.setdiff1d(np.arange(len(one.data)), base.excluded)
    some, others = one.data.state.rows(used), one.true.state
    A, y = _slopes(base, some), base.position_error[used].ravel()
    F, where = _functions(base, some)
    G, _ = _functions(base, others)
    Q, _ = np.linalg.qr(A / (np.linalg.norm(A, axis=0) + 1e-300))
    rest, n, taken = y - Q @ (Q.T @ y), len(y), list[int]()
    inside = F - Q @ (Q.T @ F)
    length = np.linalg.norm(inside, axis=0)
    seen = length > 1e-4 * np.linalg.norm(F, axis=0).max()
    while len(taken) < TERMS:
        worth = np.where(seen, np.abs(inside.T @ rest) / np.where(seen, length, 1.0), 0.0)
        worth[taken] = 0.0
        k = int(np.argmax(worth))
        columns = inside[:, [*taken, k]]
        left = y - Q @ (Q.T @ y)
        left = left - columns @ np.linalg.lstsq(columns, left, rcond=1e-9)[0]
        # The search pays for the number of functions it chooses from, as extended BIC does (Chen and Chen 2008).
        if n * np.log((rest @ rest) / (left @ left)) < np.log(n) + 2 * np.log(len(where)):
            break
        taken, rest = [*taken, k], left
    whole = np.hstack([A, F[:, taken]])
    scale = np.linalg.norm(whole, axis=0) + 1e-300
    x = np.linalg.lstsq(whole / scale, y, rcond=1e-10)[0] / scale
    foretold = (np.hstack([_slopes(base, others), G[:, taken]]) @ x).reshape(-1, 3)
    return {"after": _left(base, one, foretold), "terms": [where[k] for k in taken]}


def _left(base: Fit, one: Set, foretold: np.ndarray) -> float:
    e = one.true.position - predict(base.model, one.true.state)[:, :3, 3] - foretold
    return float(np.sqrt(np.mean(e**2)))


def _slopes(base: Fit, state: State) -> np.ndarray:
    """(3 n, p) derivatives of the position by the fitted parameters."""
    D = derivatives(base.model, state, base.parameters)[0][:, :3]
    return np.asarray(D).reshape(-1, D.shape[2])


def _named(state: State) -> dict[str, np.ndarray]:
    found = recorded(state, Site())
    return {k: v for k, v in found.items() if k not in ("row", "x", "y", "z") and not k.startswith("load")}


def _inputs(one: Set, used: np.ndarray) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Joint angles in radians, and the other channels by their standard deviation, of the rows and of the others."""
    some, others = one.data.state.rows(used), one.true.state
    a, b = _named(some), _named(others)
    more = sorted(k for k in a if k in b and k[0] != "q")

    def scaled(c: dict[str, np.ndarray]) -> np.ndarray:
        columns = [(c[k] - a[k].mean()) / (a[k].std() + 1e-12) for k in more]
        return np.stack(columns, axis=1) if columns else np.zeros((len(next(iter(c.values()))), 1))

    return [some.q, scaled(a)], [others.q, scaled(b)]


def _functions(base: Fit, state: State) -> tuple[np.ndarray, list[tuple[str, str]]]:
    """(3 n, m) moves of the measured point by every function at every place, and what they are."""
    c = _named(state)
    found: dict[str, np.ndarray] = {}
    for name, x in c.items():
        found[name] = x
        if name[0] == "q":
            for k in range(1, 13):
                found[f"sin {k} {name}"], found[f"cos {k} {name}"] = np.sin(k * x), np.cos(k * x)
        elif name[0] in "vt":
            found[f"{name} squared"] = x**2
    moves = {f"joint {j + 1}": _turned(base, state, j) for j in range(6)}
    moves |= {axis: np.broadcast_to(np.eye(3)[k], (len(state), 3)) for k, axis in enumerate("xyz")}
    where = list(product(moves, found))
    return np.stack([(moves[p] * found[f][:, None]).ravel() for p, f in where], axis=1), where


def _turned(base: Fit, state: State, j: int) -> np.ndarray:
    """(n, 3) [m/rad] by central differences."""
    step = STEP * np.eye(6)[j]
    ends = (predict(base.model, state.with_(q=state.q + way * step))[:, :3, 3] for way in (1, -1))
    return np.asarray((next(ends) - next(ends)) / (2 * STEP))


METHODS: dict[str, Callable[[Set], dict[str, Any]]] = {"bic": bic, "gp": gaussian_process, "sparse": sparse}
"""By the word of ``--method``."""


def run(method: str, one: Set) -> dict[str, Any]:
    """The figures of another method, its times with those of the base."""
    begin = time.process_time()
    result = METHODS[method](one)
    return {**result, "diagnose_s": time.process_time() - begin, "noise": one.noise, "rows": len(one.data)}
