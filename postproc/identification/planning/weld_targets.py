"""Programs that measurements are planned for: where they weld, and what is expected on the arm there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from postproc.arrays import Array
from postproc.channels.state import State
from postproc.compensation.conversion import Conversion
from postproc.compensation.judgement.accuracy import judged_targets, length_interval, on_arm_mm, without_link_masses
from postproc.model.arm import Model
from postproc.model.controller import unknown_loads
from postproc.model.uncertainty.field import coordinates
from postproc.model.uncertainty.prediction import Uncertainty, error_directions, position_covariance
from postproc.model.uncertainty.scatter import (
    Scatter,
    deflection_gram,
    deflection_shares,
    deflection_slopes,
    scatter_by,
)
from postproc.motion.values import Flags


@dataclass(frozen=True)
class WeldTargets:
    """Targets at which a program welds, as `compensate` corrects it.

    Args:
        program: name of its file. model: of the arm, as far as it holds for the program.
        every: n targets with the loads and tools of the program; welding: (n,) which of them weld.
        before, remaining: largest deviation [m] where it welds, in the model: of the program, and corrected.
        scatter: of arms of the type, where the stiffness is that of the type, else None.
        expected_mm: 95 % interval of the largest deviation on the arm where it welds, as `compensate` says it; None
            where nothing is known of the model's errors.
    """

    program: str
    model: Model
    every: State
    welding: Flags
    before: float
    remaining: float
    scatter: Scatter | None
    expected_mm: list[float] | None

    @classmethod
    def of(cls, program: str, conversion: Conversion) -> WeldTargets | None:
        """Return the weld targets of a conversion; None where it measured no weld."""
        judged, model = conversion.judged, conversion.model
        if judged is None or judged.plan is None or model is None:
            return None
        every, welding = judged_targets(judged.plan.motion)
        place = next((place for place in judged.places if place.place == "weld"), None)
        if place is None or not welding.any():
            return None
        model = model if judged.scatter is None else without_link_masses(model)
        figures = place.before, place.after, judged.scatter, judged.expected_mm(place)
        return cls(program, model, every, welding, *figures)

    @cached_property
    def state(self) -> State:
        """The m targets that weld."""
        return self.every.rows(self.welding)

    def slopes(self) -> list[Array]:
        """Return derivatives (m, 3, 12) and (n, 3, 12) of `deflection_slopes` at the welds and at all targets.

        By all of them `compensate` counts what the stiffness of a type leaves of the deflection at the welds.
        """
        D = deflection_slopes(deflection_shares(*unknown_loads(self.model, self.every)))
        return [D[self.welding], D]

    def errors(self, known: Uncertainty) -> Array:
        """Return the errors (m, 3, e) [m] of the TCP by the e causes of `error_directions`, in the base frame."""
        return error_directions(self.model, self.state, known, instrument=False)

    def errors_after(
        self, known: Uncertainty, open_causes: Array, measured: State | None = None
    ) -> tuple[float, float]:
        """Return the 95 % interval of the error [m] of a fitted model at the worst target, with further rows.

        Args:
            known: the uncertainty that the fit noted. open_causes: (e, e) covariance of the causes with these rows.
            measured: poses whose positions the rows hold: what no effect explains is told near them, too.
        """
        E, far = self.errors(known), np.zeros(len(self.state))
        reduction = E @ (np.eye(len(open_causes)) - open_causes) @ E.mT
        if (field := known.measured) is not None:
            rows = field.rows if measured is None else np.vstack([field.rows, coordinates(measured, field.names)])
            far = 1.0 - replace(field, rows=rows).known(self.state)
        unexplained = known.unexplained**2 + known.beyond**2 * far[:, None, None]
        covariance = position_covariance(self.model, self.state, known, instrument=False) - reduction
        covariance = covariance + unexplained * np.eye(3)
        return length_interval(covariance[np.argmax(np.trace(covariance, axis1=1, axis2=2))])

    def shares_after(self, springs: Array) -> tuple[float, float]:
        """Return the interval of the share of ``before`` that the arm's stiffness leaves, known by type and readings.

        Args:
            springs: (12, 12) covariance of the logarithms of compliances and link masses with the readings.
        """
        return scatter_by(deflection_gram(*unknown_loads(self.model, self.every)), springs).of_estimate

    def on_arm(self, shares: tuple[float, float], errors: tuple[float, float]) -> list[float]:
        """Return ``expected_mm`` for other shares and errors (`on_arm_mm`)."""
        return on_arm_mm(self.remaining, self.before, shares, errors)


def weld_weight(errors: Sequence[Array]) -> Array:
    """Return W (e, e) [m^2] with tr(W S) the mean square error over the targets of some programs, each as much.

    Args:
        errors: of each program (m, 3, e) by e causes, of covariance S.
    """
    return np.asarray(sum(np.einsum("nip,niq->pq", E, E) / len(E) for E in errors))
