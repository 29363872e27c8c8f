"""Weight and inertia of the links against pinocchio: arms of which nothing is special, gravity aslant, any springs."""

from __future__ import annotations

import sys
from dataclasses import replace

import numpy as np
import pytest

from postproc.compensation.options import Options
from postproc.diagnostics import Source
from postproc.files import resource
from postproc.model.chain import deflected_chain, directions
from postproc.model.file import default_model
from postproc.model.multibody import Multibody
from postproc.model.pinocchio_bodies import PinocchioBodies
from postproc.runtime.passes import correct_program
from tests.independent.rigid_body import RigidBody
from tests.model.arms import random_arm


@pytest.mark.parametrize("bodies", [(), (0,), (6,), (2, 5), tuple(range(7))])
@pytest.mark.parametrize("carried", [False, True])
@pytest.mark.parametrize("kind", [Multibody, PinocchioBodies])
def test_it_agrees_with_pinocchio_pose_by_pose(bodies: tuple[int, ...], carried: bool, kind: type[Multibody]) -> None:
    g, n = np.random.default_rng(sum(bodies) + carried), 12
    root = g.normal(size=(7, 3, 3))
    robot = replace(random_arm(3)[0], mass=g.uniform(5, 60, 7), inertia=root @ np.swapaxes(root, 1, 2))
    gravity = None if carried else g.normal(size=3) * 9
    ours, theirs = kind(robot, gravity, bodies), RigidBody(robot, gravity, bodies)
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


def test_where_pinocchio_is_not_installed_the_recursion_takes_its_place(monkeypatch: pytest.MonkeyPatch) -> None:
    source = Source("hull_seam.mod", resource("samples", "hull_seam.mod").read_bytes())
    with_it = correct_program([source], default_model("irb4600_60_205"), Options())
    monkeypatch.setitem(sys.modules, "pinocchio", None)
    model = default_model("irb4600_60_205")
    assert type(model.multibody()) is Multibody
    assert correct_program([source], model, Options()).outputs == with_it.outputs
