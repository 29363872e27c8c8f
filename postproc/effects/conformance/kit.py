"""The kit that every effect goes through: ``check_effect(cls)`` and ``postproc effects check FILE.py``.

What a class declares: its equation (a docstring) and its units, with bounds and typical sizes. What it gives on the arm
and the states of `example_state`, with only the channels that it declares: nothing at its null value, derivatives that
agree with what it gives, and an arm that every parameter moves.
"""

from __future__ import annotations

import inspect
import re
import warnings
from collections.abc import Iterator
from dataclasses import fields, replace

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import GRAVITY, Array
from postproc.channels.state import COLUMNS
from postproc.diagnostics import Diagnostic, PostprocError, did_you_mean, has_errors
from postproc.effects.asking import displacement_of, load_of
from postproc.effects.base import FILLED_BY_MODEL, Displacement, Effect, Load, State, Variant
from postproc.effects.conformance.example import example_arm, example_state
from postproc.effects.conformance.table import COLUMN_CHANNELS, columns_read, raised, report
from postproc.effects.parameters import Parameter, unit_suffix

TRIAL_ROWS = 240
MOST_VARIANTS = 12
LARGEST_MOVE = 0.02
"""Move [m] and turn [rad] that no single cause makes at its ordinary size: an arm as delivered is within 10 mm."""
COLUMN_SCALES = (1.0, 10.0, 100.0, 1e3, 1e4, 1e5)
"""Largest values of a column of the user's own with which an effect is tried."""
STATE_COLUMNS = {
    column
    for key, columns in COLUMNS.items()
    if key != "external_axes"
    for name in columns
    for column in (name.lower(), name.split("_")[0])
}
KNOWN_READS = STATE_COLUMNS.union(COLUMN_CHANNELS, FILLED_BY_MODEL, ("channels", "state", "joint_load", "body_load"))
"""Columns of a table, and their beginnings (`q1`), that a state holds under other names alone."""
SI = ("rad", "m", "kg", "s", "K", "N", "J", "W", "Pa", "Hz", "V", "A")
SI_OF = {
    **dict.fromkeys(("deg", "°", "mrad", "urad", "arcmin", "arcsec"), "rad"),
    **dict.fromkeys(("mm", "cm", "um", "µm", "in", "inch"), "m"),
    **dict.fromkeys(("min", "h", "ms", "d"), "s"),
    **dict.fromkeys(("C", "degC", "°C"), "K"),
    **dict.fromkeys(("g", "t", "lb"), "kg"),
    "kN": "N",
    "Nm": "N m",
    "%": "1",
}
"""What is commonly written in place of a part of the SI, or of two without the blank between them."""


def check_effect(cls: type[Effect]) -> list[Diagnostic]:
    """Check an effect class; an empty list means that every command can use it."""
    findings = list(_declaration(cls))
    if has_errors(findings):
        return findings
    state = _declared_channels(cls, example_state(TRIAL_ROWS))
    try:
        for check in (_null, _derivative, _sample, _sizes):
            findings += check(cls, state)
            if has_errors(findings):
                break  # Later checks would only repeat the first failure.
    except PostprocError as error:
        findings += error.diagnostics
    except (Exception, SystemExit) as error:
        findings.append(raised(cls, error))
    return findings


def contribution(effect: Effect, state: State) -> Array:
    """Return all outputs (n, 114): displacement of joints, bodies, tool, instrument, set-ups; load on joints, bodies.

    Raises:
        PostprocError: EFF003 for a wrong shape, EFF005 or EFF010 for an exception in the effect.
    """
    cls, blocks = type(effect), []
    for member, evaluate in (("displacement", displacement_of), ("load", load_of)):
        try:
            with np.errstate(all="ignore"), warnings.catch_warnings():  # What is not finite is found in the result.
                warnings.simplefilter("error", np.exceptions.ComplexWarning)
                result = evaluate(effect, state)
        except (Exception, SystemExit) as error:
            raise PostprocError([raised(cls, error, member)]) from error
        if not isinstance(result, Displacement | Load):
            raise PostprocError([report("type", cls, member=member, kind=type(result).__name__)])
        if unknown := [body for body in result.body if body not in range(7)]:
            raise PostprocError([report("body", cls, member=member, body=repr(unknown[0]))])
        ends = (result.tool, result.instrument, result.setup) if isinstance(result, Displacement) else ()
        parts = (result.joint, *(result.body.get(body) for body in range(7)), *ends)
        blocks += [_block(cls, member, len(state), part) for part in parts]
    return np.concatenate(blocks, axis=1)


def _declaration(cls: type[Effect]) -> Iterator[Diagnostic]:
    """Yield what is wrong with the docstring, the names, the units, the channels and the methods of an effect class."""
    declared = inspect.get_annotations(cls)
    if taken := [name for name in declared if hasattr(Effect, name) or name in Effect.__annotations__]:
        yield from (report("name taken", cls, member=name, name=name) for name in taken)
        return
    if not cls.title:
        yield report("docstring", cls)
    for name, meta in cls.parameters().items():
        yield from _unit(cls, name, meta.unit)
        if what := _bounds(meta):
            yield report(what, cls, member=name, name=name)
    known = ", ".join((*COLUMNS, *FILLED_BY_MODEL))
    yield from (report("reads", cls, name=n, known=known) for n in columns_read(cls) if n.lower() in KNOWN_READS)
    if not cls.parameters():
        yield report("no parameters", cls)
    if cls.displacement is Effect.displacement and cls.load is Effect.load and cls.joint_basis is Effect.joint_basis:
        members = (name for name, value in vars(cls).items() if inspect.isfunction(value))
        meant = (f"`{n}`: {d}" for n in members if (d := did_you_mean(n, ("displacement", "load"))))
        yield report("no method", cls, hint=next(meant, "write one of the two"))


def _unit(cls: type[Effect], name: str, unit: str) -> Iterator[Diagnostic]:
    """Yield EFF002 for a parameter without a unit of the SI, EFF017 where its name does not end in it."""
    # Per what a column of the user's own counts, any word may stand.
    checked = unit.partition("/")[0] if columns_read(cls) else unit
    foreign = [part for part in re.split(r"[\s()*/^\d.-]+", checked) if part and part not in SI]
    if not unit:
        yield report("no unit", cls, member=name, name=name)
    elif foreign:
        part = foreign[0]
        hint = f"write `{SI_OF[part]}` in place of `{part}`; " if part in SI_OF else ""
        yield report("foreign unit", cls, member=name, name=name, unit=unit, hint=hint, si=", ".join(SI))
    elif not name.endswith(unit_suffix(unit)):
        yield report("no unit in name", cls, member=name, name=name, unit=unit, suffix=unit_suffix(unit))


def _bounds(meta: Parameter) -> str:
    """Return which row of the table the bounds, null value and typical size of a parameter deserve; empty for none."""
    try:
        low, high, null, typical = (0.0 + np.asarray(x) for x in (meta.low, meta.high, meta.null, meta.typical))
    except (TypeError, ValueError):
        return "no numbers"
    if np.any(low > null) or np.any(null > high) or not np.all(typical > 0.0):
        return "bounds"
    beyond = meta.amplitude and np.any(typical > np.maximum(high - null, null - low))
    return "typical" if beyond else ""


def _declared_channels(cls: type[Effect], state: State) -> State:
    """Return the state with only q and what the effect reads, all arrays read-only."""
    along = np.arccos(np.linspace(-1.0, 1.0, TRIAL_ROWS))
    columns = {name: np.cos((k + 1) * along) for k, name in enumerate(columns_read(cls))}
    columns |= {n: x for n, x in state.channels.items() if n in cls.reads}
    fields_of = {
        "payload": ("payload_mass", "payload_center"),
        "load": ("joint_load", "body_load"),
        "pose": ("T_base_body",),
        "external_axes": ("external_axes", "work", "station"),
        "setup": ("setup", "setup_names"),
    }
    wanted = {"q", "T_flange_tcp", "gravity", "channels", *(f for n in cls.reads for f in fields_of.get(n, (n,)))}
    if {"load", "pose", "robot"} & set(cls.reads):
        wanted |= {"robot", "T_base_body"}
    dropped = {f.name: None for f in fields(state) if f.name not in wanted}
    return _locked(replace(state, channels=columns, **dropped))  # type: ignore[arg-type]


def _null(cls: type[Effect], state: State) -> Iterator[Diagnostic]:
    """Yield EFF003 where `displacement` returns nothing, EFF004 where the effect does something at its null value."""
    forms = [cls.null(), *(form.effect for form in _forms(cls, state))]
    for effect in forms:
        contribution(_sized(effect), state)  # raises what is wrong with shapes
    if cls.load is Effect.load and _sized(cls.null()).displacement(state) is None:
        yield report("nothing", cls, member="displacement")
        return
    for effect in forms:
        remaining = np.abs(contribution(effect.with_vector(effect.null_vector()), state))
        if np.any(remaining):
            member = "displacement" if np.any(remaining[:, :66]) else "load"
            yield report("not null", cls, member=member, largest=float(remaining.max()))
            return


def _derivative(cls: type[Effect], state: State) -> Iterator[Diagnostic]:
    """Yield EFF012 where `joint_basis` and `displacement` disagree, or an effect declared linear is not."""
    few = _locked(state.rows(np.arange(40)))
    effect = _sized(cls.null())
    columns = effect.joint_basis(few)
    if columns is not None:
        exact = np.zeros((len(few), 6, len(effect.scale())))
        exact[:, columns.joint, np.arange(len(effect.scale()))] = columns.values
        if not np.allclose(contribution(effect, few)[:, :6], exact @ effect.vector(), atol=1e-12):
            yield report("basis", cls, member="joint_basis")
            return
    if cls.linear:
        # Halved, not doubled: an ordinary size may lie at a bound.
        null, ordinary = effect.null_vector(), effect.vector()
        base, half, full = (contribution(effect.with_vector(x), few) for x in (null, (null + ordinary) / 2, ordinary))
        if not np.allclose(full - base, 2 * (half - base), rtol=1e-6, atol=1e-6 * np.abs(full).max(initial=0.0)):
            yield report("not linear", cls)


def _sample(cls: type[Effect], state: State) -> Iterator[Diagnostic]:
    """Yield EFF009 where a row depends on others, EFF014 where a parameter changes nothing or repeats others."""
    effect, rows = _sized(cls.null()), np.array([7, 3, 100])
    alone = contribution(effect, _locked(state.rows(rows)))
    if not np.allclose(contribution(effect, state)[rows], alone, rtol=1e-9, atol=1e-15):
        yield report("rows", cls, member="displacement")
        return
    for form in _forms(cls, state):
        effect, freed = _sized(form.effect), np.flatnonzero(form.refit)
        columns = _moves(effect, freed, state)
        size = np.linalg.norm(columns, axis=0)
        if np.any(size == 0.0):
            names = ", ".join(f"`{n}`" for n in np.array(effect.names())[freed][size == 0.0][:4])
            # A threshold has no slope; the kit knows no levels of a payload, nor of a channel of the user's own.
            levels = bool(columns_read(cls)) or "payload" in cls.reads
            excused = not np.any(effect.amplitudes()[freed][size == 0.0]) or levels
            yield report("maybe no change" if excused else "no change", cls, names=names, warn=excused)
            if not excused:
                return
        columns, size = columns[:, size > 0.0], size[size > 0.0]
        if columns.shape[1] == 0 or effect.roughness() is not None:
            continue  # A penalty, not the data, decides between columns of a free function that nearly repeat others.
        singular = np.linalg.svd(columns / size, compute_uv=False)
        if singular[-1] < 1e-8 * singular[0]:
            yield report("repeated", cls, count=len(freed), form=form.label or "all")
            return


def _moves(effect: Effect, freed: NDArray[np.int_], state: State) -> Array:
    """Return (r, k) what k parameters of an effect change, in the state and with its own columns in larger units.

    A column may hold shares, bar, millimetres or pascals: it is tried up to 1, 10 .. 100,000 to either side.

    Args:
        freed: (k,) index of the parameters.
    """
    x, step, blocks = effect.vector(), 1e-4 * np.diag(effect.scale()), []
    own = columns_read(type(effect))
    for factor in COLUMN_SCALES if own else (1.0,):
        channels = {**state.channels, **{name: factor * state.channels[name] for name in own}}
        tried = _locked(replace(state, channels=channels))
        try:
            if (basis := effect.joint_basis(tried)) is not None:
                block = basis.values[:, freed]
            else:
                ends = ([contribution(effect.with_vector(x + s * step[i]), tried) for s in (1, -1)] for i in freed)
                block = np.stack([(up - down).ravel() for up, down in ends], axis=1)
        except PostprocError:
            if factor == 1.0:
                raise
            break  # an exponential of a large number: its smaller ones have shown what it does
        blocks.append(block / max(float(np.linalg.norm(block, axis=0).max(initial=0.0)), 1e-300))
    return np.concatenate(blocks)


def _sizes(cls: type[Effect], state: State) -> Iterator[Diagnostic]:
    """Yield EFF018 where an effect moves over 20 mm or 20 mrad, or loads more than the arm's weight at full reach.

    Such sizes come from mm in place of m, or N mm in place of N m.
    """
    arm = example_arm()
    weight = GRAVITY * float(arm.mass.sum())
    reach = float(np.linalg.norm(arm.link[:, :3, 3], axis=1).sum())
    for form in _forms(cls, state):
        # (19, 6): joints; bodies 0 to 6, tool and instrument; set-ups; torques; wrenches on bodies 0 to 6
        size = np.abs(contribution(_sized(form.effect), state)).max(axis=0).reshape(19, 6)
        for member, does, largest, most in (
            ("displacement", "turns something by {:.3g} rad", max(size[0].max(), size[1:10, 3:].max()), LARGEST_MOVE),
            ("displacement", "moves something by {:.3g} m", size[1:10, :3].max(), LARGEST_MOVE),
            ("load", "pulls with {:.3g} N", size[12:, :3].max(), weight),
            ("load", "turns with {:.3g} N m", max(size[11].max(), size[12:, 3:].max()), weight * reach),
        ):
            if largest > most:
                yield report("size", cls, member=member, does=does.format(largest))
                return


def _block(cls: type[Effect], member: str, n: int, part: Array | None) -> Array:
    """Return one part of a result as (n, 6), zero for None; EFF003 for other shapes or values that are not finite."""
    if part is None:
        return np.zeros((n, 6))
    array = np.asarray(part)
    if array.shape not in ((n, 6), (6,)):
        raise PostprocError([report("shape", cls, member=member, shape=array.shape, n=n)])
    if array.dtype.kind not in "fi" or not np.all(np.isfinite(array)):
        raise PostprocError([report("not finite", cls, member=member)])
    return np.broadcast_to(array.astype(float), (n, 6))


def _locked(state: State) -> State:
    """Make all arrays of a state read-only, and return it."""
    for value in [*(getattr(state, f.name) for f in fields(state)), *state.channels.values()]:
        if isinstance(value, np.ndarray):
            value.setflags(write=False)
    return state


def _forms(cls: type[Effect], state: State) -> tuple[Variant, ...]:
    """Return about twelve of the forms of an effect, evenly chosen from all."""
    forms = cls.variants(state)
    return forms[:: max(1, len(forms) // MOST_VARIANTS)]


def _sized(effect: Effect) -> Effect:
    """Return the effect with each amplitude one typical size from its null value; other parameters as they are."""
    x, null = effect.vector(), effect.null_vector()
    low, high = effect.bounds()
    return effect.with_vector(np.where(effect.amplitudes(), np.clip(null + effect.scale(), low, high), x))
