"""A few hundred inputs of the fuzzer with every test run, and inputs that once went wrong."""

from __future__ import annotations

import warnings
from pathlib import Path

import pytest

from tests.fuzz import checks
from tests.fuzz.__main__ import fuzz


def test_broken_inputs_end_in_findings(tmp_path: Path) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        tallies = fuzz(programs=400, models=60, tables=60, seed=20, save=tmp_path)
    assert [(t.kind, t.inputs) for t in tallies] == [("program", 400), ("model", 60), ("table", 60)]
    assert {t.kind: t.failures for t in tallies} == {"program": {}, "model": {}, "table": {}}
    assert sum(t.hangs for t in tallies) == 0
    # Neither all refused nor all accepted: the changes reach behind the first check.
    assert all(0.05 * t.inputs < t.good < 0.95 * t.inputs for t in tallies)


def test_the_fuzzer_sees_a_traceback_and_a_hang(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(data: bytes) -> bool:
        if b"ArcL" in data:
            raise IndexError("lost")
        while b"TEST" in data:
            pass
        return True

    monkeypatch.setattr(checks, "check_program", broken)
    monkeypatch.setattr(checks, "check_inspection", lambda data, model: True)
    monkeypatch.setattr(checks, "check_conversion", lambda data, model: True)
    monkeypatch.setattr(checks, "check_command", lambda kind, data: True)
    monkeypatch.setattr(checks, "SECONDS", 0.02)
    programs, _, _ = fuzz(programs=60, models=0, tables=0, seed=1, save=tmp_path)
    assert sum(programs.failures.values()) > 0 and programs.hangs > 0
    assert any(b"ArcL" in path.read_bytes() for path in tmp_path.iterdir())


LOOPS = b"FOR i FROM 1 TO 99 DO " * 30
PROGRAMS = {
    "a loop without an end": b"MODULE M PROC main() FOR i FROM 1 TO -1E999 DO MoveL p,v1,z1,t; ENDFOR ENDPROC ENDMODULE",
    "empty loops in loops": b"MODULE M PROC main() " + LOOPS + b"ENDFOR " * 30 + b"ENDPROC ENDMODULE",
    "components of components": b"MODULE M PROC main() a" + b".a" * 3000 + b":=1; ENDPROC ENDMODULE",
    "loops that nothing closes": b"MODULE M PROC main() " + LOOPS + b"ENDPROC ENDMODULE",
}
CONVERSIONS = {
    "configuration data beyond 64 bits": b"MODULE M PROC main() MoveJ [[1200,0,900],[0,0,1,0],[1E38,0,0,0],"
    b"[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,tool0; MoveL Offs([[1200,0,900],[0,0,1,0],[0,0,-1E30*1,0],"
    b"[9E9,9E9,9E9,9E9,9E9,9E9]],0,0,9),v100,fine,tool0; ENDPROC ENDMODULE",
}
MODELS = {
    "a number of 5000 digits": b'robot = "irb4600_60_205"\n[fit]\nn = ' + b"1" * 5000,
    "brackets a thousand deep": b"robot = " + b"[" * 5000,
    "angles that are no numbers": b'robot = "irb4600_60_205"\n[mounting]\nrpy_deg = [inf, 0, 0]\n',
    "a name that no file can have": b'robot = "' + b"irb" * 400 + b'"\n',
    "a body that is infinite": b'robot = "irb4600_60_205"\n[effects.arm_load]\nbody = [inf]\nmass_kg = [14.0]\n',
    "integers beyond a float": b'robot = "irb4600_60_205"\n[effects.arm_load]\nbody = ['
    + b"9" * 400
    + b"]\nmass_kg = [14.0]\n",
    "integers beyond 64 bits": b'robot = "irb4600_60_205"\n[tool]\nrpy_deg = [99999999999999999999, 0, 0]\n',
}
HEADER = b"q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg,x_mm,y_mm,z_mm\n"
TABLES = {
    "a carriage return in a quoted row": HEADER + b'0,0,0,0,30,0,1200\r,0,"900"\n0,0,0,0,30,0,1200,0,900\n',
    "numbers whose squares overflow": HEADER + b"1e300,0,0,0,30,0,1200,0,1e308\n0,0,0,0,30,0,1200,0,900\n",
    "a cell of 200,000 letters": HEADER + b'0,0,0,0,30,0,1200,0,"' + b"9" * 200_000 + b'"\n0,0,0,0,30,0,1200,0,900\n',
}


@pytest.mark.parametrize("text", PROGRAMS.values(), ids=PROGRAMS)
def test_programs_that_once_went_wrong(text: bytes) -> None:
    with checks.limited(checks.SECONDS):
        checks.check_program(text)


@pytest.mark.parametrize("text", CONVERSIONS.values(), ids=CONVERSIONS)
def test_conversions_that_once_went_wrong(text: bytes) -> None:
    assert not checks.check_conversion(text, checks.shipped_model())


@pytest.mark.parametrize("text", MODELS.values(), ids=MODELS)
def test_models_that_once_went_wrong(text: bytes) -> None:
    checks.check_model(text, rendered=True)


@pytest.mark.parametrize("text", TABLES.values(), ids=TABLES)
def test_tables_that_once_went_wrong(text: bytes) -> None:
    checks.check_table(text, checks.shipped_model())
