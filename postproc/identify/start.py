"""Where the instrument stands and what the tool is, before the first step of a fit.

Closed form, no guess from the user.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from postproc.effects.base import Effect
from postproc.identify.problem import Problem
from postproc.measure.alignment import align
from postproc.robot.kinematics import forward


def start_frames(problem: Problem) -> Problem:
    """Give null `instrument_frame` and `tool_frame` effects the values that the nominal arm suggests."""
    model, data = problem.model, problem.data
    frame, tool = model.effect("instrument_frame"), model.effect("tool_frame")
    fresh = [e for e in (frame, tool) if e is not None and e.is_null]
    rows = np.flatnonzero(np.isfinite(data.position).all(axis=1))
    if not fresh or len(rows) < 4 or frame is None or not frame.is_null:
        return problem
    T = forward(model.robot, data.state.q)
    nominal = data.state.T_flange_tcp if data.tool_known else model.T_flange_tcp
    free_tool = tool is not None and tool.is_null
    aligned = align((T @ nominal)[rows], data.position[rows], tool=free_tool)
    R = aligned.T_instrument_base[:3, :3]
    new: dict[str, Effect] = {
        "instrument_frame": frame.with_vector(
            np.concatenate([aligned.T_instrument_base[:3, 3], Rotation.from_matrix(R).as_rotvec()])
        )
    }
    if free_tool and tool is not None:
        turn = np.zeros(3)
        if data.rotation is not None:
            seen = np.swapaxes((T @ nominal)[:, :3, :3], 1, 2) @ R.T @ data.rotation
            good = np.isfinite(seen).all(axis=(1, 2))
            if good.any():
                turn = Rotation.from_matrix(seen[good]).mean().as_rotvec()
        new["tool_frame"] = tool.with_vector(np.concatenate([aligned.tool, turn]))
    return problem.at([new.get(e.key, e) for e in model.effects])
