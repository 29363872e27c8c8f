"""``python -m tests.worlds [FILES..]``: programs through the product and five worlds, as a table."""

from __future__ import annotations

import sys
from pathlib import Path

from tests.worlds.checking import Check, check, grouped, tasks


def row(c: Check) -> str:
    goal = max([0.0, *(o.goal_mm for o in c.outcomes)])
    added = max([0.0, *(o.added_mm for o in c.outcomes)])
    bad = sum(bool(o.faults) for o in c.outcomes)
    return f"{c.name:34}{len(c.outcomes):7}{bad:5}{c.statements:11}{c.corrected:10}{c.kept:6}{goal:10.3f}{added:10.3f}  {c.verdict}"


def main(names: list[str]) -> int:
    """Exit code 1 where a program is not the same in every world."""
    words = [w for w in names if w != "-v"]
    groups = grouped([Path(n) for n in words]) if words else tasks()
    print(
        f"{'program':34}{'worlds':>7}{'bad':>5}{'statements':>11}{'corrected':>10}{'named':>6}{'goal':>10}{'added':>10}  verdict"
    )
    bad = 0
    for paths in groups:
        c = check(paths)
        print(row(c), flush=True)
        bad += c.verdict == "different"
        if c.refused:
            print(f"    {c.refused[:200]}")
        if "-v" in names:
            for world, fault in c.faults[:12]:
                print(f"    [{world}] {fault[:220]}")
    print(f"{bad} of {len(groups)} programs do something else")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
