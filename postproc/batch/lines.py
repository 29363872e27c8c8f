"""Lines of a batch's journal: what was made of a task or a copied file; read as data that anybody may have changed."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path, PurePosixPath
from typing import Any, Literal, get_args

from postproc.batch.values import COUNTED, Status
from postproc.diagnostics import Diagnostic, Finding, Matter, Severity
from postproc.files import read_file, stays_inside
from postproc.numbers import LARGEST_NUMBER

STATE = ".postproc"  # folder in the tree of outputs
COPY: Literal["copy"] = "copy"  # key and status of files that are not converted
Subject = tuple[bool, str]  # whether a file is copied, and its name; a task may be called like a file
STATUSES: tuple[Status, ...] = get_args(Status)


@dataclass(frozen=True, slots=True)
class Line:
    """What was made of a task, or of a copied file.

    Args:
        name: of the task, or path of the file. status: ``copy`` for a copied file.
        key: hash of all that the result depends on; ``copy`` for a copied file, empty for a result that the same input
            might not give again.
        outputs: SHA-256 of each written file by its path. figures: of the result of a task.
    """

    name: str
    key: str
    status: Status | Literal["copy"]
    outputs: Mapping[str, str]
    figures: Mapping[str, Any] = field(default_factory=dict)
    findings: tuple[Finding, ...] = ()

    @property
    def subject(self) -> Subject:
        """Whether the line is about a copied file, and the name of that file or of the task."""
        return self.key == COPY, self.name

    def encoded(self) -> bytes:
        """Return the line as the bytes of the journal: JSON with sorted keys and a line feed."""
        findings = [{**asdict(found), "matter": found.matter and found.matter.name} for found in self.findings]
        text = json.dumps(
            {**asdict(self), "findings": findings}, sort_keys=True, separators=(",", ":"), allow_nan=False
        )
        return text.encode() + b"\n"


def read_lines(path: Path, findings: list[Diagnostic]) -> Iterator[Line]:
    """Yield the valid lines of a journal; appends BAT018 to ``findings`` with the number of invalid lines."""
    odd = 0
    for text in read_file(path).split(b"\n"):
        try:
            content = json.loads(text)
        except ValueError:
            continue  # empty, or torn by a kill
        except RecursionError:
            content = None
        try:
            yield _line(content)
        except (KeyError, TypeError, ValueError):
            odd += 1
    if odd:
        what = f"{odd} line{'s' * (odd > 1)} of the journal `{path}` cannot come from a batch"
        help_ = "what they speak of is done again; files that they name are left as they are"
        findings.append(Diagnostic("BAT018", "warning", f"{what}: left out", help=help_))


def _line(content: Any) -> Line:
    """Return a line of a journal from its JSON content, after checking it; its files are all inside the output folder.

    Raises:
        KeyError, TypeError, ValueError: no batch writes that.
    """
    name, key, outputs = _text(content["name"]), _text(content["key"]), content["outputs"]
    status, figures = content["status"], content.get("figures", {})
    if status not in (*STATUSES, COPY) or not isinstance(outputs, dict) or not isinstance(figures, dict):
        raise ValueError("no status, files or figures of a batch")
    if not all(stays_inside(p) and PurePosixPath(p).parts[0] != STATE and _text(h) for p, h in outputs.items()):
        raise ValueError("a file outside the folder")
    if figures and not _are_figures(figures):
        raise ValueError("no figures of a batch")
    return Line(name, key, status, outputs, figures, tuple(map(_finding, content.get("findings", []))))


def _text(value: Any) -> str:
    """Return the value, which is a text.

    Raises:
        TypeError: it is none.
    """
    if not isinstance(value, str):
        raise TypeError("no text")
    return value


def _are_figures(figures: Mapping[str, Any]) -> bool:
    """Tell whether a line's figures have the keys and finite numbers that a batch writes."""
    statements = figures.get("statements")
    lengths = [figures[key] for key in ("max_error_before_mm", "max_error_after_mm") if key in figures]
    counted = [figures.get(key) for key in ("added_targets", "unproved_statements")]
    counted += [figures["cycle_time_s"]] if "cycle_time_s" in figures else []
    if not isinstance(statements, dict) or statements.keys() != set(COUNTED):
        return False
    numbers = (*lengths, *counted, *statements.values())
    return len(lengths) != 1 and all(type(n) in (int, float) and abs(n) <= LARGEST_NUMBER for n in numbers)


def _finding(content: Any) -> Finding:
    """Return a finding from its JSON content in a line.

    Raises:
        KeyError, TypeError, ValueError: no batch writes that.
    """
    code, severity, message = _text(content["code"]), content["severity"], _text(content["message"])
    path, help_ = (None if content[key] is None else _text(content[key]) for key in ("path", "help"))
    line, column, offset = content["line"], content["column"], content.get("offset")
    matter, length = content.get("matter"), content.get("length_mm", 0.0)
    whole = all(number is None or isinstance(number, int) for number in (line, column, offset))
    if severity not in get_args(Severity) or not whole or not 0 <= length <= LARGEST_NUMBER:
        raise ValueError("no finding of a batch")
    about = None if matter is None else Matter[matter]
    name = _text(content.get("name", ""))
    return Finding(code, severity, message, path, line, column, offset, help_, about, name, float(length))
