"""What the tests of this room build: small programs in the shorthand of the corpora, models of a few lines, findings."""

from __future__ import annotations

import re

import numpy as np

from postproc.compensation.conversion import Conversion
from postproc.diagnostics import Diagnostic, Source
from postproc.model.arm import Model
from postproc.model.file import parse_model
from tests import corpus
from tests.build import module, places, target, written

NO_FORCE = (0.0, 0.0, 0.0)
PROCESS = "v100,sm,wd"
"""Arguments of a weld statement between its target and its zone."""


def broken(data: str, body: str, more: str = "") -> str:
    """A module with a line for each statement and each head of a routine."""
    return module(broken_lines(data), broken_lines(body), broken_lines(more) + "\n" * bool(more))


def broken_lines(text: str) -> str:
    lines = re.sub(r"(?<=;) +(?=[^!\s])", "\n", text)
    return re.sub(r"(?m)^((?:PROC|FUNC|TRAP)\b[^()]*(?:\([^()]*\))?) +", r"\1\n", lines)


def placed(x: str, y: str, z: str = "700", *conf: str) -> str:
    """A target whose height and confdata are the usual ones where they are left out."""
    return target(float(x), float(y), float(z), [int(c) for c in conf] or (-1, 0, -1, 0))


def small(body: str, at: str = "", data: str = "", more: str = "") -> str:
    """A program in the shorthand of the corpora.

    Args:
        body: statements of ``main``, with `@{x,y}` or `@{x,y,z}` for a target.
        at: declared targets, `name x y z, ..`. data, more: further declarations and routines.
    """
    declared = corpus.declared(at) + "\n" if at else ""
    return corpus.written(broken(declared + data, body, more), placed)


TWO = small("MoveJ p1,v200,fine,tT; MoveL p2,v50,fine,tT;", "p1 1350 -500, p2 1350 -100")
"""A joint move and a line of 400 mm between names."""


def model(effects: str, robot: str = "irb4600_60_205") -> Model:
    """The model of a file with an arm and these tables."""
    return parse_model(Source("arm.toml", f'robot = "{robot}"\n{effects}\n'.encode()))


def effect(key: str, *lines: str) -> str:
    """The table of an effect in a model file."""
    return "\n".join((f"[effects.{key}]", *lines, ""))


def brief(value: object) -> str | None:
    """The name of a program in the names of tests; other values have their usual one."""
    return "text" if isinstance(value, str) and "\n" in value else None


def shifts(conversion: Conversion, text: str = TWO) -> np.ndarray:
    """How far the first and the last goal of a program were moved (2, 3) [mm]."""
    goals = places(written(conversion))
    return np.subtract([goals[0], goals[-1]], [places(text)[0], places(text)[-1]])


def findings(conversion: Conversion, code: str) -> list[Diagnostic]:
    return [d for d in conversion.diagnostics if d.code == code]


def errors(conversion: Conversion) -> list[str]:
    return [d.code for d in conversion.diagnostics if d.severity == "error"]


def statuses(conversion: Conversion) -> list[str]:
    return [o.status for o in conversion.outcomes]
