"""A file that is read along and holds corrected targets already: a story of two conversions."""

from __future__ import annotations

from postproc.diagnostics import Source
from tests.build import convert, module, target


def test_a_lent_file_that_was_compensated_before_is_found_out() -> None:
    """Statements that use its targets would be corrected twice."""
    own = module("", f"MoveJ {target(1290, -500)},v100,fine,tT;\nMoveL shared,v100,fine,tT;")
    library = module(f"CONST robtarget shared:={target(1300, -500)};", "MoveL shared,v100,fine,tT;")
    library = library.replace("MODULE M", "MODULE Lib").replace("PROC main", "PROC r")
    library = "\n".join(line for line in library.splitlines() if "PERS" not in line or "tT:=" in line)
    own = "\n".join(line for line in own.splitlines() if "tT:=" not in line)
    once = convert(library).outputs["m.mod"]
    assert convert(own, None, [Source("lib.mod", library.encode(), True)]).outputs
    found = convert(own, None, [Source("lib.mod", once, True)])
    ((code, path, help_),) = [(d.code, d.source.path, d.help) for d in found.diagnostics if d.source is not None]
    assert (code, path, help_, found.exit_code) == ("CMP001", "lib.mod", "lend the original", 1)
