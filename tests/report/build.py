"""Results of the samples, pages of them, and what a page carries."""

from __future__ import annotations

import base64
import json
import re
from collections.abc import Iterable, Sequence
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np

from postproc.arrays import Array
from postproc.batch.document import batch_document
from postproc.batch.values import Batch, TaskOutcome
from postproc.compensation.conversion import Conversion
from postproc.compensation.options import Options
from postproc.diagnostics import Source
from postproc.effects.library.frames.instrument_frame import InstrumentFrame
from postproc.effects.library.frames.tool_frame import ToolFrame
from postproc.effects.library.joints.joint_offset import JointOffset
from postproc.files import resource
from postproc.identification.add import Addition, add_effects
from postproc.identification.compare import Comparison, compare
from postproc.identification.diagnose import diagnose
from postproc.identification.diagnosis import Diagnosis
from postproc.measure.measurements import Measurements
from postproc.measure.read.table import read_measurements
from postproc.model.arm import Model
from postproc.model.file import default_model
from postproc.rapid.diff.compare import compare_programs
from postproc.rapid.diff.difference import Difference, FileDiff, ProgramDiff
from postproc.rapid.program.program import read_program
from postproc.report.page import render_page
from postproc.results.convert.conversion import conversion_document
from postproc.results.convert.difference import difference_document, folders_document
from postproc.runtime.passes import correct_program
from postproc.tasks.task import Task
from tests.independent.arm import rotation, transform

LONG_NAME = "stern_section_of_the_hull/program_with_a_really_long_name"
BACKLASH, STEP = "simulated_backlash.csv", "simulated_step.csv"


@cache
def sample(name: str) -> tuple[Model, Measurements]:
    """A table of the samples, and the shipped model with the usual base at null."""
    base = (effect.null() for effect in (InstrumentFrame, ToolFrame, JointOffset))
    model = replace(default_model(), effects=(*default_model().effects, *base))
    data = resource("samples", "measurements", name).read_bytes()
    return model, read_measurements(Source("cell.csv", data), model.robot)


@cache
def compared() -> Comparison:
    return compare(default_model(), sample(BACKLASH)[1])


@cache
def diagnosed(name: str) -> Diagnosis:
    return diagnose(*sample(name))


@cache
def added(*keys: str) -> Addition:
    return add_effects(*sample(BACKLASH), list(keys))


def corrected(name: str, **options: Any) -> Conversion:
    """The conversion of a program of the samples to a hundredth of a millimetre."""
    source = Source(name, resource("samples", name).read_bytes())
    return correct_program(source, default_model(), Options(tolerance_m=1e-5, **options))


@cache
def seam() -> Conversion:
    return corrected("hull_seam.mod")


@cache
def seam_under_force() -> Conversion:
    return corrected("paper_case.mod", force=(200.0, -200.0, -200.0))


def program_page(conversion: Conversion, name: str = "x.mod", **report: Any) -> str:
    """The page of a conversion whose report has some other values."""
    return render_page(conversion_document(name, replace(conversion, report={**conversion.report, **report})))


def main_place(before: float, after: float, on_arm: tuple[float, float] | None = None) -> dict[str, Any]:
    """Entries of the document of a conversion on the place that counts most."""
    place = {"place": "weld", "before_mm": before, "after_mm": after, "tolerance_mm": 0.1, "line": 3}
    return {"figures": [{**place, "expected_on_arm_mm": on_arm}], "tolerance_mm": 0.1}


def batch_page(names: Iterable[str]) -> str:
    """The page of a batch of programs with a few figures."""
    outcomes = []
    for i, name in enumerate(names):
        errors: dict[str, Any] = {"max_error_before_mm": 0.1 + i % 977, "max_error_after_mm": 0.001 * (i % 499 + 1)}
        errors |= main_place(errors["max_error_before_mm"], errors["max_error_after_mm"])
        outcomes.append(TaskOutcome(Task(name, ()), "compensated", False, {**errors, "added_targets": 0}, ()))
    return render_page(batch_document("cell", Batch(tuple(outcomes), 0, ())))


def folders_page() -> str:
    """The page of two folders: a file is equal, one is gone, one differs in many statements."""
    difference = Difference(
        "changed", "motion", "HullSeam.rShellSeam", "ArcL", 1234, 1240, 0.5, 0.02,
        shift_mm=(0.1, -0.2, 0.4), speed_mm_s=(8.0, 7.0),
    )  # fmt: skip
    files = [
        FileDiff("a.mod", "equal", "the same bytes"),
        FileDiff("gone.mod", "removed"),
        FileDiff(f"RAPID/{LONG_NAME}.mod", "changed", None, ProgramDiff((difference,) * 250, 300, 0.5, 0.02)),
    ]
    return render_page(folders_document("approved", "out", files, (0.001, 0.01)))


def two_programs_page() -> str:
    """The page of a program of the samples and of what corrects it."""
    sources = (seam().outcomes[0].statement.source, Source("hull_seam.mod", seam().outputs["hull_seam.mod"]))
    first, second = map(read_program, sources)
    return render_page(difference_document("a", "b", compare_programs(first, second, 0.001), (first, second)))


def carried(page: str, name: str = "document") -> Any:
    """What a page carries in the script element of that name."""
    [text] = re.findall(rf'<script type="application/json" id="{name}">(.*?)</script>', page, re.DOTALL)
    return json.loads(text)


def tables(page: str) -> dict[str, Any]:
    """Tables that stand in a page, by label."""
    specs = re.findall(
        r'<div data-(?:table|programs="table")><script type="application/json">(.*?)</script>', page, re.DOTALL
    )
    return {spec["label"]: spec for spec in map(json.loads, specs)}


def figures(page: str) -> dict[str, str]:
    return dict(re.findall(r"<dt>(.*?)</dt><dd[^>]*>(.*?)</dd>", page))


def numbers(column: dict[str, Any]) -> Array:
    """Numbers of a column, read as a browser reads them."""
    kinds = {"f4": "<f4", "i4": "<i4", "u2": "<u2"}
    values = np.frombuffer(base64.b64decode(column["data"]), kinds[column["type"]]).astype(float)
    if column["type"] == "u2":
        values = np.where(values > 0, column["low"] + values * column["step"], np.nan)
    return values if column["width"] == 1 else values.reshape(-1, column["width"])


def points(svg: str) -> Array:
    """Points (n, 2) of a chart, in pixels."""
    return np.array(re.findall(r"M([\d.]+) ([\d.]+)h0", svg), float).reshape(-1, 2)


def line(svg: str, kind: str) -> Array:
    """Places (n, 2) of the first path of a class, in pixels."""
    return np.array(re.findall(r"([\d.]+) ([\d.]+)", re.findall(rf'<path d="([^"]*)" class="{kind}"', svg)[0]), float)


def chain(link: Sequence[Array], axis: Sequence[Array], q: Array) -> list[Array]:
    """Frames (4, 4) of the bodies behind the joints of an arm, and of its flange: links and turns, one by one."""
    T, frames = np.eye(4), []
    for j in range(6):
        T = T @ np.asarray(link[j]) @ transform(rotation(np.asarray(axis[j]), q[j]), np.zeros(3))
        frames.append(T)
    return [*frames, T @ np.asarray(link[6])]
