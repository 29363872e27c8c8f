"""Lines of a batch's journal: what was made of a task or a copied file; read as data that anybody may have changed."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from pathlib import Path, PurePosixPath
from typing import Any, get_args

from postproc.batch.values import COUNTED, Status
from postproc.diagnostics import Diagnostic, Severity
from postproc.files import read_file, stays_inside
from postproc.numbers import LARGEST_NUMBER

STATE = ".postproc"  # folder in the tree of outputs
COPY = "copy"  # key and status of files that are not converted
Line = dict[str, Any]  # name, key, status, outputs (path to hash), figures, findings
Subject = tuple[bool, str]  # whether a file is copied, and its name; a task may be called like a file


def subject(line: Line) -> Subject:
    """Return what a line is about: whether it is a copied file, and its name."""
    return line["key"] == COPY, str(line["name"])


def encoded(line: Mapping[str, Any]) -> bytes:
    """Return a line as the bytes of the journal: JSON with sorted keys and a line feed."""
    return json.dumps(line, sort_keys=True, separators=(",", ":"), allow_nan=False).encode() + b"\n"


def read_lines(path: Path, findings: list[Diagnostic]) -> Iterator[Line]:
    """Yield the valid lines of a journal; appends BAT018 to ``findings`` with the number of invalid lines."""
    odd = 0
    for text in read_file(path).split(b"\n"):
        try:
            line = json.loads(text)
        except ValueError:
            continue  # empty, or torn by a kill
        except RecursionError:
            line = None
        if _is_line(line):
            yield {"figures": {}, "findings": [], **line}
        else:
            odd += 1
    if odd:
        what = f"{odd} line{'s' * (odd > 1)} of the journal `{path}` cannot come from a batch"
        help_ = "what they speak of is done again; files that they name are left as they are"
        findings.append(Diagnostic("BAT018", "warning", f"{what}: left out", help=help_))


def _is_line(line: Any) -> bool:
    """Tell whether a value has the types that a batch writes, and only names files inside the output folder."""
    if not isinstance(line, dict) or line.get("status") not in (*get_args(Status), COPY):
        return False
    outputs, figures, findings = line.get("outputs"), line.get("figures", {}), line.get("findings", [])
    try:
        encoded(line)  # no NaN
    except ValueError:
        return False
    return (
        all(isinstance(line.get(key), str) for key in ("name", "key"))
        and isinstance(outputs, dict)
        and all(
            isinstance(h, str) and stays_inside(p) and PurePosixPath(p).parts[0] != STATE for p, h in outputs.items()
        )
        and isinstance(figures, dict)
        and (not figures or _are_figures(figures))
        and isinstance(findings, list)
        and all(isinstance(found, dict) and _is_finding(found) for found in findings)
    )


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


def _is_finding(found: Mapping[str, Any]) -> bool:
    """Tell whether a value has the keys and types of a diagnostic in JSON."""
    texts = all(isinstance(found.get(key), str) for key in ("code", "message"))
    return (
        texts
        and found.get("severity") in get_args(Severity)
        and all(
            key in found and (found[key] is None or isinstance(found[key], kind))
            for key, kind in (("path", str), ("help", str), ("line", int), ("column", int))
        )
    )
