"""Periodic errors of the gears."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array, finest
from postproc.effects.base import Effect, JointBasis, State, Variant, param, structure, variant
from postproc.effects.library.joints.joint_error_map import MAP_ORDERS as MAPPED
from postproc.effects.sums import SumOfTerms

GEAR, MOTOR = 30, 320
"""Highest order searched of the output side, and of the motor side: two waves a turn of a strain-wave gear of 160:1."""
MANY_LINES = 3
"""Lines in all from which a smooth function may tell them as well."""
CLOSE_ORDERS = np.array([0.02, 0.04, 0.06, 0.08, 0.1, 0.2, 0.3, 0.4, 0.5])
"""How far beside an order others are tried, on either side."""
LOWEST = 1.0
"""No wheel turns more slowly than the joint that it moves: what comes again more rarely is a slope, and no gear's."""


class TransmissionError(
    SumOfTerms,
    confused_with={
        "joint_error_map": "a fine sweep of one joint (five points a period): one line in the spectrum, or many",
        "gravity_compensator": "the motor's torque at rest, for a first harmonic of joint 2: positions are the same",
        "link_geometry": "first harmonics only: wide ranges of the joints after it",
        "joint_compliance": "first harmonics only: two payloads",
    },
):
    """A joint's angle oscillates with its own turning (eccentric gears, strain waves).

    Equation: dq_j = A sin(n q_j) + B cos(n q_j); each term has a joint (from 1), an order n (it need not be whole, of
    motors least of all), its A and its B. Source: gear catalogues (angular transmission accuracy).
    Typical size: 50 to 600 microradian (1 to 2 arcmin for strain-wave gears).
    """

    joint: tuple[int, ...] = structure((1, 2, 3, 4, 5, 6), low=1, high=6)
    order: tuple[float, ...] = structure((1.0, 1.0, 1.0, 1.0, 1.0, 1.0), low=0.0, high=1000.0)
    sine_rad: Array = param(unit="rad", shape=("joint",), low=-0.05, high=0.05, typical=1e-4)
    cosine_rad: Array = param(unit="rad", shape=("joint",), low=-0.05, high=0.05, typical=1e-4)

    def joint_basis(self, state: State) -> JointBasis:
        """Columns sin(n q_j), then cos(n q_j), of each term: rad per rad."""
        joint = np.array(self.joint, dtype=int) - 1
        angle = state.q[:, joint] * np.array(self.order)
        return JointBasis(np.concatenate([joint, joint]), np.concatenate([np.sin(angle), np.cos(angle)], axis=1))

    def plus(self, term: Self) -> Self:
        """The effect with the terms of another one after its own."""
        sine, cosine = (np.append(getattr(self, x), getattr(term, x)) for x in self.parameters())
        joint, order = (*self.joint, *term.joint), (*self.order, *term.order)
        return type(self)(joint=joint, order=order, sine_rad=sine, cosine_rad=cosine)

    @classmethod
    def rooms(cls, terms: Sequence[Effect], present: Effect | None, others: Mapping[str, Effect]) -> NDArray[np.bool_]:
        """Tell for each term whether it may be added, or a map of a joint's error would be the simpler cause.

        A term is refused if it gives a joint three terms, or the effect more than three orders: eccentric gears have
        the orders of the wheel, of the strain wave and of the motor. It is also refused on a joint with a map, or on
        any joint if three have one (one kind of gear is in all of them), unless its order is finer than a map's: strain
        waves and the lines of an encoder come hundreds of times a turn. Arguments are those of `SumOfTerms.rooms`.
        """
        mapped = getattr(others.get("joint_error_map"), "joint", ())
        joint, order = (present.joint, present.order) if isinstance(present, TransmissionError) else ((), ())

        def room(term: Effect) -> bool:
            """Tell whether a wave may be added: at most two of a joint, three orders, no slow one beside a map."""
            assert isinstance(term, TransmissionError)
            joints = (*joint, *term.joint)
            many = any(joints.count(j) > 2 for j in joints) or len({*order, *term.order}) > 3
            with_map = len(mapped) > 2 or not set(term.joint).isdisjoint(mapped)
            return not (many or (with_map and min(term.order) <= MAPPED[-1]))

        if len(joint) < 2 and not mapped:
            return np.ones(len(terms), dtype=bool)  # two lines are never many
        return np.array([room(term) for term in terms], dtype=bool)

    def generalised(self) -> list[tuple[Self | None, str]]:
        """A map in place of the terms of joints that have several, or of all terms if three or more; motors' stay."""
        motor, joint = np.array(self.order) > GEAR, np.array(self.joint)
        crowded = ~motor & (np.bincount(joint[~motor], minlength=7)[joint] > 1)
        parts = [crowded, ~motor if (~motor).sum() >= MANY_LINES else crowded]
        some = {part.tobytes(): part for part in parts if part.any()}.values()
        return [(None if part.all() else self._among(~part), "joint_error_map") for part in some]

    def _among(self, use: NDArray[np.bool_]) -> Self:
        """The effect with some of its terms only, by a mask over them."""
        fields: dict[str, Any] = {name: np.array(getattr(self, name))[use] for name in self.__dataclass_fields__}
        return type(self)(**fields)

    @classmethod
    def variants(cls, state: State, current: Self | None = None) -> tuple[Variant, ...]:
        """Forms: one more term: each joint that moves, with each whole order that its angles can tell from lower ones.

        An order is a scale, whose logarithm is even: order n has the odds 1/n (Jeffreys 1939).
        """
        old = cls(joint=(), order=()) if current is None else current
        moving = [int(i) + 1 for i in np.flatnonzero(np.ptp(state.q, axis=0) > 0.1)]
        known = set(zip(old.joint, old.order, strict=True))
        highest = {j: min(MOTOR, finest(state.q[:, j - 1])) for j in moving}
        every = [(j, float(n)) for j in moving for n in range(1, int(highest[j]) + 1)]
        return tuple(_longer(old, j, n, 1 / n) for j, n in every if (j, n) not in known)

    def nearby(self, new: int = 1) -> tuple[Variant, ...]:
        """Forms with another order near that of one of the ``new`` last terms: gears in stages have no whole orders."""
        terms, every = list(zip(self.joint, self.order, strict=True)), np.ones(2 * len(self.order), dtype=bool)
        old, forms = len(terms) - new, []
        for at, (j, order) in enumerate(terms[old:], old):
            for n in order + np.concatenate([-CLOSE_ORDERS, CLOSE_ORDERS]):
                one = j, round(float(n), 2)
                if n >= LOWEST and one not in terms:
                    some = [*terms[:at], one, *terms[at + 1 :]]
                    other = TransmissionError(joint=tuple(j for j, _ in some), order=tuple(n for _, n in some))
                    forms.append(variant(other, "; ".join(_term_label(*term) for term in some[old:]), every, every))
        return tuple(forms)


def _longer(old: TransmissionError, joint: int, order: float, odds: float) -> Variant:
    """The form with one more term behind those of ``old``; it alone is screened. ``odds``: how ordinary the form is."""
    term = TransmissionError(joint=(joint,), order=(order,))
    new = old.plus(term) if old.joint else term
    last = np.array(2 * [*[False] * len(old.order), True])
    return variant(new, _term_label(joint, order), last, np.ones(len(last), dtype=bool), odds)


def _term_label(joint: int, order: float) -> str:
    """Label of a term, such as ``joint 3, order 12``."""
    return f"joint {joint}, order {order:g}"
