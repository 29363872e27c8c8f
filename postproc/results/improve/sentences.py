"""A diagnosis in a few sentences that a welding engineer understands."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from postproc.diagnostics import joined
from postproc.estimation.solving.smooth import effective_parameters
from postproc.estimation.validation.regions import Regions
from postproc.estimation.validation.residual_split import SLOW
from postproc.identification.diagnosis import Diagnosis, shortage, suspect_size
from postproc.identification.screen.candidate import Candidate
from postproc.identification.screen.suspects import Suspect
from postproc.measure.errors import rms
from postproc.results.wording import ABOVE_NOISE, percent, place

MOST_RIVALS_NAMED = 3
"""So many rivals of an effect stand in the headline; where there are more, a line below it has them."""
REPEATED = 10
"""Poses that tell the noise to a sixth when they are measured three times each."""
NO_LAW_SHARE = 0.2
"""Share below which curves are no law: what is left follows something else."""
NEARLY_ALL = 0.9
"""Share of what stands above the noise that the law of a curve explains."""
LITTLE = 0.02
"""Share of the error by which a significant effect lowers it, and no user will notice."""


def headline(d: Diagnosis) -> str:
    """Say the verdict: what is missing and how far the error falls, or what remains, or that nothing is missing."""
    if d.verdict == "complete" or d.untold:
        return _complete_text(d)
    if d.verdict == "missing":
        what = f": {title(d, d.missing[0])}" if len(d.missing) == 1 else ""
        return f"The model lacks {_named_together(d)}{what}. {_fall(d)}"
    noise = "" if d.missing else _noise(d)
    unnamed = "and something else that no effect of the library explains"
    text = f"The model lacks {_named_together(d)}, {unnamed}. {_fall(d)} " if d.missing else ""
    if not d.remaining:
        return text or f"More is left than noise, and no effect of the library explains it.{noise}"
    lead = text or "Something is missing that no effect of the library explains. "
    return f"{lead}{_remaining(d, d.remaining[0])}{noise}"


def _unit(d: Diagnosis) -> str:
    """Return the unit of errors: ``mm per axis``."""
    return f"{d.base.observed.unit} per {d.base.observed.each}"


def _noise(d: Diagnosis) -> str:
    """Say what the noise is, after a blank; empty where it is not known."""
    return f" The noise is {1e3 * d.floor:.3f} {_unit(d)}." if d.floor else ""


def _complete_text(d: Diagnosis) -> str:
    """Say that nothing is missing, or that this data does not tell whether anything is."""
    error = f"{1e3 * d.base.held_out_rms:.3f} {_unit(d)} on rows the fit has not seen"
    if (lacking := shortage(d.base)) is not None:
        few = f"Too few {'readings' if lacking.kind else 'poses'} to tell: {len(d.base.problem.residual)} measured "
        few += f"numbers for {lacking.parameters} parameters"
        if of_setups := len(d.base.parameters) - lacking.parameters:
            few += f" and {of_setups} unknown number{'s' * (of_setups != 1)} of set-ups"
        further = f"measure {lacking.count} more {lacking.item} at least"
        return f"{few}. Nothing stands out, but hardly anything could; {further}."
    if d.verdict != "complete":
        return (
            f"Nothing stands out, but this data cannot tell whether what is left ({error}) is noise: {_would_tell(d)}."
        )
    if d.floor is None:
        return (
            f"Nothing stands out: what is left ({error}) is no more than how well arm and instrument repeat, as stated."
        )
    return f"Nothing is missing: what is left ({error}) looks like noise.{_noise(d)}"


def _named_together(d: Diagnosis) -> str:
    """Return all missing effects, each with its place and those that explain this data as well."""
    every = [_named(d, m) for m in d.missing]
    return "; and ".join(every) if any(m.rivals for m in d.missing) else joined(every)


def _fall(d: Diagnosis) -> str:
    """Say how far the error falls with what is missing, what the curve that remains adds, and what the noise is."""
    regions = d.regions if d.verdict == "unknown" and not d.misleading else None
    first, last = f"{1e3 * d.base.held_out_rms:.3f}", f"{1e3 * d.final.held_out_rms:.3f} {_unit(d)}"
    fell = f"With {'them' if len(d.missing) > 1 else 'it'}, the error on rows the fit has not seen "
    if regions is None:
        fell += f"falls from {first} to {last}"
    else:
        fell += f"is {last}, without {first}; {_in_parts(regions)}"
    little = joined([f"`{key}`" for key in of_little_worth(d)])
    worth = f" Significant, but worth next to nothing: {little}." if little else ""
    return f"{fell}.{_noise(d)}{worth}"


def _remaining(d: Diagnosis, s: Suspect) -> str:
    """Say what the strongest curve without a name follows, and what to do about it."""
    same = [x.channel for x in d.remaining if (x.where, x.pattern, x.share) == (s.where, s.pattern, s.share)]
    channels = joined(sorted(same, key=lambda name: name not in d.base.data.state.channels))
    at = ("" if s.where.startswith(("joint", "body")) else "the ") + s.where + ("," if "," in s.where else "")
    if s.share + sum(other.share for other in d.further) < NO_LAW_SHARE:
        strongest = f"the strongest curve, at {at} along {channels} ({s.pattern})"
        return f"More is left than noise; {strongest}, explains {percent(s.share)} {ABOVE_NOISE}."
    extent = ""  # how far the pattern turns a joint between its extreme rows
    if s.where.startswith("joint") and s.place.shape[2] == 1:
        turned = s.values.reshape(len(s.values), -1) @ suspect_size(d.searched, s)
        extent = f", {1e3 * float(np.ptp(turned)):.2g} mrad in all"
    follows = f"The remaining structure sits at {at} and follows {channels} ({s.pattern}{extent})."
    if s.channel == "row":
        follows += " If the rows stand in the order of measuring, something moved or drifted there."
    follows += _cause_to_record(d, s)
    advice = "`postproc add` adds it as a `curve`."
    if lacking := to_record(d):
        columns = joined([f"`{name}`" for name in lacking])
        advice = f"Record {columns} first: the curve may stand for what that would tell."
    elif d.regions is None:
        advice = "Rows the fit has not seen do not confirm it: look there, and measure more."
    elif d.misleading:
        advice = f"It holds near the measured rows at best: {_in_parts(d.regions)}. Measure more before you add it."
    else:
        advice = f"I{_in_parts(d.regions)[1:]}. {advice}"
    return f"{follows} {advice}"


def _in_parts(regions: Regions) -> str:
    """Return a clause on the error in parts of the joint space that the search for a curve has not seen."""
    before, after = 1e3 * rms(regions.before), 1e3 * rms(regions.after)
    return f"in parts of the joint space left out it takes the error from {before:.3f} to {after:.3f}"


def _cause_to_record(d: Diagnosis, s: Suspect) -> str:
    """Say which columns would tell what goes on while time passes or one temperature changes; empty of other curves."""
    if not {*SLOW, "row"}.issuperset(s.channels):
        return ""
    known = d.base.data.state.channels
    columns = [] if "cycle" in known else ["`cycle` (how many restarts, tool changes and set-ups there were)"]
    if d.base.data.state.temperature is not None and "temperature2_C" not in known:
        at = ("" if s.where.startswith(("joint", "body")) else "the ") + s.where.partition(",")[0]
        columns.append(f"`temperature2_C` (a second temperature, at {at})")
    return f" A column may hold the cause, and is tried if it is there: {joined(columns)}." if columns else ""


def _would_tell(d: Diagnosis) -> str:
    """Return a clause on why the noise is not known and which measurements would tell it."""
    lacks = (
        "the arm's own repeatability is not known" if d.base.noise.instrument else "no pose was measured often enough"
    )
    return f"{lacks}. Measure {REPEATED} poses three times each, or state the noise (`--noise`)"


def to_record(d: Diagnosis) -> list[str]:
    """Return columns that the table lacks and should have, if curves explain below 90 % of what is above the noise.

    The approach side of a joint and the payload move every arm. Where they are not recorded, their influence looks like
    a function of other columns, which explains some of it. Derived sides are those of an arm that went straight from
    pose to pose; where an effect follows them, that holds.
    """
    if not d.remaining or d.remaining[0].share + sum(s.share for s in d.further) >= NEARLY_ALL:
        return []
    state = d.base.data.state
    used = any("approach" in e.reads and not e.is_null for e in d.final.model.effects)
    recorded = state.approach is not None and (used or not d.base.data.sides_from)
    lacking = [("dir1` to `dir6", recorded), ("payload_kg", state.payload_mass is not None)]
    return [name for name, known in lacking if not known]


def doubts(d: Diagnosis) -> Iterator[str]:
    """Yield sentences on the alternatives to a missing effect that the headline has no room for."""
    if d.exceeds_noise is None and d.verdict == "missing":
        yield f"Whether what is left is noise, this data cannot tell: {_would_tell(d)}."
    for m in d.missing:
        if m.rivals[MOST_RIVALS_NAMED:]:
            yield f"As far as this data can tell, `{m.key}` may be {_any_of(m.rivals)} as well."
        if m.unseen:
            yield f"Beside `{m.key}` this data would not show {_any_of(m.unseen)}."


def of_little_worth(d: Diagnosis) -> list[str]:
    """Return keys of missing effects that are significant but lower the error by less than 2 %.

    Empty where the verdict is "unknown".
    """
    if d.verdict == "unknown":
        return []
    before = [d.base.held_out_rms, *(m.held_out_after for m in d.missing)]
    pairs = zip(d.missing, before, strict=False)
    return [m.key for m, error in pairs if m.held_out_after > (1 - LITTLE) * error]


def _named(d: Diagnosis, m: Candidate) -> str:
    """Return an effect's key with its place, and with the effects that explain this data as well."""
    where = place(m.label)
    if len(d.missing) > 1 and _is_free(d, m):
        where += "; a smooth correction, not a cause"
    others = _any_of(m.rivals) if len(m.rivals) <= MOST_RIVALS_NAMED else f"one of {len(m.rivals)} others"
    rivals = f" or, as far as this data can tell, {others}" if m.rivals else ""
    return f"`{m.key}`" + (f" ({where})" if where else "") + rivals


def _any_of(keys: Iterable[str]) -> str:
    """Return keys in backticks, joined by commas and "or"."""
    return joined([f"`{key}`" for key in keys], "or")


def _is_free(d: Diagnosis, m: Candidate) -> bool:
    """Tell whether an effect is a free function, which can follow anything smooth."""
    effect = d.final.model.effect(m.key)
    return effect is not None and effect.roughness() is not None


def title(d: Diagnosis, m: Candidate) -> str:
    """Return what an effect is: its title, or of a free function the effective parameters and the held-out error."""
    if _is_free(d, m):
        # It can follow anything smooth: what it follows is no cause.
        count = effective_parameters(d.final, m.key)
        error = f"held-out error {1e3 * m.held_out_after:.3f} {_unit(d)}"
        return f"a smooth correction with {count:.0f} effective parameters, {error}, not a cause"
    effect = d.final.model.effect(m.key)
    text = "" if effect is None else effect.title.rstrip(".")
    return text if text[1:2].isupper() else text[:1].lower() + text[1:]
