"""The effects of the library, one of them, and what the conformance kit says of the user's own."""

from __future__ import annotations

import inspect
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from postproc.diagnostics import Diagnostic, has_errors
from postproc.effects.base import Effect
from postproc.effects.findings import origin
from postproc.report.blocks import DataTable, Document, Section

PARAMETERS = ("parameter", "shape", "from", "to", "ordinary size", "vanishes at", "only forms it")


def effects_document(library: Iterable[type[Effect]]) -> Document:
    """Describe the library: key and title of each effect."""
    rows = [(cls.key, cls.title) for cls in library]
    return Document(
        title="postproc effects list",
        values={"schema": "postproc/effects/1", "effects": [_values(cls) for cls in library]},
        sentence="",
        sections=[Section("", [DataTable("effects", ("", ""), rows)])],
    )


def effect_document(cls: type[Effect]) -> Document:
    """Describe an effect: equation, source, parameters, channels it reads, and effects that it is confused with."""
    rows = []
    for name, meta in cls.parameters().items():
        # Each row has a unit of its own: no number of decimals suits all.
        limits = [f"{x:g}" if np.isfinite(x) else None for x in (meta.low, meta.high)]
        null = (f"{meta.null:g}", None) if meta.amplitude else (None, f"{meta.null:g} unless said")
        shape = " x ".join(map(str, meta.shape)) or "1"
        rows.append((f"{name} [{meta.unit}]", shape, *limits, f"{meta.typical:g}", *null))
    structures = [(name, "chosen by search", None, None, None, None, None) for name in cls.structures()]
    similar = DataTable("alike", ("effect", "to tell them apart"), list(cls.confused_with.items()))
    return Document(
        title=f"postproc effects show {cls.key}",
        values={"schema": "postproc/effect/1", **_values(cls)},
        sentence=f"{cls.key}: {inspect.cleandoc(cls.__doc__ or '')}",
        sections=[
            Section("Parameters", [DataTable("parameters", PARAMETERS, [*rows, *structures])]),
            Section("Reads", [f"  {', '.join(cls.reads)}"]),
            Section("Is confused with", [similar]),
        ],
    )


def check_document(classes: Sequence[type[Effect]], findings: Sequence[Diagnostic]) -> Document:
    """Describe what the conformance kit found in the effects of a file."""
    doubt = ", if what is told above is meant so" if findings else ""
    fit = [] if has_errors(findings) else [f"{cls.key}: fit for every command{doubt}" for cls in classes]
    return Document(
        title="postproc effects check",
        values={
            "schema": "postproc/effects-check/1",
            "effects": [cls.key for cls in classes],
            "diagnostics": [finding.as_json() for finding in findings],
        },
        sentence="\n".join(fit),
    )


def _values(cls: type[Effect]) -> dict[str, Any]:
    """Return the entry of an effect in a document."""
    return {
        "key": cls.key,
        "title": cls.title,
        "reads": cls.reads,
        "parameters": {name: {"unit": meta.unit, "null": meta.null} for name, meta in cls.parameters().items()},
        "confused_with": cls.confused_with,
        "origin": origin(cls),
    }
