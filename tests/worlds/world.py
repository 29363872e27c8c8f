"""A world: everything that a program cannot know before it runs, drawn from a seed.

What is drawn depends on the identity of the thing (a data name, a signal, a routine, the statement that asks and how
often it has run), never on the order of draws, so that the original and the corrected program live in the same world.
Comments of a program say which values make sense: ``! world: giType = 1 2 3`` (choices), ``! world: nPre = 100 .. 400``
(a range), ``! world: task nShared = 0 .. 20`` (another task writes it), ``! world: writes rMeasure = nZ nTilt``.
"""

from __future__ import annotations

import hashlib
import random
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any


@dataclass(frozen=True)
class World:
    """Args: seed; unknown: routines of other files write; operator: PERS data differ; touched: targets are touched up;
    traps: interrupts fire and other tasks write; wanders: routines of other files move the arm and call procedures of
    these; enters: the procedure at which the pendant starts the task; says: the annotations of the program; found: where searches hit;
    anew: targets that are taught anew, by name, each with its function ``of`` the value in the text.
    """

    seed: int
    unknown: bool = False
    operator: bool = False
    touched: bool = False
    traps: bool = False
    wanders: bool = False
    enters: str = "main"
    says: dict[str, list[str]] = field(default_factory=dict)
    found: dict[Any, Any] = field(default_factory=dict)
    anew: Mapping[str, Any] = field(default_factory=dict)

    @property
    def name(self) -> str:
        words = [w for w in ("unknown", "operator", "touched", "traps", "wanders") if getattr(self, w)]
        return f"{self.seed} {self.enters} {'+'.join(words) or 'nominal'}"

    def random(self, *key: Any) -> random.Random:
        digest = hashlib.blake2b(repr((self.seed, key)).encode(), digest_size=8).digest()
        return random.Random(int.from_bytes(digest, "big"))

    def chance(self, p: float, *key: Any) -> bool:
        return self.random("chance", *key).random() < p

    def value(self, name: str, *key: Any) -> float | str | None:
        """A value of the choices or the range that the program's comments give for a name, else None."""
        words = self.says.get(name)
        if not words:
            return None
        r = self.random("value", name, *key)
        if len(words) == 3 and words[1] == "..":
            return round(r.uniform(float(words[0]), float(words[2])), 2)
        word = r.choice(words)
        return float(word) if word.lstrip("-").replace(".", "", 1).isdigit() else word.strip('"')

    def number(self, name: str, now: float, *key: Any) -> float:
        """A plausible other value of a number: small counts and indices stay, offsets of 0 and others change."""
        said = self.value(name, *key)
        if said is not None:
            return float(said)
        if now == 0:
            return round(self.random("number", name, *key).uniform(-20, 20), 2)
        if abs(now) <= 12 and now == int(now):
            return now
        return round(now * self.random("number", name, *key).uniform(0.4, 1.6), 2)

    def shift(self, size: float, *key: Any) -> list[float]:
        """A displacement of at most ``size`` mm, two decimals as a pendant stores it."""
        r = self.random("shift", *key)
        d = [r.gauss(0, 1) for _ in range(3)]
        length = sum(v * v for v in d) ** 0.5
        k = size * r.uniform(0.3, 1.0) / length
        return [round(v * k, 2) for v in d]

    def varied(self, value: Any, type_: str, name: str, *key: Any) -> Any:
        """Another value for data of a type, None where that type is left alone."""
        if type_ in ("num", "dnum"):
            return self.number(name, float(value), *key)
        if type_ == "bool":
            return self.random("bool", name, *key).random() < 0.5
        if type_ == "string":
            return self.value(name, *key)
        if type_ == "speeddata":
            return [round(value[0] * self.random("speed", name, *key).uniform(0.5, 1.5), 1), *value[1:]]
        if type_ == "pos":
            return self._moved(value, name, *key)
        if type_ in ("robtarget", "pose"):
            return [self._moved(value[0], name, *key), *value[1:]]
        if type_ == "wobjdata":
            frame = [self._moved(value[4][0], name, *key), value[4][1]]
            return [*value[:4], frame]
        if type_ == "tooldata":
            moved = [a + 0.1 * b for a, b in zip(value[1][0], self.shift(30, name, *key), strict=True)]
            return [value[0], [moved, value[1][1]], value[2]]
        return None

    def _moved(self, value: list[float], *key: Any) -> list[float]:
        return [a + b for a, b in zip(value, self.shift(30, *key), strict=True)]


def five(seed: int, says: dict[str, list[str]]) -> list[World]:
    """As declared; with other data from outside, twice; with touched-up targets; with all of it."""
    base = World(seed, says=says)
    return [
        base,
        replace(base, seed=seed + 1, unknown=True, operator=True, traps=True, found={}),
        replace(base, seed=seed + 2, unknown=True, operator=True, traps=True, found={}),
        replace(base, seed=seed + 3, touched=True, found={}),
        replace(base, seed=seed + 4, unknown=True, operator=True, touched=True, traps=True, found={}),
    ]


def by_every_way(seed: int, says: dict[str, list[str]], procedures: list[str]) -> list[World]:
    """As ``five``; several times with all of it and code elsewhere that moves; entered at each procedure."""
    all_ = World(seed, unknown=True, operator=True, traps=True, wanders=True, says=says)
    more = [replace(all_, seed=seed + n, found={}) for n in range(5, 12)]
    entered = [replace(all_, seed=seed + 20 + n, enters=name, found={}) for n, name in enumerate(procedures)]
    return [*five(seed, says), *more, *entered]
