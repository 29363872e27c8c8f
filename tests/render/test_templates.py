"""Templates of the user's own, and templates that are wrong."""

from __future__ import annotations

from pathlib import Path

import pytest

from postproc.diagnostics import PostprocError, Source
from postproc.rapid.program.program import read_program
from postproc.render.templates import environment
from tests.build import body_of, convert, module, target, written

TEXT = module(
    "",
    f"MoveJ {target(1350, -500)},v200,fine,tT;\nMoveL {target(1350, -20)},v50,fine,tT;",
)


def fails(folder: Path) -> PostprocError:
    with pytest.raises(PostprocError) as caught:
        convert(TEXT, template_dir=folder)
    return caught.value


def test_a_template_of_the_users_own_replaces_the_shipped_one(tmp_path: Path) -> None:
    (tmp_path / "header.j2").write_text(
        "{{ indent }}! Shipyard 7, {{ robot }}, {{ added }} added\n! postproc {{ version }}: compensated\n"
    )
    text = written(convert(TEXT, template_dir=tmp_path))
    lines = text.splitlines()
    assert lines[1].lstrip().startswith("! Shipyard 7, irb4600_60_205, ")
    assert "deviation along" not in text
    assert body_of(text) == body_of(written(convert(TEXT)))


def test_a_statement_template_may_mark_what_was_added(tmp_path: Path) -> None:
    shipped = "{{ statement.instruction }}{% for a in statement.arguments %}{{ a.lead }}{{ a.text }}{% endfor %};"
    (tmp_path / "statement.j2").write_text(shipped + " ! added")
    found = convert(TEXT, template_dir=tmp_path)
    marked = [line for line in body_of(written(found)) if line.endswith("! added")]
    assert len(marked) == found.report["added_targets"] > 0


def test_a_target_template_may_write_more_decimals(tmp_path: Path) -> None:
    (tmp_path / "target.j2").write_text(
        "[[{% for v in target.pose.trans %}{{ '%.5f' | format(v) }}{{ ',' if not loop.last }}{% endfor %}],"
        "[{{ target.pose.rot | quaternion | join(', ') }}],[{{ target.robconf | join(',') }}],[{{ target.extax | axes | join(',') }}]]"
    )
    found = convert(TEXT, template_dir=tmp_path)
    assert found.report["max_error_after_mm"] <= 0.01
    added = body_of(written(found))[1]
    assert len(added.split("[[")[1].split(",")[0].partition(".")[2]) == 5


@pytest.mark.parametrize("name", ["nowhere", "header.j2"])
def test_what_is_no_folder_of_templates_is_refused(tmp_path: Path, name: str) -> None:
    (tmp_path / "header.j2").write_text("")
    found = fails(tmp_path / name).diagnostics[0]
    assert found.code == "REN001" and name in found.message and found.help


ANYWHERE = [
    "{% for x in %}",  # not Jinja
    "{{ nothing_of_this_name }}",  # not a value
    "{{ parts | no_such_filter }}{{ target }}",
    "{{ version.nothing }}{{ target.nothing }}{{ statement.nothing }}{{ parts.nothing }}",
    "{% include 'elsewhere.j2' %}",
]
BROKEN = [(name, text) for name in ("target.j2", "statement.j2", "header.j2", "module.j2") for text in ANYWHERE] + [
    ("target.j2", "{{ 1 / 0 }}"),
    ("target.j2", "{{ target.pose.trans + 1 }}{{ statement + 1 }}{{ version + 1 }}{{ parts + 1 }}"),
    ("target.j2", "{{ '%d' | format('x') }}"),
    ("header.j2", "{{ version.__class__.__mro__[1].__subclasses__() }}"),  # nothing beyond its values
    ("header.j2", "! postproc {{ version }}: compensated f\xfcr Blech"),  # not UTF-8
]


@pytest.mark.parametrize(("name", "text"), BROKEN)
def test_a_broken_template(tmp_path: Path, name: str, text: str) -> None:
    (tmp_path / name).write_bytes(text.encode("latin-1"))
    found = fails(tmp_path).diagnostics[0]
    assert found.code == "REN002"
    assert name in found.message and found.help


def test_letters_that_rapid_does_not_have(tmp_path: Path) -> None:
    """A module is written in Latin-1: letters beyond it in a comment are replaced, not fatal."""
    (tmp_path / "header.j2").write_text("! postproc {{ version }}: compensated – Ωλ ✓ für Blech\n", encoding="utf-8")
    text = written(convert(TEXT, template_dir=tmp_path))
    assert "für Blech" in text
    assert not [d for d in read_program([Source("m.mod", text.encode("latin-1"))]).diagnostics if d.severity == "error"]


@pytest.mark.parametrize("where", ["first", "last"])
def test_a_module_template_may_add_lines(tmp_path: Path, where: str) -> None:
    note = {"first": "! Shipyard 7\n{P}", "last": "{P}! Shipyard 7\n"}[where]
    (tmp_path / "module.j2").write_text(note.replace("{P}", "{% for part in parts %}{{ part }}{% endfor %}"))
    found = convert(TEXT, template_dir=tmp_path)
    assert found.exit_code == 0
    assert "! Shipyard 7" in written(found)
    assert found.report["max_error_after_mm"] <= 0.01


def test_letters_beyond_latin_1_in_an_added_statement(tmp_path: Path) -> None:
    (tmp_path / "statement.j2").write_text(
        "{{ statement.instruction }}{% for a in statement.arguments %}{{ a.lead }}{{ a.text }}{% endfor %}; ! → added",
        encoding="utf-8",
    )
    assert convert(TEXT, template_dir=tmp_path).exit_code == 0


def test_templates_are_read_once_while_the_folder_has_the_same_files(tmp_path: Path) -> None:
    before = environment(tmp_path)
    assert environment(tmp_path) is before
    (tmp_path / "header.j2").write_text("{{ indent }}! mine\n")
    assert environment(tmp_path) is not before
    assert "! mine" in written(convert(TEXT, template_dir=tmp_path))
    (tmp_path / "header.j2").write_text("{{ indent }}! mine again\n")
    assert "! mine again" in written(convert(TEXT, template_dir=tmp_path))
