"""What other people's tools get: the wheel, the sdist, the pre-commit hooks, the GitHub Action, SARIF, JSON Schemas."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from pathlib import Path
from typing import Any

import pytest
import yaml
from jsonschema import Draft202012Validator
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from postproc.cli import hooks
from postproc.cli.app import build
from postproc.cli.run import run as run_command
from postproc.diagnostics import PostprocError, Source
from postproc.effects.registry import BUILT_IN
from postproc.model.file import parse_model, read_model
from postproc.schemas import SCHEMA_KINDS, schema_of

ROOT = Path(__file__).resolve().parent.parent
SHIPPED = ("py.typed", "templates/header.j2", "samples/hull_seam.mod", "docs/diagnostics/CLI.md", "robot/arms/ur5.toml")


def run(*command: object, cwd: Path, **more: str) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "PIP_DISABLE_PIP_VERSION_CHECK": "1", **more}
    return subprocess.run(
        list(map(str, command)), cwd=cwd, env=environment, capture_output=True, text=True, check=False
    )


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the wheel and the sdist, built from a copy without what git ignores."""
    folder = tmp_path_factory.mktemp("dist")
    done = run(sys.executable, "-m", "hatchling", "build", "-d", folder, cwd=ROOT)
    assert done.returncode == 0, done.stdout + done.stderr
    return folder


def test_a_wheel_converts_a_program_where_nothing_else_is(built: Path, tmp_path: Path) -> None:
    (wheel,) = built.glob("*.whl")
    site, work = tmp_path / "site", tmp_path / "a folder"
    work.mkdir()
    install = ("-m", "pip", "install", "-q", "--no-index", "--no-deps", "--target", site, wheel)
    assert run(sys.executable, *install, cwd=work).returncode == 0
    assert [name for name in SHIPPED if not (site / "postproc" / name).is_file()] == []
    shown = run(sys.executable, "-m", "postproc", "--version", cwd=work, PYTHONPATH=str(site))
    assert shown.stdout.startswith("postproc ")
    where = run(sys.executable, "-c", "import postproc; print(postproc.__file__)", cwd=work, PYTHONPATH=str(site))
    assert Path(where.stdout.strip()).is_relative_to(site)
    program = site / "postproc" / "samples" / "corner_arc.mod"
    command = ("-m", "postproc", "compensate", program, "-o", "out.mod")
    done = run(sys.executable, *command, cwd=work, PYTHONPATH=str(site))
    assert done.returncode == 0, done.stderr
    assert b"! postproc " in (work / "out.mod").read_bytes()


def test_the_sdist_is_complete(built: Path) -> None:
    """A wheel made of the sdist holds what the wheel of the clone holds; tests and documentation come along."""
    (sdist,) = built.glob("*.tar.gz")
    (wheel,) = built.glob("*.whl")
    with tarfile.open(sdist) as archive:
        archive.extractall(built / "unpacked", filter="data")
    (root,) = (built / "unpacked").iterdir()
    beside = ("README.md", "Makefile", "docs/index.md", "docs/conf.py", "tests/conftest.py", "action.yml")
    assert [
        name for name in (*beside, "environment.yml", ".pre-commit-hooks.yaml") if not (root / name).is_file()
    ] == []
    done = run(sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", built / "again", cwd=root)
    assert done.returncode == 0, done.stdout + done.stderr
    (again,) = (built / "again").glob("*.whl")
    names = [sorted(zipfile.ZipFile(path).namelist()) for path in (wheel, again)]
    assert names[0] == names[1]
    assert not [name for name in names[0] if "__pycache__" in name or "_generated" in name]


@pytest.fixture(scope="module")
def repository(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with one program and its approved output, as a repository of programs has them."""
    folder = tmp_path_factory.mktemp("repository")
    (folder / "my programs").mkdir()
    for name in ("corner_arc.mod", "postproc.toml"):
        shutil.copy(ROOT / "samples" / name, folder / "my programs")
    command = [
        "compensate",
        str(folder / "my programs" / "corner_arc.mod"),
        "-o",
        str(folder / "ok" / "corner_arc.mod"),
    ]
    assert run_command(build(), command) == 0
    return folder


def test_the_hooks_of_pre_commit(repository: Path, tmp_path: Path) -> None:
    declared = yaml.safe_load((ROOT / ".pre-commit-hooks.yaml").read_text("utf-8"))
    assert [hook["id"] for hook in declared] == ["postproc-check", "postproc-read"]
    assert all({"id", "name", "entry", "language", "files"} <= set(hook) for hook in declared)
    check, read = (hook["entry"].removeprefix("python -m postproc.cli.hooks ") for hook in declared)
    program = str(repository / "my programs" / "corner_arc.mod")
    places = ("--programs", str(repository / "my programs"), "--approved", str(repository / "ok"))
    assert hooks.main([check, *places, program]) == 0
    assert hooks.main([check, *places, "--force", "100,0,0", program]) == 1
    assert hooks.main([read, program]) == 0
    broken = tmp_path / "broken.mod"
    broken.write_text("MODULE broken\n")
    assert hooks.main([read, "--robot", "irb4600_60_205", str(broken), program]) != 0
    assert hooks.main(["else", program]) == 2


def test_a_check_of_nothing_fails(repository: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "data").mkdir()
    (tmp_path / "data" / "user.sys").write_text("MODULE user\nENDMODULE\n")
    (tmp_path / "gone").mkdir()
    for name in ("corner_arc.mod", "gone.mod"):
        shutil.copy(repository / "ok" / "corner_arc.mod", tmp_path / "gone" / name)
    folder = str(repository / "my programs")
    for words in (
        ("--programs", str(tmp_path / "none")),
        ("--programs", str(tmp_path / "data")),
        ("--programs", "-delete"),
        ("--programs", folder, "--approved", str(tmp_path / "gone")),
        ("--programs", str(tmp_path / "gone"), str(repository / "ok" / "corner_arc.mod")),
        (),
    ):
        assert hooks.main(["check", *words]) == 2
        assert capsys.readouterr().err.startswith("error[CLI016]")
    assert hooks.main(["check", "--programs", folder, "--approved", str(repository / "ok")]) == 0


def test_a_hook_writes_over_no_input(repository: Path, capsys: pytest.CaptureFixture[str]) -> None:
    program = repository / "my programs" / "corner_arc.mod"
    before = program.read_bytes()
    for place, code in ((program, "CLI007"), (program / "x", "CLI008"), (program.parent, "CLI008")):
        assert hooks.main(["read", "--sarif", str(place), str(program)]) == 2
        assert capsys.readouterr().err.startswith(f"error[{code}]")
    assert program.read_bytes() == before


@pytest.mark.parametrize(("command", "code"), [("check", 0), ("diff", 1)])
def test_the_script_of_the_action(repository: Path, tmp_path: Path, command: str, code: int) -> None:
    """The composite action's own script, as GitHub runs it: bash with the inputs in the environment."""
    action = yaml.safe_load((ROOT / "action.yml").read_text("utf-8"))
    steps = action["runs"]["steps"]
    assert action["runs"]["using"] == "composite"
    assert set(steps[1]["env"]) == {name.upper() for name in action["inputs"]}
    log = tmp_path / "log.sarif"
    inputs = {"PROGRAMS": "my programs", "APPROVED": "ok", "COMMAND": command, "ARGUMENTS": "", "SARIF": str(log)}
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    script = ("--noprofile", "--norc", "-eo", "pipefail", "-c", steps[1]["run"])
    done = run("bash", *script, cwd=repository, PATH=path, **inputs)
    assert done.returncode == code, done.stderr
    assert log.is_file() == (command == "check")
    if command == "check":
        check_sarif(json.loads(log.read_text()))


def check_sarif(log: dict[str, Any]) -> list[dict[str, Any]]:
    """What the schema of SARIF 2.1.0 requires of the parts that are used; returns the results."""
    assert log["version"] == "2.1.0" and isinstance(log["runs"], list)
    results = []
    for one in log["runs"]:
        driver = one["tool"]["driver"]
        assert driver["name"] == "postproc"
        ids = [rule["id"] for rule in driver["rules"]]
        assert len(ids) == len(set(ids))
        assert one["columnKind"] in ("utf16CodeUnits", "unicodeCodePoints")
        for result in one["results"]:
            assert result["message"]["text"] and result["level"] in ("none", "note", "warning", "error")
            assert ids[result["ruleIndex"]] == result["ruleId"]
            for location in result["locations"]:
                physical = location["physicalLocation"]
                assert " " not in physical["artifactLocation"]["uri"]
                region = physical.get("region", {"startLine": 1})
                assert all(isinstance(value, int) and value >= 1 for value in region.values())
        results += one["results"]
    return results


def test_findings_as_sarif(tmp_path: Path) -> None:
    text = (ROOT / "samples" / "corner_arc.mod").read_text("latin-1")
    program = tmp_path / "ein Ort µ.mod"
    program.write_text(text.replace("\\WObj:=", "\\WObj:=no", 1), "utf-8")
    command = ("-m", "postproc", "inspect", program.name, "--robot", "irb4600_60_205", "--format", "sarif")
    done = run(sys.executable, *command, cwd=tmp_path)
    results = check_sarif(json.loads(done.stdout))
    errors = [result for result in results if result["level"] == "error"]
    assert done.returncode == 1 and errors
    place = errors[0]["locations"][0]["physicalLocation"]
    assert place["artifactLocation"]["uri"] == "ein%20Ort%20%C2%B5.mod"
    line = program.read_text("utf-8").splitlines()[place["region"]["startLine"] - 1]
    assert "\\WObj:=no" in line
    missing = run(sys.executable, "-m", "postproc", "inspect", "none.mod", "--format=sarif", cwd=tmp_path)
    assert check_sarif(json.loads(missing.stdout))[0]["ruleId"] == "CLI002"


@pytest.mark.parametrize("kind", SCHEMA_KINDS)
def test_schemas_are_schemas(kind: str) -> None:
    Draft202012Validator.check_schema(schema_of(kind))


@pytest.mark.parametrize("kind", SCHEMA_KINDS)
def test_every_key_says_what_it_means(kind: str) -> None:
    schema = schema_of(kind)
    parts = [schema, *schema.get("$defs", {}).values()]
    keys = {key: value for part in parts for key, value in part.get("properties", {}).items()}
    assert [key for key, value in keys.items() if not value.get("description") and key != "effects"] == []


def accepted(kind: str, content: dict[str, Any]) -> bool:
    return not list(Draft202012Validator(schema_of(kind)).iter_errors(content))


def test_schemas_accept_what_the_program_reads() -> None:
    for path in (ROOT / "samples" / "models").glob("*.toml"):
        content = tomllib.loads(path.read_text("utf-8"))
        assert accepted("model" if "effects" in content else "robot", content), path
    for path in (ROOT / "postproc" / "robot" / "arms").glob("*.toml"):
        assert accepted("robot", tomllib.loads(path.read_text("utf-8"))), path
    assert accepted("settings", tomllib.loads((ROOT / "samples" / "postproc.toml").read_text("utf-8")))
    assert accepted("columns", {"columns": {"x_mm": "X", "q1_deg": {"name": "A1", "sign": -1}}, "separator": ";"})
    assert accepted("jobs", {"tolerance_mm": 0.01, "job": [{"folder": "a", "model": "b.toml"}]})


MODEL = {"robot": "irb4600_60_205", "effects": {"backlash": {"half_gap_rad": [0, 1e-4, 0, 0, 0, 0]}}}


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
    with pytest.raises(PostprocError):
        parse_model(Source("m.toml", toml(wrong).encode()))


def test_schema_and_reader_accept_the_same() -> None:
    assert accepted("model", MODEL)
    assert parse_model(Source("m.toml", toml(MODEL).encode())).effects


def toml(content: dict[str, Any]) -> str:
    import tomlkit

    return tomlkit.dumps(content)


def test_a_fitted_model_fits_its_schema(tmp_path: Path) -> None:
    import postproc

    data = postproc.read_measurements(ROOT / "samples" / "measurements" / "simulated_backlash.csv", "irb4600_60_205")
    found = postproc.fit(data, "irb4600_60_205", (*postproc.BASE, "backlash", "transmission_error"))
    postproc.write_model(tmp_path / "cell.toml", found)
    assert postproc.text(found).startswith("The model misses")
    assert accepted("model", tomllib.loads((tmp_path / "cell.toml").read_text("utf-8")))
    assert {effect.key for effect in read_model(tmp_path / "cell.toml").effects} >= {"backlash", "transmission_error"}


def test_the_lock_file_is_that_of_the_project() -> None:
    """Write it anew after the dependencies have changed: ``requirements.lock`` says how."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    extras = project["optional-dependencies"]
    stated = [Requirement(line) for line in (*project["dependencies"], *(line for e in extras.values() for line in e))]
    lines = (ROOT / "requirements.lock").read_text("utf-8").splitlines()
    pinned = [Requirement(line.rstrip("\\ ")) for line in lines if line[:1].isalnum()]
    versions = {canonicalize_name(r.name): next(iter(r.specifier)).version for r in pinned}
    wanted = [r for r in stated if r.name != project["name"]]
    assert [str(r) for r in wanted if versions.get(canonicalize_name(r.name)) not in r.specifier] == []
    assert sum(line.lstrip().startswith("--hash=sha256:") for line in lines) >= len(pinned)


def test_the_conda_environment_has_what_the_project_needs() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    listed = yaml.safe_load((ROOT / "environment.yml").read_text("utf-8"))["dependencies"]
    lines = [line for line in (*listed[:-1], *listed[-1]["pip"]) if line != "."]
    found = {("pin" if r.name == "pinocchio" else r.name, r.specifier) for r in map(Requirement, lines)}
    assert {(r.name, r.specifier) for r in map(Requirement, project["dependencies"])} <= found


def test_the_readme_counts_what_there_is() -> None:
    text = (ROOT / "README.md").read_text("utf-8")
    arms = {path.stem.removesuffix("_seed") for path in (ROOT / "postproc" / "robot" / "arms").glob("irb*.toml")}
    assert f"which of {len(BUILT_IN)} physical effects" in text
    assert f"{len(arms)} ABB arms" in text
