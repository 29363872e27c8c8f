"""Cells of the independent arm, read as a user's table and fitted with the usual base."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from postproc.channels.state import State
from postproc.diagnostics import Source
from postproc.effects.registry import effect_library
from postproc.estimation.fitted import Fit
from postproc.estimation.least_squares import fit_model
from postproc.identification.curves.form import CurveForm
from postproc.identification.curves.functions import fixed
from postproc.identification.curves.signal import Signal
from postproc.identification.diagnose import diagnose
from postproc.identification.diagnosis import Diagnosis
from postproc.identification.screen.candidate import Candidate
from postproc.identification.screen.suspects import Suspect, places
from postproc.measure.measurements import Measurements
from postproc.measure.read.table import read_measurements
from postproc.model.arm import Model
from postproc.model.equilibrium import predict
from postproc.robot.catalogue import load_robot
from tests.independent.hidden_effects import Plan, make_set

BASE = ("instrument_frame", "tool_frame", "joint_offset", "joint_compliance")


def cell(
    *kinds, seed: int, noise: float = 0.03, poses: int = 120, robot: str = "irb4600_60_205", outliers: int = 0
) -> tuple[Measurements, Measurements]:
    """Measured rows, and other poses with their true places, of a cell with hidden effects."""
    return _cell(tuple(kinds), seed, noise, poses, robot, outliers)[:2]


def true_compliance(*kinds, seed: int, noise: float = 0.03, poses: int = 120, robot: str = "irb4600_60_205"):
    """(6,) of the same cell's joints [rad/(N m)]."""
    return np.array(_cell(tuple(kinds), seed, noise, poses, robot, 0)[2]["compliance_rad_per_Nm"])


@cache
def _cell(kinds, seed, noise, poses, robot, outliers):
    arm = load_robot(robot)
    with TemporaryDirectory() as folder:
        answer = make_set(Path(folder), seed, Plan(list(kinds), robot, outliers), noise, poses)
        read = [
            read_measurements(Source(name, (Path(folder) / name).read_bytes()), arm)
            for name in ("fit.csv", "validate_true.csv")
        ]
    return (*read, answer)


def law(names: str, values, sentence: str = "proportional") -> CurveForm:
    """A form that is called so, of values (n,) that follow some channels, "q5 q6"."""
    signal = Signal(tuple(names.split()), values, names, "", names)
    return CurveForm(((fixed("line", sentence, "line", numbers=(0.0,)), signal),), kind="line")


def curve_candidate(fit: Fit, place: str, channel: str, values: np.ndarray) -> Candidate:
    """The curve by which a place moves in proportion to a column, as a search would have found it."""
    form = law(channel, values)
    curve = Suspect(place, places(fit.problem)[place], form, 0.0, 99.0, 0.0, channel)
    return Candidate.of_curve(curve, curve.effect(fit.problem.site))


JOINTED = {"q": "q", "v": "v", "dir": "approach", "load": "joint_load"}
NAMED = {"temperature": "temperature", "time": "time", "payload": "payload_mass"}


def table(**columns: np.ndarray) -> State:
    """Rows of an arm that stands still, but for these columns: ``q5``, ``load3``, ``time``, or any name."""
    n = len(next(iter(columns.values())))
    still = {"T_base_body": np.tile(np.eye(4), (n, 7, 1, 1)), "gravity": np.zeros(3)}
    fields: dict[str, Any] = {"q": np.zeros((n, 6)), "channels": {}, **still}
    for name, values in columns.items():
        if name[:-1] in JOINTED and name[-1] in "123456":
            fields.setdefault(JOINTED[name[:-1]], np.zeros((n, 6)))[:, int(name[-1]) - 1] = values
        elif name in NAMED:
            fields[NAMED[name]] = values
        else:
            fields["channels"][name] = values
    return State(**fields)


_fits: dict[tuple[int, str, tuple[str, ...]], tuple[Measurements, Fit]] = {}
"""Fits by the identity of their data, which is kept with them: the same cells serve many tests."""


def base_fit(data: Measurements, robot: str = "irb4600_60_205", more: tuple[str, ...] = ()) -> Fit:
    if (id(data), robot, more) not in _fits:
        library, arm = effect_library(), load_robot(robot)
        fit = fit_model(Model(arm, robot_name=robot), data, [library[key].null() for key in (*BASE, *more)])
        _fits[id(data), robot, more] = data, fit
    return _fits[id(data), robot, more][1]


def hidden_found(*kinds, seed: int, poses: int = 120) -> Diagnosis:
    """The diagnosis of a cell with hidden effects, which serves several tests."""
    return _diagnosed(kinds, seed, poses)


@cache
def _diagnosed(kinds, seed, poses):
    data, _ = cell(*kinds, seed=seed, poses=poses)
    return diagnose(base_fit(data).model, data)


def true_error(fit: Fit, true: Measurements) -> float:
    """Root mean square error per axis [m] at poses that were not measured."""
    return float(np.sqrt(np.mean((predict(fit.model, true.state)[:, :3, 3] - true.position) ** 2)))
