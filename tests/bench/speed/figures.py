"""What is measured: each part in a process of its own, so that its memory is its own, too."""

from __future__ import annotations

import cProfile
import os
import pstats
import re
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tests.bench.speed.table import CALIBRATION, Figure
from tests.cost import peak_mb

SAMPLE = Path(__file__).resolve().parents[3] / "samples" / "hull_seam.mod"
LIBRARIES = "import numpy, scipy.interpolate, toppra, ruckig, jinja2, py_opw_kinematics"
ARM = "irb4600_60_205"


@dataclass(frozen=True)
class Sizes:
    """How much of everything.

    Args:
        targets: of the programs whose growth is measured; middle: a size between them.
        counted: targets of the program whose calls are counted. rows: of the tables that are diagnosed, with their limits
            [s]. fitted: rows of the fit beside its peer. turned: poses of few places, in six orientations each; mapped:
            rows of an arm with an error map. repeat: repetitions of short parts, long: of long ones.
    """

    targets: tuple[int, ...] = (200, 2_000, 20_000)
    middle: int = 5_000
    counted: int = 2_000
    poses: int = 20_000
    rows: tuple[tuple[int, float], ...] = ((176, 2.5), (1_316, 5.0), (12_000, 15.0))
    fitted: int = 1_316
    added: int = 12_000
    turned: int = 700
    mapped: int = 1_000
    batch: int = 200
    pages: tuple[int, ...] = (20, 20_000)
    repeat: int = 5
    long: int = 3


QUICK = Sizes((60, 120), 100, 100, 300, ((60, 2.5),), 60, 0, 0, 0, 0, (20,), 2, 1)


def repeated(work: Callable[[], Any], times: int) -> tuple[float, ...]:
    """CPU time [s] of each repetition."""
    found = []
    for _ in range(times):
        begin = time.process_time()
        work()
        found.append(time.process_time() - begin)
    return tuple(found)


def peak() -> float:
    """Peak memory of this process [MB]."""
    return peak_mb()


def calibration(sizes: Sizes) -> list[Figure]:
    """How fast the machine is, and how evenly."""
    import numpy as np

    A = np.random.default_rng(0).normal(size=(6, 6))

    def loop() -> None:
        total = 0.0
        for i in range(100_000):
            total += i % 7 * 0.5
        for _ in range(20_000):
            A @ A

    return [Figure(CALIBRATION, "s", repeated(loop, 2 * sizes.repeat))]


def commands(sizes: Sizes) -> list[Figure]:
    """Whole commands in processes of their own."""
    with tempfile.TemporaryDirectory() as folder:
        words = ["-m", "postproc", "compensate", str(SAMPLE), "-o", str(Path(folder) / "out.mod")]
        _process(words)  # from here on there is bytecode
        help_ = tuple(_process(["-m", "postproc", "--help"]) for _ in range(sizes.repeat))
        whole = tuple(_process(words) for _ in range(sizes.repeat))
        libraries = tuple(_process(["-c", LIBRARIES]) for _ in range(sizes.repeat))
    return [
        Figure("`postproc --help`, imports too", "s", help_, 0.25),
        Figure("`compensate` the small sample, imports too", "s", whole, 0.9, False, "imports alone", libraries),
    ]


def _process(words: list[str]) -> float:
    """CPU time [s] of a Python process."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([sys.executable, *words], check=True, capture_output=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def _converted(n: int) -> Any:
    """A conversion of n targets that can be run again and again, warm."""
    from postproc.compensation.options import Options
    from postproc.diagnostics import Source
    from postproc.model.file import default_model
    from postproc.runtime.passes import correct_program
    from tests.bench.programs import program

    model = default_model(ARM)

    def convert(source: Source) -> Any:
        done = correct_program(source, model, Options())
        assert done.exit_code == 0, done.diagnostics
        return done

    convert(Source("warm.mod", program(50)))
    source = Source("long.mod", program(n))
    return lambda: convert(source)


def conversion(sizes: Sizes, n: int) -> list[Figure]:
    """CPU time and peak memory of one size."""
    work = _converted(n)
    times = sizes.long if n > 1_000 else sizes.repeat
    limit = 7.0 if n == 20_000 else None
    return [
        Figure(f"`compensate` {n:,} targets", "s", repeated(work, times), limit),
        Figure(f"`compensate` {n:,} targets, peak memory", "MB", (peak(),)),
    ]


def calls(sizes: Sizes) -> list[Figure]:
    """Python calls for each target, as cProfile counts them."""
    work, profile = _converted(sizes.counted), cProfile.Profile()
    profile.runcall(work)
    count = pstats.Stats(profile).total_calls / sizes.counted  # type: ignore[attr-defined]
    return [Figure(f"Python calls a target, at {sizes.counted:,}", "calls", (count,), 420)]


def reading(sizes: Sizes) -> list[Figure]:
    """Reading alone, and reading and following."""
    from postproc.diagnostics import Source
    from postproc.rapid.execution.walk import walk
    from postproc.rapid.program.program import read_program
    from tests.bench.programs import program

    data = program(sizes.targets[-1])
    read_program(Source("warm.mod", program(50)))
    times = repeated(lambda: read_program(Source("a.mod", data)), sizes.long)
    both = repeated(lambda: walk(read_program(Source("a.mod", data))), sizes.long)
    size, n = len(data) / 1e6, f"{sizes.targets[-1]:,} targets"
    return [
        Figure(f"reading {n}", "MB/s", tuple(size / t for t in times), 3.0, True),
        Figure(f"reading and following {n}", "s", both),
    ]


def inverse(sizes: Sizes) -> list[Figure]:
    """The inverse of the model over poses, beside a pose loop."""
    import numpy as np

    from postproc.compensation.correction.inverse import command
    from postproc.effects.library.structure.link_compliance import LinkCompliance
    from postproc.model.file import default_model
    from postproc.robot.kinematics import forward
    from tests.bench.speed.peers import pose_loop

    n, model, rng = sizes.poses, default_model(ARM), np.random.default_rng(0)
    tool = np.array([[0.0, 0, 1, 0.1], [0, 1, 0, 0], [-1, 0, 0, 0.35], [0, 0, 0, 1]])
    q = rng.uniform([-2, -0.4, -0.8, -2, 0.2, -3], [2, 0.9, 0.4, 2, 1.8, 3], (n, 6))
    loads = {"payload_mass": np.full(n, 5.0), "payload_center": np.tile([0, 0, 0.1], (n, 1))}
    state = model.state(q, T_flange_tcp=tool, wrench=np.tile([200.0, -200, -200, 0, 0, 0], (n, 1)), **loads)
    desired = forward(model.robot, q) @ tool
    near = state.with_(q=q + 1e-3)  # so that the nominal inverse kinematics is part of the work
    links = LinkCompliance(
        body=(2, 4), bending_per_Nm2=[8e-7, 1e-6], torsion_per_Nm2=[1e-6, 2e-6], stretch_per_N=[1e-9, 1e-9]
    )
    found: list[Figure] = []
    assert np.median(np.abs(pose_loop(model, near, desired) - command(model, near, desired).q)) < 1e-9
    peer = tuple(n / t for t in repeated(lambda: pose_loop(model, near, desired), sizes.long))
    for name, arm, limit in (
        ("6 joint springs", model, 20_000.0),
        ("18 springs", model.with_effects(*model.effects, links), 5_000.0),
    ):
        times = repeated(lambda arm=arm: command(arm, near, desired), sizes.long)  # type: ignore[misc]
        beside = ("pose loop", peer) if arm is model else ("", ())
        rates = tuple(n / t for t in times)
        found.append(Figure(f"inverse of the model, {name}", "poses/s", rates, limit, True, *beside))
    return found


def _table(rows: int) -> Any:
    import numpy as np

    from tests.identification.cells import cell
    from tests.independent import library_effects as kinds

    data = cell(kinds.backlash, kinds.arm_load, seed=222, poses=rows)[0]  # some poses are measured twice
    return data.rows(np.arange(rows))


def fitting(sizes: Sizes) -> list[Figure]:
    """A fit of 30 parameters beside scipy's least squares with finite differences."""
    from postproc.effects.registry import effect_library
    from postproc.estimation.least_squares import fit_model
    from postproc.model.arm import Model
    from postproc.robot.catalogue import load_robot
    from tests.bench.speed.peers import fit_by_differences
    from tests.identification.cells import BASE

    data, library = _table(sizes.fitted), effect_library()
    model, keys = Model(load_robot(ARM), robot_name=ARM), (*BASE, "backlash")
    effects = [library[key].null() for key in keys]
    fit = fit_model(model, data, effects)
    begin = [effect if effect.key.endswith("frame") else effect.null() for effect in fit.model.effects]
    times = repeated(lambda: fit_model(model, data, effects), sizes.repeat)
    rms, count = fit_by_differences(model, begin, data)
    beside = repeated(lambda: fit_by_differences(model, begin, data), max(1, sizes.long - 1))
    assert fit.rms < 1.05 * rms, (fit.rms, rms)
    name = f"fit of {len(data):,} rows, {count} parameters"
    ratios = tuple(b / t for b, t in zip(sorted(beside) * len(times), sorted(times), strict=False))
    return [
        Figure(name, "s", times, None, False, "scipy, finite differences", beside),
        Figure(f"{name}, times faster than scipy", "times", ratios, 15.0, True),
    ]


def diagnosis(sizes: Sizes, rows: int, limit: float) -> list[Figure]:
    """The search for missing effects, and its memory."""
    from postproc.identification.diagnose import diagnose
    from tests.identification.cells import base_fit

    data = _table(rows)
    model = base_fit(data).model
    name = f"`diagnose` {rows:,} rows"
    times = repeated(lambda: diagnose(model, data), sizes.long if rows < 5_000 else 2)
    return [
        Figure(name, "s", times, limit),
        Figure(f"{name}, peak memory", "MB", (peak(),), 600.0 if rows < 5_000 else None),
    ]


def adding(sizes: Sizes) -> list[Figure]:
    """An effect added to a large table."""
    from postproc.identification.add import add_effects
    from tests.identification.cells import base_fit

    data = _table(sizes.added)
    model = base_fit(data).model
    name = f"`add` on {sizes.added:,} rows"
    times = repeated(lambda: add_effects(model, data, ["backlash"]), 2)
    return [Figure(name, "s", times, 120.0), Figure(f"{name}, peak memory", "MB", (peak(),), 2_000.0)]


def improving(sizes: Sizes, name: str, add: bool) -> list[Figure]:
    """`diagnose` of a table whose errors are many times the noise, or `add` of the map that it finds, and the memory."""
    from postproc.identification.add import add_effects
    from postproc.identification.diagnose import diagnose
    from tests.bench.speed import measured
    from tests.identification.cells import base_fit

    if name == "turned":
        data, what = measured.six_orientations(sizes.turned), "six-orientation poses"
        model, limits = base_fit(data).model, (20.0, 500.0)
    else:
        data, what = measured.mapped(sizes.mapped), "rows with an error map"
        model, limits = base_fit(data, "ur5", ("link_geometry",)).model, (30.0, None)
    command = f"{'`add` on' if add else '`diagnose`'} {len(data):,} {what}"
    work = (lambda: add_effects(model, data, ["joint_error_map"])) if add else lambda: diagnose(model, data)
    times = repeated(work, 2)
    return [Figure(command, "s", times, limits[0]), Figure(f"{command}, peak memory", "MB", (peak(),), limits[1])]


def pages(sizes: Sizes, n: int) -> list[Figure]:
    """The page of a conversion: time and size, and what of it is no data."""
    from postproc.report.page import render_page
    from postproc.results.convert.conversion import conversion_document

    done = _converted(n)()
    page = render_page(conversion_document("long.mod", done))
    times = repeated(lambda: render_page(conversion_document("long.mod", done)), sizes.long)
    data = sum(map(len, re.findall(r'(?s)<script type="application/json"[^>]*>(.*?)</script>', page)))
    name = f"page of {n:,} targets"
    return [
        Figure(name, "s", times),
        Figure(f"{name}, size", "MB", (len(page.encode()) / 1e6,)),
        Figure(f"{name}, beside the data", "MB", ((len(page) - data) / 1e6,), 2.0),
    ]


def batches(sizes: Sizes) -> list[Figure]:
    """Two workers beside one on many small programs, by the clock."""
    from tests.batch.build import programs, start

    def timed(source: Path, out: Path, workers: int) -> float:
        begin = time.perf_counter()
        run = start(source, out, "--workers", str(workers))
        _, printed = run.communicate(timeout=600)
        assert run.returncode == 0, printed.decode()[-2000:]
        return time.perf_counter() - begin

    ratios = []
    with tempfile.TemporaryDirectory() as folder:
        source = programs(Path(folder) / "in", sizes.batch)
        for k in range(sizes.long):
            one, two = (timed(source, Path(folder) / f"{k}-{w}", w) for w in (1, 2))
            ratios.append(one / two)
    name = f"batch of {sizes.batch} programs, two workers beside one"
    return [Figure(name, "times", tuple(ratios), 1.8, True)]


def parts(sizes: Sizes) -> dict[str, Callable[[], list[Figure]]]:
    """Everything that is measured, by name, in the order of the table."""
    converted = sorted({*sizes.targets, sizes.middle})
    found: dict[str, Callable[[], list[Figure]]] = {"calibration": lambda: calibration(sizes)}
    found["commands"] = lambda: commands(sizes)
    found |= {f"targets {n}": lambda n=n: conversion(sizes, n) for n in converted}  # type: ignore[misc]
    found |= {"calls": lambda: calls(sizes), "reading": lambda: reading(sizes), "inverse": lambda: inverse(sizes)}
    found["fit"] = lambda: fitting(sizes)
    found |= {f"rows {n}": lambda n=n, most=most: diagnosis(sizes, n, most) for n, most in sizes.rows}  # type: ignore[misc]
    if sizes.added:
        found["add"] = lambda: adding(sizes)
    for name in ("turned", "mapped") if sizes.turned else ():
        found |= {
            f"{name} {word}": lambda n=name, a=word == "add": improving(sizes, n, a) for word in ("diagnose", "add")
        }  # type: ignore[misc]
    found |= {f"page {n}": lambda n=n: pages(sizes, n) for n in sizes.pages}  # type: ignore[misc]
    if sizes.batch and (os.cpu_count() or 1) > 1:
        found["batch"] = lambda: batches(sizes)
    return found
