"""The pages in docs/ name options that the commands have; the reference that lists them all is generated."""

from __future__ import annotations

import re

import pytest

from postproc.cli.app import COMMANDS
from tests.conftest import ROOT

from .conftest import Call

PAGES = [*sorted((ROOT / "docs").glob("*.md")), ROOT / "README.md", ROOT / "CONTRIBUTING.md"]
OPTION = re.compile(r"(?<![\w-])--[a-z][a-z-]+")
EVERYWHERE = {"--help", "--version"}


@pytest.mark.parametrize("command", [name for name, *_ in COMMANDS])
def test_options_are_those_of_the_command(call: Call, command: str) -> None:
    short = dict(re.findall(r"(--[a-z-]+) (-[a-z])? ?", call(command, "--help").out))
    text = "\n".join(page.read_text("utf-8") for page in PAGES)
    # A line of usage goes on where the next ones are indented.
    lines = re.findall(rf"^(?:`|\$ )?postproc {command} .*(?:\n {{8,}}.*)*", text, re.MULTILINE)
    assert lines
    named = {option for line in lines for option in OPTION.findall(line.partition("#")[0].split("&& postproc")[0])}
    assert named - short.keys() - EVERYWHERE == set()
