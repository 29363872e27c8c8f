"""Whether what is left is noise: the independent arm with a law of two joints that no search finds, and with nothing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from postproc.diagnostics import Source
from postproc.identification.diagnose import diagnose
from postproc.identification.diagnosis import Diagnosis
from postproc.identification.diagnosis import lacks_fit
from postproc.measure.measurements import Measurements
from postproc.measure.read.table import read_measurements
from postproc.results.sentences import headline
from postproc.robot.catalogue import load_robot
from tests.identification.cells import base_fit
from tests.independent import arm as A
from tests.independent.cells import Hidden, column, draw_cell, draw_states, measure
from tests.independent.hidden_effects import write_table

NOISE, POSES, REPEATED = 3e-5, 260, 12


def sum_wave(size: float) -> tuple[Hidden, ...]:
    return (
        Hidden("two", "unknown", joint=lambda s, tau: column(4, size * np.sin(7 * s.q[:, 3] + 11 * s.q[:, 4] + 0.7))),
    )


def rows(tmp_path, hidden: tuple[Hidden, ...], seed: int, repeated: int = REPEATED) -> Measurements:
    """Single poses, so many of them measured twice more at times and temperatures of their own."""
    g = np.random.default_rng(seed)
    arm = A.ARMS["irb4600_60_205"]()
    cell, s = draw_cell(g, arm, hidden), draw_states(g, POSES, arm, False, False)
    label = np.concatenate([np.arange(POSES), *[np.arange(repeated) * (POSES // REPEATED)] * 2])
    s, more = s.take(label), 2 * repeated
    time = np.append(s.time[:POSES], np.round(g.uniform(0, 21600, more), 1))
    warm = np.append(s.temperature[:POSES], np.round(g.uniform(20, 40, more), 2))
    # Three poses are measured again at once: nine degrees of freedom of one visit, which alone tell little.
    soon = np.arange(min(3, repeated))
    time[POSES + soon], warm[POSES + soon] = time[label[POSES + soon]] + 20.0, warm[label[POSES + soon]]
    s = replace(s, time=time, temperature=warm)
    seen = measure(cell, s) + g.normal(0, NOISE, (len(label), 3))
    path = tmp_path / "rows.csv"
    write_table(path, s, seen, [f"P{i:03d}" for i in label], 4)
    return read_measurements(Source(path.name, path.read_bytes()), load_robot("irb4600_60_205"))


def found(data: Measurements, **terms) -> Diagnosis:
    return diagnose(base_fit(data).model, data, **terms)


def test_what_repeats_say_is_more_than_noise_is_not_called_noise(tmp_path):
    d = found(rows(tmp_path, sum_wave(7e-4), 1))
    assert (d.verdict, d.lacking) == ("unknown", True)
    assert d.final.rms > 3 * NOISE and "Nothing is missing" not in headline(d)
    assert "explains" in headline(d) and "can be added" not in headline(d)


def test_a_table_that_lacks_nothing_stays_quiet(tmp_path):
    d = found(rows(tmp_path, (), 3))
    assert (d.verdict, d.lacking, d.suspects) == ("complete", False, ())
    assert headline(d).startswith("Nothing is missing")


def test_without_a_known_noise_nobody_can_tell(tmp_path):
    data = rows(tmp_path, sum_wave(7e-4), 3, repeated=0)
    d = found(data)
    assert (d.verdict, d.lacking, d.untold) == ("unknown", None, True)
    assert "cannot tell whether what is left" in headline(d)
    assert "Measure 10 poses three times each, or state the noise (`--noise`)" in headline(d)
    stated = found(data, noise=NOISE)
    assert (stated.verdict, stated.lacking) == ("unknown", True)
    assert found(data, noise=2e-4).verdict == "complete"


def test_what_the_arm_repeats_by_its_data_sheet_bounds_what_could_be_missing(tmp_path):
    """RP of this arm is 0.06 mm: what is left is no more than that, and would not be noticed if it were more."""
    d = found(rows(tmp_path, (), 4, repeated=0))
    assert (d.verdict, d.floor) == ("complete", None)
    assert "no more than how well arm and instrument repeat" in headline(d)


def test_an_instrument_alone_does_not_tell_the_noise_of_an_arm_of_which_no_repeatability_is_known(tmp_path):
    data = rows(tmp_path, sum_wave(7e-4), 5, repeated=0)
    data = replace(data, sigma=np.full(len(data), 1e-5))
    fit = base_fit(data)
    assert lacks_fit(fit) is True
    bare = replace(fit.model, robot=replace(fit.model.robot, repeatability=None))
    assert lacks_fit(replace(fit, problem=replace(fit.problem, model=bare))) is None
