"""The table of speed and memory: what it measures runs, and a comparison tells what became slower and nothing else."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.bench.speed.__main__ import main
from tests.bench.speed.table import CALIBRATION, Figure, Run, compared, growth, load, markdown, save


def test_a_quick_run_fills_the_table(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    saved, page = tmp_path / "bench.json", tmp_path / "benchmarks.md"
    parts = ("targets 60", "targets 120", "calls", "reading", "inverse", "page 20")
    assert main(["--quick", "--json", str(saved), "--write", str(page), "--only", *parts]) == 0
    run = load(saved)
    names = [f.name for f in run.figures]
    for name in (
        CALIBRATION,
        "`compensate` 120 targets",
        "Python calls a target, at 100",
        "inverse of the model, 6 joint springs",
        "page of 20 targets, beside the data",
        "growth of CPU time with the targets",
        "memory a target",
    ):
        assert name in names
    loop = run.figure("inverse of the model, 6 joint springs")
    assert loop is not None and loop.peer_values and loop.advantage
    assert all(np.isfinite(f.values).all() for f in run.figures)
    shown = capsys.readouterr().out
    text = page.read_text("utf-8")
    assert all(name in shown and name in text for name in names)
    assert main(["--quick", "--against", str(saved), "--only"]) == 0


def test_a_figure_tells_its_share_of_the_limit_and_its_peer() -> None:
    seconds = Figure("a", "s", (1.0, 2.0, 4.0), 8.0, False, "loop", (6.0,))
    assert (seconds.median, seconds.share, seconds.advantage) == (2.0, 0.25, 3.0)
    rate = Figure("b", "poses/s", (50.0,), 25.0, True, "loop", (10.0,))
    assert (rate.share, rate.advantage) == (0.5, 5.0)
    assert rate.cells() == ["b", "50", "50", "50", "poses/s", "at least 25", "0.5", "loop: 10", "5"]
    assert growth([200, 2_000, 20_000], [0.1, 0.9, 10.0]) == pytest.approx(1.0)


def run(scale: float = 1.0, **times: tuple[float, ...]) -> Run:
    figures = [Figure(CALIBRATION, "s", (scale, scale))]
    figures += [Figure(name, "s", values) for name, values in times.items()]
    return Run(tuple(figures), {"cores": "2"})


@pytest.mark.parametrize(
    ("now", "worse", "better"),
    [
        (run(fit=(1.0, 1.1, 1.2)), 0, 0),
        (run(fit=(1.2, 1.4, 1.5)), 0, 0),  # one repetition is as fast as before
        (run(fit=(1.3, 1.4, 1.5)), 1, 0),
        (run(fit=(0.8, 0.8, 0.9)), 0, 1),
        (run(2.0, fit=(2.0, 2.2, 2.4)), 0, 0),  # a machine that is half as fast
        (run(2.0, fit=(2.6, 2.7, 2.8)), 1, 0),
        (run(other=(9.0,)), 0, 0),
    ],
)
def test_slower_is_what_stands_beyond_the_noise(now: Run, worse: int, better: int) -> None:
    found = compared(now, run(fit=(1.0, 1.1, 1.2)))
    assert tuple(map(len, found)) == (worse, better)
    assert all(line.startswith(("fit: 1", "fit: 2")) for part in found for line in part)


def test_rates_and_sizes_are_compared_their_way(tmp_path: Path) -> None:
    def with_(rate: float, size: float) -> Run:
        rates = Figure("inverse", "poses/s", (rate, rate * 1.01), None, True)
        return replace(run(), figures=(*run().figures, rates, Figure("memory", "MB", (size,))))

    worse, better = compared(with_(80.0, 50.0), with_(100.0, 60.0))
    assert (worse, better) == (["inverse: 100 -> 80.4 poses/s"], ["memory: 60 -> 50 MB"])
    save(with_(80.0, 50.0), tmp_path / "new" / "a.json")
    assert load(tmp_path / "new" / "a.json") == with_(80.0, 50.0)
    assert "| inverse | 80 | 80.4 | 80.8 | poses/s |" in markdown(with_(80.0, 50.0))
