"""The shape of the package: rooms import downward only, starting up is cheap, every diagnostic is explained."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PACKAGE = ROOT / "postproc"
ROOMS = (
    "rapid",
    "robot",
    "channels",
    "effects",
    "model",
    "motion",
    "compensation",
    "measure",
    "estimation",
    "identification",
    "render",
    "report",
    "results",
    "convert",
    "runtime",
    "settings",
    "settings_files",
    "tasks",
    "batch",
    "cli",
    "testing",
)
HEAVY = {"numpy", "scipy", "pinocchio", "toppra", "ruckig", "playwright", "pydantic", "jinja2", "tomlkit", "matplotlib"}
MODULES = sorted(PACKAGE.rglob("*.py"))


@cache
def nodes(path: Path) -> list[ast.AST]:
    return list(ast.walk(ast.parse(path.read_text("utf-8"))))


def own(path: Path) -> str:
    return path.relative_to(PACKAGE).as_posix()


@cache
def imported(path: Path) -> frozenset[str]:
    """Names of the package's modules that a file imports, anywhere in it."""
    names: set[str] = set()
    for node in nodes(path):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative import"
            names.add(node.module or "")
            names |= {f"{node.module}.{alias.name}" for alias in node.names}
    return frozenset(name for name in names if name.split(".")[0] == "postproc")


def test_imports_point_downward() -> None:
    """The foundation imports no room. `__init__`, the API, names what it gives and loads it where it is called."""
    upward = []
    for path in MODULES:
        room = own(path).removesuffix(".py").split("/")[0]
        if room not in ("__init__", "__main__"):
            floor = ROOMS.index(room) if room in ROOMS else -1
            used = {name: name.split(".")[1] for name in imported(path) if "." in name}
            upward += [(own(path), name) for name, u in used.items() if u in ROOMS and ROOMS.index(u) > floor]
    assert upward == []


# Folders and files inside a room, in the order in which they may use each other; what a room does not name is free.
FLOORS = {
    "rapid": ("unknown", "syntax", "data", "program", "evaluation", "motions", "execution", "diff"),
    "motion": ("mounts", "values", "findings", "path", "timing", "smoothing"),
    "compensation": (
        *("options", "tolerances", "path", "correction", "reading", "text", "plan"),
        *("readback", "judgement", "conversion"),
    ),
    "cli": ("printing", "options", "program_options", "programs", "convert", "app"),
    "effects": (
        "contract",
        "findings",
        "parameters",
        "modules",
        "files",
        "base",
        "terms",
        "conformance",
        "library",
        "registry",
    ),
    "measure": ("observations", "measurements", "alignment", "trajectory", "read"),
    "estimation": ("problem", "linear", "solution", "validation", "fitted", "recorded", "findings"),
    "identification": ("curves", "screen", "acceptance", "state", "search", "diagnosis"),
    "channels": ("state", "memory", "tool", "sight", "expression", "units"),
    "results": ("wording", "convert", "improve", "certificate"),
    "report": ("blocks", "document", "drawing", "page"),
    "runtime": ("conditions", "tables", "module", "proof", "written", "programs", "passes"),
}


def test_folders_of_a_room_import_downward() -> None:
    upward = []
    for path in MODULES:
        room, *inside = own(path).removesuffix(".py").split("/")
        floors = FLOORS.get(room, ())
        if inside and inside[0] in floors:
            for name in imported(path):
                parts = name.split(".")
                if parts[1:2] == [room] and len(parts) > 2 and parts[2] in floors[floors.index(inside[0]) + 1 :]:
                    upward.append((own(path), name))
    assert upward == []


def test_libraries_without_wheels_for_every_platform_are_asked_for_in_one_place() -> None:
    """URDF files need pinocchio; else both have a stand-in. Nothing else may need them, or Windows is left out."""
    users: dict[str, set[str]] = {"pinocchio": set(), "toppra": set()}
    for path in MODULES:
        for node in nodes(path):
            if isinstance(node, ast.Import | ast.ImportFrom):
                named = [alias.name for alias in node.names] if isinstance(node, ast.Import) else [node.module or ""]
                for name in {name.split(".")[0] for name in named} & users.keys():
                    users[name].add(own(path))
    allowed = {"pinocchio": {"robot/urdf.py", "model/pinocchio_bodies.py"}, "toppra": {"motion/timing/constraints.py"}}
    assert users == allowed


def test_every_folder_is_a_known_room() -> None:
    assert {p.name for p in PACKAGE.iterdir() if (p / "__init__.py").exists()} <= set(ROOMS)


def test_package_inits_hold_nothing() -> None:
    for path in PACKAGE.glob("*/__init__.py"):
        body = ast.parse(path.read_text("utf-8")).body
        assert all(isinstance(node, ast.Expr) for node in body), f"{path} does more than say what it is"


STARTS = """
import sys
from postproc.cli.app import build
from postproc.cli.run import run
build()
print("LOADED", *{m.split(".")[0] for m in sys.modules})
for command in ([], *([name] for name in "compensate inspect diff fit diagnose add plan".split())):
    run(build(), [*command, "--help"])
    print("LOADED", *{m.split(".")[0] for m in sys.modules})
"""


def test_the_command_line_starts_and_helps_without_heavy_libraries() -> None:
    shown = subprocess.run([sys.executable, "-c", STARTS], capture_output=True, text=True, check=True, cwd=ROOT).stdout
    loaded = [line.split() for line in shown.splitlines() if line.startswith("LOADED")]
    assert len(loaded) == 9 and shown.count("Exit codes: 0 done") == 8
    assert [HEAVY & set(modules) for modules in loaded] == [set()] * 9


NO_FINDINGS = {
    "measure/read/terms.py",  # a user says by its code which judgement is accepted (`--accept`)
}


def test_nothing_is_decided_by_the_code_or_the_words_of_a_finding() -> None:
    """`Matter` says what a finding is about."""
    decides = []
    for path in MODULES:
        for node in nodes(path):
            if isinstance(node, ast.Compare) and own(path) not in NO_FINDINGS:
                parts = (node.left, *node.comparators)
                sides = {s.attr for s in parts if isinstance(s, ast.Attribute)}
                sides |= {ast.unparse(s.slice).strip("'") for s in parts if isinstance(s, ast.Subscript)}
                decides += [(own(path), node.lineno)] if sides & {"code", "message"} else []
    assert decides == []


def test_no_two_classes_have_one_name() -> None:
    places: dict[str, list[str]] = {}
    for path in MODULES:
        for node in nodes(path):
            if isinstance(node, ast.ClassDef):
                places.setdefault(node.name, []).append(own(path))
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


def test_a_room_says_what_its_files_are_for() -> None:
    """A newcomer finds a file in the docstring of its room: all of them stand there, and nothing that is none."""
    differ = {}
    for path in PACKAGE.rglob("*/__init__.py"):
        named = set(re.findall(r"`([a-z_0-9]+)`", path.read_text("utf-8")))
        inside = [*path.parent.glob("*.py"), *(p.parent for p in path.parent.glob("*/__init__.py"))]
        differ[own(path)] = named ^ ({p.stem for p in inside} - {"__init__"})
    assert {room: names for room, names in differ.items() if names} == {}


def test_modules_stay_small() -> None:
    sizes = {own(p): len(p.read_text("utf-8").splitlines()) for p in MODULES}
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


def test_a_single_program_passes_through_no_batch() -> None:
    uses = {own(path) for path in MODULES if any(name.startswith("postproc.batch") for name in imported(path))}
    others = {name for name in uses if not name.startswith("batch/")}
    assert others == {
        "cli/look_up/schemas.py",
        *(f"cli/convert/{name}.py" for name in ("batch", "batch_lines", "diff")),
    }


def test_only_effects_know_the_library() -> None:
    """The rest asks effects by what they declare of themselves, so that one more effect is one more file."""
    library = "postproc.effects.library"
    others = [path for path in MODULES if not own(path).startswith("effects/")]
    assert [own(path) for path in others if any(name.startswith(library) for name in imported(path))] == []
