"""Programs nobody has seen, through the command line, driven by the independent arm."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from postproc.cli.app import build
from postproc.cli.run import run
from tests.independent import arm as A
from tests.independent import generate_programs, untidy, verify

FORCE = (200.0, -200.0, -200.0)


@pytest.mark.parametrize(
    ("seed", "geometry", "hard", "air"),
    [
        (5, "irb4600_60_205", False, 0.2),
        (20, "irb4600_60_205", True, 0.01),
        (39, "irb4600_60_205", False, 0.01),
        (108, "irb4600_60_205_seed", False, 0.2),
    ],
)
def test_a_converted_program_reaches_the_programmed_path(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], seed: int, geometry: str, hard: bool, air: float
) -> None:
    """At most 0.01 mm along what welds, the air's tolerance (0.2 mm is the default) along other lines and arcs and at
    goals, 15 added targets a metre, nothing else changed in the text.
    """
    text = generate_programs.generate(seed, geometry)
    text = untidy.complicate(text, seed) if hard else text
    source, output = tmp_path / "weld.mod", tmp_path / "weld.out.mod"
    source.write_bytes(text.encode("latin-1"))
    options = (
        "--tolerance",
        0.01,
        "--inertia",
        "off",
        "--force",
        ",".join(map(str, FORCE)),
        "--air-tolerance",
        air,
        "--json",
    )
    arguments = ("compensate", source, "-o", output, "--robot", geometry, *options)
    assert run(build(), list(map(str, arguments))) == 0
    claimed = float(json.loads(capsys.readouterr().out)["max_error_after_mm"])
    r = verify.check(text, output.read_bytes().decode("latin-1"), A.ARMS[geometry](), np.array(FORCE))
    assert r.violations == []
    assert max(s.after for s in r.segments if s.counted and s.welding) <= 0.01
    assert r.after <= air and r.goal_after <= air
    assert r.after <= 1.2 * claimed + 0.002
    assert 0 < r.added_per_metre <= 15
    assert r.before > 0.5
    assert {s.kind for s in r.segments} >= {"A", "J", "L"}
