"""Offline post-processor that corrects ABB RAPID programs with a model of the real robot.

From Python it is about ten functions, each named after a command that does the same:

    import postproc

    model = postproc.read_model("irb4600_60_205")
    result = postproc.compensate(postproc.read_program("seam.mod"), model)

They take file names or what other functions here return; nothing is written unless `write_model` is called.  What they
need is imported where they are called: ``import postproc`` alone loads no library.
"""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias, cast

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from postproc.arrays import Array
    from postproc.compensation.conversion import Conversion
    from postproc.compensation.options import Options
    from postproc.diagnostics import PostprocError
    from postproc.estimation.fitted import Fit
    from postproc.identification.add import Addition
    from postproc.identification.compare import Comparison
    from postproc.identification.diagnosis import Diagnosis
    from postproc.measure.measurements import Measurements
    from postproc.model.arm import Model
    from postproc.rapid.diff.difference import ProgramDiff
    from postproc.rapid.program.program import Program
    from postproc.report.blocks import Document

    Result: TypeAlias = Fit | Comparison | Diagnosis | Addition | ProgramDiff | Conversion

__version__ = "0.1.0"
__all__ = [
    "BASE",
    "Model",
    "Options",
    "PostprocError",
    "add",
    "compare",
    "compensate",
    "diagnose",
    "diff",
    "document",
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
_EXPORTS = {
    "Model": "postproc.model.arm",
    "Options": "postproc.compensation.options",
    "PostprocError": "postproc.diagnostics",
}


_DOCUMENTS = {
    "Fit": ("improve.fit", ""),
    "Comparison": ("improve.comparison", ""),
    "Diagnosis": ("improve.diagnosis", ""),
    "Addition": ("improve.addition", ""),
    "ProgramDiff": ("convert.difference", "a", "b"),
    "Conversion": ("convert.conversion", ""),
}
"""Which file of ``results`` says what of a result, and what it is called there."""


def __getattr__(name: str) -> Any:
    """The types of the API, loaded where they are first asked for."""
    if name in _EXPORTS:
        return getattr(import_module(_EXPORTS[name]), name)
    raise AttributeError(f"module `postproc` has no attribute `{name}`")


def read_program(*files: str | Path) -> Program:
    """Read the program in one file, or in all files of a task; findings are in its ``diagnostics``.

    Raises:
        PostprocError: a file cannot be read.
    """
    from postproc.files import read_source
    from postproc.rapid.program.program import read_program as read_modules

    return read_modules([read_source(file) for file in files])


def read_model(name: str | Path, effects: Iterable[str | Path] = ()) -> Model:
    """The model in a TOML file, or the shipped model of an arm of the library.

    Args:
        name: path that ends in ``.toml``, or name of an arm.
        effects: Python files with effects that the model may use; their code is run.

    Raises:
        PostprocError: what is wrong with a file, or KIN006 for an arm that is not known.
    """
    from postproc.effects.registry import effect_library
    from postproc.model import file

    library = effect_library(effects)
    is_file = Path(name).suffix == ".toml"
    return file.read_model(name, library) if is_file else file.default_model(str(name))


def write_model(file: str | Path, model: Model | Fit) -> None:
    """Write a model, or a fit with its covariance, as a TOML file; comments of the file that it replaces survive."""
    from postproc.estimation.fitted import Fit
    from postproc.estimation.recorded import recorded_model
    from postproc.files import read_source, write_atomically
    from postproc.model.rewrite import render_model

    path = Path(file)
    model = recorded_model(model) if isinstance(model, Fit) else model
    before = read_source(path).data.decode("utf-8-sig") if path.is_file() else ""
    write_atomically(path, render_model(model, before).encode())


def read_measurements(file: str | Path, robot: str | Model, column_map: str | Path | None = None) -> Measurements:
    """A table of measured poses.

    Args:
        file: CSV file.
        robot: the arm that was measured, by its name or file; or its model: mounting, external axes and tool count.
        column_map: TOML file that says what columns are called.

    Raises:
        PostprocError: DAT001 to DAT009, where the table cannot be what it says.
    """
    from postproc.files import read_source
    from postproc.measure.read.table import read_measurements as read_table
    from postproc.measure.read.terms import Reading
    from postproc.model.arm import Model
    from postproc.robot.catalogue import load_robot

    layout = None if column_map is None else read_source(column_map)
    if not isinstance(robot, Model):
        return read_table(read_source(file), load_robot(robot), column_map=layout)
    terms = Reading(station=robot.station, tool=robot.T_flange_tcp, gravity=robot.gravity)
    return read_table(read_source(file), robot.robot, column_map=layout, terms=terms)


def compensate(program: Program | str | Path, model: Model, options: Options | None = None) -> Conversion:
    """Correct a program so that the real arm follows its programmed paths.

    The result has ``output`` (bytes, None where the program is not safe to compensate), ``report`` (what ``--json``
    prints) and ``diagnostics``.

    Args:
        program: as read, or the path of its file. model: the real arm. options: the defaults if None.
    """
    from postproc.compensation.options import Options
    from postproc.files import read_source
    from postproc.runtime.passes import correct_program

    sources = [read_source(program)] if isinstance(program, str | Path) else program.sources
    return correct_program(sources, model, options or Options())


def diff(a: Program, b: Program, tolerance_mm: float = 0.001) -> ProgramDiff:
    """Compare two programs by meaning, statement by statement.

    Args:
        tolerance_mm: distance between targets that still counts as equal.
    """
    from postproc.rapid.diff.compare import compare_programs

    return compare_programs(a, b, tolerance_mm)


def predict(model: Model, q: Array) -> Array:
    """Poses of the real TCP as the instrument sees them, (n, 4, 4) [m], of joint angles q (n, 6) [rad]."""
    import numpy as np

    from postproc.model import equilibrium

    return equilibrium.predict(model, model.state(np.asarray(q)))


def fit(data: Measurements, robot: str, effects: Sequence[str] = BASE) -> Fit:
    """The model of an arm from measured poses: ``.model``, ``.rms`` and ``.held_out_rms`` [m].

    Args:
        robot: the arm, by its name or file. effects: keys of the effects to fit.

    Raises:
        PostprocError: EFF020 an unknown key, DAT020 fewer measured numbers than parameters, DAT039 a model that is
            farther off than the nominal arm.
    """
    from postproc.effects.registry import effect_library, find_effect
    from postproc.estimation.recorded import no_farther_than_nominal
    from postproc.identification.add import fit_effects
    from postproc.model.arm import Model
    from postproc.robot.catalogue import load_robot

    classes = [find_effect(key, effect_library()) for key in effects]
    fitted = fit_effects(Model(load_robot(robot), robot_name=robot), data, classes)
    no_farther_than_nominal(fitted)
    return fitted


def compare(model: Model, data: Measurements) -> Comparison:
    """Compare a model with measurements: ``.fit``, ``.error``, ``.trends`` and ``.bound`` say where it fails."""
    from postproc.identification import compare as comparison

    return comparison.compare(model, data)


def diagnose(model: Model, data: Measurements, effects: Iterable[str | Path] = ()) -> Diagnosis:
    """Which effects a model lacks: ``.verdict`` ("complete", "missing" or "unknown"), ``.missing``, ``.remaining``.

    Args:
        effects: Python files with effects of your own to look for, too; their code is run.
    """
    from postproc.effects.loading import load_effect_file
    from postproc.identification import diagnose as search

    return search.diagnose(model, data, [cls for file in effects for cls in load_effect_file(file)])


def add(model: Model, effects: Sequence[str], data: Measurements) -> Addition:
    """Add effects of the library by key and fit everything again: ``.model``, ``.fit``, ``.before``.

    Raises:
        PostprocError: EFF020 an unknown key, DAT021 the data lacks a channel that an effect reads.
    """
    from postproc.identification.add import add_effects

    return add_effects(model, data, effects)


def text(result: Result) -> str:
    """The text that the command line prints for a result."""
    from postproc.report.terminal import render_text

    return render_text(_shown(result))


def document(result: Result) -> dict[str, Any]:
    """What ``--json`` prints of a result, as plain values (docs/documents.md)."""
    from postproc.report.blocks import plain

    return dict(plain(_shown(result).values))


def _shown(result: Result) -> Document:
    """The document of a result, as the command that finds the same shows it."""
    name, *arguments = _DOCUMENTS[type(result).__name__]
    draw = getattr(import_module(f"postproc.results.{name}"), f"{name.partition('.')[2]}_document")
    return cast("Document", draw(*arguments, result))
