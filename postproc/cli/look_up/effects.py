"""``postproc effects list|show|check``: the library of physical effects and the user's own."""

from __future__ import annotations

import inspect
from pathlib import Path

import numpy as np

from postproc.cli import report
from postproc.cli.options import EffectFiles, Flag
from postproc.cli.report import print_json, put
from postproc.diagnostics import has_errors
from postproc.effects.base import Effect
from postproc.effects.conformance.kit import check_effect
from postproc.effects.findings import origin
from postproc.effects.loading import load_effect_file
from postproc.effects.registry import effect_library, find_effect, installed_effects, keys_taken_twice


def list_(*, effects: EffectFiles = (), json: Flag = False) -> int:
    """List the effects by key.

    Args:
        json: print the postproc/effects/1 document.
    """
    library = effect_library(effects)
    report.show(installed_effects()[1])
    if json:
        print_json({"schema": "postproc/effects/1", "effects": [_document(cls) for cls in library.values()]})
        return 0
    for key, cls in library.items():
        put(f"{key:22} {cls.title}")
    return 0


def show(key: str, /, *, effects: EffectFiles = (), json: Flag = False) -> int:
    """Show an effect: equation, source, parameters, what it needs, what it is confused with.

    Args:
        key: as in a model file, such as joint_compliance.
        json: print the postproc/effect/1 document.
    """
    cls = find_effect(key, effect_library(effects))
    if json:
        print_json({"schema": "postproc/effect/1", **_document(cls)})
        return 0
    put(f"{cls.key}: {inspect.cleandoc(cls.__doc__ or '')}\n")
    put("parameters")
    for name, meta in cls.parameters().items():
        shape = " x ".join(map(str, meta.shape)) or "1"
        limits = f"from {meta.low} to {meta.high}, " if np.isfinite((meta.low, meta.high)).any() else ""
        without = f"vanishes at {meta.null}" if meta.amplitude else f"only forms it, {meta.null} unless said"
        put(f"  {name} [{meta.unit}], {shape}: {limits}ordinary size {meta.typical}, {without}")
    for name in cls.structures():
        put(f"  {name}, chosen by search")
    put(f"reads {', '.join(cls.reads)}")
    if cls.confused_with:
        put("is confused with")
        for other, remedy in cls.confused_with.items():
            put(f"  {other}; to tell them apart: {remedy}")
    return 0


def check(file: Path, /, *, json: Flag = False) -> int:
    """Run the effects of a Python file through the conformance kit; exit 1 if one fails.

    Args:
        file: Python file with effects; its code is run.
        json: print the postproc/effects-check/1 document.
    """
    classes = load_effect_file(file, check=False)
    found = [finding for cls in classes for finding in check_effect(cls)]
    found += keys_taken_twice([*effect_library().values(), *classes])
    report.show(found)
    if json:
        findings = [finding.as_json() for finding in found]
        keys = [cls.key for cls in classes]
        print_json({"schema": "postproc/effects-check/1", "effects": keys, "diagnostics": findings})
    elif not has_errors(found):
        doubt = ", if what is told above is meant so" if found else ""
        put("\n".join(f"{cls.key}: fit for every command{doubt}" for cls in classes))
    return int(has_errors(found))


def _document(cls: type[Effect]) -> dict[str, object]:
    return {
        "key": cls.key,
        "title": cls.title,
        "reads": cls.reads,
        "parameters": {name: {"unit": meta.unit, "null": meta.null} for name, meta in cls.parameters().items()},
        "confused_with": cls.confused_with,
        "origin": origin(cls),
    }
