"""``python -m tests.worlds.taught [-v] [FAMILY..]``: programs through the product and five worlds, as a table."""

from __future__ import annotations

import sys

from tests.worlds.taught.checking import check
from tests.worlds.taught.programs import FAMILIES, generate

EACH = 7


def main(words: list[str]) -> int:
    """Exit code 1 where a program is harmful in one of the worlds."""
    names = [w for w in words if w in FAMILIES]
    print(f"{'program':34}{'worlds':>7}{'motions':>9}{'added':>7}{'faults':>7}{'before':>9}{'after':>8}")
    harmful = programs = worlds = added = 0
    for task in generate(EACH, names):
        c = check(task)
        programs, harmful = programs + 1, harmful + bool(c.faults)
        worlds, added = worlds + len(c.judged), added + sum(j.added for j in c.judged.values())
        print(c.row, flush=True)
        if "-v" in words:
            for world, fault in c.faults[:6]:
                print(f"    [{world}] {fault}")
    print(f"{harmful} of {programs} programs harmful in {worlds} worlds; {added} added targets judged")
    return 1 if harmful else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
