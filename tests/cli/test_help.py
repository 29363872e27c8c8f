"""``--help`` and the pages: every command has an example, and what is shown is what the command takes."""

from __future__ import annotations

import re
import shlex

import pytest
from cyclopts import App

from postproc.cli.app import COMMANDS, EXAMPLES, GROUPED, build
from tests.conftest import ROOT

from .conftest import Call

GROUPS = {name for name, *_ in GROUPED}
PAGES = [*sorted((ROOT / "docs").glob("*.md")), ROOT / "README.md", ROOT / "CONTRIBUTING.md"]
OPTION = re.compile(r"(?<![\w-])--[a-z][a-z-]+")


def leaves(app: App, before: tuple[str, ...] = ()) -> list[str]:
    """Every command that does something, as it is called."""
    commands = []
    for name in app:
        if not name.startswith("-"):
            words = (*before, name)
            commands += leaves(app[name], words) if not before and name in GROUPS else [" ".join(words)]
    return commands


@pytest.mark.parametrize("command", leaves(build()))
def test_every_command_shows_an_example_that_it_takes(call_as_written: Call, command: str) -> None:
    shown, example = call_as_written(*command.split(), "--help").out, EXAMPLES[command]
    assert f"Example: postproc {example}" in " ".join(shown.split())
    assert "Exit codes: 0 done" in shown
    assert f"{example} ".startswith(f"{command} ")
    words = shlex.split(example.partition(" > ")[0])
    _, bound, *_ = build().parse_args(words, print_error=False, exit_on_error=False)
    assert bound.arguments or command.endswith("list")


@pytest.mark.parametrize("group", ["", *sorted(GROUPS)])
def test_groups_of_commands_show_one_of_theirs(call_as_written: Call, group: str) -> None:
    shown = " ".join(call_as_written(*group.split(), "--help").out.split())
    assert "Example: postproc " + (f"{group} " if group else "compensate ") in shown


@pytest.mark.parametrize("command", [name for name, *_ in COMMANDS])
def test_options_on_pages_are_those_of_the_command(call: Call, command: str) -> None:
    taken = dict(re.findall(r"(--[a-z-]+) (-[a-z])? ?", call(command, "--help").out))
    text = "\n".join(page.read_text("utf-8") for page in PAGES)
    # A line of usage goes on where the next ones are indented.
    lines = re.findall(rf"^(?:`|\$ )?postproc {command} .*(?:\n {{8,}}.*)*", text, re.MULTILINE)
    assert lines
    named = {option for line in lines for option in OPTION.findall(line.partition("#")[0].split("&& postproc")[0])}
    assert named - taken.keys() - {"--help", "--version"} == set()
