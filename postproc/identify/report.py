"""Results as JSON and as sentences that a welding engineer understands, tables after them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from postproc.identify.fit import Fit
from postproc.identify.record import not_identifiable, unphysical
from postproc.identify.selection import Candidate

if TYPE_CHECKING:
    from postproc.identify.diagnose import Diagnosis


def mm(value: float | None) -> float | None:
    """Metres to millimetres, None where it is not known."""
    return None if value is None or not np.isfinite(value) else round(float(value) * 1e3, 6)


def diagnosis_json(d: Diagnosis) -> dict[str, Any]:
    """``postproc/diagnose/1``."""
    return {
        "schema": "postproc/diagnose/1",
        "verdict": d.verdict,
        "noise_mm": mm(d.floor),
        "rms_mm": mm(d.base.rms),
        "held_out_rms_mm": mm(d.base.held_out_rms),
        "rms_mm_after": mm(d.final.rms),
        "held_out_rms_mm_after": mm(d.final.held_out_rms),
        "missing": [
            {
                "effect": m.candidate.key,
                "form": m.candidate.label,
                "held_out_rms_mm_after": mm(m.held_out_after),
                "p_value": m.candidate.p_value,
                "not_separable_from": list(m.not_separable),
                "parameters": parameters_json(d.final, m.candidate.key),
            }
            for m in d.missing
        ],
        "candidates": [_candidate(d, c) for c in d.candidates]
        + [
            {"effect": k, "rms_mm_after": mm(d.base.rms), "p_value": 1.0, "testable": False, "why_not": why}
            for k, why in d.untestable.items()
        ],
        "suspects": [s.as_json() for s in d.suspects],
        "floor_mm": mm(d.floor),
        "bound_mm": mm(d.bound),
        "blind_to": [{"effect": k, "why": why} for k, why in d.blind.items()],
        "diagnostics": [x.as_json() for x in d.diagnostics],
    }


def parameters_json(fit: Fit, key: str) -> dict[str, list[list[float | None]]]:
    """[value, standard deviation] of every parameter of an effect that was fitted or is not null."""
    effect = fit.model.effect(key)
    if effect is None:
        return {}
    width, at = fit.intervals[key], 0
    found: dict[str, list[list[float | None]]] = {}
    for name in effect.parameters():
        values = np.atleast_1d(np.asarray(getattr(effect, name), dtype=float)).ravel()
        widths = width[at : at + len(values)]
        at += len(values)
        found[name] = [
            [float(v), None if np.isnan(w) else float(w) / 1.96] for v, w in zip(values, widths, strict=True)
        ]
    return found


def _candidate(d: Diagnosis, c: Candidate) -> dict[str, Any]:
    before = d.base.linear.square
    after = d.base.rms * np.sqrt(max(before - c.fall, 0.0) / before)
    return {
        "effect": c.key,
        "form": c.label,
        "rms_mm_after": mm(after),
        "p_value": float(c.p_value),
        "evidence": None if not np.isfinite(c.evidence) else round(c.evidence, 2),
        "testable": c.key not in d.blind,
        "why_not": d.blind.get(c.key),
    }


def diagnosis_text(d: Diagnosis) -> str:
    """The verdict in sentences, then the ladder, the ranking and what was seen."""
    lines = [_headline(d), ""]
    lines += [*_ladder(d), "", "Ranking on the model as it came (error if this effect alone were added):"]
    for c in d.candidates[:8]:
        row = _candidate(d, c)
        lines.append(f"  {c.key:24s} {row['rms_mm_after']:8.3f} mm   p {c.p_value:8.1e}   {c.label}")
    if d.suspects:
        lines += ["", "What the remaining structure follows:"]
        for s in d.suspects:
            lines.append(f"  {s.where}, {s.channel}: {s.pattern}, {100 * s.share:.0f} % of what is above the noise")
    if d.blind:
        lines += ["", "This data could not have shown:"]
        lines += [f"  {key}: {why}" for key, why in d.blind.items()]
    held = not_identifiable(d.final)
    if held:
        lines += ["", "Not determined by this data and held: " + ", ".join(held)]
    return "\n".join(lines)


def _headline(d: Diagnosis) -> str:
    names = " and ".join(f"`{m.candidate.key}`" for m in d.missing)
    before, after = 1e3 * d.base.held_out_rms, 1e3 * d.final.held_out_rms
    noise = f" The instrument's noise is {1e3 * d.floor:.3f} mm." if d.floor else ""
    if d.verdict == "complete":
        return (
            f"Nothing is missing: what is left ({before:.3f} mm on rows the fit has not seen) looks like noise.{noise}"
        )
    them = "them" if len(d.missing) > 1 else "it"
    fell = f"With {them}, the error on rows the fit has not seen falls from {before:.3f} to {after:.3f} mm.{noise}"
    if d.verdict == "missing":
        doubt = [f"`{m.candidate.key}` could as well be {_or(m.not_separable)}" for m in d.missing if m.not_separable]
        more = f" On this data {'; '.join(doubt)}: measure the poses of `postproc plan --between`." if doubt else ""
        return f"The model lacks {names}. {fell}{more}"
    found = (
        f"The model lacks {names}, and something else that no effect of the library explains. {fell} "
        if d.missing
        else ""
    )
    if not d.suspects:
        return found or "More is left than noise, and no effect of the library explains it."
    s = d.suspects[0]
    follows = f"The remaining structure sits at {s.where} and follows {s.channel} ({s.pattern})."
    lead = found or "Something is missing that no effect of the library explains. "
    return f"{lead}{follows} Write it as an effect (docs/effects.md) and add it.{noise if not d.missing else ''}"


def _or(keys: tuple[str, ...]) -> str:
    return " or ".join(f"`{k}`" for k in keys)


def _ladder(d: Diagnosis) -> list[str]:
    floor = f"{1e3 * d.floor:.3f}" if d.floor else "unknown"
    lines = ["held-out error, mm per axis:", f"  {'base':24s} {1e3 * d.base.held_out_rms:8.3f}"]
    lines += [f"  + {m.candidate.key:22s} {1e3 * m.held_out_after:8.3f}   {m.candidate.label}" for m in d.missing]
    lines += [f"  {'free function (bound)':24s} {1e3 * d.bound:8.3f}", f"  {'noise':24s} {floor:>8s}"]
    return lines


def fit_text(fit: Fit) -> str:
    """A fit in sentences, then its parameters with 95 % intervals."""
    noise = "unknown" if fit.noise.position is None else f"{1e3 * fit.noise.position:.3f} mm ({fit.noise.origin})"
    lines = [
        f"The model misses {1e3 * fit.rms:.3f} mm per axis, {1e3 * fit.held_out_rms:.3f} mm on rows that the fit "
        f"has not seen; the noise is {noise}.",
        "",
    ]
    for effect in fit.model.effects:
        width = fit.intervals[effect.key]
        for name, value, w in zip(effect.names(), effect.vector(), width, strict=True):
            if not np.isnan(w):
                lines.append(f"  {effect.key + '.' + name:52s} {value: .4e} +- {w:.1e}")
    held = not_identifiable(fit)
    if held:
        lines += ["", "Not determined by this data and held: " + ", ".join(held)]
    for i in fit.set_aside:
        lines.append(f"Row {fit.data.row[i]} was left out: it lies far from everything else.")
    lines += [f"{d.message[0].upper()}{d.message[1:]}; {d.help}." for d in unphysical(fit)]
    return "\n".join(lines)
