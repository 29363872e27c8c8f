"""JSON Schemas of the files that people write, from the declarations by which they are read: the two cannot drift."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from pydantic import BaseModel
from pydantic.json_schema import GenerateJsonSchema, JsonSchemaValue
from pydantic_core.core_schema import ModelSchema

from postproc.batch.jobsfile import JobsFile
from postproc.effects.base import Effect
from postproc.effects.parameters import Parameter, Structure
from postproc.effects.registry import effect_library
from postproc.measure.read.layout import ColumnMap
from postproc.model.file import ModelFile
from postproc.robot.catalogue import RobotFile
from postproc.settings_files import SettingsFile
from postproc.user_options import described

DRAFT = "https://json-schema.org/draft/2020-12/schema"
NUMBER: dict[str, Any] = {"type": "number"}
TYPES: Mapping[str, type | tuple[type, ...]] = {"integer": int, "number": (int, float), "string": str}


def schema_of(kind: str) -> dict[str, Any]:
    """Return the JSON Schema (draft 2020-12) of one kind of file, a key of `SCHEMA_KINDS`.

    Raises:
        KeyError: there is no such kind.
    """
    declared, title = SCHEMA_KINDS[kind]
    schema = declared.model_json_schema(by_alias=True, schema_generator=_DescribedSchema)
    if declared is ModelFile:
        # As the effects declare it; other keys may hold anything.
        known = {key: _effect(cls) for key, cls in effect_library().items()}
        unknown = {"type": "object", "description": "an effect of your own (`--effects FILE.py`)"}
        schema["properties"]["effects"] = {"type": "object", "properties": known, "additionalProperties": unknown}
    return {"$schema": DRAFT, **schema, "title": title}


class _DescribedSchema(GenerateJsonSchema):
    """Makes schemas in which each key has the description that the docstring of its class, or of a base, gives it."""

    def model_schema(self, schema: ModelSchema) -> JsonSchemaValue:
        """Return the schema of a table, with descriptions of its keys from the ``Args`` of its class and bases."""
        part = super().model_schema(schema)
        cls: type[BaseModel] = schema["cls"]
        bases = [base for base in reversed(cls.__mro__) if issubclass(base, BaseModel)]
        if bases[-1].__doc__:
            part["description"] = bases[-1].__doc__.partition("\n")[0]
        texts = {name: text for base in bases for name, text in described(base).items()}
        for name, declared in cls.model_fields.items():
            if name in texts:
                part["properties"][declared.alias or name]["description"] = " ".join(texts[name].split())
        return part


def _effect(cls: type[Effect]) -> dict[str, Any]:
    """Return the schema of an effect's table."""
    keys = {name: _structure(declared, getattr(cls, name)) for name, declared in cls.structures().items()}
    keys |= {name: _parameter(declared) for name, declared in cls.parameters().items()}
    return {"type": "object", "description": cls.title, "properties": keys, "additionalProperties": False}


def _parameter(declared: Parameter) -> dict[str, Any]:
    """Return the schema of a parameter: a number, or nested lists as deep as its shape.

    Lengths that a structural field gives stay open.
    """
    entry = NUMBER | _limits(np.min(declared.low), np.max(declared.high))
    for length in reversed(declared.shape):
        sized = {"minItems": length, "maxItems": length} if isinstance(length, int) else {}
        entry = {"type": "array", "items": entry, **sized}
    return {**entry, "description": f"[{declared.unit}]"}


def _structure(declared: Structure, default: object) -> dict[str, Any]:
    """Return the schema of a structural choice: an enumeration, a value, or a list for a tuple.

    Args:
        default: its value by default, which tells the type.
    """
    if declared.choices:
        return {"enum": list(declared.choices)}
    values = default if isinstance(default, tuple) else (default,)
    kind = next(name for name, types in TYPES.items() if all(isinstance(value, types) for value in values))
    entry = {"type": kind, **_limits(declared.low, declared.high)}
    return {"type": "array", "items": entry} if isinstance(default, tuple) else entry


def _limits(low: float, high: float) -> dict[str, float]:
    """Return the keywords ``minimum`` and ``maximum`` of JSON Schema, without limits that are infinite."""
    named = {"minimum": float(low), "maximum": float(high)}
    return {name: value for name, value in named.items() if np.isfinite(value)}


SCHEMA_KINDS: Mapping[str, tuple[type[BaseModel], str]] = {
    "model": (ModelFile, "model of a real arm"),
    "settings": (SettingsFile, "postproc.toml"),
    "jobs": (JobsFile, "jobs of a batch"),
    "columns": (ColumnMap, "column map of a measurement table"),
    "robot": (RobotFile, "nominal arm"),
}
"""Each kind of file: how it is read, and its name for people."""
