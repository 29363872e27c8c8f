"""``postproc schema KIND``: the JSON Schema of a file that people write."""

from __future__ import annotations

from typing import Literal

from postproc.cli.printing import put

Kind = Literal["model", "settings", "jobs", "columns", "robot"]


def run(kind: Kind, /) -> None:
    """Print the JSON Schema of a kind of file, for editors that complete and check it.

    Args:
        kind: model file, postproc.toml (settings), jobs file of a batch, column map of a table, or arm.
    """
    from json import dumps

    from postproc.cli.look_up.schemas import schema_of

    put(dumps(schema_of(kind), indent=2))
