"""What the pages state as figures: each text is made by a run of the product, by the name between the marks.

``score`` and ``speed`` read the records that ``python -m tests.bench.diagnosis --card`` and ``make bench`` write; all
others come from commands that run here.
"""

from __future__ import annotations

import json
import tempfile
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path
from typing import Any

import welding
from blocks import run_postproc

from postproc.effects.registry import BUILT_IN

DOCS = Path(__file__).resolve().parent
HULL = ("samples/hull_seam.mod", "--force", "200,-200,-200")
BY_WEIGHTS = ("samples/corner_arc.mod", "--robot", "irb2600_20_165")
"""A program and an arm whose links, of estimated masses, make nearly all of the deflection by their weight."""


@cache
def conversion(*arguments: str) -> dict[str, Any]:
    """The document of ``compensate`` with these arguments, paths from the root of the repository."""
    program, *options = arguments
    with tempfile.TemporaryDirectory() as folder:
        found = Path(folder) / "found.json"
        written = ["-o", str(Path(folder) / "out.mod"), "--json"]
        code, text = run_postproc(["compensate", str(DOCS.parent / program), *options, *written], found)
        assert code == 0, text
        result: dict[str, Any] = json.loads(found.read_text("utf-8"))
    return result


def hull(key: str, digits: int) -> str:
    """A figure [mm] of the seam of the first tutorial."""
    return f"{conversion(*HULL)['figures'][0][key]:.{digits}f}"


def hull_expected() -> str:
    low, high = conversion(*HULL)["figures"][0]["expected_on_arm_mm"]
    return f"{low:.2f} to {high:.2f} mm"


def remaining_share(arguments: tuple[str, ...], key: str) -> str:
    """A share [%] of the deflection that is expected to remain on an arm of the type."""
    low, high = (100.0 * share for share in conversion(*arguments)[key])
    return f"{low:.0f} to {high:.0f} %"


@cache
def cells(page: str, row: str) -> Mapping[str, tuple[str, ...]]:
    """Cells of every row of a record's tables that begins with a name, by the first two titles of its table."""
    found: dict[str, tuple[str, ...]] = {}
    titles: tuple[str, ...] = ()
    for line in (DOCS / page).read_text("utf-8").splitlines():
        if not line.startswith("|"):
            titles = ()
            continue
        parts = tuple(part.strip() for part in line.strip("|").split("|"))
        titles = titles or parts
        if parts[0] == row:
            found["/".join(titles[:2])] = parts
    return found


def score(row: str, title: str, column: int) -> str:
    return cells("scorecard.md", row)[title][column]


def speed(row: str) -> str:
    """The median and its unit."""
    _, _, median, _, unit, *_ = cells("benchmarks.md", row)["figure/min"]
    return f"{median} {unit}"


@cache
def abb_arms() -> Mapping[str, bool]:
    """The ABB arms of the library by name, without the misprinted one; whether their kinematics are computed."""
    with tempfile.TemporaryDirectory() as folder:
        found = Path(folder) / "robots.json"
        run_postproc(["robots", "list", "--json"], found)
        robots = json.loads(found.read_text("utf-8"))["robots"]
    names = [arm["name"] for arm in robots if arm["name"].startswith("irb") and not arm["name"].endswith("_seed")]
    return {arm["name"]: not arm["parallelogram"] for arm in robots if arm["name"] in names}


MADE: Mapping[str, Callable[[], str]] = {
    "welding": welding.rows,
    "hull-before": lambda: hull("before_mm", 2),
    "hull-after": lambda: hull("after_mm", 2),
    "hull-expected": hull_expected,
    "hull-share": lambda: remaining_share(HULL, "expected_remaining_fraction"),
    "hull-gauge-share": lambda: remaining_share(HULL, "expected_remaining_fraction_after_gauge"),
    "weights-gauge-share": lambda: remaining_share(BY_WEIGHTS, "expected_remaining_fraction_after_gauge"),
    "sets": lambda: score("all", "kind/sets", 1),
    "sets-right": lambda: score("all", "kind/sets", 2),
    "effects-found": lambda: score("all", "kind/found", 1),
    "needless-names": lambda: score("all", "kind/found", 2),
    "intervals-hold": lambda: score("all", "kind/found", 6),
    "clean-sets": lambda: score("clean", "kind/sets", 1),
    "clean-right": lambda: score("clean", "kind/sets", 2),
    "ur10-before": lambda: score("ur10_iso_b", "table/base", 1),
    "ur10-after": lambda: score("ur10_iso_b", "table/base", 3),
    "ur5-before": lambda: score("ur5_grid", "table/base", 1),
    "ur5-after": lambda: score("ur5_grid", "table/base", 3),
    "speed-start": lambda: speed("`compensate` the small sample, imports too"),
    "speed-targets": lambda: speed("`compensate` 20,000 targets"),
    "speed-reading": lambda: speed("reading 20,000 targets"),
    "speed-following": lambda: speed("reading and following 20,000 targets"),
    "arms": lambda: str(len(abb_arms())),
    "arms-computed": lambda: str(sum(computed for computed in abb_arms().values())),
    "effects": lambda: str(len([cls for cls in BUILT_IN if cls.key != "curve"])),  # a curve has no physical name
    "speed-diagnose": lambda: speed("`diagnose` 1,316 rows"),
}
"""Texts between ``<!-- made: NAME -->`` and ``<!-- end -->``, by name."""
