"""Weight and inertia of the links against pinocchio: arms of which nothing is special, gravity aslant, any springs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from postproc.model.chain import deflected_chain, directions
from postproc.model.multibody import Multibody
from tests.independent.rigid_body import RigidBody
from tests.model.arms import random_arm


@pytest.mark.parametrize("bodies", [(), (0,), (6,), (2, 5), tuple(range(7))])
@pytest.mark.parametrize("carried", [False, True])
def test_the_recursion_agrees_with_pinocchio(bodies: tuple[int, ...], carried: bool) -> None:
    g, n = np.random.default_rng(sum(bodies) + carried), 12
    root = g.normal(size=(7, 3, 3))
    robot = replace(random_arm(3)[0], mass=g.uniform(5, 60, 7), inertia=root @ np.swapaxes(root, 1, 2))
    gravity = None if carried else g.normal(size=3) * 9
    ours, theirs = Multibody(robot, gravity, bodies), RigidBody(robot, gravity, bodies)
    at = g.normal(size=(n, ours.size))
    chain = deflected_chain(robot, at[:, ours.joint], {b: at[:, k] for b, k in ours.columns.items()}, bool(bodies))
    along = directions(robot, chain, bodies)
    assert np.array_equal(ours.coordinates(chain), at)
    assert ours.joint.tolist() == theirs.joint
    v, a = g.normal(size=(2, n, 6))
    base = tuple(g.normal(size=(3, n, 3))) if carried else None
    torques = theirs.torques(at, v, a, base)
    assert np.abs(ours.rnea(chain, along, v, a, base) - torques).max() < 1e-9
    assert np.abs(torques).max() > 100.0
    if not carried:
        rest = ours.rnea(chain, along)
        assert np.abs(rest - theirs.torques(at, 0 * v, 0 * a, None)).max() < 1e-9
        assert np.abs(ours.weight_stiffness(chain, along) - theirs.weight_stiffness(at)).max() < 1e-9
        assert np.abs(ours.inertia(chain, along) - theirs.inertia(at)).max() < 1e-9
