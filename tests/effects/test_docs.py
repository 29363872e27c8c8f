"""The pages about effects say what the code does."""

import re
import runpy
import tomllib
from pathlib import Path

import pytest

from postproc.effects.loading import load_effect_file
from postproc.effects.registry import BUILT_IN, effect_library

ROOT = Path(__file__).parents[2]


def shown(page: str, language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", (ROOT / page).read_text(encoding="utf-8"), re.DOTALL)


def test_the_generated_page_has_a_section_for_each_effect(monkeypatch):
    monkeypatch.syspath_prepend(ROOT / "docs")  # scripts of the documentation import each other
    page = runpy.run_path(str(ROOT / "docs/generate.py"))["effects_page"]()
    assert re.findall(r"^## (\w+)$", page, re.M) == [cls.key for cls in BUILT_IN]


@pytest.mark.parametrize(
    ("page", "keys"),
    [("docs/effects.md", ["gear_step", "base_lean", "loose_tool"]), ("CONTRIBUTING.md", ["gear_step"])],
)
def test_the_effects_shown_on_the_page_pass_the_kit(page, keys, tmp_path):
    for key, code in zip(keys, shown(page, "python"), strict=True):
        assert len([line for line in code.splitlines() if line.strip()]) <= 15
        path = tmp_path / f"{key}.py"
        path.write_text(code, encoding="utf-8")
        assert [cls.key for cls in load_effect_file(path)] == [key]


def test_toml_example_is_a_model():
    (text,) = shown("docs/effects.md", "toml")
    library = effect_library()
    assert all(library[key].problems(table) == [] for key, table in tomllib.loads(text)["effects"].items())
