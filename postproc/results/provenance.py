"""What a certificate rests on: files and their hashes, rows of the fit, versions, and the day."""

from __future__ import annotations

import os
import platform
from collections.abc import Iterable, Mapping, Sequence
from datetime import UTC, datetime
from hashlib import sha256
from importlib.metadata import PackageNotFoundError, version
from typing import Any

from postproc import __version__
from postproc.diagnostics import Source, joined

Row = tuple[str, str]
COMPUTING = ("numpy", "scipy", "pin", "toppra")
"""Distributions whose versions can change the last digits of a figure."""
MOST_ROWS = 12
"""Rows left out of a fit that are named one by one."""


def hashes(files: Iterable[Source]) -> list[Row]:
    """Return rows of the name of a file, without its folder, and the SHA-256 of its bytes."""
    return [(f"{_bare(file)}, SHA-256", sha256(file.data).hexdigest()) for file in files]


def issued() -> str:
    """Return the day in UTC, ``2026-11-29``: that of SOURCE_DATE_EPOCH [s] where it is set, so that builds repeat."""
    stated = os.environ.get("SOURCE_DATE_EPOCH", "")
    now = datetime.fromtimestamp(int(stated), UTC) if stated.isdecimal() else datetime.now(UTC)
    return now.date().isoformat()


def versions() -> str:
    """Return the versions of postproc, Python and the libraries that compute."""
    versions = [f"postproc {__version__}", f"Python {platform.python_version()}"]
    for name in COMPUTING:
        try:
            versions.append(f"{name} {version(name)}")
        except PackageNotFoundError:
            continue
    return ", ".join(versions)


def rows_of_fit(table: Mapping[str, Any]) -> list[Row]:
    """Return rows on the measurements to which a model was fitted: tables with hashes, rows in and out, held-out error.

    Args:
        table: ``[fit]`` of the model file; empty for a model that was not fitted, which gives no rows.
    """
    if not table.get("rows"):
        return []
    names, digests = (_listed(table.get(key)) for key in ("data", "data_sha256"))
    known = [(f"fitted to {name}, SHA-256", digest) for name, digest in zip(names, digests, strict=False)]
    excluded, blocks = table.get("set_aside"), table.get("held_out_blocks", 0)
    out = "not recorded in the model file"
    if blocks:
        out = f"every row once: {blocks} blocks of consecutive poses, each predicted by a fit to the others"
        out += _error(table, "held_out_rms")
    elif table.get("measured"):
        out = f"parts of the joint space, with the curve searched anew in the others{_error(table, 'held_out_rms')}"
    return [
        *known,
        ("rows fitted", f"{table['rows']}{_error(table, 'rms')}"),
        (
            "rows left out of the fit",
            "not recorded in the model file" if excluded is None else _excluded_text(excluded),
        ),
        ("rows held out", out),
        ("fitted by", f"postproc {table.get('version') or 'of unknown version'}"),
    ]


def compared_rows(table: Mapping[str, Any], sources: Sequence[Source]) -> str:
    """Say whether the compared tables are those to which a model was fitted.

    Args:
        table: ``[fit]`` of the model file. sources: of the compared tables.
    """
    fitted = set(_listed(table.get("data_sha256")))
    if not fitted:
        return "the model names no table to which it was fitted"
    same = [_bare(source) for source in sources if sha256(source.data).hexdigest() in fitted]
    if not same:
        return "other rows than those of the fit"
    return f"{joined(same)} {'is' if len(same) == 1 else 'are'} what the model was fitted to: no independent check"


def _bare(file: Source) -> str:
    """Return the name of a file without its folder: a certificate is the same wherever it is made."""
    return file.path.replace("\\", "/").rsplit("/", 1)[-1]


def _excluded_text(excluded: Sequence[str]) -> str:
    """Return which rows were left out as text: they lie far from everything else."""
    if not excluded:
        return "none"
    named = joined(excluded[:MOST_ROWS]) if len(excluded) <= MOST_ROWS else f"{', '.join(excluded[:MOST_ROWS])}, .."
    return f"{len(excluded)}, far from everything else: {named}"


def _error(table: Mapping[str, Any], key: str) -> str:
    """Return an error of the fit, after a semicolon; empty where the table has none.

    Args:
        key: without its unit.
    """
    known = [(table[f"{key}_{unit}"], unit) for unit in ("mm", "mrad") if table.get(f"{key}_{unit}")]
    return "".join(f"; rms {value:.3f} {unit} per {table.get('each', 'axis')}" for value, unit in known)


def _listed(value: str | Sequence[str] | None) -> list[str]:
    """Return a name or several as a list, empty for none."""
    return [] if not value else [value] if isinstance(value, str) else list(value)
