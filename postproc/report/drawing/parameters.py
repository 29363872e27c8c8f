"""Parameters of a fit: each with its interval beside what was known before, and which of them go together."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape

import numpy as np

from postproc.arrays import Array
from postproc.estimation.fitted import Fit
from postproc.estimation.priors import prior_at
from postproc.estimation.solving.step import Name
from postproc.grouping import grouped

AXIS_REACH = 3.0
"""Deviations of the prior to which the axis goes on both sides of its value."""
NORMAL_95 = 1.96
STRONG, MOST_PAIRS = 0.5, 8
"""Correlation from which a pair is told, and how many pairs at most."""
CELL, LETTER, MOST_DRAWN = 15, 6.6, 40
"""Pixels of a cell of the heat map and of a letter beside it, and the most parameters that it has."""


@dataclass(frozen=True, slots=True)
class DrawnParameter:
    """A parameter on the axis of its prior.

    Args:
        effect, name: key of the effect and name of the entry. text: value, standard deviation and unit.
        at, low, high: estimate and ends of its 95 % interval, in standard deviations of the prior from its value, of
            positive parameters in logarithms.
        share: standard deviation over that of the prior. determined: the rows have said more than half of it.
    """

    effect: str
    name: str
    text: str
    at: float
    low: float
    high: float
    share: float
    determined: bool


Words = Mapping[Name, tuple[str, str]]
"""Name, and value with standard deviation and unit, of parameters by effect key and index in its vector."""


def drawn_parameters(fit: Fit, words: Words) -> list[DrawnParameter]:
    """Return those parameters of a fit that have a prior and words, in the order of the words."""
    after, drawn = fit.posterior, list[DrawnParameter]()
    names = (*after.names, *after.unidentifiable)
    silent, prior = {names[k] for k in after.undetermined}, dict(zip(names, after.prior.tolist(), strict=True))
    for (key, i), (name, text) in words.items():
        effect = fit.model.effect(key)
        if effect is None or not np.isfinite(prior.get((key, i), np.inf)):
            continue
        value, wide = float(effect.vector()[i]), float(fit.intervals[key][i])
        known = prior_at(fit.model, [effect], [(key, i)])
        ends = [float(known.off(np.array([x]))[0] / known.spread[0]) for x in (value, value - wide, value + wide)]
        low = -np.inf if known.log[0] and value <= wide else ends[1]
        share = fit.sigma[key, i] / prior[key, i]
        drawn.append(DrawnParameter(key, name, text, ends[0], low, ends[2], share, (key, i) not in silent))
    return drawn


def parameter_chart(drawn: Sequence[DrawnParameter]) -> str:
    """Return parameters as HTML: the prior's 95 % interval as a grey band, estimate and 95 % interval over it."""
    if not drawn:
        return ""
    band = f'<i class="prior" style="{_span(-NORMAL_95, NORMAL_95)}"></i>'
    rows = []
    for effect, some in grouped((one.effect, one) for one in drawn).items():
        rows.append(f"<h3>{escape(effect)}</h3>")
        for one in some:
            kind = "axis" if one.determined else "axis open"
            far = "" if abs(one.at) <= AXIS_REACH else f", {one.at:+.0f} deviations of the prior"
            width = f"{100 * one.share:.0f} %" if one.share >= 0.005 else "under 1 %"
            note = f"{far}; {width} of the prior's width" if one.determined else "; not told by these rows"
            value = f"{one.text}{note}"
            marks = f'{band}<i class="interval" style="{_span(one.low, one.high)}"></i>'
            marks += f'<i class="estimate" style="left: {_place(one.at):.1f}%"></i>'
            label = escape(f"{one.name}: {value}")
            axis = f'<span class="{kind}" role="img" aria-label="{label}" title="{label}">{marks}</span>'
            rows.append(f'<span class="name">{escape(one.name)}</span>{axis}<span class="value">{escape(value)}</span>')
    ticks = "".join(f'<span style="left: {_place(x):.1f}%">{x:+.0f}</span>' for x in (-2.0, 0.0, 2.0)).replace(
        "+0", "0"
    )
    rows.append(f'<span></span><span class="scale">{ticks}</span><span class="value">deviations of the prior</span>')
    return f'<div class="parameters">{"".join(rows)}</div>'


def correlations(fit: Fit) -> tuple[list[Name], Array]:
    """Return the parameters of a fit and their correlations (k, k); those with no deviation are left out."""
    after = fit.posterior
    names = (*after.names, *after.unidentifiable)
    covariance = after.directions.T @ after.directions
    count = len(after.names)
    covariance[:count, :count] += after.covariance
    sigma = np.sqrt(np.diag(covariance))
    known = np.flatnonzero(sigma > 0)
    return [names[k] for k in known], (covariance / np.outer(sigma, sigma).clip(1e-300))[np.ix_(known, known)]


def correlated_pairs(fit: Fit, words: Words, first: Sequence[str]) -> list[tuple[str, str, str, str]]:
    """Return the most strongly correlated pairs of parameters as texts: both, their correlation, what the rows tell.

    Args:
        words: of the parameters that count. first: keys of effects whose pairs come first.
    """
    names, rho = correlations(fit)
    shown = {name: f"{name[0]} {label}" for name, (label, _) in words.items()}
    pairs = [(i, j) for i, j in zip(*np.triu_indices(len(names), 1), strict=True) if abs(rho[i, j]) >= STRONG]
    pairs = [(i, j) for i, j in pairs if names[i] in shown and names[j] in shown]
    pairs.sort(key=lambda p: (not {names[p[0]][0], names[p[1]][0]} & set(first), -abs(rho[p])))
    wording = {True: "their difference is told better than each", False: "their sum is told better than each"}
    chosen = [(shown[names[i]], shown[names[j]], float(rho[i, j])) for i, j in pairs[:MOST_PAIRS]]
    return [(one, other, f"{r:+.2f}", wording[r > 0]) for one, other, r in chosen]


def correlation_map(fit: Fit, words: Words) -> str:
    """Return the correlations of some parameters as a heat map (SVG); empty for one or for very many."""
    names, rho = correlations(fit)
    shown = {name: f"{name[0]} {label}" for name, (label, _) in words.items()}
    index = [k for k, name in enumerate(names) if name in shown][: MOST_DRAWN + 1]
    if not 1 < len(index) <= MOST_DRAWN:
        return ""
    labels = [shown[names[k]] for k in index]
    label_width = int(12 + LETTER * max(map(len, labels)))
    wide = label_width + CELL * len(index) + 4
    cells = []
    for row, i in enumerate(index):
        y = CELL * row + 2
        cells.append(f'<text x="{label_width - 6}" y="{y + 11}" text-anchor="end">{escape(labels[row])}</text>')
        for column, j in enumerate(index[: row + 1]):
            kind, value = "plus" if rho[i, j] >= 0 else "minus", float(abs(rho[i, j]))
            title = f"<title>{escape(labels[row])}, {escape(labels[column])}: {rho[i, j]:+.2f}</title>"
            place = f'x="{label_width + CELL * column}" y="{y}" width="{CELL - 1}" height="{CELL - 1}"'
            cells.append(f'<rect {place} class="{kind}" fill-opacity="{value:.2f}">{title}</rect>')
    high = CELL * len(index) + 4
    head = f'<svg xmlns="http://www.w3.org/2000/svg" width="{wide}" height="{high}" viewBox="0 0 {wide} {high}"'
    head += ' role="img" aria-label="correlations of the parameters" class="map"'
    return (
        f'<div class="scroll" tabindex="0" role="region" aria-label="correlations">{head}>{"".join(cells)}</svg></div>'
    )


def _place(x: float) -> float:
    """Return the place [%] on the axis of so many deviations of the prior, at its ends for what is farther."""
    return float(50 + 50 * np.clip(x / AXIS_REACH, -1.0, 1.0))


def _span(low: float, high: float) -> str:
    """Return the style of an interval on the axis."""
    start, end = _place(low), _place(high)
    return f"left: {start:.1f}%; width: {end - start:.1f}%"
