"""The generated part of docs/effects.md; ``python docs/write_effects.py`` writes it anew."""

from __future__ import annotations

import inspect
from pathlib import Path

from postproc.effects.base import Effect
from postproc.effects.registry import BUILT_IN

BEGIN = "<!-- generated from the classes: python docs/write_effects.py -->\n"
END = "<!-- end of the generated part -->\n"


def library_page() -> str:
    """A table of the library, then each effect with its equation, parameters and confusions."""
    rows = [f"| [`{c.key}`](#{c.key}) | {c.title} | {_reads(c)} | {_parameters(c)} |" for c in BUILT_IN]
    head = ["| key | what it is | reads | parameters |", "|---|---|---|---|"]
    return "\n".join([*head, *rows, "", *map(_section, BUILT_IN)])


def described(cls: type[Effect]) -> str:
    """The docstring after its title: equation, source, typical size."""
    return inspect.cleandoc(cls.__doc__ or "").partition("\n")[2].strip()


def with_library(page: str) -> str:
    """The page with its generated part made anew."""
    before, _, rest = page.partition(BEGIN)
    return before + BEGIN + "\n" + library_page() + "\n" + END + rest.partition(END)[2]


def _section(cls: type[Effect]) -> str:
    lines = [f"### {cls.key}", "", cls.title, "", "```text", described(cls), "```", ""]
    lines += ["| parameter | unit | shape | from | to | typical |", "|---|---|---|---|---|---|"]
    for name, meta in cls.parameters().items():
        shape = " x ".join(map(str, meta.shape)) or "1"
        forming = "" if meta.amplitude else " (forms the effect)"
        lines.append(f"| `{name}`{forming} | {meta.unit} | {shape} | {meta.low:g} | {meta.high:g} | {meta.typical:g} |")
    for name, choice in cls.structures().items():
        allowed = ", ".join(choice.choices) or f"{choice.low:g} to {choice.high:g}"
        default = getattr(cls, name)
        shown = ", ".join(map(str, default)) if isinstance(default, tuple) else str(default)
        lines.append(f"| `{name}` (searched) | {allowed} |  |  |  | {shown} |")
    lines += ["", "Confused with:", ""]
    return "\n".join([*lines, *(f"- `{key}`: {way}" for key, way in cls.confused_with.items()), ""])


def _reads(cls: type[Effect]) -> str:
    return ", ".join(cls.reads) or "-"


def _parameters(cls: type[Effect]) -> str:
    return ", ".join(f"`{name}`" for name in (*cls.parameters(), *cls.structures()))


if __name__ == "__main__":
    file = Path(__file__).with_name("effects.md")
    file.write_text(with_library(file.read_text(encoding="utf-8")), encoding="utf-8")
