"""What an instrument or a tool does in every direction at once: moves of the measured point, smooth in the pose."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from postproc.arrays import Array
from postproc.fit.problem import Problem
from postproc.model.places import TOOL
from postproc.patterns.instrument_model import SEEN, WRIST, Sight
from postproc.patterns.tool_frame_forces import felt_by_tool

PLACE = ("x", "y", "z")


@dataclass(frozen=True)
class Field:
    """A move of the tool or of the measured point, each way by each of some numbers of the pose.

    Args:
        where, said: for people; channels: that it follows; moves: (n, r, m).
        codes: its numbers as expressions of a state.
    """

    where: str
    channels: tuple[str, ...]
    said: str
    moves: Array
    codes: tuple[str, ...]


def fields(problem: Problem) -> Iterator[Field]:
    """Every field.

    Those of the instrument are smooth in the predicted position: a column that holds the measured numbers would explain
    their noise.
    """
    sight = Sight.of(problem.rest)
    middle, size = np.round(sight.point.mean(axis=0), 4), round(float(np.abs(sight.point).max()), 4)
    p = (sight.point - middle) / size
    axes = [f"(({SEEN}[:, {i}] - {middle[i]:.4f}) / {size:.4f})" for i in range(3)] if sight.code else []
    smooth = "smooth in the place"
    scaled = _everywhere(problem, p)
    yield Field("instrument, axes of their own scale and angle", PLACE, smooth, scaled, tuple(axes))
    yield Field("instrument, curved axes", PLACE, smooth, _everywhere(problem, _squares(p)), _products(axes))
    state = problem.sensitivity.state
    # The squares of a direction sum to one.
    beam = _products([f"{sight.beam_code}[{i}]" for i in range(3)] if sight.beam_code else [])[:5]
    moves = _everywhere(problem, _squares(sight.beam)[:, :5])
    yield Field("instrument, seen from the tool", WRIST, "by where the beam comes from", moves, beam)
    tool = problem.sensitivity.matrix[:, :, TOOL : TOOL + 3]
    for what, names, felt, code in felt_by_tool(state, problem.rest.T_base_tcp[:, :3, 3]):
        most = max(float(np.abs(felt).max()), 1e-300)
        bent = np.einsum("nri,nk->nrik", tool, felt / most)
        codes = tuple(f"{code.replace('AXIS', str(k))} / {most:.6g}" for k in range(3)) if code else ()
        said = f"{what} in the axes of the tool"
        # Most springs are as stiff to one side as to the other; then any.
        round_ = np.stack([bent[..., 0, 0] + bent[..., 1, 1], bent[..., 2, 2]], axis=-1)
        yield Field(f"tool, bent alike across its axis by {what}", names, said, round_, codes)
        yield Field(f"tool, bent by {what}", names, said, bent.reshape(*tool.shape[:2], 9), codes)


def _squares(p: Array) -> Array:
    """(n, 6) products of three components; the last is the square of the third."""
    return np.stack([p[:, i] * p[:, j] for i in range(3) for j in range(i, 3)], axis=1)


def _products(codes: Sequence[str]) -> tuple[str, ...]:
    """The same as text."""
    return tuple(f"{a} * {b}" for i, a in enumerate(codes) for b in codes[i:])


def _everywhere(problem: Problem, values: Array) -> Array:
    """(n, r, 3 k) the measured point moved along each axis of the instrument by each of (n, k) values."""
    found = np.zeros((*problem.error.shape, 3 * values.shape[1]))
    found[:, :3] = np.einsum("nk,ij->nikj", values, np.eye(3)).reshape(len(values), 3, -1)
    return found
