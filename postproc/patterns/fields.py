"""What an instrument or a tool does in every direction at once: moves of the measured point, smooth in the pose."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from postproc.arrays import Array
from postproc.fit.problem import Problem
from postproc.model.places import TOOL
from postproc.patterns.felt import felt_by_tool
from postproc.patterns.signals import tool_poses

PLACE = ("x", "y", "z")
WRIST = ("q5", "q6", "q4")


def fields(problem: Problem) -> Iterator[tuple[str, tuple[str, ...], str, Array]]:
    """Where, channels, what it looks like and (n, r, m) moves of every field.

    Those of the instrument are smooth in the predicted position: a column that holds the measured numbers would explain
    their noise.
    """
    predicted = np.nan_to_num(problem.data.position - problem.error[:, :3])
    p = (predicted - predicted.mean(axis=0)) / max(float(np.abs(predicted).max()), 1e-300)
    smooth = "smooth in the place"
    yield "instrument, axes of their own scale and angle", PLACE, smooth, _everywhere(problem, p)
    yield "instrument, curved axes", PLACE, smooth, _everywhere(problem, _squares(p))
    state = problem.sensitivity.state
    turn = tool_poses(state)[:, :3, :3]
    for k, axis in enumerate("xyz"):
        # The squares of a direction sum to one.
        yield (
            f"instrument, seen along {axis} of the tool",
            WRIST,
            "by where the tool points",
            _everywhere(problem, _squares(turn[:, :, k])[:, :5]),
        )
    tool = problem.sensitivity.matrix[:, :, TOOL : TOOL + 3]
    for what, names, felt, _ in felt_by_tool(state, problem.rest.T_base_tcp[:, :3, 3]):
        bent = np.einsum("nri,nk->nrik", tool, felt / max(float(np.abs(felt).max()), 1e-300))
        # Most springs are as stiff to one side as to the other; then any.
        round_ = np.stack([bent[..., 0, 0] + bent[..., 1, 1], bent[..., 2, 2]], axis=-1)
        yield f"tool, bent alike across its axis by {what}", names, f"{what} in the axes of the tool", round_
        yield f"tool, bent by {what}", names, f"{what} in the axes of the tool", bent.reshape(*tool.shape[:2], 9)


def _squares(p: Array) -> Array:
    """(n, 6) products of three components; the last is the square of the third."""
    return np.stack([p[:, i] * p[:, j] for i in range(3) for j in range(i, 3)], axis=1)


def _everywhere(problem: Problem, values: Array) -> Array:
    """(n, r, 3 k) the measured point moved along each axis of the instrument by each of (n, k) values."""
    found = np.zeros((*problem.error.shape, 3 * values.shape[1]))
    found[:, :3] = np.einsum("nk,ij->nikj", values, np.eye(3)).reshape(len(values), 3, -1)
    return found
