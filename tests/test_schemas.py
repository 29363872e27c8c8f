"""JSON Schemas of the files that people write accept and refuse what the readers do."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import pytest
import tomlkit
from jsonschema import Draft202012Validator

import postproc
from postproc.cli.look_up.schemas import SCHEMA_KINDS, schema_of
from postproc.diagnostics import Source
from postproc.model.file import parse_model, read_model
from tests.build import refused
from tests.conftest import ROOT

MODEL = {"robot": "irb4600_60_205", "effects": {"backlash": {"half_gap_rad": [0, 1e-4, 0, 0, 0, 0]}}}


@pytest.mark.parametrize("kind", SCHEMA_KINDS)
def test_schemas_are_schemas_in_which_every_key_says_what_it_means(kind: str) -> None:
    schema = schema_of(kind)
    Draft202012Validator.check_schema(schema)
    parts = [schema, *schema.get("$defs", {}).values()]
    keys = {key: value for part in parts for key, value in part.get("properties", {}).items()}
    assert [key for key, value in keys.items() if not value.get("description") and key != "effects"] == []


def accepted(kind: str, content: dict[str, Any]) -> bool:
    return not list(Draft202012Validator(schema_of(kind)).iter_errors(content))


def parsed(content: dict[str, Any]) -> object:
    return parse_model(Source("m.toml", tomlkit.dumps(content).encode())).effects


def test_schemas_accept_what_the_program_reads() -> None:
    for path in (*(ROOT / "samples/models").glob("*.toml"), *(ROOT / "postproc/robot/arms").glob("*.toml")):
        content = tomllib.loads(path.read_text("utf-8"))
        assert accepted("model" if "effects" in content else "robot", content), path
    assert accepted("settings", tomllib.loads((ROOT / "samples" / "postproc.toml").read_text("utf-8")))
    assert accepted("columns", {"columns": {"x_mm": "X", "q1_deg": {"name": "A1", "sign": -1}}, "separator": ";"})
    assert accepted("jobs", {"tolerance_mm": 0.01, "job": [{"folder": "a", "model": "b.toml"}]})
    assert accepted("model", MODEL) and parsed(MODEL)


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("robto", "ur5"),
        ("stiffness_source", "guessed"),
        ("effects", {"backlash": {"half_gap": [0, 0, 0, 0, 0, 0]}}),
        ("effects", {"backlash": {"half_gap_rad": [0, 0, 0]}}),
        ("effects", {"backlash": {"half_gap_rad": [0, -1e-4, 0, 0, 0, 0]}}),
        ("effects", {"nonlinear_compliance": {"law": "none"}}),
        ("fit", {"covariance": 3}),
    ],
)
def test_schema_and_reader_refuse_the_same(key: str, value: object) -> None:
    wrong = {**MODEL, key: value}
    assert not accepted("model", wrong)
    assert refused(lambda: parsed(wrong))


def test_a_fitted_model_fits_its_schema(tmp_path: Path) -> None:
    data = postproc.read_measurements(ROOT / "samples/measurements/simulated_backlash.csv", "irb4600_60_205")
    fit = postproc.fit(data, "irb4600_60_205", (*postproc.BASE, "backlash", "transmission_error"))
    postproc.write_model(tmp_path / "cell.toml", fit)
    assert postproc.text(fit).startswith("The model misses")
    assert accepted("model", tomllib.loads((tmp_path / "cell.toml").read_text("utf-8")))
    assert {effect.key for effect in read_model(tmp_path / "cell.toml").effects} >= {"backlash", "transmission_error"}
