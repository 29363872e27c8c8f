"""The Jinja environment: shipped templates, the user's own before them, and the filters that write numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache
from pathlib import Path

import numpy as np
from jinja2 import ChoiceLoader, FileSystemLoader, StrictUndefined, Template
from jinja2.sandbox import SandboxedEnvironment

from postproc.diagnostics import Diagnostic, PostprocError
from postproc.files import read_source, resource
from postproc.rapid.data.records import NO_AXIS
from postproc.render.text import DEGREES_DECIMALS, MM_DECIMALS, QUATERNION_DECIMALS, rapid_number


def mm(values: Sequence[float | str]) -> list[str]:
    """Lengths [mm] as RAPID writes them; entries that are text stay as they are."""
    return [v if isinstance(v, str) else rapid_number(v, MM_DECIMALS) for v in values]


def quaternion(values: Sequence[float]) -> list[str]:
    """The four numbers of a quaternion as RAPID writes them."""
    return [rapid_number(v, QUATERNION_DECIMALS) for v in values]


def axes(values: Sequence[float]) -> list[str]:
    """External axes [mm], [deg] as RAPID writes them; an unused axis (``NO_AXIS``) is written 9E9."""
    return ["9E9" if v >= NO_AXIS else rapid_number(v, 6) for v in values]


def degrees(values: Sequence[float]) -> list[str]:
    """Angles [rad] as RAPID text in degrees."""
    return [rapid_number(x, DEGREES_DECIMALS) for x in np.degrees(values)]


def environment(template_dir: Path | None = None) -> SandboxedEnvironment:
    """The Jinja environment with the shipped templates; those of the user's folder take their place.

    Raises:
        PostprocError: ``REN001`` if the folder does not exist, ``REN002`` if a template in it cannot be read.
    """
    if template_dir is not None and not template_dir.is_dir():
        help_ = "give --template a folder with any of target.j2, displaced.j2, statement.j2, header.j2, module.j2"
        text = f"template folder `{template_dir}` does not exist"
        raise PostprocError.of("REN001", text, help=help_)
    for template in () if template_dir is None else template_dir.glob("*.j2"):
        read_source(template, "REN002")  # a pipe would be waited for
    names = () if template_dir is None else tuple(sorted(file.name for file in template_dir.iterdir()))
    return _environment(template_dir, names)


@lru_cache(maxsize=4)  # reading the templates takes a tenth of the time for a small program
def _environment(template_dir: Path | None, names: tuple[str, ...]) -> SandboxedEnvironment:
    """The cached environment for a folder with files of these names; changed template files are read again."""
    folders = [str(d) for d in (template_dir, resource("templates")) if d is not None]
    env = SandboxedEnvironment(
        loader=ChoiceLoader([FileSystemLoader(d) for d in folders]),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        autoescape=False,  # RAPID text, not HTML
    )
    env.filters.update(mm=mm, quaternion=quaternion, axes=axes, degrees=degrees)
    return env


def load_template(env: SandboxedEnvironment, name: str) -> Template:
    """Load the template with this file name.

    Raises:
        PostprocError: ``REN002`` where the template is not valid Jinja.
    """
    try:
        return env.get_template(name)
    except Exception as error:  # brackets a thousand deep are no error of the template's own kind
        raise PostprocError(_template_diagnostic(name, error)) from error


def fill(template: Template, values: Mapping[str, object]) -> str:
    """Render one template.

    Raises:
        PostprocError: ``REN002`` where the template asks for something that is not there.
    """
    try:
        return template.render(values)
    except Exception as error:  # a template is the user's code: anything may go wrong in it
        raise PostprocError(_template_diagnostic(template.name or "template", error)) from error


def _template_diagnostic(name: str, error: Exception) -> Diagnostic:
    """REN002, an error that names the template and, if known, the line at fault."""
    line = getattr(error, "lineno", None)
    where = f" line {line}" if line else ""
    text, help_ = f"template `{name}`{where} cannot be rendered: {error}", "compare it with the shipped template"
    return Diagnostic("REN002", "error", text, help=f"{help_} of the same name")
