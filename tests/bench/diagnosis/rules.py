"""The search with one of its rules switched off, so that its worth can be counted."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from importlib import import_module
from typing import Any
from unittest.mock import patch

Patch = tuple[str, str, Any]
"""A module of `postproc`, a name in it, and what stands there instead."""


def _plain_forward(search: Any, first: Any) -> Any:
    from postproc.identify.way import Way

    end = Way(search.fit, search, known=first).to_end()
    search.fit, search.outside, search.classes = end.search.fit, end.search.outside, end.search.classes
    return end.missing


def _patterns_alone(search: Any, base: Any, missing: Any) -> Any:
    from postproc.identify.unnamed import with_patterns

    left = with_patterns(search)
    search.fit, search.outside = left.fit, left.outside
    return missing


RULES: dict[str, tuple[Patch, ...]] = {
    "forks": (("identify.diagnose", "select_forward", _plain_forward),),
    "rivals": (("identify.way", "Rival.beats", lambda rival, way: False),),
    "plainer": (("identify.search", "_plainer", lambda start, named, rival: named),),
    "anew": (
        ("identify.way", "formed_anew", lambda search, base, missing: missing),
        ("identify.backward", "anew", lambda search, base, missing, *others: missing),
    ),
    "contest": (("identify.diagnose", "contested", _patterns_alone),),
    "beside": (("identify.diagnose", "formed_beside", lambda search, base, missing: missing),),
    "lines": (
        ("identify.diagnose", "lines_or_map", lambda search, missing, noise: missing),
        ("identify.diagnose", "perhaps_a_map", lambda search, missing, noise: missing),
    ),
    "one_or_more": (("identify.way", "one_or_more", lambda search, best: best),),
    "backward": (("identify.diagnose", "check_backward", lambda search, base, missing: missing),),
    "shaped": (("identify.ranking", "formed", lambda screen, linear, candidate, least: candidate),),
    "further": (("identify.taking", "reaches_further", lambda after, before: True),),
    "row": (("identify.taking", "_lives_on_a_row", lambda fit, best: False),),
    "nested": (("identify.ranking", "_nested", lambda candidate, found: candidate),),
    "broadband": (("identify.candidate", "_broadband", lambda *parts: False),),
    "chains": (("patterns.tried", "Tried._channels", lambda *parts: []),),
    "switches": (("patterns.tried", "Tried._switched", lambda *parts: []),),
}
"""By the word of ``--without``, which may join several with +."""
RULES["plain"] = tuple(
    p for name in ("forks", "plainer", "anew", "contest", "beside", "lines", "one_or_more") for p in RULES[name]
)


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
            with suppress(RuntimeError):
                stop()
