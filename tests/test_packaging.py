"""What other people's tools get: the wheel, the sdist, the pre-commit hooks, the GitHub Action, SARIF."""

from __future__ import annotations

import json
import os
import re
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
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from postproc.cli import hooks
from postproc.cli.app import build
from postproc.cli.run import run as run_command
from postproc.effects.registry import BUILT_IN
from postproc.effects.roles import Role
from postproc.files import resource
from tests.conftest import ROOT

SHIPPED = ("py.typed", "templates/header.j2", "samples/hull_seam.mod", "docs/diagnostics/CLI.md", "robot/arms/ur5.toml")
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]


def run(*command: object, cwd: Path, **more: str) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "PIP_DISABLE_PIP_VERSION_CHECK": "1", **more}
    return subprocess.run([*map(str, command)], cwd=cwd, env=environment, capture_output=True, text=True, check=False)


def python(*words: object, cwd: Path, **more: str) -> str:
    """What a command of Python prints, which must succeed."""
    done = run(sys.executable, *words, cwd=cwd, **more)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the wheel and the sdist, built from a copy without what git ignores."""
    folder = tmp_path_factory.mktemp("dist")
    python("-m", "hatchling", "build", "-d", folder, cwd=ROOT)
    return folder


def test_a_wheel_converts_a_program_where_nothing_else_is(built: Path, tmp_path: Path) -> None:
    (wheel,) = built.glob("*.whl")
    site, work = tmp_path / "site", tmp_path / "a folder"
    work.mkdir()
    python("-m", "pip", "install", "-q", "--no-index", "--no-deps", "--target", site, wheel, cwd=work)
    assert [name for name in SHIPPED if not (site / "postproc" / name).is_file()] == []
    place = python("-c", "import postproc; print(postproc.__file__)", cwd=work, PYTHONPATH=str(site))
    assert Path(place.strip()).is_relative_to(site)
    assert python("-m", "postproc", "--version", cwd=work, PYTHONPATH=str(site)).startswith("postproc ")
    program = site / "postproc" / "samples" / "corner_arc.mod"
    python("-m", "postproc", "compensate", program, "-o", "out.mod", cwd=work, PYTHONPATH=str(site))
    assert b"! postproc " in (work / "out.mod").read_bytes()


def test_a_checkout_uses_the_folders_beside_the_package() -> None:
    assert resource("templates") == ROOT / "templates"
    assert resource("docs", "diagnostics", "CLI.md").is_file() and resource("samples", "hull_seam.mod").is_file()


def test_the_sdist_is_complete(built: Path) -> None:
    """A wheel made of the sdist holds what the wheel of the clone holds; tests and documentation come along."""
    (sdist,), (wheel,) = built.glob("*.tar.gz"), built.glob("*.whl")
    with tarfile.open(sdist) as archive:
        archive.extractall(built / "unpacked", filter="data")
    (root,) = (built / "unpacked").iterdir()
    files = ["README.md", "Makefile", "docs/index.md", "docs/conf.py", "tests/conftest.py", "action.yml"]
    files += ["environment.yml", ".pre-commit-hooks.yaml"]
    assert [name for name in files if not (root / name).is_file()] == []
    python("-m", "hatchling", "build", "-t", "wheel", "-d", built / "again", cwd=root)
    (again,) = (built / "again").glob("*.whl")
    first, second = (sorted(zipfile.ZipFile(path).namelist()) for path in (wheel, again))
    assert first == second
    assert not [name for name in first if "__pycache__" in name or "_generated" in name]


@pytest.fixture(scope="module")
def repository(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with one program and its approved output, as a repository of programs has them."""
    folder = tmp_path_factory.mktemp("repository")
    for place in ("my programs", "none", "broken", "gone"):
        (folder / place).mkdir()
    for name in ("corner_arc.mod", "postproc.toml"):
        shutil.copy(ROOT / "samples" / name, folder / "my programs")
    words = ["compensate", str(folder / "my programs/corner_arc.mod"), "-o", str(folder / "ok/corner_arc.mod")]
    assert run_command(build(), words) == 0
    for name in ("corner_arc.mod", "gone.mod"):
        shutil.copy(folder / "ok" / "corner_arc.mod", folder / "gone" / name)
    (folder / "none" / "user.sys").write_text("MODULE user\nENDMODULE\n")
    (folder / "broken" / "broken.mod").write_text("MODULE broken\n")
    return folder


PROGRAM = "my programs/corner_arc.mod"
PLACES = ("--programs", "my programs", "--approved", "ok")


@pytest.mark.parametrize(
    ("words", "code", "first"),
    [
        (("check", *PLACES, PROGRAM), 0, f"`{PROGRAM}` is as approved\nall 1 are as approved\n"),
        (("check", *PLACES), 0, f"`{PROGRAM}` is as approved\nall 1 are as approved\n"),
        (("check", *PLACES, "--verbose"), 0, "arm `irb4600"),
        (("check", *PLACES, "--force", "100,0,0", PROGRAM), 1, ""),
        # What programs are corrected with counts for all of them; the value of an option is no file to look at.
        (("check", *PLACES, "my programs/postproc.toml"), 0, f"`{PROGRAM}` is as approved\nall 1 are as approved\n"),
        (("check", *PLACES, "--with", "none/user.sys", "none/user.sys"), 0, f"`{PROGRAM}` is as approved\nall 1 "),
        (("read", "--alone", "my programs/postproc.toml"), 0, ""),
        (("read", PROGRAM), 0, ""),
        (("read", "--robot", "irb4600_60_205", "broken/broken.mod", PROGRAM), 1, ""),
        (("else", PROGRAM), 2, "``python -m postproc.cli.hooks``"),
        # A check of nothing fails.
        (("check",), 2, "error[CLI016]"),
        (("check", "--programs", "nowhere"), 2, "error[CLI016]"),
        (("check", "--programs", "none"), 2, "error[CLI016]"),
        (("check", "--programs", "-delete"), 2, "error[CLI016]"),
        (("check", "--programs", "my programs", "--approved", "gone"), 1, f"`{PROGRAM}` is as approved\nerror[CLI016]"),
        # A hook is not told which program was deleted.
        (
            ("check", "--programs", "my programs", "--approved", "gone", PROGRAM),
            1,
            f"`{PROGRAM}` is as approved\nerror[C",
        ),
        (("diff", "--programs", "my programs", "--approved", "gone"), 1, "error[CLI016]"),
        (("check", "--programs", "gone", "ok/corner_arc.mod"), 2, "error[CLI016]"),
        # No input is written over.
        (("read", "--sarif", PROGRAM, PROGRAM), 2, "error[CLI007]"),
        (("read", "--sarif", f"{PROGRAM}/x", PROGRAM), 2, "error[CLI008]"),
        (("read", "--sarif", "my programs", PROGRAM), 2, "error[CLI008]"),
    ],
)
def test_the_hooks_of_pre_commit(
    repository: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    words: tuple[str, ...],
    code: int,
    first: str,
) -> None:
    monkeypatch.chdir(repository)
    before = Path(PROGRAM).read_bytes()
    assert hooks.main(words) == code
    assert capsys.readouterr().err.startswith(first)
    assert Path(PROGRAM).read_bytes() == before


def test_a_check_goes_on_where_an_output_has_no_program_and_writes_its_log(
    repository: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(repository)
    for name in ("corner_arc.mod", "other.mod", ".postproc/edited/12345678/mine.mod", ".git/old.mod"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(repository / "ok" / "corner_arc.mod", tmp_path / name)
    words = ("check", "--programs", "my programs", "--approved", str(tmp_path), "--sarif", str(tmp_path / "log.sarif"))
    assert hooks.main((*words, "--force", "100,0,0")) == 1
    first, last = capsys.readouterr().err.splitlines()[-2:]
    assert first.startswith(f"1 of 1 programs are not as approved: {PROGRAM}; approve with `postproc batch`, or ")
    assert last == "1 approved output has no program: take out what CLI016 names"
    (gone,) = [r for r in check_sarif(json.loads((tmp_path / "log.sarif").read_text())) if r["ruleId"] == "CLI016"]
    assert "other.mod` is not in `my programs`" in gone["message"]["text"]
    (tmp_path / "other.mod").unlink()
    assert hooks.main(words) == 0
    assert capsys.readouterr().err.endswith("all 1 are as approved\n")


def test_hooks_are_declared_with_what_the_script_takes() -> None:
    """Both for each program and for settings; the files of the template are those of its folder."""
    declared = yaml.safe_load((ROOT / ".pre-commit-hooks.yaml").read_text("utf-8"))
    assert all({"id", "name", "entry", "language", "files"} <= set(hook) for hook in declared)
    entry = "python -m postproc.cli.hooks"
    assert {hook["id"]: hook["entry"] for hook in declared} == {
        f"postproc-{w}": f"{entry} {w}" for w in ("check", "read")
    }
    (template,) = yaml.safe_load((ROOT / "docs/template/.pre-commit-config.yaml").read_text("utf-8"))["repos"]
    for hook in [*declared, *template["hooks"]]:
        taken = [name for name in ("programs/a.mod", "programs/postproc.toml") if re.search(hook["files"], name)]
        assert len(taken) == 2 and not re.search(hook["files"], "pyproject.toml"), hook["id"]


@pytest.mark.parametrize(("command", "code"), [("check", 0), ("diff", 1)])
def test_the_script_of_the_action(repository: Path, tmp_path: Path, command: str, code: int) -> None:
    """The composite action's own script, as GitHub runs it: bash with the inputs in the environment."""
    action = yaml.safe_load((ROOT / "action.yml").read_text("utf-8"))
    step, log = action["runs"]["steps"][1], tmp_path / "log.sarif"
    assert action["runs"]["using"] == "composite"
    assert set(step["env"]) == {name.upper() for name in action["inputs"]}
    inputs = {"PROGRAMS": "my programs", "APPROVED": "ok", "COMMAND": command, "ARGUMENTS": "", "SARIF": str(log)}
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    script = ("--noprofile", "--norc", "-eo", "pipefail", "-c", step["run"])
    done = run("bash", *script, cwd=repository, PATH=path, **inputs)
    assert done.returncode == code, done.stderr
    assert log.is_file() == (command == "check")
    if command == "check":
        results = check_sarif(json.loads(log.read_text()))
        (weld,) = [result for result in results if result["ruleId"] == "weld"]
        region = weld["locations"][0]["physicalLocation"]["region"]
        at = (repository / PROGRAM).read_text("latin-1").splitlines()[region["startLine"] - 1]
        assert "ArcLStart" in at and "expected on the arm: " in weld["message"]["text"] and weld["level"] == "note"


def check_sarif(log: dict[str, Any]) -> list[dict[str, Any]]:
    """What the schema of SARIF 2.1.0 requires of the parts that are used; returns the results."""
    assert log["version"] == "2.1.0" and len(log["runs"]) == 1
    results = []
    for one in log["runs"]:
        driver = one["tool"]["driver"]
        ids = [rule["id"] for rule in driver["rules"]]
        assert driver["name"] == "postproc" and len(ids) == len(set(ids))
        assert one["columnKind"] in ("utf16CodeUnits", "unicodeCodePoints")
        for result in one["results"]:
            assert result["message"]["text"] and result["level"] in ("none", "note", "warning", "error")
            assert ids[result["ruleIndex"]] == result["ruleId"]
            for location in result["locations"]:
                physical = location["physicalLocation"]
                assert " " not in physical["artifactLocation"]["uri"]
                assert all(isinstance(value, int) and value >= 1 for value in physical.get("region", {}).values())
        results += one["results"]
    marks = [result["partialFingerprints"]["wording/v1"] for result in results]
    assert len(marks) == len(set(marks))
    return results


def test_findings_as_sarif(tmp_path: Path) -> None:
    program = tmp_path / "ein Ort µ.mod"
    program.write_text(
        (ROOT / "samples/corner_arc.mod").read_text("latin-1").replace(r"\WObj:=", r"\WObj:=no", 1), "utf-8"
    )
    inspect = (sys.executable, "-m", "postproc", "inspect")
    done = run(*inspect, program.name, "--robot", "irb4600_60_205", "--format", "sarif", cwd=tmp_path)
    error = next(result for result in check_sarif(json.loads(done.stdout)) if result["level"] == "error")
    place = error["locations"][0]["physicalLocation"]
    assert done.returncode == 1 and place["artifactLocation"]["uri"] == "ein%20Ort%20%C2%B5.mod"
    assert r"\WObj:=no" in program.read_text("utf-8").splitlines()[place["region"]["startLine"] - 1]
    missing = run(*inspect, "none.mod", "--format=sarif", cwd=tmp_path)
    assert check_sarif(json.loads(missing.stdout))[0]["ruleId"] == "CLI002"


def test_the_lock_file_is_that_of_the_project() -> None:
    """Write it anew after the dependencies have changed: ``requirements.lock`` says how."""
    extras = [line for extra in PROJECT["optional-dependencies"].values() for line in extra]
    stated = [Requirement(line) for line in (*PROJECT["dependencies"], *extras)]
    lines = (ROOT / "requirements.lock").read_text("utf-8").splitlines()
    pinned = [Requirement(line.rstrip("\\ ")) for line in lines if line[:1].isalnum()]
    versions = {canonicalize_name(r.name): next(iter(r.specifier)).version for r in pinned}
    needed = [r for r in stated if r.name != PROJECT["name"]]
    assert [str(r) for r in needed if versions.get(canonicalize_name(r.name)) not in r.specifier] == []
    assert sum(line.lstrip().startswith("--hash=sha256:") for line in lines) >= len(pinned)


def test_the_conda_environment_has_what_the_project_needs() -> None:
    listed = yaml.safe_load((ROOT / "environment.yml").read_text("utf-8"))["dependencies"]
    lines = [line for line in (*listed[:-1], *listed[-1]["pip"]) if line != "."]
    stated = {("pin" if r.name == "pinocchio" else r.name, r.specifier) for r in map(Requirement, lines)}
    needed = [r for r in map(Requirement, PROJECT["dependencies"]) if "toppra" not in r.name]  # it brings that itself
    assert {(r.name, r.specifier) for r in needed} <= stated


def test_the_readme_counts_what_there_is() -> None:
    text = re.sub(r"<!--.*?-->", "", (ROOT / "README.md").read_text("utf-8"))
    arms = {path.stem.removesuffix("_seed") for path in (ROOT / "postproc" / "robot" / "arms").glob("irb*.toml")}
    named = [cls for cls in BUILT_IN if cls.role is not Role.CURVE]
    assert f"which of {len(named)} physical effects" in text
    assert f"{len(arms)} ABB arms" in text
