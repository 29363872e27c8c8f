"""A fit in sentences."""

from __future__ import annotations

from postproc.estimation.errors import distances
from postproc.estimation.fitted import Fit
from postproc.estimation.words.findings import SHOWN
from postproc.estimation.words.record import cautions
from postproc.estimation.words.wording import FEW, held_text, values_lines


def held_lines(fit: Fit) -> list[str]:
    """What the data could not determine, and what stopped at a bound; a blank line before it."""
    lines = [f"Not determined by this data and held: {held_text(fit, fit.held)}"] if fit.held else []
    lines += [f"Stopped at a bound: {held_text(fit, fit.at_bound)}"] if fit.at_bound else []
    return ["", *lines] if lines else []


def set_aside_lines(fit: Fit) -> list[str]:
    """Rows that no figure counts; their number alone where they are many."""
    off, unit, data = 1e3 * distances(fit.observed_error), fit.observed.unit, fit.data
    lines = [
        f"R{data.name(i)[1:]} was left out: it lies {off[i]:.1f} {unit} off, far from everything else."
        for i in fit.set_aside
    ]
    here = set(zip(data.file or (0,) * len(data), data.row, strict=False))
    for file, row in sorted(data.wrong - here):
        of = f" of {data.sources[file].path}" if data.file else ""
        lines.append(f"Row {row}{of} was left out: no arm can be where it says.")
    if len(lines) > SHOWN:
        return [f"{len(lines)} rows were left out: they lie far from everything else."]
    return lines


def fit_text(fit: Fit) -> str:
    """A fit in sentences, then its parameters with their standard deviations."""
    unit, each, level = fit.observed.unit, fit.observed.each, fit.parts.level
    noise = "unknown" if level is None else f"{1e3 * level:.3f} {unit} ({fit.parts.origin})"
    if level is not None and fit.parts.repeatability:
        noise += f", of which {1e3 * fit.parts.repeatability:.3f} {unit} is how well the arm repeats a pose"
    lines = [
        f"The model misses {1e3 * fit.rms:.3f} {unit} per {each}, {1e3 * fit.held_out_rms:.3f} {unit} on rows that the "
        f"fit has not seen; the noise is {noise}.",
        "",
    ]
    for effect in fit.model.effects:
        values = values_lines(fit, effect.key, 4 * FEW)
        lines += [f"{effect.key}:", *(f"  {text}" for text in values)] if values else []
    lines += held_lines(fit)
    lines += set_aside_lines(fit)
    lines += [f"{d.message[0].upper()}{d.message[1:]}; {d.help}." for d in cautions(fit)]
    return "\n".join(lines)
