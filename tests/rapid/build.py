"""Small programs for tests, and shorthand for reading them."""

from __future__ import annotations

from postproc.diagnostics import Source
from postproc.rapid.data.events import MotionEvent
from postproc.rapid.execution.walk import walk
from postproc.rapid.program.program import Program, read_program

UNUSED = "[9E9,9E9,9E9,9E9,9E9,9E9]"


def target(x: float, y: float, z: float, rot: str = "[0,1,0,0]", conf: str = "[0,0,0,0]") -> str:
    return f"[[{x},{y},{z}],{rot},{conf},{UNUSED}]"


def module(body: str, data: str = "", name: str = "M") -> bytes:
    """A module with the given data and a procedure main."""
    return f"MODULE {name}\n{data}\nPROC main()\n{body}\nENDPROC\nENDMODULE\n".encode("latin-1")


def program(text: bytes | str, path: str = "test.mod") -> Program:
    return read_program(Source(path, text if isinstance(text, bytes) else text.encode("latin-1")))


def events(body: str, data: str = "") -> list[MotionEvent]:
    return walk(program(module(body, data)))


def places(found: list[MotionEvent]) -> list[tuple[float, ...] | None]:
    """Positions of the events' targets."""
    return [getattr(event.target, "trans", None) for event in found]
