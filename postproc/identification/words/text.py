"""A diagnosis as JSON, and as text: sentences first, tables after them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import Any

import numpy as np

from postproc.effects.registry import BUILT_IN
from postproc.estimation.errors import mm
from postproc.estimation.solving.smooth import effective_parameters
from postproc.estimation.words.record import noise_json, parameters_json, structure_json
from postproc.estimation.words.text import held_lines
from postproc.estimation.words.wording import FREE, joined, p_text, place, values_lines
from postproc.identification.candidates.candidate import Candidate
from postproc.identification.curves import curves
from postproc.identification.diagnosis import Diagnosis
from postproc.identification.words.sentences import doubts, headline, title
from postproc.patterns.suspects import Suspect

UNNAMED = "+ what was found, without a name"
TELLING = 0.05
"""Chance below which a candidate stands in the ranking on the terminal; the first FEWEST and no more than MOST do.

Those of the user's own always do.
"""
FEWEST, MOST = 3, 8
LIBRARY = frozenset(cls.key for cls in BUILT_IN)


def _known(value: float | None) -> float | None:
    """Metres to millimetres (radians to milliradians), None where it is not known."""
    return None if value is None or not np.isfinite(value) else mm(value)


def diagnosis_json(d: Diagnosis) -> dict[str, Any]:
    """``postproc/diagnose/1``; the keys of figures hold the unit of what was observed."""
    key = d.base.observed.key
    return {
        "schema": "postproc/diagnose/1",
        "observed": d.base.observed.name,
        "verdict": d.verdict,
        **noise_json(d.final),
        key("rms"): _known(d.base.rms),
        key("held_out_rms"): _known(d.base.held_out_rms),
        f"{key('rms')}_after": _known(d.final.rms),
        f"{key('held_out_rms')}_after": _known(d.final.held_out_rms),
        "missing": [
            {
                "effect": m.candidate.key,
                "form": m.candidate.label,
                f"{key('held_out_rms')}_after": _known(m.held_out_after),
                "p_value": m.candidate.p_value,
                **_smooth(d, m.candidate.key),
                "not_separable_from": list(m.not_separable),
                "not_seen_beside": list(m.unseen),
                "parameters": parameters_json(d.told, m.candidate.key),
                "structure": structure_json(d.told, m.candidate.key),
                "law": [curve.as_json() for curve in curves(d.told, m.candidate.key)],
            }
            for m in d.missing
        ],
        "candidates": [
            *(_candidate(d, c) for c in d.candidates),
            *(_untestable(d, key, why) for key, why in d.untestable.items()),
        ],
        "suspects": [s.as_json() for s in d.suspects],
        key("floor"): _known(d.floor),
        f"{key('held_out_rms')}_unnamed": _known(d.unnamed),
        "searched": {"rows": len(d.searched.data), key("held_out_rms"): _known(d.searched.held_out_rms)},
        key("bound"): _known(d.bound),
        "hold_out": None if d.hold_out is None else d.hold_out.as_json(),
        "blind_to": [{"effect": k, "why": why} for k, why in d.blind.items()],
        "diagnostics": [x.as_json() for x in d.diagnostics],
    }


def _smooth(d: Diagnosis, key: str) -> dict[str, Any]:
    """Whether an effect is a cause or a smooth correction, and how many parameters of that the data moves."""
    effect = d.final.model.effect(key)
    if effect is None or effect.roughness() is None:
        return {"is": "cause"}
    return {"is": "smooth correction", "effective_parameters": round(effective_parameters(d.final, key), 1)}


def _candidate(d: Diagnosis, c: Candidate) -> dict[str, Any]:
    before = d.screened.linear.square
    after = d.base.rms * np.sqrt(max(before - c.fall, 0.0) / before)
    return {
        "effect": c.key,
        "form": c.label,
        f"{d.base.observed.key('rms')}_after": _known(after),
        "p_value": float(c.p_value),
        "evidence": None if not np.isfinite(c.evidence) else round(c.evidence, 2),
        "testable": c.key not in d.blind,
        "why_not": d.blind.get(c.key),
    }


def _untestable(d: Diagnosis, key: str, why: str) -> dict[str, Any]:
    return {
        "effect": key,
        "form": "",
        f"{d.base.observed.key('rms')}_after": _known(d.base.rms),
        "p_value": 1.0,
        "evidence": None,
        "testable": False,
        "why_not": why,
    }


def diagnosis_text(d: Diagnosis) -> str:
    """The verdict in sentences, then what was found, the ladder, the ranking and what was seen."""
    lines = [headline(d), *doubts(d), "", *_found(d), *_ladder(d)]
    kind = d.base.observed
    alone = f"rms per {kind.each} on the fitted rows if this effect alone were added"
    lines += ["", f"Ranking on the model as it came ({alone}):"]
    for c in _told(d.candidates):
        after = _candidate(d, c)[f"{kind.key('rms')}_after"]
        row = f"  {c.key:24s} {after:8.3f} {kind.unit}   p {p_text(c.p_value):>8s}   {place(c.label)}"
        lines.append(row.rstrip())
    if d.hold_out is not None:
        lines += ["", d.hold_out.text()]
    if d.suspects:
        lines += ["", "What the remaining structure follows:"]
        lines += _followed(d.suspects)
    if d.blind:
        lines += ["", "This data could not have shown (`postproc effects show KEY` says what to measure):"]
        lines += [f"  {key}: {why}" for key, why in d.blind.items()]
    return "\n".join([*lines, *held_lines(d.told)])


def _told(ranked: Sequence[Candidate]) -> list[Candidate]:
    """Those that stand in the ranking on the terminal."""
    first = max(FEWEST, sum(c.p_value < TELLING for c in ranked[:MOST]))
    return [*ranked[:first], *(c for c in ranked[first:] if c.key not in LIBRARY)]


def _followed(suspects: Iterable[Suspect]) -> Iterator[str]:
    """A line for each pattern at a place, with all the channels that show it."""
    channels: dict[tuple[str, str, float], list[str]] = {}
    for s in suspects:
        channels.setdefault((s.where, s.pattern, s.share), []).append(s.channel)
    for (where, pattern, share), some in channels.items():
        yield f"  {where}, {joined(some)}: {pattern}, {100 * share:.0f} % of what is above the noise"


def _found(d: Diagnosis) -> list[str]:
    lines: list[str] = []
    for m in d.missing:
        lines += [f"{m.candidate.key}: {title(d, m)}"]
        lines += [f"  {text}" for text in values_lines(d.told, m.candidate.key)]
        if _smooth(d, m.candidate.key)["is"] != "cause":
            lines += [f"  {curve.text()}" for curve in curves(d.told, m.candidate.key)]
    return [*lines, ""] if lines else []


def _ladder(d: Diagnosis) -> list[str]:
    floor = f"{1e3 * d.floor:.3f}" if d.floor else "unknown"
    rungs = [("the model as it came", d.base.held_out_rms, "")]
    rungs += [(f"+ {m.candidate.key}", m.held_out_after, place(m.candidate.label)) for m in d.missing]
    if d.unnamed is not None:
        some, every = len(d.searched.data), len(d.base.data)
        where = f"on {some} of {every} rows, without it {1e3 * d.searched.held_out_rms:.3f}" if some < every else ""
        rungs.append((UNNAMED, d.unnamed, where))
    rungs.append((FREE, d.bound, ""))
    lines = [f"held-out error, {d.base.observed.unit} per {d.base.observed.each}:"]
    lines += [f"  {name:36s} {1e3 * error:8.3f}   {where}".rstrip() for name, error, where in rungs]
    return [*lines, f"  {'noise':36s} {floor:>8s}"]
