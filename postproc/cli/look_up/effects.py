"""``postproc effects list|show|check``: the library of physical effects and the user's own."""

from __future__ import annotations

from pathlib import Path

from postproc.cli import printing
from postproc.cli.options import CheckFlag, EffectFiles
from postproc.cli.output import present
from postproc.diagnostics import has_errors
from postproc.effects.conformance.kit import check_effect
from postproc.effects.loading import load_effect_file
from postproc.effects.registry import effect_library, find_effect, installed_effects, keys_taken_twice
from postproc.model.file import read_model
from postproc.results.library import check_document, effect_document, effects_document


def list_(*, effects: EffectFiles = (), json: CheckFlag = False) -> None:
    """List the effects by key.

    Args:
        json: print the postproc/effects/1 document.
    """
    library = effect_library(effects)
    printing.show(installed_effects()[1])
    present(effects_document(library.values()), json=json)


def show(key: str, /, *, model: Path | None = None, effects: EffectFiles = (), json: CheckFlag = False) -> None:
    """Show an effect: equation, source, parameters, what it needs, what it is confused with.

    Args:
        key: as in a model file, such as joint_compliance.
        model: TOML file of an arm, of which the effect's values are shown, or its law in symbols.
        json: print the postproc/effect/1 document.
    """
    library = effect_library(effects)
    stated = None if model is None else read_model(model, library).effect(key)
    present(effect_document(find_effect(key, library), stated), json=json)


def check(file: Path, /, *, json: CheckFlag = False) -> int:
    """Run the effects of a Python file through the conformance kit; exit 1 if one fails.

    Args:
        file: Python file with effects; its code is run.
        json: print the postproc/effects-check/1 document.
    """
    classes = load_effect_file(file, check=False)
    findings = [finding for cls in classes for finding in check_effect(cls)]
    findings += keys_taken_twice([*effect_library().values(), *classes])
    printing.show(findings)
    present(check_document(classes, findings), json=json)
    return int(has_errors(findings))
