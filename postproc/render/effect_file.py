"""What remains without a name as an effect of the user's own: the diagnosis gives its shape, the user its cause."""

from __future__ import annotations

import re

import numpy as np

from postproc.diagnostics import Diagnostic
from postproc.effects.registry import effect_library
from postproc.identify.diagnose import Diagnosis
from postproc.identify.signals import channels_read
from postproc.identify.suspects import Suspect
from postproc.identify.verdict import suspect_size
from postproc.render.templates import environment, fill, load_template


def effect_file(found: Diagnosis, name: str, data: str) -> tuple[str, str | None]:
    """Key and Python text of the first suspect; no text where a pose does not tell it, or where it moves no one place.

    Args:
        name: of the file, which becomes the key. data: name of the table.
    """
    words = [w for w in re.split(r"\W+|_", name.lower()) if w[:1].isalpha()] or ["own"]
    words = ["own", *words] if "_".join(words) in effect_library() else words
    suspect = next(iter(found.suspects), None)
    place = None if suspect is None else _place(suspect)
    if suspect is None or place is None or not suspect.code:
        return "_".join(words), None
    size = float(np.abs(suspect.values).max() * np.abs(suspect_size(found.searched, suspect)).max())
    values = {
        "name": "".join(word.capitalize() for word in words),
        "reads": ", ".join(f'"{name}"' for name in channels_read(suspect.code)),
        "where": suspect.where,
        "channels": " and ".join(suspect.channels),
        "pattern": suspect.pattern,
        "data": data,
        "law": suspect.code,
        "typical": f"{size:.0e}",
        "bound": f"{100 * size:.0e}",
        **place,
    }
    return "_".join(words), fill(load_template(environment(), "effect.py.j2"), values)


def nothing_to_draft(found: Diagnosis) -> Diagnostic:
    """Why there is no file."""
    help_ = "write it by hand: `postproc explain DAT028` shows how"
    if not found.suspects:
        why, help_ = "nothing remains that follows a channel", "see what the verdict says"
    elif _place(found.suspects[0]) is None:
        why = f"`{found.suspects[0].where}` is no joint, body, tool or instrument that moves as a whole"
    else:
        why = f"`{found.suspects[0].pattern}` is nothing that a single pose tells"
    return Diagnostic("DAT028", "info", f"no effect was drafted: {why}", help=help_)


def _place(suspect: Suspect) -> dict[str, object] | None:
    """How the template moves the place; None for one that is no joint, body, tool or instrument as a whole."""
    found = re.fullmatch(r"(joint|base|body|tool|instrument)(?: (\d))?(, shifted)?", suspect.where)
    if found is None or suspect.place.shape[2] != (1 if found[1] == "joint" else 3):
        return None
    number = int(found[2] or 0)
    if found[1] == "joint":
        return {"kind": "joint", "number": number - 1, "unit": "rad"}
    if found[1] in ("tool", "instrument"):
        return {"kind": found[1], "number": 0, "unit": "m"}
    return {"kind": "body", "number": number, "unit": "m" if found[3] else "rad"}
