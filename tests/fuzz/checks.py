"""What must hold for every input, however broken."""

from __future__ import annotations

import contextlib
import io
import signal
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from types import FrameType

from postproc.cli.app import build
from postproc.cli.run import run
from postproc.compensation.inspection import inspect_program
from postproc.compensation.options import Options
from postproc.diagnostics import Diagnostic, PostprocError, Source
from postproc.measure.read.table import read_measurements
from postproc.model.arm import Model
from postproc.model.file import default_model, parse_model
from postproc.model.rewrite import render_model
from postproc.rapid.execution.walk import walk_program
from postproc.rapid.program.program import read_program
from postproc.rapid.syntax.spans import Edit, edited
from postproc.rapid.syntax.tokens import tokenize
from postproc.runtime.passes import correct_program

SAMPLES = Path(__file__).resolve().parents[2] / "samples"
DEFECTS = {"CMP004", "CMP013"}  # the product's own checks of what it would write: they never fail
SECONDS = 20.0  # a program may be followed for 300,000 statements


class Hang(BaseException):
    """An input took more than its time; no ``except Exception`` may swallow it."""


@contextlib.contextmanager
def limited(seconds: float) -> Iterator[None]:
    """Raise `Hang` after so much processor time (a busy machine does not count)."""

    def stop(number: int, frame: FrameType | None) -> None:
        raise Hang(f"more than {seconds:g} s")

    before = signal.signal(signal.SIGVTALRM, stop)
    signal.setitimer(signal.ITIMER_VIRTUAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0)
        signal.signal(signal.SIGVTALRM, before)


def check_program(data: bytes) -> bool:
    """Read and follow; every byte is in a token, every motion statement has an event. True if it read without errors."""
    at = 0
    for _, (start, end) in tokenize(data):
        assert start == at < end, "tokens do not cover the text"
        at = end
    assert at == len(data), "tokens end before the text"
    program = read_program(Source("fuzz.mod", data))
    walk = walk_program(program)
    assert {s.span for s in program.statements} == {e.statement.span for e in walk.events}, "a statement without event"
    assert b"".join(edited(data, [])) == data
    same = [Edit(*s.span, data[slice(*s.span)]) for s in program.statements]
    assert b"".join(edited(data, same)) == data, "statements are not where they say"
    findings = [*program.diagnostics, *walk.diagnostics]
    _read_out(findings)
    return not any(d.severity == "error" for d in findings)


def check_inspection(data: bytes, model: Model) -> bool:
    """The posture of the arm at every statement; one row each."""
    source = Source("fuzz.mod", data)
    found = inspect_program(source, model.robot)
    assert [row.statement.span for row in found.rows] == [s.span for s in read_program(source).statements]
    _read_out(found.diagnostics)
    return True


def check_conversion(data: bytes, model: Model) -> bool:
    """The whole convert loop: an output, or none and a reason."""
    try:
        result = correct_program(Source("fuzz.mod", data), model, Options())
    except PostprocError as error:
        _read_out(error.diagnostics)
        return False
    assert result.output is not None or result.exit_code in (1, 2), "neither an output nor an exit code"
    assert result.output is not None or any(d.severity == "error" for d in result.diagnostics), (
        "refused without a reason"
    )
    assert not DEFECTS & {d.code for d in result.diagnostics}, "a check of the corrected program failed"
    _read_out(result.diagnostics)
    return result.output is not None


def check_model(data: bytes, rendered: bool = False) -> bool:
    """A model, or findings with places; what is written reads again."""
    try:
        model = parse_model(Source("fuzz.toml", data))
    except PostprocError as error:
        _read_out(error.diagnostics)
        return False
    if rendered:
        text = render_model(model, data.decode("utf-8-sig"))
        again = parse_model(Source("again.toml", text.encode()))
        assert [e.to_file() for e in again.effects] == [e.to_file() for e in model.effects], (
            "the model reads differently after it was written"
        )
    return True


def check_table(data: bytes, model: Model) -> bool:
    """Measured rows, or findings with places."""
    try:
        table = read_measurements(Source("fuzz.csv", data), model.robot)
    except PostprocError as error:
        _read_out(error.diagnostics)
        return False
    _read_out(table.diagnostics)
    assert len(table.usable) == len(table.line) == len(table.repeats)
    return True


def check_command(kind: str, data: bytes) -> bool:
    """The same through the command line: exit code 0, 1 or 2, and with anything but 0 no output and nothing left over."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        given, out = folder / "given", folder / "out"
        given.write_bytes(data)
        arguments = {
            "program": ["compensate", str(given), "--robot", "irb4600_60_205", "-o", str(out)],
            "model": ["compensate", str(SAMPLES / "paper_case.mod"), "-m", str(given), "-o", str(out)],
            "table": ["predict", str(SAMPLES / "models" / "hull_cell.toml"), str(given), "-o", str(out)],
        }[kind]
        taken = io.TextIOWrapper(io.BytesIO(), encoding="utf-8")
        with contextlib.redirect_stdout(taken), contextlib.redirect_stderr(io.StringIO()) as said:
            code = run(build(), arguments)
        assert code in (0, 1, 2), f"exit code {code}: {said.getvalue()[-300:]}"
        assert out.exists() == (code == 0), f"exit code {code}, output {'there' if out.exists() else 'missing'}"
        assert {path.name for path in folder.iterdir()} <= {"given", "out"}, "something was left over"
        assert given.read_bytes() == data, "the input was changed"
        if code == 0:
            assert out.read_bytes().endswith(b"\n") or kind == "program", "the output is cut off"
        return code == 0


def shipped_model() -> Model:
    return default_model()


def _read_out(findings: list[Diagnostic] | tuple[Diagnostic, ...]) -> None:
    """Findings have texts and places that can be printed."""
    for finding in findings[:8]:
        finding.render().encode(sys.stdout.encoding or "utf-8", "backslashreplace")
        finding.as_json()
