"""Templates of the user's folder, and templates that are wrong."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from postproc.render.templates import environment
from tests.build import body_of, convert, module, refused, target, written
from tests.rapid.build import program

TEXT = module("", f"MoveJ {target(1350, -500)},v200,fine,tT;\nMoveL {target(1350, -20)},v50,fine,tT;")
SHIPYARD = "{{ indent }}! Shipyard 7, {{ robot }}, {{ added }} added\n! postproc {{ version }}: compensated\n"
STATEMENT = "{{ statement.instruction }}{% for a in statement.arguments %}{{ a.lead }}{{ a.text }}{% endfor %};"
TRANS = "{% for v in target.pose.trans %}{{ '%.5f' | format(v) }}{{ ',' if not loop.last }}{% endfor %}"
OTHERS = "[{{ target.pose.rot | quaternion | join(', ') }}],[{{ target.robconf | join(',') }}],[{{ target.extax | axes | join(',') }}]"
PARTS = "{% for part in parts %}{{ part }}{% endfor %}"
CHANGED = [  # a template, its text, and the pattern that it makes, once or for each added target
    ("header.j2", SHIPYARD, r"MODULE M\n *! Shipyard 7, irb4600_60_205, [1-9]\d* added\n! postproc"),
    ("header.j2", "! postproc {{ version }}: compensated – Ωλ ✓ für Blech\n", r": compensated \? \?\? \? für Blech\n"),
    ("module.j2", f"! Shipyard 7\n{PARTS}", r"^! Shipyard 7\n"),
    ("module.j2", f"{PARTS}! Shipyard 7\n", r"ENDMODULE\n! Shipyard 7$"),
    ("statement.j2", f"{STATEMENT} ! added", r"tT; ! added\n"),
    ("statement.j2", f"{STATEMENT} ! → added", r"tT; ! \? added\n"),  # Latin-1 has no arrow
    ("target.j2", f"[[{TRANS}],{OTHERS}]", r"MoveL \[\[[\d.]+\.\d{5},"),
]


@pytest.mark.parametrize(("name", "text", "pattern"), CHANGED)
def test_a_template_of_the_folder_replaces_the_shipped_one(tmp_path: Path, name: str, text: str, pattern: str) -> None:
    (tmp_path / name).write_text(text, encoding="utf-8")
    result = convert(TEXT, template_dir=tmp_path)
    once = name in ("header.j2", "module.j2")
    assert len(re.findall(pattern, written(result))) == (1 if once else result.report["added_targets"]) > 0
    assert result.exit_code == 0 and result.report["max_error_after_mm"] <= 0.01
    assert not program(written(result)).diagnostics
    assert ("! lines and arcs " in written(result)) == (name != "header.j2")
    assert (body_of(written(result)) == body_of(written(convert(TEXT)))) == once


@pytest.mark.parametrize("name", ["nowhere", "header.j2"])
def test_what_is_no_folder_of_templates_is_refused(tmp_path: Path, name: str) -> None:
    (tmp_path / "header.j2").write_text("")
    [finding] = refused(lambda: convert(TEXT, template_dir=tmp_path / name))
    assert (finding.code, finding.message) == ("REN001", f"template folder `{tmp_path / name}` does not exist")
    assert finding.help.startswith("give --template a folder with any of target.j2, displaced.j2,")


WRONG_IN_ANY = [
    "{% for x in %}",  # not Jinja
    "{{ nothing_of_this_name }}",  # not a value
    "{{ parts | no_such_filter }}{{ target }}",
    "{{ version.nothing }}{{ target.nothing }}{{ statement.nothing }}{{ parts.nothing }}",
    "{% include 'elsewhere.j2' %}",
]
BROKEN = [(f"{name}.j2", text) for name in ("target", "statement", "header", "module") for text in WRONG_IN_ANY] + [
    ("target.j2", "{{ 1 / 0 }}"),
    ("target.j2", "{{ target.pose.trans + 1 }}"),
    ("target.j2", "{{ '%d' | format('x') }}"),
    ("header.j2", "{{ version.__class__.__mro__[1].__subclasses__() }}"),  # nothing beyond its values
    ("header.j2", "! postproc {{ version }}: compensated f\xfcr Blech"),  # not UTF-8
]


@pytest.mark.parametrize(("name", "text"), BROKEN)
def test_a_broken_template_is_named(tmp_path: Path, name: str, text: str) -> None:
    (tmp_path / name).write_bytes(text.encode("latin-1"))
    [finding] = refused(lambda: convert(TEXT, template_dir=tmp_path))
    assert finding.code == "REN002" and name in finding.message and finding.help


def test_the_message_of_a_broken_template_names_its_line(tmp_path: Path) -> None:
    (tmp_path / "header.j2").write_text("! line 1\n{{ version }\n")
    [finding] = refused(lambda: convert(TEXT, template_dir=tmp_path))
    assert finding.message == "template `header.j2` line 2 cannot be rendered: unexpected '}'"
    assert finding.help == "compare it with the shipped template of the same name"


def test_templates_are_read_again_when_the_folder_changes(tmp_path: Path) -> None:
    assert environment(tmp_path) is environment(tmp_path)
    for text in ("first", "second, longer"):
        (tmp_path / "header.j2").write_text(f"{{{{ indent }}}}! {text}\n")
        assert f"! {text}\n" in written(convert(TEXT, template_dir=tmp_path))
