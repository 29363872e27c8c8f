"""A fit in sentences."""

from __future__ import annotations

from postproc.fit.fitted import Fit, distances
from postproc.fit.record import cautions
from postproc.fit.wording import FEW, held_text, values_lines


def held_lines(fit: Fit) -> list[str]:
    """What the data could not determine, and what stopped at a bound; a blank line before it."""
    lines = [f"Not determined by this data and held: {held_text(fit, fit.held)}"] if fit.held else []
    lines += [f"Stopped at a bound: {held_text(fit, fit.at_bound)}"] if fit.at_bound else []
    return ["", *lines] if lines else []


def set_aside_lines(fit: Fit) -> list[str]:
    """Rows that no figure counts."""
    off = 1e3 * distances(fit.problem.error[:, :3])
    rows = [(f"R{fit.data.name(i)[1:]}", off[i]) for i in fit.set_aside]
    return [f"{row} was left out: it lies {far:.1f} mm off, far from everything else." for row, far in rows]


def fit_text(fit: Fit) -> str:
    """A fit in sentences, then its parameters with their standard deviations."""
    noise = "unknown" if fit.noise.position is None else f"{1e3 * fit.noise.position:.3f} mm ({fit.noise.origin})"
    lines = [
        f"The model misses {1e3 * fit.rms:.3f} mm per axis, {1e3 * fit.held_out_rms:.3f} mm on rows that the fit "
        f"has not seen; the noise is {noise}.",
        "",
    ]
    for effect in fit.model.effects:
        values = values_lines(fit, effect.key, 4 * FEW)
        lines += [f"{effect.key}:", *(f"  {text}" for text in values)] if values else []
    lines += held_lines(fit)
    lines += set_aside_lines(fit)
    lines += [f"{d.message[0].upper()}{d.message[1:]}; {d.help}." for d in cautions(fit)]
    return "\n".join(lines)
