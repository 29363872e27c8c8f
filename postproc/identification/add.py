"""Add effects to a model, refit everything, and show the error fall."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import cast

import numpy as np

from postproc.diagnostics import PostprocError
from postproc.effects.base import Effect
from postproc.effects.registry import effect_library, find_effect
from postproc.effects.roles import Role
from postproc.estimation.fitted import Fit
from postproc.estimation.least_squares import fit_model
from postproc.estimation.priors import is_placed, with_earlier_fit
from postproc.estimation.recorded import no_farther_than_nominal, recorded_model
from postproc.estimation.solving.rounding import with_judged_rounding
from postproc.estimation.solving.settle import settled, settled_by_size
from postproc.identification.acceptance import fitted_best
from postproc.identification.curves.families import curve_forms
from postproc.identification.refits import refit_all, thinned, with_channels_of
from postproc.identification.refits import without as without_effects
from postproc.identification.regions import with_regions
from postproc.identification.screen.candidate import Screen
from postproc.identification.screen.composition import compose
from postproc.identification.search import with_curves_anew
from postproc.identification.state import SearchState
from postproc.measure.measurements import Measurements
from postproc.measure.observations import Observation
from postproc.measure.read.columns import columns_of
from postproc.model.arm import Model
from postproc.watch import Watch, unwatched

LEAST_FALL = 0.005
"""Share by which the held-out error must fall to be called a fall: half a percent is lost in three digits."""


@dataclass(frozen=True)
class FitFigures:
    """Figures that are reported of a fit which is not kept, since a fit of many rows needs much memory.

    Args:
        rms, held_out_rms: of what was observed [m], [rad] of angles; observed: the kind of measured numbers.
        unseen_rms: as of `Fit`.
    """

    rms: float
    held_out_rms: float
    observed: Observation
    unseen_rms: float | None

    @classmethod
    def of(cls, fit: Fit) -> FitFigures:
        """Return the figures of a fit."""
        return cls(fit.rms, fit.held_out_rms, fit.observed, fit.unseen_rms)


@dataclass(frozen=True)
class Step:
    """One step of an addition: what was added, and the fit after it.

    Args:
        share: of the mean square of the held-out error above that of the floor, how much is gone since the base, in
            [0, 1]; None where it cannot fall.
    """

    name: str
    fit: Fit | FitFigures
    model: Model
    share: float | None = None


@dataclass(frozen=True)
class Addition:
    """A model with further effects.

    Args:
        ladder: base, then one step for each effect; the last one holds the fit.
        without: the final fit with one effect left out, by key.
        floor: noise per axis [m], or what smooth functions reach without physics where the noise is not known.
    """

    ladder: tuple[Step, ...]
    without: dict[str, FitFigures]
    floor: float

    @property
    def before(self) -> Fit | FitFigures:
        """The fit, or its figures, before anything was added."""
        return self.ladder[0].fit

    @property
    def fit(self) -> Fit:
        """The final fit, with all effects."""
        return cast(Fit, self.ladder[-1].fit)

    @property
    def model(self) -> Model:
        """The new model with its table [fit], ready to be written to a file."""
        return recorded_model(self.fit)


def add_effects(
    model: Model,
    data: Measurements,
    keys: Sequence[str],
    extra_effects: Iterable[type[Effect]] = (),
    *,
    noise: float | None = None,
    watch: Watch = unwatched,
) -> Addition:
    """Add effects by key one after another, each in the form that suits the data, and refit everything.

    Args:
        keys: of the effects to add; extra_effects: classes beside the library's.
        noise: standard deviation per axis [m] stated by the user; that of repeats or ``sigma_mm`` by default.
        watch: is called with what is being done and the share of the work that is done.

    Raises:
        PostprocError: EFF020 for an unknown key, DAT021 where the data lacks a channel that an effect reads.
    """
    library = effect_library()
    library.update({cls.key: cls for cls in extra_effects})
    classes = [find_effect(key, library) for key in keys]
    data = with_channels_of(classes, model, data.in_order)
    model = with_earlier_fit(model, data)
    return with_judged_rounding(
        lambda rows: _added(model, rows, classes, noise, watch), data, lambda addition: addition.fit
    )


def _added(
    model: Model, data: Measurements, classes: Sequence[type[Effect]], noise: float | None, watch: Watch
) -> Addition:
    """Return the result of `add_effects` with joint angles taken as rounded or not as ``data.rounded`` says.

    Args:
        classes: of the effects to add; noise, watch: as in `add_effects`.
    """
    watch("the model as it came", 0.0)
    base = fit_model(model, data, noise=noise)
    # Forms are chosen on as many rows as tell them, and fitted to all.
    current = start = thinned(base)
    came = settled(base)
    steps, bound = [Step("base", FitFigures.of(came), came.model)], base.smooth_bound
    every = list(dict.fromkeys([*(cls.key for cls in classes), *(e.key for e in model.effects)]))
    # In units of the first fit, as a UR5 with an error map takes them.
    fitted, without_one = 1 + 2 * len(classes), 0.25
    total = fitted + 3 + without_one * len(every)

    def on_all_rows(current: Fit, keys: Sequence[str]) -> Fit:
        """Return what was found on some rows fitted to all of them."""
        # A start that some of the rows have settled needs no step below a third of a standard deviation.
        return current if start is base else refit_all(base, current, keys, closely=0.1 / len(base.problem.residual))

    curves = 0
    for k, cls in enumerate(classes):
        watch(f"`{cls.key}`", (1 + 2 * k) / total)
        if cls.role is Role.CURVE:
            with_curves = with_curve(current)
            current, curves = with_curves.fit, len(with_curves.curves)
        else:
            current = grown(current, cls)
        if cls is not classes[-1]:
            rung = settled(on_all_rows(current, [c.key for c in classes[: k + 1]]))
            steps.append(Step(f"+ {cls.key}", FitFigures.of(rung), rung.model))
    added = [cls for cls in classes if model.effect(cls.key) is None and cls.role is not Role.CURVE]
    current = _formed_together(current, added if len(classes) > 1 else [])
    watch("all of it", fitted / total)
    final = on_all_rows(current, [cls.key for cls in classes])
    no_farther_than_nominal(final)
    watch("regions left out", (len(classes) + 1.5) / total)
    unnamed = [cls.key for cls in classes if cls.role is Role.CURVE]
    after = with_regions(settled(final), without_effects(final, unnamed) if curves else base, searched=curves)
    steps.append(Step(f"+ {classes[-1].key}", after, after.model))
    level = final.parts.level
    floor = bound if level is None else level
    top = steps[0].fit.held_out_rms
    if top > floor:
        shares = [float(np.clip((top**2 - s.fit.held_out_rms**2) / (top**2 - floor**2), 0.0, 1.0)) for s in steps]
        steps = [replace(s, share=share) for s, share in zip(steps, shares, strict=True)]
    without: dict[str, FitFigures] = {}
    # Frames of sessions, and points of reflectors, that nobody asked for say where things stood.
    placed = {Role.SESSION_FRAMES, Role.WORK_OBJECTS, Role.REFLECTOR_POINTS} - {cls.role for cls in classes}
    for k, effect in enumerate(e for e in final.model.effects if not e.is_frame and e.role not in placed):
        watch(f"without `{effect.key}`", (fitted + 3 + without_one * k) / total)
        fit = without_effects(final, [effect.key])
        without[effect.key] = FitFigures.of(settled(fit) if start is base else fit)
    return Addition(tuple(steps), without, floor)


def fit_effects(
    model: Model,
    data: Measurements,
    classes: Iterable[type[Effect]],
    *,
    noise: float | None = None,
    watch: Watch = unwatched,
) -> Fit:
    """Fit effects to measurements: those with one fixed form together, then the others, each in its best form.

    Args:
        classes: of the effects; noise, watch: as in `add_effects`.

    Raises:
        PostprocError: DAT020 fewer measured numbers than parameters, DAT021 a channel that is not in the data, DAT022 a
            fit that does not converge.
    """
    classes = list(classes)
    data = with_channels_of(classes, model, data)
    fit = fit_model(model, data, [c.null() for c in classes if not c.structures()], noise=noise, watch=watch)
    for cls in classes:
        if cls.structures():
            fit = grown(fit, cls)
    nominal = without_effects(fit, [e.key for e in fit.model.effects if not is_placed(e)])
    return with_regions((settled_by_size if fit.problem.few else settled)(fit), nominal)


def grown(fit: Fit, cls: type[Effect]) -> Fit:
    """Return a fit with one more effect, in its form of the largest log evidence, everything fitted again.

    Args:
        cls: class of the effect; where the model has that effect, it may get further terms.

    Raises:
        PostprocError: DAT021 a channel that is not in the data, DAT022 a fit that does not converge.
    """
    if cls.role is Role.CURVE:
        return with_curve(fit).fit
    missing = cls.null().missing(fit.problem.sensitivity.state)
    if missing:
        columns = ", ".join(map(columns_of, missing))
        message = f"`{cls.key}` reads {columns}: the measurements have no such column"
        raise PostprocError.of("DAT021", message, fit.data.source, help="measure with that channel")
    screen = Screen(fit.problem, {cls.key: cls})
    candidate = compose(screen, fit.linear, cls.key)
    if candidate is None:
        return fit_model(fit.model, fit.data, [fit.model.effect(cls.key) or cls.null()], noise=fit.noise.stated)
    best = fitted_best(fit, screen, candidate)
    if best is None:
        message = f"the fit with `{cls.key}` does not settle on this data"
        raise PostprocError.of("DAT022", message, fit.data.source, help="measure more poses that move it")
    return best[1]


def with_curve(fit: Fit) -> SearchState:
    """Return a search on a fit with the curves of channels that remaining structure follows, everything fitted again.

    Raises:
        PostprocError: DAT028, nothing that remains follows a channel.
    """
    state = fit.problem.sensitivity.state
    searched = with_curves_anew(SearchState(fit, fit, {}, curve_forms(state, fit.problem.site)))
    if not searched.curves and fit.model.in_role(Role.CURVE) is None:
        message = "no curve is added: nothing that remains follows a channel"
        raise PostprocError.of("DAT028", message, fit.data.source, help="see what `diagnose` says", exit_code=1)
    return searched


def _formed_together(final: Fit, added: Sequence[type[Effect]]) -> Fit:
    """Return the fit with each added effect in the form that suits it beside all the others.

    The first forms were chosen without the later effects; a form is changed where the held-out error falls by the share
    `LEAST_FALL` at least.

    Args:
        final: the fit with all effects; added: classes of those that were added.
    """
    for cls in added:
        regrown = grown(without_effects(final, [cls.key]), cls)
        final = regrown if regrown.held_out_rms < (1 - LEAST_FALL) * final.held_out_rms else final
    return final
