"""Several shapes of one channel: as many as there are, each where it is."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from postproc.effects.contract import State
from postproc.patterns.dictionary import patterns
from postproc.patterns.suspects import look
from tests.identify.cells import base_fit, cell
from tests.independent import unknown_effects as kinds

WEAR = np.round(np.random.default_rng(3).uniform(0, 10, 1000), 2)


def worn(law, poses: int = 90, wear=WEAR):
    """A fit whose joint 2 follows a column of the table, and the patterns of that."""
    data, _ = cell(kinds.elbow_wave, seed=313, noise=0.02, poses=poses)
    fit = base_fit(data)
    row, wear = fit.problem.row, wear[: len(data)]
    moved = fit.problem.whiten(fit.problem.sensitivity.matrix[:, :, 1:2])[:, 0] * 4e-4 * law(wear)[row]
    y = moved + np.random.default_rng(1).normal(size=len(row))
    T = np.tile(np.eye(4), (len(wear), 7, 1, 1))
    at = State(q=np.zeros((len(wear), 6)), T_flange_tcp=np.eye(4), T_base_body=T)
    every = patterns({"wear": wear, "q5": data.state.q[:, 4]}, at, np.zeros((len(wear), 3)))
    return fit.problem, replace(fit.linear, residual=y), every


def told(law, wear=WEAR) -> list[str]:
    """What is told of joint 2 where it follows a column of the table, and how much of it remains."""
    found = look(*worn(law, wear=wear)).suspects()[0]
    assert (found.channel, found.where) == ("wear", "joint 2") and found.share > 0.99
    return re.split(r", (?!\d+\.?\d* wide)| and ", found.pattern)


@pytest.mark.parametrize(
    ("law", "edges"),
    [
        (lambda x: 1.0 * (x > 2) + 1.0 * (x > 5) - 1.5 * (x > 7.5), [2, 5, 7.5]),
        (lambda x: 1.0 * (x > 2) - 0.7 * (x > 3.5) + 0.8 * (x > 6) + 0.6 * (x > 8), [2, 3.5, 6, 8]),
    ],
)
def test_slips_are_as_many_steps(law, edges):
    shapes = told(law)
    assert all(shape.startswith("step near ") for shape in shapes)
    assert [float(shape.split()[2]) for shape in shapes] == pytest.approx(edges, abs=0.25)


def test_a_saw_tooth_of_less_than_two_teeth_is_a_line_with_a_jump():
    first, second = told(lambda x: np.mod(x / 7 + 0.2, 1.0))
    assert first == "proportional" and float(second.split()[2]) == pytest.approx(5.6, abs=0.25)


def test_a_bump_and_a_step_are_neither_more_bumps_nor_more_steps():
    shapes = told(lambda x: np.exp(-0.5 * ((x - 3) / 0.5) ** 2) + 0.8 * (x > 6))
    assert [shape.split()[0] for shape in shapes] == ["bump", "step"]


def test_a_column_of_few_values_has_no_edges_and_is_told_all_the_same():
    """Between six values that lie far apart nothing was measured."""
    assert told(lambda x: (x - 4) ** 2, wear=np.floor(WEAR * 0.6))[0].startswith("another value at each of")


def test_a_pattern_that_cannot_be_worth_what_is_asked_is_left_as_it_was_tried():
    problem, linear, every = worn(lambda x: 0.06 * ((x > 2) + (x > 5) - 1.5 * (x > 7.5)))
    whole, seen = look(problem, linear, every).suspects()[0], look(problem, linear, every)
    coarse = seen.suspects(1e6)[0]
    assert coarse.evidence < whole.evidence - 5
    assert seen.suspects(2e6)[0] is coarse
    again = seen.suspects(0.9 * whole.evidence)[0]
    assert again.pattern == whole.pattern and again.evidence == pytest.approx(whole.evidence)
