"""``runtime write`` and ``check``."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from .conftest import Call


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("runtime")


@pytest.fixture
def module(folder: Path, call: Call) -> Path:
    path = folder / "ppModel.sys"
    if not path.exists():
        result = call("runtime", "write", "-o", path, "--force", "200,-200,-200", "--tcp", "0,0,350")
        assert result.code == 0
        assert "largest error 0.000" in result.err
    return path


def test_the_header_says_what_the_module_is_made_for(module: Path) -> None:
    head = module.read_text("ascii").partition("TASK PERS")[0]
    for words in (
        "MODULE ppModel(SYSMODULE)",
        "arm: irb4600_60_205",
        "corrected: joint_compliance",
        "process force where Weld is given [N]: [200,-200,-200]",
        "region of axis 3 [deg]: -180 to 75",
        "with 60 kg, over",
        "one target takes 1",
    ):
        assert words in head


def test_a_written_module_is_checked(module: Path, call: Call) -> None:
    result = call("runtime", "check", module, "--json", "--targets", "50")
    assert result.code == 0
    (check,) = json.loads(result.out)["checks"]
    assert check["corrected"] + sum(check["returned"].values()) == 50
    assert check["errors"] == 0
    assert check["max_error_mm"] < 0.001


def test_an_edited_module_is_found_out(module: Path, folder: Path, call: Call) -> None:
    text = module.read_text("ascii")
    edited = folder / "edited.sys"
    edited.write_text(text.replace(",1.7257766E-05,", ",1.9E-05,"), "ascii")
    assert edited.read_text("ascii") != text
    result = call("runtime", "check", edited, "--targets", "20")
    assert result.code == 1


def test_an_error_that_leaves_the_function_is_found(module: Path, folder: Path, call: Call) -> None:
    text = module.read_text("ascii").replace("ppReason:=2;", "ppReason:=2/ppCorrectedCount;", 1)
    guarded, careless = folder / "guarded.sys", folder / "careless.sys"
    guarded.write_text(text, "ascii")
    careless.write_text(
        text.replace("ERROR\n        RETURN FALSE;", "").replace("ERROR\n        RETURN p;", ""), "ascii"
    )
    said = {}
    for path in (guarded, careless):
        result = call("runtime", "check", path, "--targets", "10", "--json")
        assert result.code == 1
        said[path] = json.loads(result.out)["checks"][0]["errors"]
    assert said == {guarded: 0, careless: 10}


@pytest.mark.parametrize(
    ("statement", "words"),
    [
        ("WaitTime 1;", "`waittime` is not calculated here"),
        ("WHILE TRUE DO ENDWHILE", "this statement is not calculated here"),
        ("ppReason:=nowhere;", "`nowhere` is not declared in these files"),
        ("ppReason:=CRobT();", "`CRobT` is known only at run time"),
        ("mass:=t+1;", "`+` has no value for these operands"),
    ],
)
def test_what_is_not_calculated_is_named_with_its_place(
    module: Path, folder: Path, call: Call, statement: str, words: str
) -> None:
    edited = folder / "edited_here.sys"
    edited.write_text(module.read_text("ascii").replace("ppReason:=2;", statement, 1), "ascii")
    result = call("runtime", "check", edited)
    assert result.code == 2
    line = edited.read_text("ascii").partition(statement)[0].count("\n") + 1
    assert f"edited_here.sys:{line}:" in result.err
    assert f"error[RUN003]: {words}" in result.err
