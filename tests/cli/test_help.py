"""``--help``: every command has an example, and what it shows is what the command takes."""

from __future__ import annotations

import shlex
from pathlib import Path

import pytest
from cyclopts import App

from postproc.cli.app import EXAMPLES, SUBCOMMANDS, build

from .conftest import Call

GROUPS = {name for name, *_ in SUBCOMMANDS}


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


def test_the_first_line_says_what_is_assumed(call: Call, samples: Path, tmp_path: Path) -> None:
    """Arm, effects and noise where a table is read; arm, tolerances and scope where a program is."""
    table, model = samples / "measurements" / "simulated_backlash.csv", samples / "models" / "irb4600_60_205.toml"
    taken = f"arm `irb4600_60_205`; effects joint_compliance; noise from the table; model `{model}`"
    assert call("compare", model, table).err.splitlines()[0] == taken
    assert call("predict", model, table, "-o", tmp_path / "p.csv").err.splitlines()[0] == taken.replace(
        "; noise from the table", ""
    )
    words = ("fit", table, "--robot", "irb4600_60_205", "--effects", "instrument_frame,tool_frame", "--noise", "0.03")
    fitted = call(*words, "-o", tmp_path / "m.toml").err.splitlines()[0]
    assert (
        fitted
        == "arm `irb4600_60_205`; effects instrument_frame, tool_frame; noise 0.03 mm per axis; arm from `--robot`"
    )
    read = call("inspect", samples / "corner_arc.mod").err.splitlines()[0]
    assert read == "arm `irb4600_60_205` (from --robot); tolerance 0.1 mm, 0.2 mm in the air; scope all"
