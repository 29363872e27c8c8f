"""A name that hangs on a few poses: what other poses would have named is told beside it."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np

from postproc.effects.library.joints.backlash import Backlash
from postproc.effects.library.loads.arm_load import ArmLoad
from postproc.estimation.evidence import CLOSE_EVIDENCE
from postproc.identification.indistinguishable import contenders
from postproc.identification.screen.candidate import Candidate
from postproc.identification.screen.forms import columns_of
from postproc.identification.screen.gain import gain
from tests.identification.cells import base_fit, cell


def rivals(strengths: dict[str, np.ndarray]) -> tuple[list[Candidate], SimpleNamespace]:
    """Lost motion of joint 2 and a load on body 3, in a residual that holds so much of each in every pose."""
    data, _ = cell(seed=981)
    fit = base_fit(data)
    alone = {"backlash": (Backlash.null(), np.arange(6) == 1), "arm_load": (ArmLoad(body=(3,)), np.arange(4) == 0)}
    y, row = np.random.default_rng(5).normal(size=len(fit.linear.residual)), fit.linear.row
    columns = {key: columns_of(fit.problem, *of) for key, of in alone.items()}
    for key, size in strengths.items():
        own = fit.linear.project(columns[key])[:, 0]
        y = y + own / np.sqrt(np.mean(own**2)) * size[data.repeats][row]
    linear = replace(fit.linear, residual=y)
    found = []
    for key, (effect, free) in alone.items():
        brought = gain(linear, columns[key])
        found.append(Candidate(key, effect, free, "", brought.evidence, brought.fall, 1, 0.0, 9.0, 1e-9))
    found.sort(key=lambda c: -c.evidence)
    return found, SimpleNamespace(linear=linear, data=data, problem=fit.problem)


def test_what_most_poses_say_is_told_beside_what_a_few_say_loudly():
    loud = np.zeros(120)
    loud[np.random.default_rng(2).choice(120, 14, replace=False)] = 8.0
    ranked, before = rivals({"backlash": loud, "arm_load": np.full(120, 0.7)})
    first, second = ranked
    assert first.key == "backlash" and first.evidence - second.evidence > CLOSE_EVIDENCE  # not close on all poses
    assert contenders(ranked, first, before) == ["arm_load"]


def test_what_every_part_of_the_poses_says_stands_alone():
    ranked, before = rivals({"backlash": np.full(120, 1.2), "arm_load": np.full(120, 0.5)})
    assert ranked[0].key == "backlash" and ranked[1].evidence > 0
    assert contenders(ranked, ranked[0], before) == []
