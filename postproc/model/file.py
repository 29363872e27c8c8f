"""Reading model files: the robot, how it stands, its tool, its effects, and what a fit noted."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from os.path import isfile  # unlike Path.is_file it takes any text for a name
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import AfterValidator, BeforeValidator, Field, ValidationInfo, field_validator
from pydantic_core import PydanticCustomError

from postproc.diagnostics import Diagnostic, PostprocError, Source, did_you_mean
from postproc.effects.base import Effect
from postproc.effects.registry import effect_in_role, effect_library, installed_effects
from postproc.effects.roles import Role
from postproc.files import read_source
from postproc.model.arm import Model, StatedPrior
from postproc.model.doubts import doubts
from postproc.model.uncertainty.field import Field as MeasuredRows
from postproc.model.uncertainty.packed import unpack_correlation
from postproc.model.uncertainty.prediction import stated_covariance
from postproc.numbers import read_number
from postproc.robot.arm import Robot
from postproc.robot.catalogue import list_robots, load_robot
from postproc.robot.cells.cell_file import ExternalAxis, Mounting, stated_cell
from postproc.robot.cells.station import station_of
from postproc.robot.pose import rpy, transform
from postproc.tomlfile import FileTable, Place, check, each_once, parse_toml, span_of

DEFAULT_ROBOT = "irb4600_60_205"
AGAIN = {"help": "fit the model again, or take the table [fit] out"}

Vec3 = tuple[float, float, float]
NotNegative = Annotated[float, Field(ge=0)]
Names = Annotated[list[str], AfterValidator(each_once)]
Span = tuple[float, float]
_Sides = Literal["dir1", "dir2", "dir3", "dir4", "dir5", "dir6"]
_Axes = Literal["eax_a", "eax_b", "eax_c", "eax_d", "eax_e", "eax_f"]
_Joints = Literal["q1", "q2", "q3", "q4", "q5", "q6"]
_Coordinate = Literal[_Joints, "payload", _Sides]
Channel = Literal[_Joints, "payload", "temperature", "time", _Sides, _Axes]


class _Tool(FileTable):
    """The nominal tool where a program or a table names none.

    Args:
        xyz_mm: TCP in tool0.
        rpy_deg: roll, pitch, yaw of its frame.
    """

    xyz_mm: Place = (0.0, 0.0, 0.0)
    rpy_deg: Vec3 = (0.0, 0.0, 0.0)


def _numbers(row: object) -> object:
    """Split a text of numbers at its spaces, as a row of a matrix is written; any other value comes back as it is."""
    return [_number(word) for word in row.split()] if isinstance(row, str) else row


def _number(word: str) -> float | str:
    """Read a number; a text that is none comes back as it is, for the schema to refuse."""
    try:
        return read_number(word)
    except ValueError:
        return word


def _ordered(ends: Span) -> Span:
    """Return lowest and highest value; refuse them the other way round."""
    if ends[0] > ends[1]:
        raise PydanticCustomError("range", "the lowest value is above the highest", AGAIN)
    return ends


_Prior = tuple[float, Annotated[float, Field(gt=0)], str]
_Row = Annotated[list[float], BeforeValidator(_numbers, json_schema_input_type=str | list[float])]


class _Measured(FileTable):
    """Where measured rows are; written by ``fit`` and ``add``.

    Args:
        lengths: over which what the arm lacks changes, by coordinate (rad, kg).
        noise: variance of a row's noise, in that of what the arm lacks.
        rows: the coordinates of rows, packed.
    """

    lengths: Annotated[dict[_Coordinate, Annotated[float, Field(gt=0)]], Field(min_length=1)]
    noise: NotNegative
    rows: str

    @field_validator("rows")
    @classmethod
    def _of_the_lengths(cls, text: str, info: ValidationInfo) -> str:
        """Return packed rows; refuse a text that is not that of rows with these lengths."""
        if {"lengths", "noise"} <= info.data.keys():
            try:
                MeasuredRows.of_table({**info.data, "rows": text})
            except ValueError as error:
                raise PydanticCustomError("packed", str(error), AGAIN) from error
        return text


BODIES_WITH_MASS = 6


class _Fit(FileTable):
    """What a fit notes; written by ``fit`` and ``add``.

    Args:
        rows: measured rows of the fit.
        each: what one measured number belongs to, of which errors and noise are: an axis, a joint, a reading.
        kinds: of rows that read something else than positions: gauge, tip, plane, anchor, from; position beside them.
        rms_mm, rms_mrad: error on them.
        set_aside: rows left out, far from everything else, as FILE:ROW.
        held_out_rms_mm, held_out_rms_mrad: error on rows that the fit has not seen.
        held_out_blocks: blocks of consecutive poses that were held out one after another for that.
        noise_mm, noise_mrad: standard deviation of a measured number.
        noise_repeatability_mm: the arm's share of it.
        noise_from: where the noise comes from.
        not_identifiable: parameters that the data did not determine.
        undetermined: parameters that stand at their priors, since the data says less than half of them.
        parameters: names of the fitted parameters, in the order of sigma and of the covariance.
        sigma: standard deviation of each parameter, SI.
        correlation: of the parameters, packed.
        covariance: lower triangle, SI; in place of sigma and correlation, by hand and in older files.
        unseen: directions in which parameters may be off unseen.
        link_mass: directions in which parameters and the masses of bodies 1 to 6, by their logarithms, may be off.
        contradicted: why nothing is promised with this fit: what its rows contradict.
        base: undetermined parameters that only move the base as a whole, which work that counts from the arm ignores.
        unexplained_mm: per axis, without the noise.
        beyond_mm: per axis, what else stays unexplained where no measured row is near.
        measured: where measured rows are.
        local: effects that hold near the measured rows alone.
        surest: the vectors, SI, of effects that are others without these.
        range: lowest and highest value of each channel that was measured.
        data, data_sha256: the tables.
        touched_sha256: programs whose touch-ups they hold.
        version: of postproc.
    """

    rows: Annotated[int, Field(ge=0)] = 0
    each: Literal["axis", "joint", "reading"] = "axis"
    kinds: list[str] = []
    rms_mm: NotNegative = 0.0
    rms_mrad: NotNegative = 0.0
    held_out_rms_mrad: NotNegative = 0.0
    noise_mrad: NotNegative = 0.0
    held_out_rms_mm: NotNegative = 0.0
    set_aside: list[str] = []
    held_out_blocks: Annotated[int, Field(ge=0)] = 0
    noise_mm: NotNegative = 0.0
    noise_repeatability_mm: NotNegative = 0.0
    noise_from: str = ""
    not_identifiable: Names = []
    undetermined: Names = []
    version: str = ""
    data: str | list[str] = ""
    data_sha256: str | list[str] = ""
    touched_sha256: list[str] = []
    parameters: Names = []
    sigma: list[NotNegative] = []
    correlation: str = ""
    covariance: list[_Row] = []
    unseen: list[_Row] = []
    link_mass: list[_Row] = []
    contradicted: list[str] = []
    base: Names = []
    unexplained_mm: NotNegative = 0.0
    beyond_mm: NotNegative = 0.0
    measured: _Measured | None = None
    local: Names = []
    surest: dict[str, list[float]] = {}
    range: dict[Channel, Annotated[Span, AfterValidator(_ordered)]] = {}

    @field_validator("sigma")
    @classmethod
    def _a_sigma_for_each_parameter(cls, sigma: list[float], info: ValidationInfo) -> list[float]:
        """Return the standard deviations; refuse them if not one a parameter."""
        count = len(info.data.get("parameters", []))
        if len(sigma) != count:
            raise PydanticCustomError("sigma", f"{len(sigma)} numbers for {count} parameters", AGAIN)
        return sigma

    @field_validator("correlation")
    @classmethod
    def _of_the_parameters(cls, text: str, info: ValidationInfo) -> str:
        """Return a packed correlation; refuse a text that is not that of the parameters, or that lacks their sigma."""
        count = len(info.data.get("sigma", []))
        if text and not count and info.data.get("parameters"):
            raise PydanticCustomError("sigma", "there is no `sigma` to it", AGAIN)
        try:
            unpack_correlation(text, count)
        except ValueError as error:
            raise PydanticCustomError("packed", str(error), AGAIN) from error
        return text

    @field_validator("covariance")
    @classmethod
    def _a_row_for_each_parameter(cls, rows: list[list[float]], info: ValidationInfo) -> list[list[float]]:
        """Return the rows of a covariance; refuse them if not one a parameter, or not positive semidefinite."""
        count = len(info.data.get("parameters", []))
        if info.data.get("correlation"):
            raise PydanticCustomError("twice", "`correlation` states it already", {"help": "take one of the two out"})
        if len(rows) != count:
            raise PydanticCustomError("rows", f"{len(rows)} rows for {count} parameters", AGAIN)
        short = next((i for i, row in enumerate(rows) if len(row) not in (i + 1, count)), None)
        if short is not None:
            text = f"row {short + 1} has {len(rows[short])} numbers, not {short + 1}"
            raise PydanticCustomError("row", text, AGAIN)
        if not _is_covariance(rows):
            raise PydanticCustomError("covariance", "no parameters can vary so", AGAIN)
        return rows

    @field_validator("unseen", "link_mass")
    @classmethod
    def _a_number_for_each_parameter(cls, rows: list[list[float]], info: ValidationInfo) -> list[list[float]]:
        """Return the directions; refuse one without a number for each fitted and undetermined parameter, and mass."""
        count = len(info.data.get("parameters", [])) + len(info.data.get("not_identifiable", []))
        count += BODIES_WITH_MASS * (info.field_name == "link_mass")
        odd = next((i for i, row in enumerate(rows) if len(row) != count), None)
        if odd is not None:
            raise PydanticCustomError("row", f"row {odd + 1} has {len(rows[odd])} numbers, not {count}", AGAIN)
        return rows


def _is_covariance(rows: list[list[float]]) -> bool:
    """Tell whether a lower triangle is that of a positive semidefinite matrix, up to the rounding of written digits."""
    covariance = stated_covariance({"covariance": rows}, len(rows))
    if covariance is None:
        return True
    # A negative variance stays one over its own size, and makes an eigenvalue negative.
    size = np.sqrt(np.abs(np.diag(covariance)))
    scale = np.where(size > 0, size, 1.0)
    return float(np.linalg.eigvalsh(covariance / np.outer(scale, scale))[0]) > -1e-6


class ModelFile(FileTable):
    """The arm as it really is.

    Args:
        robot: name of the library, or a TOML or URDF file beside this one.
        stiffness_source: where joint stiffness comes from.
        measured_springs: joints whose compliance a fit has measured, for people; the others stand as those of the type.
        mounting: how its base stands in the world.
        tool: nominal tool where a program or a table names none.
        effects: one table for each effect, by its key; without this table the springs are those of the arm's type.
        priors: value, standard deviation and source of parameters that are known from elsewhere than the measured rows,
            by name, such as "joint_offset.offset_rad[2]".
        fit: what a fit noted.
        external_axes: tracks, gantries and positioners around it.
    """

    robot: Annotated[str, Field(min_length=1)]
    stiffness_source: Literal["measured", "estimated", "controller", "user"] | None = None
    measured_springs: list[Annotated[int, Field(ge=1, le=6)]] | None = None
    mounting: Mounting = Mounting()
    tool: _Tool = _Tool()
    effects: dict[str, dict[str, Any]] = {}
    priors: dict[str, _Prior] = {}
    fit: _Fit = _Fit()
    external_axes: list[ExternalAxis] = []


def default_model(robot_name: str = DEFAULT_ROBOT) -> Model:
    """Return the shipped model of a robot: published or estimated joint stiffness, with weights of links and tool.

    A stiffness that is stated with a factor (of one other arm of the type, or by a rule) is an estimate for this one.

    Raises:
        PostprocError: KIN006 unknown robot, MOD004 nobody knows how stiff it is.
    """
    robot = load_robot(robot_name)
    if robot.joint_compliance is None:
        text = f"the stiffness of `{robot.name}` is not known: compensating it needs a fitted model"
        help_ = f"measure it, `postproc fit DATA --robot {robot_name} --effects joint_compliance,.. -o MODEL`, "
        raise PostprocError.of("MOD004", text, help=help_ + "and give that model with -m")
    springs, source = _of_type(robot)
    return Model(robot, springs, robot_name=str(robot_name), stiffness_source=source)


def _of_type(robot: Robot) -> tuple[tuple[Effect, ...], str]:
    """Return the springs of an arm's type and where they come from; neither where nobody knows them."""
    if robot.joint_compliance is None:
        return (), ""
    source = "estimated" if robot.stiffness_factor is not None else str(robot.stiffness_source)
    return (effect_in_role(Role.JOINT_SPRINGS).null().with_vector(robot.joint_compliance),), source


def read_model(path: str | Path, library: Mapping[str, type[Effect]] | None = None) -> Model:
    """Read the model in a TOML file.

    Args:
        library: effects by key; None for those of the package and of installed packages.

    Raises:
        PostprocError: MOD001 not readable or not TOML, MOD002 a key or value that does not fit, MOD003 an unknown
            effect, EFF021..EFF024 its parameters, MOD005 values that no arm has, KIN006 or KIN007 its robot, KIN016
            its external axes; each at file:line:col.
    """
    return parse_model(read_source(Path(path), "MOD001"), library)


def parse_model(source: Source, library: Mapping[str, type[Effect]] | None = None) -> Model:
    """Return the model in the text of a model file; arguments and errors are those of `read_model`."""
    content = parse_toml(source, "MOD001")
    file = check(ModelFile, content, source, "MOD002")
    known = effect_library() if library is None else library
    effects = _effects(file, source, known)
    priors = _priors(file, source, known)
    tool = transform(np.array(file.tool.xyz_mm) * 1e-3, rpy(np.radians(file.tool.rpy_deg)))
    mounting = rpy(np.radians(file.mounting.rpy_deg))
    stated, noted = str(file.stiffness_source or ""), content.get("fit", {})
    axes = file.external_axes
    station = station_of(stated_cell(axes, file.mounting, source)) if axes else None
    robot = _robot(file.robot, source)
    if "effects" not in content and not noted:
        effects, of_type = _of_type(robot)
        stated = stated or of_type
    model = Model(robot, effects, mounting, tool, file.robot, noted, stated, station, priors=priors)
    if not model.fit:  # what the user wrote, not a fit
        wrong = [replace(d, source=source, span=span_of(source, ("effects", *keys))) for *keys, d in doubts(model)]
        if wrong:
            raise PostprocError(wrong)
    if not file.fit.local:
        return model
    return replace(model, surest=_surest(file.fit, model, source))


def _surest(fit: _Fit, model: Model, source: Source) -> Model:
    """Return the model without the effects that hold near the measured rows alone; raises MOD002 for odd entries."""
    size = {e.key: len(e.vector()) for e in model.effects}
    odd = [("local", key, "there is no such effect") for key in fit.local if key not in size]
    odd += [("surest", key, "has other parameters") for key, x in fit.surest.items() if len(x) != size.get(key)]
    odd += [] if fit.measured else [("local", "measured", "is not there, and says where these effects hold")]
    if odd:
        table, key, text = odd[0]
        span = span_of(source, ("fit", table, key) if table == "surest" else ("fit", table))
        raise PostprocError([Diagnostic("MOD002", "error", f"`{key}`: {text}", source, span, AGAIN["help"])])
    every = (e.with_vector(np.array(fit.surest.get(e.key, e.vector()))) for e in model.effects)
    return model.with_effects(*(e for e in every if e.key not in fit.local))


def _robot(name: str, source: Source) -> Robot:
    """Load the robot of a model file: a file beside it, else a library name; errors point to the key ``robot``."""
    local = Path(source.path).parent / name
    try:
        return load_robot(local if name not in list_robots() and isfile(local) else name)
    except PostprocError as error:
        at = span_of(source, ("robot",), value=True)  # of what has no place of its own: the name
        placed = [replace(d, source=source, span=at) if d.source is None else d for d in error.diagnostics]
        raise PostprocError(placed, error.exit_code) from error


def _priors(file: ModelFile, source: Source, library: Mapping[str, type[Effect]]) -> dict[str, StatedPrior]:
    """Return the stated priors by parameter name; raises MOD002 for names that no effect has."""
    findings: list[Diagnostic] = []
    for name in file.priors:
        key, _, parameter = name.partition(".")
        known = library[key].parameters() if key in library else None
        if known is None or parameter.partition("[")[0] not in known:
            names = library if known is None else [f"{key}.{p}" for p in known]
            message = f"`{name}` is no parameter of an effect"
            help_ = did_you_mean(key if known is None else name.partition("[")[0], names)
            findings.append(Diagnostic("MOD002", "error", message, source, span_of(source, ("priors", name)), help_))
    if findings:
        raise PostprocError(findings)
    return {name: StatedPrior(*prior) for name, prior in file.priors.items()}


def _effects(file: ModelFile, source: Source, library: Mapping[str, type[Effect]]) -> tuple[Effect, ...]:
    """Build the effects of a model file; raises all MOD003 and EFF diagnostics at once."""
    findings: list[Diagnostic] = []
    effects: list[Effect] = []
    for key, table in file.effects.items():
        where = ("effects", key)
        if key not in library:
            custom = "an effect of your own is made known with `--effects FILE.py`"
            help_ = f"{did_you_mean(key, library)} If not, {custom}".removeprefix(" If not, ")
            message = f"there is no effect `{key}`"
            findings.append(Diagnostic("MOD003", "error", message, source, span_of(source, where), help_))
            continue
        problems = library[key].problems(table)
        findings += [p.diagnostic(source, span_of(source, (*where, p.field))) for p in problems]
        if not problems:
            effects.append(library[key].from_file(table))
    if not file.effects.keys() <= library.keys():
        findings += installed_effects()[1]
    if findings:
        raise PostprocError(findings)
    return tuple(effects)
