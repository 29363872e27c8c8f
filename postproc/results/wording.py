"""Fitted numbers, places and probabilities as people read them."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from postproc.diagnostics import joined
from postproc.effects.base import Effect
from postproc.effects.parameters import unit_suffix
from postproc.grouping import grouped as by_key

if TYPE_CHECKING:
    from postproc.estimation.fitted import Fit  # a conversion words no fit

SMOOTH_FUNCTIONS = "smooth functions of all columns"
CHANNEL = "a recorded column, or what follows from it: load2 is the torque on joint 2"
"""What a channel is, where people first meet the word."""
SINGLY = 48  # parameters of one effect that are told one by one
BODIES = 7  # an array with one entry for each body counts them from the pedestal, 0


def fitted_values(fit: Fit, key: str) -> Iterator[tuple[str, float, float, str]]:
    """Yield name, value, standard deviation and unit of every fitted parameter of an effect.

    Names are such as ``half_gap[2]`` or ``mass[body 3]``; lengths, angles and times are in thousandths, what is derived
    from them (rad/(N m), m/s, 1/K) in millionths.

    Args:
        key: of the effect.
    """
    effect = fit.model.effect(key)
    if effect is None:
        return
    entries = list(_entries(effect))
    for i in _stated_entries(fit, effect):
        name, unit = entries[i]
        factor, shown = readable(unit)
        yield name, factor * float(effect.vector()[i]), factor * fit.sigma[key, i], shown


def _stated_entries(fit: Fit, effect: Effect) -> list[int]:
    """Return the entries of an effect's vector that are told: fitted ones, and open ones at another prior than null."""
    x, null, fitted = effect.vector(), effect.null_vector(), set(fit.posterior.names)
    every = [i for i in range(len(x)) if (effect.key, i) in fit.sigma]
    return [i for i in every if (effect.key, i) in fitted or x[i] != null[i]]


def known_values(fit: Fit, key: str) -> Iterator[tuple[int, str]]:
    """Yield index and text of every parameter of an effect: ``the compliance of joint 1, 4.22 ± 0.90 µrad/(N m)``.

    Args:
        key: of the effect, which the model has.
    """
    effect = fit.model.effect(key)
    assert effect is not None
    for i, (name, value, sigma, unit) in zip(_stated_entries(fit, effect), fitted_values(fit, key), strict=True):
        yield i, f"{in_words(type(effect), name)}, {with_sigma(value, sigma)} {unit}".rstrip()


def named_values(fit: Fit, keys: Iterable[str]) -> dict[tuple[str, int], tuple[str, str]]:
    """Return ``half_gap[2]`` and ``0.109 ± 0.001 mrad`` of every parameter of some effects, by effect key and index.

    Args:
        keys: of the effects; those that the model lacks have none.
    """
    words: dict[tuple[str, int], tuple[str, str]] = {}
    for key in keys:
        if (effect := fit.model.effect(key)) is not None:
            values = zip(_stated_entries(fit, effect), fitted_values(fit, key), strict=True)
            for i, (name, value, sigma, unit) in values:
                words[key, i] = name, f"{with_sigma(value, sigma)} {unit}".rstrip()
    return words


def parameter_rows(fit: Fit, key: str, most: int = SINGLY) -> list[tuple[str, str, str, str]]:
    """Return rows of effect, ``half_gap[2]``, ``0.109 ± 0.001`` and ``mrad`` for every fitted parameter.

    Args:
        key: of the effect. most: of an effect with more parameters, one row tells only how many they are.
    """
    values = list(fitted_values(fit, key))
    if len(values) > most:
        return [(key, f"{len(values)} numbers, in the model file", "", "")]
    return [(key, name, with_sigma(value, sigma), unit) for name, value, sigma, unit in values]


def place(label: str) -> str:
    """Return the forms of an effect as one phrase.

    ``joint 2; joint 3`` is ``joints 2 and 3``; ``joint 2, order 6; joint 2, order 7`` is ``joint 2, orders 6 and 7``.

    Args:
        label: of a candidate: its forms with semicolons between them.
    """
    label = label.replace("joints 1, 2, 3, 4, 5 and 6", "all joints")
    parts = [re.fullmatch(r"(joint|body) (\d(?: and \d)*)(?:, order (\d+))?", part) for part in label.split("; ")]
    known_parts = [m for m in parts if m]
    if len(known_parts) < len(parts) or len({(m[1], m[3] is None) for m in known_parts}) > 1:
        return label
    word, _, order = known_parts[0].groups()
    if order:
        orders = by_key((m[2], m[3]) for m in known_parts)
        return "; ".join(f"{word} {number}, {_several('order', numbers)}" for number, numbers in orders.items())
    return _several(word, sorted(number for m in known_parts for number in m[2].split(" and ")))


def _several(word: str, numbers: Sequence[str]) -> str:
    """Return a noun with its numbers, in the plural for several: ``joints 2 and 3``.

    Args:
        word: ``joint``, ``body`` or ``order``.
    """
    plural = {"joint": "joints", "body": "bodies", "order": "orders"}[word]
    return f"{word if len(numbers) == 1 else plural} {joined(numbers)}"


def parameters_text(fit: Fit, which: Iterable[tuple[str, int]]) -> str:
    """Return parameters by effect, in one text: ``tool_frame turn[x y z], link_geometry shift[body 2, z]``.

    Args:
        which: the parameters, as (effect key, index in its vector).
    """
    names = {e.key: [name for name, _ in _entries(e)] for e in fit.model.effects}
    return grouped(f"{key} {names[key][i]}" for key, i in which)


def grouped(names: Iterable[str]) -> str:
    """Return one text in which entries of an array stand together: ``turn[x y z], shift[body 2, z; body 3, x]``.

    Args:
        names: such as ``turn[x]``.
    """
    parts = (name.partition("[") for name in names)
    groups = by_key((array, index.rstrip("]")) for array, _, index in parts)
    between = {array: "; " if any(", " in e for e in entries) else " " for array, entries in groups.items()}
    return ", ".join(f"{a}[{between[a].join(entries)}]" if entries[0] else a for a, entries in groups.items())


def p_text(p: float) -> str:
    """Return a probability as text: ``0.37``, ``6e-125``, ``< 1e-300``."""
    return f"{p:.2f}" if p > 0.005 else f"{p:.0e}" if p > 1e-300 else "< 1e-300"


ABOVE_NOISE = "of the variance above the noise"
"""What shares of an error are shares of: of its mean square, less that of the noise."""


def percent(share: float) -> str:
    """Return a share above 0 as text: ``37 %``, ``less than 1 %``."""
    return f"{100 * share:.0f} %" if share >= 0.005 else "less than 1 %"


def _entries(effect: Effect) -> Iterator[tuple[str, str]]:
    """Yield name and unit of every entry of an effect's vector, with the joint, body or session it belongs to."""
    chosen = {name: getattr(effect, name) for name in effect.structures()}
    for name, meta in effect.parameters().items():
        axes = []
        for word, length in zip(meta.shape, effect.shape(name), strict=True):
            tied = {} if isinstance(word, int) else {k: v for k, v in chosen.items() if isinstance(v, tuple)}
            tied = {k: v for k, v in tied.items() if word in tied and len(v) == length}
            if isinstance(word, str) and isinstance(next(iter(tied.get(word, ())), None), str):
                tied = {word: tied[word]}  # a name says it all
            # A name that says of what kind it is needs no other word.
            words = {k: "" if all(" " in str(x) for x in v) else f"{k} " for k, v in tied.items()}
            plain = [f"body {i}" if length == BODIES else str(i + 1) for i in range(length)]
            axes.append(
                [
                    ", ".join(words[k] + (v[i] if isinstance(v[i], str) else f"{v[i]:g}") for k, v in tied.items())
                    or plain[i]
                    for i in range(length)
                ]
            )
        if meta.labels and axes:
            axes[-1] = list(meta.labels)
        for index in product(*axes):
            yield name.replace(unit_suffix(meta.unit), "") + (f"[{', '.join(index)}]" if index else ""), meta.unit


def in_words(effect: type[Effect], name: str) -> str:
    """Return a parameter of a joint or a body as a noun: ``compliance[1]`` is ``the compliance of joint 1``.

    Numbers count the joints where an array has an entry for each of them. Others are named as in tables, behind the key
    of their effect: ``tool_frame shift[x]``.

    Args:
        effect: its class; name: with or without the unit, and the index.
    """
    array, bracket, index = name.partition("[")
    fields = {field.removesuffix(unit_suffix(meta.unit)): meta for field, meta in effect.parameters().items()}
    noun = next((short for short in fields if array in (short, short + unit_suffix(fields[short].unit))), array)
    of = index.rstrip("]")
    if of.isdigit() and noun in fields and fields[noun].shape == (6,):
        of = f"joint {of}"
    if re.fullmatch(r"(joint|body) \d", of):
        return f"the {noun.replace('_', ' ')} of {of}"
    return f"{effect.key} {noun}{bracket}{index}"


def readable(unit: str) -> tuple[float, str]:
    """Return the factor from an SI unit to thousandths or millionths of it, and the name of those: 1e3, ``mrad``."""
    if unit in ("m", "rad", "s"):
        return 1e3, f"m{unit}"
    if unit.startswith(("m/", "rad/")):
        return 1e6, f"\N{MICRO SIGN}{unit}"
    if unit.startswith("1/"):
        return 1e6, f"1e-6/{unit[2:]}"
    return 1.0, "" if unit == "1" else unit


def with_sigma(value: float, sigma: float) -> str:
    """Return a value with its standard deviation, with the digits that the latter makes certain: ``0.109 ± 0.001``."""
    if not sigma > 0 or not 1e-3 <= max(abs(value), sigma) < 1e6:
        return f"{value:.3g} ± {sigma:.2g}"
    digits = max(0, 1 - int(np.floor(np.log10(sigma))))
    return f"{value:.{digits}f} ± {sigma:.{digits}f}"
