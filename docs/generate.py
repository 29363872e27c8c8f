"""What the build of the documentation writes from the code and from real runs, into ``docs/_generated``.

Commands with their options, keys of files with their JSON Schemas, effects, pages and pictures of the tutorials. What
the commands of the tutorials print stands in their pages: ``python docs/generate.py`` writes it there.
"""

from __future__ import annotations

import inspect
import json
import os
import runpy
import shutil
import tempfile
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

from blocks import is_same, made_names, run_page, with_made, with_outputs
from welding import programs_page

DOCS = Path(__file__).resolve().parent
TUTORIALS = ("first-program", "hidden-effect")
STALE = "`python docs/generate.py` writes what the commands print, and figures in sentences"


def write_all(folder: Path) -> None:
    """Write every generated page; one that is as it was keeps its time, so that Sphinx does not read it again."""
    for key, value in {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MPLBACKEND": "svg"}.items():
        os.environ.setdefault(key, value)
    (folder / "pages" / "schema").mkdir(parents=True, exist_ok=True)
    for name, page in PAGES.items():
        _write(folder / f"{name}.md", page())
    for kind, schema in _schemas().items():
        _write(folder / "pages" / "schema" / f"{kind}.json", json.dumps(schema, indent=2) + "\n")
    for name in TUTORIALS:
        _run_tutorial(name, folder)
    for page, text in _pages_with_made():
        assert is_same(page.read_text("utf-8"), text), f"{page.name}: {STALE}"


def _pages_with_made() -> Iterator[tuple[Path, str]]:
    """Pages that state figures, with these as they are made now."""
    from made import MADE

    pages = {page: page.read_text("utf-8") for page in (*sorted(DOCS.glob("*.md")), DOCS.parent / "README.md")}
    names = {name for text in pages.values() for name in made_names(text)}
    texts = {name: MADE[name]() for name in sorted(names)}
    for page, text in pages.items():
        if made_names(text):
            yield page, with_made(text, texts)


def _write(path: Path, text: str) -> None:
    if not path.is_file() or path.read_text("utf-8") != text:
        path.write_text(text, encoding="utf-8")


def _run_tutorial(name: str, folder: Path) -> None:
    """Run a tutorial's commands as a reader would; keep the pages they write, and its pictures."""
    outputs, text = [], (DOCS / f"{name}.md").read_text("utf-8")
    with tempfile.TemporaryDirectory() as work:
        for ran in run_page(DOCS / f"{name}.md", Path(work)):
            assert ran.code == ran.expected, f"{name}.md: `{ran.line}` returned {ran.code}: {ran.output}"
            outputs.append(ran.output)
        assert is_same(text, with_outputs(text, outputs)), f"{name}.md: {STALE}"
        for page in Path(work).glob("out/*.html"):
            shutil.copy(page, folder / "pages")
        draw = runpy.run_path(str(DOCS / "figures" / f"{name.replace('-', '_')}.py"))["draw"]
        draw(Path(work), folder)


def commands_page() -> str:
    """Every command with all its options."""
    from postproc.cli.app import build

    text: str = build().generate_docs(output_format="markdown")
    _, _, listed = text.partition("**Convert programs**")
    return f"# Commands and options\n\nGenerated from the program.\n\n**Convert programs**{listed}"


def files_page() -> str:
    """Keys of every kind of file that people write, and where its JSON Schema is."""
    from postproc.cli.look_up.schemas import SCHEMA_KINDS

    lines = ["# Files: keys and JSON Schemas", "", "Generated from the declarations by which the files are read.", ""]
    lines += [
        "`postproc schema KIND` prints the schema; [editors](other-tools.md#editors) complete and check with it.",
        "",
    ]
    for kind, schema in _schemas().items():
        lines += [f"## {kind}", "", f"{SCHEMA_KINDS[kind][1]}: [schema](pages/schema/{kind}.json)", ""]
        lines += ["| key | value | meaning |", "|---|---|---|"]
        lines += [f"| `{key}` | {words} | {text} |" for key, words, text in key_rows(schema, schema.get("$defs", {}))]
        lines.append("")
    return "\n".join(lines).replace("](other-tools", "](../other-tools")


def _schemas() -> dict[str, dict[str, Any]]:
    from postproc.cli.look_up.schemas import SCHEMA_KINDS, schema_of

    return {kind: schema_of(kind) for kind in SCHEMA_KINDS}


def effects_page() -> str:
    """A table of the library, then each effect with its equation, parameters and confusions."""
    from postproc.effects.registry import BUILT_IN

    head = ["# The library of effects", "", "Generated from the classes.", ""]
    head += ["| key | what it is | reads | parameters |", "|---|---|---|---|"]
    for cls in BUILT_IN:
        names = ", ".join(f"`{name}`" for name in (*cls.parameters(), *cls.structures()))
        head.append(f"| [`{cls.key}`](#{cls.key}) | {cls.title} | {', '.join(cls.reads) or '-'} | {names} |")
    return "\n".join([*head, "", *map(_effect_section, BUILT_IN)])


def _effect_section(cls: Any) -> str:
    described = inspect.cleandoc(cls.__doc__ or "").partition("\n")[2].strip()
    lines = [f"## {cls.key}", "", cls.title, "", "```text", described, "```", ""]
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
    if cls.confused_with:
        lines += ["", "Confused with:", "", *(f"- `{key}`: {way}" for key, way in cls.confused_with.items())]
    return "\n".join([*lines, ""])


def key_rows(schema: Mapping[str, Any], named: Mapping[str, Any], at: str = "") -> Iterator[tuple[str, str, str]]:
    """Keys of a schema with dots between tables, their types in words, what they mean."""
    for key, value in schema.get("properties", {}).items():
        entry = _resolved(value, named)
        inside = _resolved(entry.get("items", {}), named)
        if key == "effects" and "properties" in entry:
            yield f"{at}effects.KEY", "parameters of [an effect](effects.md)", ""
        elif "properties" in entry or "properties" in inside:
            table, mark = (entry, "") if "properties" in entry else (inside, "[]")
            yield from key_rows(table, named, f"{at}{key}{mark}.")
        else:
            stated = entry.get("default") not in (None, "", [], {}, 0.0)
            default = f" Default: `{entry['default']}`." if stated else ""
            yield f"{at}{key}", _words(entry, named), str(entry.get("description", "")).replace("|", "/") + default


def _resolved(entry: Mapping[str, Any], named: Mapping[str, Any]) -> Mapping[str, Any]:
    """What stands behind a reference; of "this or nothing" this."""
    if "$ref" in entry:
        return {**named[entry["$ref"].rpartition("/")[2]], **entry}
    some = [part for part in entry.get("anyOf", ()) if part.get("type") != "null"]
    return (
        {**_resolved(some[0], named), **{k: v for k, v in entry.items() if k != "anyOf"}} if len(some) == 1 else entry
    )


def _words(entry: Mapping[str, Any], named: Mapping[str, Any]) -> str:
    """The type of a key in words: "list of 6 (number)"."""
    entry = _resolved(entry, named)
    if "enum" in entry or "const" in entry:
        return " or ".join(f"`{word}`" for word in entry.get("enum", [entry.get("const")]))
    if "anyOf" in entry:
        return " or ".join(_words(part, named) for part in entry["anyOf"] if part.get("type") != "null")
    if entry.get("type") == "array":
        many = (
            f"{entry['minItems']} " if entry.get("minItems", 0) and entry["minItems"] == entry.get("maxItems") else ""
        )
        inside = entry.get("items") or next(iter(entry.get("prefixItems", [])), None)
        return f"list of {many}({_words(inside, named)})" if inside else "list"
    kind = str(entry.get("type", "any"))
    return {"string": "text", "boolean": "yes/no", "object": "table", "integer": "whole number"}.get(kind, kind)


PAGES: Mapping[str, Callable[[], str]] = {
    "commands": commands_page,
    "files": files_page,
    "effects": effects_page,
    "welding": programs_page,
}
"""Generated pages by name."""


def write_outputs() -> None:
    """Write what the commands of the tutorials print into their pages: ``python docs/generate.py``."""
    for name in TUTORIALS:
        page = DOCS / f"{name}.md"
        with tempfile.TemporaryDirectory() as work:
            outputs = [ran.output for ran in run_page(page, Path(work))]
        page.write_text(with_outputs(page.read_text("utf-8"), outputs), encoding="utf-8")
    for page, text in _pages_with_made():
        page.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    write_outputs()
