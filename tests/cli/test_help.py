"""``--help``: every command has an example, and what it shows is what the command takes."""

from __future__ import annotations

import shlex

import pytest
from cyclopts import App

from postproc.cli.app import EXAMPLES, GROUPED, build

from .conftest import Call

GROUPS = {name for name, *_ in GROUPED}


def leaves(app: App, before: tuple[str, ...] = ()) -> list[str]:
    """Every command that does something, as it is called."""
    found = []
    for name in app:
        if name.startswith("-"):
            continue
        words = (*before, name)
        found += leaves(app[name], words) if not before and name in GROUPS else [" ".join(words)]
    return found


@pytest.mark.parametrize("command", leaves(build()))
def test_every_command_shows_an_example_that_it_takes(call_as_written: Call, command: str) -> None:
    shown = call_as_written(*command.split(), "--help").out
    example = EXAMPLES[command]
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
