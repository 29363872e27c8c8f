"""The template repository of the documentation: with git, as its workflow and its hooks run it, without a network."""

from __future__ import annotations

import re
import shlex
import shutil
import subprocess
from pathlib import Path

import pytest
import yaml

from postproc.cli import hooks
from postproc.cli.app import build
from postproc.cli.run import run
from tests.conftest import ROOT

TEMPLATE = ROOT / "docs" / "template"
README = re.search(r"```sh\n(.*?)```", (TEMPLATE / "README.md").read_text("utf-8"), re.S)
PROGRAM = Path("programs/bracket.mod")


def git(*words: str) -> str:
    identity = ("-c", "user.name=A", "-c", "user.email=a@b.c", "-c", "core.autocrlf=false")
    return subprocess.run(["git", *identity, *words], capture_output=True, text=True, check=True).stdout


def shell(script: str) -> int:
    """Run lines of commands as ``bash -e`` does, those of postproc in this process; returns the last exit code."""
    for line in script.strip().splitlines():
        for command in line.split(" && "):
            words = shlex.split(command)
            if words[0] == "git":
                git(*words[1:])
                code = 0
            elif words[0] == "postproc":
                code = run(build(), words[1:])
            else:
                assert words[:3] == ["python", "-m", "postproc.cli.hooks"]
                code = hooks.main(words[3:])
            if code:
                return code
    return 0


def workflow() -> list[int]:
    """Exit codes of the steps of the workflow; those that need a network and other people's actions are left out."""
    steps = yaml.safe_load(Path(".github/workflows/programs.yml").read_text("utf-8"))["jobs"]["approved"]["steps"]
    codes: list[int] = []
    for step in steps:
        if "run" in step and "pip install" not in step["run"] and (any(codes) or step.get("if") != "failure()"):
            codes.append(shell(step["run"]))
    return codes


def before_a_commit() -> int:
    """What pre-commit does: the entry and arguments of each hook with the staged files that it is for."""
    declared = {h["id"]: h["entry"] for h in yaml.safe_load((ROOT / ".pre-commit-hooks.yaml").read_text("utf-8"))}
    (repository,) = yaml.safe_load(Path(".pre-commit-config.yaml").read_text("utf-8"))["repos"]
    staged = git("diff", "--cached", "--name-only").split()
    code = 0
    for hook in repository["hooks"]:
        files = [name for name in staged if re.search(hook["files"], name)]
        code = max(code, shell(shlex.join([*declared[hook["id"]].split(), *hook.get("args", []), *files])))
    return code


def test_approve_change_see_red_approve_see_green(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert README is not None
    shutil.copytree(TEMPLATE, tmp_path / "cell")
    monkeypatch.chdir(tmp_path / "cell")
    git("init", "-q")
    git("add", ".")
    assert shell(README[1]) == 0
    assert workflow() == [0] and git("status", "--porcelain") == ""
    settings = PROGRAM.with_name("postproc.toml")
    settings.write_text(f"tolerance_mm = 0.02\n{settings.read_text('utf-8')}", "utf-8")
    git("add", str(settings))
    assert before_a_commit() == 1 and f"not as approved: {PROGRAM.as_posix()};" in capsys.readouterr().err
    git("reset", "-q", "--hard")
    old = PROGRAM.read_text("latin-1")
    PROGRAM.write_text(old.replace("pEnd:=[[0,0,0]", "pEnd:=[[0,0,2]"), "latin-1")
    git("add", str(PROGRAM))
    assert before_a_commit() == 1
    git("commit", "-qm", "The seam ends higher")
    capsys.readouterr()
    assert workflow() == [1, 1]
    assert re.search(r"Bracket\.rBracket .*ArcLEnd .* 1\.999 ", capsys.readouterr().out)
    assert "<html" in Path("difference.html").read_text("utf-8")
    assert shell(README[1]) == 0
    assert git("diff", "--stat", "HEAD~1", "--", "approved").startswith(" approved/bracket.mod |")
    assert workflow() == [0] and git("status", "--porcelain") == ""
