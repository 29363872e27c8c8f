"""The search with one of its rules switched off, so that its worth can be counted."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib import import_module
from typing import Any
from unittest.mock import patch

import numpy as np

Patch = tuple[str, str, Any]
"""A module of `postproc`, a name in it, and what stands there instead."""


def _nothing(*parts: Any, **named: Any) -> list[Any]:
    return []


RULES: dict[str, tuple[Patch, ...]] = {
    "backward": (("identification.search", "backward", lambda state: state),),
    "maps": (("effects.library.joints.transmission_error", "TransmissionError.generalised", _nothing),),
    "nonlinear": (("identification.acceptance", "refit_form", lambda screen, linear, candidate, *least: candidate),),
    "held_out": (("identification.search", "predicts_better", lambda after, before, errors: True),),
    "row": (("identification.search", "with_and_without_a_row", lambda linear, columns: (0.0, 0.0)),),
    "nested": (("identification.acceptance", "_nested", lambda candidate, found: candidate),),
    "rooms": (
        (
            "effects.library.joints.transmission_error",
            "TransmissionError.rooms",
            lambda terms, *others: np.ones(len(terms), dtype=bool),
        ),
    ),
    "switches": (("identification.screen.curves", "CurveScreen._switched", _nothing),),
    "memory": (
        ("identification.curves.families", "memories", _nothing),
        ("identification.curves.families", "lags", _nothing),
    ),
    "leaning": (("identification.curves.families", "overturning", lambda *parts: ([], [])),),
}
"""By the word of ``--without``, which may join several with +."""


@contextmanager
def without(words: str) -> Iterator[None]:
    """Within it the product searches without these rules.

    Raises:
        KeyError: a word is no rule.
    """
    undo: list[Callable[[], Any]] = []
    try:
        for module, name, instead in (p for word in filter(None, words.split("+")) for p in RULES[word]):
            owner: Any = import_module(f"postproc.{module}")
            *outer, last = name.split(".")
            for part in outer:
                owner = getattr(owner, part)
            changed = patch.object(owner, last, instead)
            changed.start()
            undo.append(changed.stop)
        yield
    finally:
        for stop in reversed(undo):
            stop()
