"""Add effects to a model, refit everything, and show the error fall."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from postproc.diagnostics import PostprocError
from postproc.effects.base import Effect
from postproc.effects.registry import effect_library, find_effect
from postproc.fit.fitted import Fit
from postproc.fit.least_squares import fit_model
from postproc.fit.leftover import smooth_bound
from postproc.fit.record import figures_json, fit_json, mm, recorded_model
from postproc.fit.rounding import rounded
from postproc.fit.solve import Terms
from postproc.fit.step import FRAMES
from postproc.identify.candidate import Screen
from postproc.identify.judgement import fitted_best
from postproc.identify.selection import compose
from postproc.measure.columns import columns_of
from postproc.measure.measurements import Measurements
from postproc.model.arm import Model

HELPS = 0.005
"""Share by which the held-out error must fall to be called a fall: half a percent is lost in three digits."""
LITTLE = 0.05
"""Share of the way to the floor that must be gone to be called more than hardly any: chance goes a few percent."""


@dataclass(frozen=True)
class Step:
    """One rung of the ladder: what was added, the fit after it, the share of the way from the base to the floor."""

    name: str
    fit: Fit
    share: float | None


@dataclass(frozen=True)
class Addition:
    """A model with further effects.

    Args:
        ladder: base, then one rung for each effect. without: the final fit with one effect left out, by key.
        floor: noise per axis, or the bound of any function where no noise is known [m].
    """

    ladder: tuple[Step, ...]
    without: dict[str, Fit]
    floor: float

    @property
    def before(self) -> Fit:
        return self.ladder[0].fit

    @property
    def fit(self) -> Fit:
        return self.ladder[-1].fit

    @property
    def model(self) -> Model:
        """The new model with its table [fit], ready to be written."""
        return recorded_model(self.fit)

    def as_json(self) -> dict[str, Any]:
        """``postproc/fit/1`` with the ladder and the leave-one-out table."""
        return {
            **fit_json(self.fit, figures_json(self.before)),
            self.fit.observed.key("floor"): mm(self.floor),
            "ladder": [{"step": s.name, **figures_json(s.fit), "share_of_way": s.share} for s in self.ladder],
            "leave_one_out": [{"without": key, **figures_json(f)} for key, f in self.without.items()],
        }

    def text(self) -> str:
        """How far the error fell, then the ladder and the leave-one-out table."""
        first, last = 1e3 * self.before.held_out_rms, 1e3 * self.fit.held_out_rms
        helps = last < (1 - HELPS) * first
        known, unit, each = self.fit.noise_level is not None, self.fit.observed.unit, self.fit.observed.each
        floor = "the noise is" if known else "any smooth function of the channels would leave"
        floor = f"{floor} {1e3 * self.floor:.3f} {unit}"
        names = " and ".join(f"`{s.name.removeprefix('+ ')}`" for s in self.ladder[1:])
        gone, unseen = self.ladder[-1].share, "on rows that the fit has not seen"
        falls = f"the error falls from {first:.3f} to {last:.3f} {unit} per {each}"
        said = f"O{unseen[1:]}, {falls}"
        if not helps:
            said = f"Adding {names} does not help: {unseen}, the error is {last:.3f} {unit} per {each}, "
            said += f"{first:.3f} before"
        elif gone is not None and gone < LITTLE:
            helps, said = False, f"Adding {names} hardly helps: {unseen}, {falls}"
        lines = [
            f"{said}; {floor}.",
            "The next `compensate` with this model corrects what it now predicts."
            if helps
            else "Keep the model as it was, and ask `diagnose` what it lacks.",
            "",
            f"{'ladder':28s} rms {unit}  held-out {unit}  way to {'the noise' if known else 'that bound'}",
        ]
        for s in self.ladder:
            way = "" if s.share is None else f"{100 * s.share:5.0f} %"
            lines.append(f"  {s.name:24s} {1e3 * s.fit.rms:8.3f} {1e3 * s.fit.held_out_rms:10.3f}     {way}")
        lines += ["", f"{'leave one out':28s} rms {unit}  held-out {unit}"]
        lines += [f"  - {k:22s} {1e3 * f.rms:8.3f} {1e3 * f.held_out_rms:10.3f}" for k, f in self.without.items()]
        return "\n".join(lines)


def add_effects(
    model: Model,
    data: Measurements,
    keys: Sequence[str],
    extra_effects: Iterable[type[Effect]] = (),
    *,
    noise: float | None = None,
) -> Addition:
    """Add effects by key one after another, each in the form that suits the data, and refit everything.

    Args:
        extra_effects: classes beside the library's.

    Raises:
        PostprocError: EFF020 for an unknown key, DAT021 where the data lacks a channel that an effect reads.
    """
    library = effect_library()
    library.update({cls.key: cls for cls in extra_effects})
    classes = [find_effect(key, library) for key in keys]
    data = data.in_order
    added = _added(model, data, classes, noise)
    told = added.fit.data.rounded
    if told is None or told == rounded(added.fit):
        return added
    return _added(model, replace(data, rounded=not told), classes, noise)


def _added(model: Model, data: Measurements, classes: Sequence[type[Effect]], noise: float | None) -> Addition:
    base = fit_model(model, data, noise=noise)
    steps = [("base", base)]
    for cls in classes:
        steps.append((f"+ {cls.key}", grown(steps[-1][1], cls, noise)))
    added = [cls for cls in classes if model.effect(cls.key) is None]
    final = _beside_each_other(steps[-1][1], added if len(classes) > 1 else [], noise)
    steps[-1] = (steps[-1][0], final)
    level = final.noise_level
    floor = smooth_bound(base) if level is None else level
    top = base.held_out_rms
    ladder = []
    for name, fit in steps:
        share = None if top <= floor else float(np.clip((top - fit.held_out_rms) / (top - floor), 0.0, 1.0))
        ladder.append(Step(name, fit, share))
    without = {e.key: _without(final, e.key, noise) for e in final.model.effects if e.key not in FRAMES}
    # The frames of sessions that saw the arm from elsewhere come back by themselves.
    return Addition(tuple(ladder), {key: fit for key, fit in without.items() if fit.model.effect(key) is None}, floor)


def grown(fit: Fit, cls: type[Effect], noise: float | None = None) -> Fit:
    """A fit with one more effect, in the form that the data prefers.

    With the likeliest penalty for free functions.
    """
    missing = cls.missing(fit.problem.sensitivity.state)
    if missing:
        columns = ", ".join(map(columns_of, missing))
        message = f"`{cls.key}` reads {columns}: the measurements have no such column"
        raise PostprocError.of("DAT021", message, fit.data.source, help="measure with that channel")
    screen = Screen(fit.problem, {cls.key: cls})
    candidate = compose(screen, fit.linear, cls.key)
    if candidate is None:
        return fit_model(fit.model, fit.data, [fit.model.effect(cls.key) or cls.null()], noise=noise)
    found = fitted_best(fit, screen, candidate)
    if found is None:
        message = f"the fit with `{cls.key}` does not settle on this data"
        raise PostprocError.of("DAT022", message, fit.data.source, help="measure more poses that move it")
    return found[1]


def _beside_each_other(final: Fit, added: Sequence[type[Effect]], noise: float | None) -> Fit:
    """Every added effect in the form that suits it with all the others in: the first found its own without them."""
    for cls in added:
        anew = grown(_without(final, cls.key, noise), cls, noise)
        final = anew if anew.held_out_rms < (1 - HELPS) * final.held_out_rms else final
    return final


def _without(final: Fit, key: str, noise: float | None) -> Fit:
    kept = [e for e in final.model.effects if e.key != key]
    free = {e.key: final.free[e.key] for e in kept}
    strength = {k: v for k, v in final.strength.items() if k != key}
    return fit_model(final.model.with_effects(*kept), final.data, noise=noise, terms=Terms(free, strength))
