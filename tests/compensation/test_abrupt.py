"""A law of the user's that jumps at a joint angle: seen between targets, and corrected on both sides."""

from __future__ import annotations

import numpy as np

from postproc.channels.state import State
from postproc.effects.base import Displacement, Effect, param
from tests.build import arm, convert, module, target


class LooseBolt(Effect, key="loose_bolt_of_a_test", reads=("q",)):
    """Joint 2 gives way beyond an angle. Source: a test."""

    size_rad: float = param(unit="rad", low=-1e-2, high=1e-2, typical=1e-3)
    edge_rad: float = param(unit="rad", low=-3.0, high=3.0, typical=1.0)

    def displacement(self, state: State) -> Displacement:
        joint = np.zeros((len(state), 6))
        joint[:, 1] = self.size_rad * (state.q[:, 1] > self.edge_rad)
        return Displacement(joint=joint)


def test_a_jump_between_two_targets_is_seen_and_corrected_on_both_sides() -> None:
    """20 mm of line have no sample of their own between the ends: the jump of 0.4 mm was bridged, in no figure."""
    text = module("", f"MoveJ {target(1340, -500)},v200,fine,tT;\nMoveL {target(1360, -500)},v50,fine,tT;")
    plain = convert(text)
    assert plain.plan is not None and plain.report["added_targets"] == 0
    q2 = plain.plan.motion.samples.q[[0, -1], 1]
    bolt = LooseBolt(size_rad=3e-4, edge_rad=float(q2.mean()))
    found = convert(text, arm().with_effects(*arm().effects, bolt))
    assert found.plan is not None
    samples = found.plan.motion.samples
    place = samples.T_work_tcp[samples.move == 1][:, :3, 3]
    assert np.linalg.norm(np.diff(place, axis=0), axis=1).max() <= 0.0005 + 1e-9
    assert found.report["added_targets"] >= 2
    assert found.report["max_error_before_mm"] > plain.report["max_error_before_mm"] + 0.2
