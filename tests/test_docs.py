"""The documentation: short paragraphs, links that lead somewhere, commands that run as they stand there."""

from __future__ import annotations

import doctest
import importlib.util
import re
import runpy
import sys
import tomllib
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from types import ModuleType

import pytest
from jsonschema import Draft202012Validator
from markdown_it import MarkdownIt

from postproc.cli.look_up.schemas import schema_of
from tests.conftest import ROOT

DOCS = ROOT / "docs"
PAGES = sorted(
    page for page in [*DOCS.rglob("*.md"), *ROOT.glob("*.md")] if not {"_build", "_generated"} & set(page.parts)
)
PROSE = [page for page in PAGES if page.name != "CHANGELOG.md"]
MOST_LINES, WIDTH = 5, 140
IDS = {"ids": lambda page: page.relative_to(ROOT).as_posix()}


sys.path.insert(0, str(DOCS))  # scripts of the documentation import each other


def script(name: str) -> ModuleType:
    """A script of the documentation, which is no package."""
    if name not in sys.modules:
        spec = importlib.util.spec_from_file_location(name, DOCS / f"{name}.py")
        assert spec is not None and spec.loader is not None
        sys.modules[name] = module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
    return sys.modules[name]


def runs(page: Path) -> bool:
    """Whether a page shows commands that are run here: those of the tutorials run where these are built, by `make docs`."""
    built = page.parent == DOCS and page.stem in script("generate").TUTORIALS
    return not built and any(not block.not_run for block in script("blocks").read_blocks(page))


def test_paragraphs_have_at_most_five_lines() -> None:
    """Items of lists, too; a line that is longer than the screen counts as several."""
    long = []
    for page in PROSE:
        lines = page.read_text("utf-8").splitlines()
        for token in MarkdownIt("commonmark").enable("table").parse("\n".join(lines)):
            if token.type == "inline" and token.map is not None and token.level <= 5:
                inside = lines[slice(*token.map)]
                size = sum(-(-len(line) // WIDTH) for line in inside)
                if not inside[0].lstrip().startswith("|") and size > MOST_LINES:
                    long.append((page.name, token.map[0] + 1, inside[0]))
    assert long == []


@cache
def anchors(page: Path) -> set[str]:
    """What headings of a page are called in links."""
    if page.parent.name == "_generated":
        text = script("generate").PAGES[page.stem]()
    else:
        text = page.read_text("utf-8")
    return {
        re.sub(r"[^\w\- ]", "", heading.lower()).strip().replace(" ", "-")
        for heading in re.findall(r"^#+ (.+?)\s*$", text, re.M)
    }


def test_links_lead_somewhere() -> None:
    generated = {f"{name}.md" for name in script("generate").PAGES}
    for page in PAGES:
        text = re.sub(r"^```.*?^```$", "", page.read_text("utf-8"), flags=re.M | re.S)
        for target in re.findall(r"\]\((?![a-z]+:)([^)\s]+)\)", text):
            name, _, anchor = target.partition("#")
            file = (page.parent / name).resolve() if name else page
            if file.parent == DOCS / "_generated" and file.suffix == ".md":
                assert file.name in generated, (page, target)
            elif DOCS / "_generated" not in file.parents:  # what the build draws, Sphinx itself misses
                assert file.exists(), (page, target)
            assert not anchor or anchor in anchors(file), (page, target)


@pytest.mark.parametrize("page", [page for page in PAGES if runs(page)], **IDS)
def test_commands_run_as_they_stand(page: Path, tmp_path: Path) -> None:
    every = list(script("blocks").run_page(page, tmp_path))
    for ran in every:
        assert ran.code == ran.expected, f"{page.name}: `{ran.line}`\n{ran.output}"
    if page in EFFECT_PAGES:
        takes_the_error_to_the_noise(page, {one.line: one.output for one in every})


EFFECT_PAGES = (DOCS / "my-effect.md", ROOT / "CONTRIBUTING.md")
"""Pages that add an effect of one's own."""


def takes_the_error_to_the_noise(page: Path, ran: Mapping[str, str]) -> None:
    """What `add` prints, by the line of the page, says that the effect takes the error to the noise."""
    (said,) = (output for line, output in ran.items() if line.startswith("postproc add") and "gear_step.py" in line)
    fell = re.search(r"the error falls from ([\d.]+) to ([\d.]+) mm per axis; the noise is ([\d.]+) mm", said)
    assert fell is not None, said
    before, after, noise = map(float, fell.groups())
    assert before > 3 * noise and after < 1.1 * noise
    assert page.name == "CONTRIBUTING.md" or f"falls from {fell[1]} to {fell[2]}" in page.read_text("utf-8")


def test_figures_of_the_pages_are_made_by_runs() -> None:
    """`make docs` compares them; here each name has a maker, and each maker a page."""
    used = {name for page in PAGES for name in script("blocks").made_names(page.read_text("utf-8"))}
    assert used == {*script("made").MADE}


def test_what_commands_print_is_compared_where_the_pages_are_built() -> None:
    shown = {page.stem for page in PAGES if "<!-- output " in page.read_text("utf-8")}
    assert shown == {*script("generate").TUTORIALS}


def test_blocks_that_are_not_run_say_why() -> None:
    why = [block.not_run for page in PAGES for block in script("blocks").read_blocks(page) if block.not_run]
    assert all(len(reason.split()) > 3 for reason in why)


def test_the_page_of_the_python_api_is_a_doctest(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "samples").symlink_to(ROOT / "samples")
    monkeypatch.chdir(tmp_path)
    found = doctest.testfile(str(DOCS / "api.md"), module_relative=False, optionflags=doctest.NORMALIZE_WHITESPACE)
    assert found.attempted > 15 and found.failed == 0


def test_the_seam_of_the_readme_says_what_the_package_says_today() -> None:
    text = re.compile(r"<text[^>]*>([^<]*)</text>")
    draw = runpy.run_path(str(DOCS / "figures" / "draw_seam.py"))["draw"]
    assert text.findall(draw()) == text.findall((DOCS / "figures" / "seam.svg").read_text("utf-8"))


def test_pages_for_users_name_no_revisions_and_no_files_of_the_package() -> None:
    """What a user reads does not change with the package's files; the page of evidence names the commands that make it."""
    contents = re.findall(r"^:caption: ([^\n]+)\n(.*?)^```", (DOCS / "index.md").read_text("utf-8"), re.M | re.S)
    names = [name for caption, list_ in contents if caption != "How it works" for name in list_.split()]
    pages = [DOCS / f"{name}.md" for name in ["index", *names] if re.fullmatch(r"[a-z-]+", name) and name != "how-good"]
    files = "|".join(re.escape(path.name) for path in (ROOT / "postproc").rglob("*.py"))
    revision = r"\b(?=[0-9]*[a-f])(?=[a-f]*[0-9])[0-9a-f]{7,40}\b"
    inner = re.compile(rf"{revision}|\btests?[./][a-z_]\w*|postproc/\w[\w/]*\.py|`(?:{files})`")
    found = {}
    for page in [ROOT / "README.md", *pages, *(DOCS / "diagnostics").glob("*.md")]:
        prose = re.sub(r"^```.*?^```", "", page.read_text("utf-8"), flags=re.M | re.S)
        found[page.name] = inner.findall(prose)
    assert len(found) > 30
    assert {name: words for name, words in found.items() if words} == {}


def test_every_page_stands_in_the_contents() -> None:
    """Sphinx says so, too; here it is told without it."""
    listed = set()
    for page in DOCS.glob("*.md"):
        for tree in re.findall(r"^```\{toctree\}\n(.*?)^```", page.read_text("utf-8"), re.M | re.S):
            listed |= {*re.findall(r"^([\w-]+)$", tree, re.M)}
    assert {page.stem for page in DOCS.glob("*.md")} - listed == {"index"}


@pytest.mark.parametrize(
    ("page", "kind"),
    [
        ("model.md", "model"),
        ("commands.md", "settings"),
        ("batch.md", "jobs"),
        ("measure.md", "columns"),
        ("my-table.md", "columns"),
        ("other-tools.md", "model"),
    ],
)
def test_the_file_that_a_page_shows_fits_its_schema(page: str, kind: str) -> None:
    shown = re.findall(r"^```toml\n(.*?)^```", (DOCS / page).read_text("utf-8"), re.M | re.S)
    wrong = [error.message for error in Draft202012Validator(schema_of(kind)).iter_errors(tomllib.loads(shown[0]))]
    assert wrong == []
