"""The pages about effects say what the code does."""

import re
import runpy
from pathlib import Path

import pytest

from postproc.effects import registry
from postproc.effects.loading import load_effect_file

ROOT = Path(__file__).parents[2]


def test_the_generated_page_has_a_section_for_each_effect():
    page = runpy.run_path(str(ROOT / "docs/generate.py"))["effects_page"]()
    assert re.findall(r"^## (\w+)$", page, re.M) == [cls.key for cls in registry.BUILT_IN]


@pytest.mark.parametrize(
    ("page", "keys"), [("docs/effects.md", ["gear_step", "loose_tool"]), ("CONTRIBUTING.md", ["gear_step"])]
)
def test_the_effects_shown_on_the_page_pass_the_kit(page, keys, tmp_path):
    shown = re.findall(r"```python\n(.*?)```", (ROOT / page).read_text(encoding="utf-8"), re.DOTALL)
    for key, code in zip(keys, shown, strict=True):
        assert len([line for line in code.splitlines() if line.strip()]) <= 15
        path = tmp_path / f"{key}.py"
        path.write_text(code)
        (cls,) = load_effect_file(path)
        assert cls.key == key


def test_toml_example_is_a_model():
    import tomllib

    (text,) = re.findall(r"```toml\n(.*?)```", (ROOT / "docs/effects.md").read_text(encoding="utf-8"), re.DOTALL)
    library = registry.effect_library()
    for key, table in tomllib.loads(text)["effects"].items():
        assert library[key].problems(table) == []
