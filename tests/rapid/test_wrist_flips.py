r"""``SingArea\Wrist`` where the configurations of a line's ends ask for it."""

from __future__ import annotations

import pytest

from postproc.rapid.execution.walk import walk_program
from tests.rapid.build import module, program, target

A, B = target(900, 0, 700, conf="[0,-1,1,0]"), target(900, 50, 700, conf="[0,1,-1,1]")


def found(body: str) -> tuple[list[bool | None], list[str]]:
    walked = walk_program(program(module(f"MoveJ {A},v5,fine,tool0; {body}")))
    return [e.options.get("wrist_in_joints") for e in walked.events], [d.code for d in walked.diagnostics]


@pytest.mark.parametrize(
    ("body", "settings"),
    [
        (f"SingArea\\Wrist; MoveL {A},v5,z0,tool0; SingArea\\Off; MoveL {B},v5,z0,tool0;", [False, True, True]),
        (f"SingArea\\Wrist; MoveL {A},v5,z0,tool0; SingArea\\Off; MoveJ {B},v5,z0,tool0;", [False, True, False]),
        (f"MoveL {B},v5,z0,tool0;", [False, False]),
        (f"SingArea\\LockAxis4; MoveL {A},v5,z0,tool0;", [False, True]),
        (f"ConfL\\Off; SingArea\\Wrist; MoveL {A},v5,z0,tool0; SingArea\\Off; MoveL {B},v5,z0,tool0;",
         [False, True, False]),
    ],
)  # fmt: skip
def test_a_line_over_a_flipped_wrist_takes_the_setting_that_the_program_uses(body: str, settings: list[bool]) -> None:
    own, codes = found(body)
    assert own == settings
    assert ("RAP026" in codes) == (settings == [False, True, True])
