"""The shape of the package: rooms import downward only, starting up is cheap, every diagnostic is explained."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
PACKAGE = ROOT / "postproc"
FOUNDATION = {
    *("__main__", "arrays", "diagnostics", "excerpt", "files", "grouping", "numbers"),
    *("process", "tomlfile", "watch"),
}
ROOMS = (
    "rapid",
    "robot",
    "effects",
    "model",
    "motion",
    "compensation",
    "measure",
    "estimation",
    "patterns",
    "identification",
    "render",
    "runtime",
    "convert",
    "settings",
    "choices",
    "report",
    "results",
    "batch",
    "schemas",
    "cli",
    "testing",
)
HEAVY = {"numpy", "scipy", "pinocchio", "toppra", "ruckig", "playwright", "pydantic", "jinja2", "tomlkit", "matplotlib"}
MODULES = sorted(PACKAGE.rglob("*.py"))


def imported(path: Path) -> set[str]:
    """Names of the package's modules that a file imports, anywhere in it."""
    names: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative import"
            names.add(node.module or "")
            names |= {f"{node.module}.{alias.name}" for alias in node.names}
    return {name for name in names if name.split(".")[0] == "postproc"}


def room(name: str) -> str:
    parts = name.split(".")
    return parts[1] if len(parts) > 1 else ""


@pytest.mark.parametrize("path", MODULES, ids=lambda p: p.relative_to(PACKAGE).as_posix())
def test_imports_point_downward(path: Path) -> None:
    own = path.relative_to(PACKAGE).with_suffix("").parts[0]
    if own == "__init__":
        return  # the API: it names what it gives, and loads it where it is called
    for name in imported(path):
        used = room(name)
        if used in FOUNDATION or used not in ROOMS or own == "__main__":
            continue
        assert own in ROOMS, f"{own} is the foundation and imports {name}"
        assert ROOMS.index(used) <= ROOMS.index(own), f"{own} imports {name}, which stands above it"


# Folders and files inside a room, in the order in which they may use each other; what a room does not name is free.
FLOORS = {
    "rapid": ("unknown", "syntax", "data", "program", "evaluation", "flow", "motions", "execution", "diff"),
    "motion": ("mounts", "values", "findings", "path", "timing", "smoothing"),
    "compensation": (
        *("options", "tolerances", "path", "correction", "reading", "text", "plan"),
        *("readback", "results", "worlds"),
    ),
    "cli": ("report", "options", "conversion", "programs", "convert", "app"),
    "effects": ("contract", "findings", "parameters", "modules", "files", "base", "conformance", "library", "registry"),
    "measure": ("observations", "measurements", "alignment", "clock", "trajectory", "iso9283", "read"),
    "estimation": ("errors", "problem", "linear", "solution", "leftover", "fitted", "recorded", "findings"),
    "identification": ("candidates", "state", "diagnosis", "interventions"),
    "report": ("blocks", "document", "drawing", "page"),
    "runtime": ("conditions", "tables", "module", "proof", "written", "programs"),
}


@pytest.mark.parametrize("path", MODULES, ids=lambda p: p.relative_to(PACKAGE).as_posix())
def test_folders_of_a_room_import_downward(path: Path) -> None:
    room_name, *inside = path.relative_to(PACKAGE).with_suffix("").parts
    floors = FLOORS.get(room_name, ())
    if not inside or inside[0] not in floors:
        return
    for name in imported(path):
        parts = name.split(".")
        if parts[1:2] == [room_name] and len(parts) > 2 and parts[2] in floors:
            used, own = floors.index(parts[2]), floors.index(inside[0])
            assert used <= own, f"{room_name}/{inside[0]} imports {name}, which stands above it"


def test_every_folder_is_a_known_room() -> None:
    assert {p.name for p in PACKAGE.iterdir() if (p / "__init__.py").exists()} <= set(ROOMS)


def test_package_inits_hold_nothing() -> None:
    for path in PACKAGE.glob("*/__init__.py"):
        body = ast.parse(path.read_text("utf-8")).body
        assert all(isinstance(node, ast.Expr) for node in body), f"{path} does more than say what it is"


def test_the_command_line_starts_without_heavy_libraries() -> None:
    code = "import sys; from postproc.cli.app import build; build(); print(*{m.split('.')[0] for m in sys.modules})"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT)
    assert not HEAVY & set(loaded.stdout.split())


@pytest.mark.parametrize("command", ["--help", "compensate", "inspect", "diff", "fit", "diagnose", "add", "plan"])
def test_help_needs_no_heavy_library(command: str) -> None:
    arguments = ["--help"] if command == "--help" else [command, "--help"]
    code = (
        "import sys; from postproc.cli.app import build; from postproc.cli.run import run; "
        f"run(build(), {arguments}); print('LOADED', *{{m.split('.')[0] for m in sys.modules}})"
    )
    shown = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT).stdout
    assert "Exit codes: 0 done" in shown
    assert not HEAVY & set(shown.partition("LOADED")[2].split())


NO_FINDINGS = {
    "measure/read/terms.py",  # a user says by its code which judgement is accepted (`--accept`)
    "patterns/signals.py",  # the text of an expression
}


@pytest.mark.parametrize("path", MODULES, ids=lambda p: p.relative_to(PACKAGE).as_posix())
def test_nothing_is_decided_by_the_code_or_the_words_of_a_finding(path: Path) -> None:
    """`Matter` says what a finding is about."""
    if path.relative_to(PACKAGE).as_posix() in NO_FINDINGS:
        return
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.Compare):
            sides = [s.attr for s in (node.left, *node.comparators) if isinstance(s, ast.Attribute)]
            assert not {"code", "message"} & set(sides), f"{path}:{node.lineno} decides by a finding's code or words"


def test_no_two_classes_have_one_name() -> None:
    places: dict[str, list[str]] = {}
    for path in MODULES:
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            if isinstance(node, ast.ClassDef):
                places.setdefault(node.name, []).append(path.relative_to(PACKAGE).as_posix())
    assert {name: files for name, files in places.items() if len(files) > 1} == {}


def test_every_diagnostic_is_explained() -> None:
    """A code used in the package has a section in docs/diagnostics and the other way round, each code once."""
    code = re.compile(r"[\"']([A-Z]{3}\d{3})[\"']")
    used = {found for path in MODULES for found in code.findall(path.read_text("utf-8"))}
    pages = sorted((ROOT / "docs" / "diagnostics").glob("*.md"))
    explained = [(m, p.stem) for p in pages for m in re.findall(r"^## ([A-Z]{3}\d{3}) \S", p.read_text("utf-8"), re.M)]
    codes = [found for found, _ in explained]
    assert used - set(codes) == set(), "used but not explained"
    assert set(codes) - used == set(), "explained but not used"
    assert len(codes) == len(set(codes))
    assert all(found.startswith(page) for found, page in explained)


def test_pages_name_files_that_exist() -> None:
    every = [p.relative_to(ROOT).as_posix() for folder in ("postproc", "tests") for p in (ROOT / folder).rglob("*.py")]
    pages = [*(ROOT / "docs").rglob("*.md"), *ROOT.glob("*.md")]
    named = {(page.name, name) for page in pages for name in re.findall(r"`([a-z_/]+\.py)`", page.read_text("utf-8"))}
    assert {(page, name) for page, name in named if not any(f"/{path}".endswith(f"/{name}") for path in every)} == set()


@pytest.mark.parametrize(
    "folder",
    sorted(p.parent for p in PACKAGE.rglob("*/__init__.py")),
    ids=lambda p: p.relative_to(PACKAGE).as_posix(),
)
def test_a_room_says_what_its_files_are_for(folder: Path) -> None:
    """A newcomer finds a file in the docstring of its room: all of them stand there, and nothing that is none."""
    named = set(re.findall(r"`([a-z_0-9]+)`", (folder / "__init__.py").read_text("utf-8")))
    inside = [*folder.glob("*.py"), *(p.parent for p in folder.glob("*/__init__.py"))]
    assert named == {p.stem for p in inside} - {"__init__"}


def test_modules_stay_small() -> None:
    sizes = {p.relative_to(PACKAGE).as_posix(): len(p.read_text("utf-8").splitlines()) for p in MODULES}
    assert {name: size for name, size in sizes.items() if size > 400} == {}
    assert {name: size for name, size in sizes.items() if name.startswith("cli/") and size > 160} == {}


def test_no_files_import_in_circles() -> None:
    """Also imports inside functions and for types count: who reads one file need not have read another first."""
    names = {path: ".".join(path.relative_to(ROOT).with_suffix("").parts) for path in MODULES}
    uses = {names[p]: imported(p) & set(names.values()) - {names[p]} for p in MODULES if p.name != "__init__.py"}
    while free := [name for name, used in uses.items() if not used & set(uses)]:
        for name in free:
            del uses[name]
    assert sorted(uses) == []


@pytest.mark.parametrize("path", MODULES, ids=lambda p: str(p.relative_to(PACKAGE)))
def test_only_effects_know_the_library(path: Path) -> None:
    """The rest asks effects by what they declare of themselves, so that one more effect is one more file."""
    inside = path.relative_to(PACKAGE).parts[0] == "effects"
    assert inside or not any(name.startswith("postproc.effects.library") for name in imported(path))
