"""TOML files at the boundary: read, check against a schema, say at file:line:col what is wrong and what is allowed."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Iterator
from functools import lru_cache
from typing import Annotated, Any, TypeVar

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError
from pydantic_core import PydanticCustomError

from postproc.diagnostics import Diagnostic, PostprocError, Source, Span, did_you_mean
from postproc.files import is_program, is_table
from postproc.numbers import LARGEST_NUMBER

Keys = tuple[str | int, ...]
Schema = TypeVar("Schema", bound=BaseModel)

TOML_MISTAKES = {
    "Cannot declare": "a table stands twice: put its lines together under one of the two heads",
    "Cannot overwrite": "a key stands twice: take one of the two out",
    "Invalid statement": "a line is `[table]`, `key = value` or `# comment`",
    "Expected '='": "a line is `[table]`, `key = value` or `# comment`; commas stand between the values of a list",
    "Invalid value": "quotes stand around words; numbers begin with a digit, 0.49",
    "Expected newline": "one value stands on a line; numbers have a decimal point and end with a digit, 5.0",
}
"""What is commonly meant by text that is not TOML, by how the reader's message begins."""
WRITTEN_HINT = "commas stand between the values of a list, quotes around words; numbers have a decimal point"
LARGEST_TOML_BYTES = 2_000_000
"""Bytes of a TOML file: a model of a thousand fitted parameters has less than half of it."""
FARTHEST = 1e7
"""Millimetres: ten kilometres."""
MOST_FINDINGS = 50
MOST_KEY_PARTS = 50
"""Parts of a dotted key: the reader's memory grows with their square."""
_KEY = r"(?:[A-Za-z0-9_-]+|\"[^\"\n]*\"|'[^'\n]*')"
_TABLE_HEADER = re.compile(rf"[ \t]*(\[\[?)[ \t]*({_KEY}(?:[ \t]*\.[ \t]*{_KEY})*)[ \t]*\]\]?")
_DEEP = re.compile(
    rf"(?<![A-Za-z0-9_-])(?:(?:[A-Za-z0-9_-]++|\"[^\"\n]*+\"|'[^'\n]*+')[ \t]*+\.[ \t]*+){{{MOST_KEY_PARTS}}}"
)
_PAIR = re.compile(rf"[ \t]*({_KEY}(?:[ \t]*\.[ \t]*{_KEY})*)[ \t]*=[ \t]*")
MOST_CHARACTERS_SHOWN = 60  # characters of a value that does not fit
_TOKEN = re.compile(r"\"\"\".*?\"\"\"|'''.*?'''|\"(?:\\.|[^\"\\\n])*\"|'[^'\n]*'|#[^\n]*|[\[\]{}\n]", re.DOTALL)


class FileTable(BaseModel):
    """A table of a file, which may have no other keys; numbers must be finite, and neither text nor true or false."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


def _near(value: float) -> float:
    """Return a length [mm]; refuse one beyond ten kilometres, which is a mistake in the unit."""
    if abs(value) > FARTHEST:
        raise PydanticCustomError("far", f"{value:g} mm is farther than {FARTHEST / 1e6:g} km", {"help": "give mm"})
    return value


def each_once(names: list[str]) -> list[str]:
    """Return the names; refuse a list in which one occurs twice."""
    seen: set[str] = set()
    for name in names:
        if name in seen:
            raise PydanticCustomError("twice", f"`{name}` stands twice", {"help": "name each once"})
        seen.add(name)
    return names


Millimetres = Annotated[float, AfterValidator(_near)]
Positive = Annotated[float, Field(gt=0)]
Place = tuple[Millimetres, Millimetres, Millimetres]


def parse_toml(source: Source, code: str) -> dict[str, Any]:
    """Parse a TOML file.

    Args:
        code: of the finding if it cannot be parsed.

    Raises:
        PostprocError: at the place where the file is not TOML.
    """
    if len(source.data) > LARGEST_TOML_BYTES:
        text = (
            f"the file has {len(source.data) / 1e6:.1f} MB, and at most {LARGEST_TOML_BYTES / 1e6:g} are read as TOML"
        )
        raise PostprocError.of(code, text, source, help="name the file that was meant")
    try:
        text = source.data.decode("utf-8-sig")
        if deep := _DEEP.search(text):
            at = len(text[: deep.start()].encode())
            message, help_ = f"a key has more than {MOST_KEY_PARTS} parts", "give tables fewer levels"
            raise PostprocError.of(code, message, source, (at, at + 1), help_)
        return tomllib.loads(text)
    except UnicodeDecodeError as error:
        raise PostprocError.of(
            code, "the file is not UTF-8 text", source, (error.start, error.start + 1), help="save it as UTF-8"
        ) from error
    except tomllib.TOMLDecodeError as error:
        if is_table(text) or source.path.lower().endswith(".csv"):
            help_ = (
                f"`postproc fit {source.path} -o MODEL.toml` makes a model of it; tables are named without an option"
            )
            message = "this is a table of measurements, not a TOML file"
            raise PostprocError.of(code, message, source, (0, 1), help_) from error
        if is_program(text):
            help_ = "name the TOML file that was meant; programs are named without an option"
            raise PostprocError.of(code, "this is a RAPID program, not a TOML file", source, (0, 1), help_) from error
        problem = str(error)
        help_ = next((meant for start, meant in TOML_MISTAKES.items() if problem.startswith(start)), WRITTEN_HINT)
        finding = Diagnostic(code, "error", f"not TOML: {problem}", source, _error_span(source, problem), help_)
        raise PostprocError(finding) from error
    except (ValueError, RecursionError) as error:  # a number of thousands of digits, brackets a thousand deep
        message = "a number is too long" if isinstance(error, ValueError) else "brackets are nested too deep"
        raise PostprocError.of(code, f"{message} to be read", source) from error


def _error_span(source: Source, message: str) -> Span:
    """Return the byte span of the line and column that a parser's message names; without, the end of the file."""
    match = re.search(r"at line (\d+), column (\d+)", message)
    if not match:
        return len(source.data), len(source.data)
    at = source.line_starts[int(match[1]) - 1] + int(match[2]) - 1
    return at, at + 1


@lru_cache(maxsize=8)
def locate(text: str) -> dict[Keys, tuple[Span, Span]]:
    """Return the spans, in characters, of every key and of its value, by the path of keys.

    Args:
        text: of a TOML file. In a path the name of an array of [[tables]] is followed by the number of the entry.
    """
    places: dict[Keys, tuple[Span, Span]] = {}
    prefix: Keys = ()
    counts: dict[Keys, int] = {}
    at = 0
    while at < len(text):
        if header := _TABLE_HEADER.match(text, at):
            prefix = _numbered(_split(header[2]), counts, header[1] == "[[")
            places[prefix] = (header.span(2), header.span(2))
            at = header.end()
        elif pair := _PAIR.match(text, at):
            end = _value_end(text, pair.end())
            value = (
                text[pair.end() : end].split("#")[0] if "\n" not in text[pair.end() : end] else text[pair.end() : end]
            )
            places[prefix + _split(pair[1])] = (pair.span(1), (pair.end(), pair.end() + len(value.rstrip())))
            at = end
        at = text.find("\n", at) + 1
        if at == 0:
            break
    return places


def _split(dotted: str) -> Keys:
    """Split a dotted key into its parts, without quotes."""
    return tuple(part.strip("\"'") for part in re.findall(_KEY, dotted))


def _numbered(keys: Keys, counts: dict[Keys, int], entry: bool) -> Keys:
    """Return the path of a header, with the number of the [[entry]] after the name of each array.

    Args:
        counts: number of the last entry of each array so far, which is updated. entry: the header is [[double]].
    """
    path: Keys = ()
    for position, key in enumerate(keys):
        path = (*path, key)
        if entry and position == len(keys) - 1:
            counts[path] = counts.get(path, -1) + 1
        if path in counts:
            path = (*path, counts[path])
    return path


def _value_end(text: str, start: int) -> int:
    """Return the end of the value that starts here: the end of its line, outside of brackets and strings."""
    depth = 0
    for token in _TOKEN.finditer(text, start):
        if token[0] == "\n" and depth <= 0:
            return token.start()
        depth += (token[0] in ("[", "{")) - (token[0] in ("]", "}"))
    return len(text)


def span_of(source: Source, keys: Keys, value: bool = False) -> Span | None:
    """Return the byte span of a key, or of the innermost part of its path that is in the file; None if no part is.

    Args:
        keys: path of the key. value: return the span of the value in place of that of the key.
    """
    text = source.data.decode("utf-8", "replace")
    places = locate(text)
    for length in range(len(keys), 0, -1):
        if place := places.get(keys[:length]):
            start, end = place[1 if value else 0]
            before = len(text[:start].encode())
            return before, before + len(text[start:end].encode())
    return None


def check(schema: type[Schema], content: dict[str, Any], source: Source, code: str) -> Schema:
    """Validate the content of a file against a schema and return it as a value; no type is converted to another.

    Args:
        content: as `parse_toml` gives it. source: the file. code: of the findings.

    Raises:
        PostprocError: one finding for each key or value that does not fit, at its place.
    """
    try:
        # As JSON, lists may stand for tuples and nothing else for another thing; dates have no place in any file.
        checked = schema.model_validate_json(json.dumps(content, default=lambda date: [str(date)]), strict=True)
    except ValidationError as error:
        every = error.errors()[:MOST_FINDINGS]
        raise PostprocError([_finding(schema, dict(e), source, code) for e in every]) from error
    odd = [
        Diagnostic(code, "error", f"`{'.'.join(map(str, keys))}`: {text}", source, span_of(source, keys, value=True))
        for keys, value in _values(content)
        if (text := _odd(value))
    ]
    if odd:
        raise PostprocError(odd[:MOST_FINDINGS])
    return checked


def _values(content: Any, keys: Keys = ()) -> Iterator[tuple[Keys, Any]]:
    """Yield every number and text of nested content, each with the path of its keys.

    Args:
        keys: path of the content itself.
    """
    if isinstance(content, dict | list):
        for key, value in content.items() if isinstance(content, dict) else enumerate(content):
            yield from _values(value, (*keys, key))
    else:
        yield keys, content


def _odd(value: Any) -> str:
    """Say what is wrong with a value: a number too large, or a text with the character 0; else empty."""
    if isinstance(value, str):
        return "no text holds the character 0" if "\0" in value else ""
    if not isinstance(value, int | float) or abs(value) <= LARGEST_NUMBER:  # NaN is in no order
        return ""
    return f"`{str(value)[:MOST_CHARACTERS_SHOWN]}` is beyond any number of an arm"


def _finding(schema: type[BaseModel], error: dict[str, Any], source: Source, code: str) -> Diagnostic:
    """Return the diagnostic for one error of pydantic, at its key.

    Args:
        schema: of the file. error: as pydantic describes it. code: of the diagnostic.
    """
    keys: Keys = tuple(error["loc"])
    name, last = ".".join(str(k) for k in keys), keys[-1] if keys else ""
    if error["type"] == "extra_forbidden":
        key, allowed = str(last), _allowed(schema, keys[:-1])
        listed = "allowed here: " + (", ".join(f"`{a}`" for a in allowed) or "nothing")
        message, help_ = f"unknown key `{key}`", f"{did_you_mean(key, allowed)} {listed}".lstrip()
        at = span_of(source, keys)
    elif error["type"] == "missing" and isinstance(last, int):
        message, help_ = f"`{name.rpartition('.')[0]}` has too few values", f"give {last + 1} or more"
        at = span_of(source, keys[:-1], value=True)
    elif error["type"] == "missing":
        message, help_, at = f"`{name}` is missing", f"add `{last} = ..`", span_of(source, keys[:-1])
    else:
        text = error["msg"][0].lower() + error["msg"][1:].replace("array", "list").replace("an object", "a table")
        message, help_, at = f"`{name}`: {text}", _expected(error), span_of(source, keys, value=True)
    return Diagnostic(code, "error", message, source, at, help_)


def _allowed(schema: type[BaseModel], loc: Keys) -> list[str]:
    """Return the keys that the table at a path may have, sorted; empty if there is no table in the schema.

    Args:
        loc: path of keys, from the whole file.
    """
    current: type[BaseModel] | None = schema
    for key in loc:
        if isinstance(key, str) and current is not None and key in current.model_fields:
            annotation = current.model_fields[key].annotation
            inside = getattr(annotation, "__args__", ())
            candidates = [annotation, *inside, *(getattr(each, "__origin__", None) for each in inside)]  # Annotated
            current = next((c for c in candidates if isinstance(c, type) and issubclass(c, BaseModel)), None)
    if current is None:
        return []
    return sorted(field.alias or name for name, field in current.model_fields.items())


def _expected(error: dict[str, Any]) -> str:
    """Return a help text for one error of pydantic: what to give, or what was found."""
    context = error.get("ctx", {})
    if "help" in context:
        return str(context["help"])
    if "min_length" in context or "max_length" in context:
        length = context.get("min_length", context.get("max_length"))
        return f"give {length} values; there are {context.get('actual_length', 'others')}"
    value = str(error.get("input"))
    return f"found `{value if len(value) <= MOST_CHARACTERS_SHOWN else value[:MOST_CHARACTERS_SHOWN] + '..'}`"
