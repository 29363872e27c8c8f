"""The package from Python, in about ten names: ``from postproc import api``.

They take file names or what other functions here return, and do what the commands of the same names do; nothing is
written unless `write_model` is called. They stand here since ``postproc.fit`` and ``postproc.compensate`` are folders.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np

from postproc.arrays import Array
from postproc.compensate.options import Options
from postproc.convert import Conversion, compensate_program
from postproc.diagnostics import PostprocError
from postproc.effects.loading import load_effect_file
from postproc.effects.registry import effect_library, find_effect
from postproc.files import read_source, write_whole
from postproc.fit.fitted import Fit
from postproc.fit.least_squares import fit_model
from postproc.fit.nominal import no_farther_than_nominal
from postproc.fit.recorded import recorded_model
from postproc.fit.words.text import fit_text
from postproc.identify.add import Addition, add_effects, grown
from postproc.identify.compare import Comparison
from postproc.identify.compare import compare as compare_model
from postproc.identify.diagnose import diagnose as find_missing
from postproc.identify.diagnosis import Diagnosis
from postproc.identify.words.text import diagnosis_text
from postproc.measure.measurements import Measurements
from postproc.measure.read.table import read_measurements as read_table
from postproc.measure.read.terms import Reading
from postproc.model import equilibrium
from postproc.model import file as model_file
from postproc.model.arm import Model
from postproc.model.rewrite import render_model
from postproc.rapid.diff.compare import compare_programs
from postproc.rapid.diff.difference import ProgramDiff
from postproc.rapid.program.program import Program
from postproc.rapid.program.program import read_program as read_modules
from postproc.robot.catalogue import load_robot

__all__ = [
    "Model",
    "Options",
    "PostprocError",
    "add",
    "compare",
    "compensate",
    "diagnose",
    "diff",
    "fit",
    "predict",
    "read_measurements",
    "read_model",
    "read_program",
    "text",
    "write_model",
]
BASE = ("instrument_frame", "tool_frame", "joint_offset", "joint_compliance")
"""Effects that are fitted where none are named."""
File = str | Path


def read_program(*files: File) -> Program:
    """The program in one file, or in all files of a task."""
    return read_modules([read_source(file) for file in files])


def read_model(name: File, effects: Iterable[File] = ()) -> Model:
    """The model in a TOML file, or the shipped model of an arm of the library.

    Args:
        effects: Python files with effects that the model may use; their code is run.

    Raises:
        PostprocError: what is wrong with a file, or KIN006 for an arm that is not known.
    """
    library = effect_library(effects)
    is_file = Path(name).suffix == ".toml"
    return model_file.read_model(name, library) if is_file else model_file.default_model(str(name))


def write_model(file: File, model: Model | Fit) -> None:
    """Write a model, or a fit with its covariance, as a TOML file; comments of the file that it replaces survive."""
    path = Path(file)
    model = recorded_model(model) if isinstance(model, Fit) else model
    before = read_source(path).data.decode("utf-8-sig") if path.is_file() else ""
    write_whole(path, render_model(model, before).encode())


def read_measurements(file: File, robot: str | Model, column_map: File | None = None) -> Measurements:
    """A table of measured poses.

    Args:
        robot: the arm that was measured, by its name or file; or its model, whose external axes count then.
        column_map: TOML file that says what columns are called.

    Raises:
        PostprocError: DAT001 to DAT009, where the table cannot be what it says.
    """
    layout = None if column_map is None else read_source(column_map)
    if isinstance(robot, Model):
        return read_table(read_source(file), robot.robot, column_map=layout, terms=Reading(station=robot.station))
    return read_table(read_source(file), load_robot(robot), column_map=layout)


def compensate(program: Program | File, model: Model, options: Options = Options()) -> Conversion:
    """Correct a program so that the real arm follows its programmed paths.

    The result has ``output`` (bytes, None where the program is not safe to compensate), ``report`` (what ``--json``
    prints) and ``diagnostics``.
    """
    sources = program.sources if isinstance(program, Program) else [read_source(program)]
    return compensate_program(sources, model, options)


def diff(a: Program, b: Program, tolerance_mm: float = 0.001) -> ProgramDiff:
    """Compare two programs by meaning, statement by statement."""
    return compare_programs(a, b, tolerance_mm)


def predict(model: Model, q: Array) -> Array:
    """Poses of the real TCP as the instrument sees them, (n, 4, 4) [m], of joint angles q (n, 6) [rad]."""
    return equilibrium.predict(model, model.state(np.asarray(q)))


def fit(data: Measurements, robot: str, effects: Sequence[str] = BASE) -> Fit:
    """The model of an arm from measured poses: ``.model``, ``.rms`` and ``.held_out_rms`` [m].

    Args:
        robot: the arm, by its name or file. effects: keys of the effects to fit.

    Raises:
        PostprocError: EFF020 an unknown key, DAT020 fewer measured numbers than parameters, DAT039 a model that is
            farther off than the nominal arm.
    """
    library = effect_library()
    classes = [find_effect(key, library) for key in effects]
    found = fit_model(
        Model(load_robot(robot), robot_name=robot), data, [c.null() for c in classes if not c.structures()]
    )
    for cls in classes:
        if cls.structures():
            found = grown(found, cls)
    no_farther_than_nominal(found)
    return found


def compare(model: Model, data: Measurements) -> Comparison:
    """Where a model fails on measurements: ``.as_json()``, ``.text()``."""
    return compare_model(model, data)


def diagnose(model: Model, data: Measurements, effects: Iterable[File] = ()) -> Diagnosis:
    """Which effects a model lacks: ``.verdict`` ("complete", "missing" or "unknown"), ``.missing``, ``.suspects``.

    Args:
        effects: Python files with effects of your own to look for, too; their code is run.
    """
    return find_missing(model, data, [cls for file in effects for cls in load_effect_file(file)])


def add(model: Model, effects: Sequence[str], data: Measurements) -> Addition:
    """Add effects of the library by key and fit everything again: ``.model``, ``.fit``, ``.before``, ``.text()``.

    Raises:
        PostprocError: EFF020 an unknown key, DAT021 the data lacks a channel that an effect reads.
    """
    return add_effects(model, data, effects)


def text(found: Fit | Diagnosis | Comparison | Addition) -> str:
    """What the command prints that finds the same."""
    if isinstance(found, Fit):
        return fit_text(found)
    return diagnosis_text(found) if isinstance(found, Diagnosis) else found.text()
