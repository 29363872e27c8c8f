"""The public kit that every effect goes through: ``check_effect(cls)`` and ``postproc effects check FILE.py``.

An effect is tried on the arm and the states of `example_state`, with only the channels that it declares.
"""

from __future__ import annotations

import pickle
from collections.abc import Iterator
from dataclasses import fields, replace

import numpy as np

from postproc.arrays import GRAVITY
from postproc.diagnostics import Diagnostic, has_errors
from postproc.effects.base import Effect, State, Variant, variant
from postproc.effects.conformance.declaration import columns_read, declaration
from postproc.effects.conformance.failures import EffectFailure, raised
from postproc.effects.conformance.trial import contribution, displaced, locked, sensitivity
from postproc.effects.example import example_arm, example_state
from postproc.effects.findings import describe, finding

TRIAL_ROWS = 240
MOST_VARIANTS = 12
LARGEST_MOVE = 0.02
"""Move [m] and turn [rad] that no single cause makes at its ordinary size: an arm as delivered is within 10 mm."""


def check_effect(cls: type[Effect]) -> list[Diagnostic]:
    """Check an effect class; an empty list means that every command can use it."""
    found = list(declaration(cls))
    if has_errors(found):
        return found
    state = _declared_channels(cls, example_state(TRIAL_ROWS))
    for check in (_shapes, _null, _rows, _repeats, _derivative, _pickles, _identifiable, _sizes, _columns):
        try:
            found += check(cls, state)
        except EffectFailure as failure:
            found.append(failure.diagnostic)
        except (Exception, SystemExit) as error:
            found.append(raised(cls, error))
        if has_errors(found):
            break  # Later checks would only repeat the first failure.
    return found


def _declared_channels(cls: type[Effect], state: State) -> State:
    """Return the state with only q and what the effect reads, all arrays read-only."""
    along = np.arccos(np.linspace(-1.0, 1.0, TRIAL_ROWS))
    extra = {name: np.cos((k + 1) * along) for k, name in enumerate(columns_read(cls))}
    keep = {
        "payload": ("payload_mass", "payload_center"),
        "load": ("joint_load", "body_load"),
        "pose": ("T_base_body",),
        "external_axes": ("external_axes", "work", "station"),
    }
    wanted = {"q", "T_flange_tcp", "gravity", "channels", *(f for n in cls.reads for f in keep.get(n, (n,)))}
    if {"load", "pose", "robot"} & set(cls.reads):
        wanted |= {"robot", "T_base_body"}
    dropped = {f.name: None for f in fields(state) if f.name not in wanted}
    known = {n: x for n, x in state.channels.items() if n in cls.reads}
    return locked(replace(state, channels={**known, **extra}, **dropped))  # type: ignore[arg-type]


def _shapes(cls: type[Effect], state: State) -> Iterator[Diagnostic]:
    """Evaluate all forms, EffectFailure for wrong shapes; yield EFF003 where `displacement` returns nothing."""
    contribution(_sized(cls.null()), state)
    for form in _forms(cls, state):
        contribution(_sized(form.effect), state)
    if cls.load is Effect.load and _sized(cls.null()).displacement(state) is None:
        text, help = f"`displacement` of `{cls.key}` gives nothing", "is `return dq` missing at its end?"
        yield finding("EFF003", text, cls, member="displacement", help=help)


def _null(cls: type[Effect], state: State) -> Iterator[Diagnostic]:
    """Yield EFF004 where the effect does something at its null parameters."""
    for effect in [cls.null(), *(f.effect.with_vector(f.effect.null_vector()) for f in _forms(cls, state))]:
        largest = float(np.abs(contribution(effect, state)).max(initial=0.0))
        if largest > 0.0:
            message = f"`{cls.key}` does not vanish at its null parameters: {largest:.3g} is left"
            member = "displacement" if np.any(displaced(effect, state)) else "load"
            help = "every term must be multiplied by an amplitude whose null value is 0"
            yield finding("EFF004", message, cls, member=member, help=help)
            return


def _rows(cls: type[Effect], state: State) -> Iterator[Diagnostic]:
    """Yield EFF009 where the result for a state depends on the other states."""
    effect, some = _sized(cls.null()), np.array([7, 3, 100])
    whole, part = contribution(effect, state)[some], contribution(effect, locked(state.rows(some)))
    if not np.allclose(whole, part, rtol=1e-9, atol=1e-15):
        help = "compute each row from its own channels: no means, sorting or differences between rows"
        yield finding(
            "EFF009", f"a row of `{cls.key}` depends on the other rows", cls, member="displacement", help=help
        )


def _repeats(cls: type[Effect], state: State) -> Iterator[Diagnostic]:
    """Yield EFF011 where a second evaluation at the same states gives another result."""
    effect = _sized(cls.null())
    if not np.array_equal(contribution(effect, state), contribution(effect, state)):
        yield finding("EFF011", f"`{cls.key}` gives another answer the second time", cls, help="remove random numbers")


def _derivative(cls: type[Effect], state: State) -> Iterator[Diagnostic]:
    """Yield EFF012 where `basis` and `displacement` disagree, or an effect declared linear is not."""
    few = locked(state.rows(np.arange(40)))
    effect = _sized(cls.null())
    columns, step = effect.joint_basis(few), effect.scale()
    if columns is not None:
        exact = np.zeros((len(few), 6, len(step)))
        exact[:, columns.joint, np.arange(len(step))] = columns.values
        if not np.allclose(displaced(effect, few)[:, :6], exact @ effect.vector(), atol=1e-12):
            yield finding("EFF012", f"`basis` and `displacement` of `{cls.key}` disagree", cls, member="basis")
            return
    if cls.linear:
        # Halved, not doubled: an ordinary size may lie at a bound.
        none, full = effect.null_vector(), effect.vector()
        base, half, whole = (contribution(effect.with_vector(x), few) for x in (none, (none + full) / 2, full))
        largest = np.abs(whole).max(initial=0.0)
        if not np.allclose(whole - base, 2 * (half - base), rtol=1e-6, atol=1e-6 * largest):
            help = "declare it: class Name(Effect, linear=False), or mark forming parameters with amplitude=False"
            yield finding("EFF012", f"`{cls.key}` says it is linear in its amplitudes and is not", cls, help=help)


def _pickles(cls: type[Effect], state: State) -> Iterator[Diagnostic]:
    """Yield EFF013 where the effect changes when it is pickled or stored in a model file and read again."""
    effect = _sized(cls.null())
    try:
        again = pickle.loads(pickle.dumps(effect))
    except Exception as error:
        help = "define the class at the top level of its file"
        yield finding("EFF013", f"`{cls.key}` cannot be sent to another process: {describe(error)}", cls, help=help)
        return
    if again.to_file() != effect.to_file() or cls.from_file(effect.to_file()).to_file() != effect.to_file():
        yield finding("EFF013", f"`{cls.key}` changes when it is stored and read again", cls)


def _identifiable(cls: type[Effect], state: State) -> Iterator[Diagnostic]:
    """Yield EFF014 where a parameter changes nothing, or parameters are linearly dependent on varied poses."""
    for form in _forms(cls, state):
        effect = _sized(form.effect)
        freed = np.flatnonzero(form.refit)
        columns = sensitivity(effect, state, freed)
        size = np.linalg.norm(columns, axis=0)
        names = np.array(effect.names())[freed]
        if np.any(size == 0.0):
            dead = ", ".join(f"`{n}`" for n in names[size == 0.0][:4])
            help = "remove the parameter, or check the channel, the index and the limit (rad, m) that it acts on"
            # A threshold has no slope; the kit knows no levels of a payload, nor of a channel of the user's own.
            levels = bool(columns_read(cls)) or "payload" in cls.reads
            excused = not np.any(effect.amplitudes()[freed][size == 0.0]) or levels
            message = f"{dead} of `{cls.key}` changes nothing on a rich set of poses"
            yield finding("EFF014", message, cls, help=help, warn=excused)
            if not excused:
                return
        columns, size = columns[:, size > 0.0], size[size > 0.0]
        if columns.shape[1] == 0:
            continue
        if effect.roughness() is not None:
            continue  # A penalty, not the data, decides between columns that nearly repeat each other.
        singular = np.linalg.svd(columns / size, compute_uv=False)
        if singular[-1] < 1e-8 * singular[0]:
            message = f"the {len(freed)} parameters of `{cls.key}` ({form.label or 'all'}) repeat each other"
            yield finding("EFF014", message, cls, help="leave out what the others can express")
            return


def _sizes(cls: type[Effect], state: State) -> Iterator[Diagnostic]:
    """Warn (EFF018) where the effect moves over 20 mm or 20 mrad, or loads more than the arm's weight at full reach.

    Such sizes come from mm in place of m, or N mm in place of N m.
    """
    arm = example_arm()
    weight = GRAVITY * float(arm.mass.sum())
    reach = float(np.linalg.norm(arm.link[:, :3, 3], axis=1).sum())
    for form in _forms(cls, state):
        # (18, 6): joints; bodies 0 to 6, tool and instrument; torques; wrenches on bodies 0 to 6
        size = np.abs(contribution(_sized(form.effect), state)).max(axis=0).reshape(18, 6)
        for member, does, largest, most in (
            ("displacement", "turns something by {:.3g} rad", max(size[0].max(), size[1:10, 3:].max()), LARGEST_MOVE),
            ("displacement", "moves something by {:.3g} m", size[1:10, :3].max(), LARGEST_MOVE),
            ("load", "pulls with {:.3g} N", size[11:, :3].max(), weight),
            ("load", "turns with {:.3g} N m", max(size[10].max(), size[11:, 3:].max()), weight * reach),
        ):
            if largest > most:
                message = f"at its ordinary size `{cls.key}` {does.format(largest)}; no single cause does so much"
                help = "give results in rad, m, N and N m; if they are, say a smaller `typical` of its parameters"
                yield finding("EFF018", message, cls, member=member, help=help, warn=True)
                return


def _columns(cls: type[Effect], state: State) -> Iterator[Diagnostic]:
    """Warn (EFF016) of columns that are declared but not used, as data without them would switch the effect off."""
    effects = [_sized(form.effect) for form in (variant(cls.null()), *_forms(cls, state))]
    for name in columns_read(cls):
        without = replace(state, channels={n: x for n, x in state.channels.items() if n != name})
        try:
            for effect in effects:
                effect.displacement(without)
                effect.load(without)
        except Exception:
            continue  # it is used, and missed
        message, help = f"`{cls.key}` reads the column `{name}` and does not use it", "leave it out of `reads`"
        yield finding("EFF016", message, cls, help=f"{help}, or correct its spelling", warn=True)


def _forms(cls: type[Effect], state: State) -> tuple[Variant, ...]:
    """Return about twelve of the forms of an effect, evenly chosen from all."""
    forms = cls.variants(state)
    return forms[:: max(1, len(forms) // MOST_VARIANTS)]


def _sized(effect: Effect) -> Effect:
    """Return the effect with each amplitude one typical size from its null value; other parameters as they are."""
    x, null = effect.vector(), effect.null_vector()
    low, high = effect.bounds()
    return effect.with_vector(np.where(effect.amplitudes(), np.clip(null + effect.scale(), low, high), x))
