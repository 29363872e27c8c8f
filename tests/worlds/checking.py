"""One program through the product and the worlds."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from tests.worlds.alignment import identities, name_kept
from tests.worlds.compare import Outcome, compare_worlds
from tests.worlds.interpreter import Interpreter, load
from tests.worlds.motions import ROLES
from tests.worlds.outside import entries
from tests.worlds.product import Converted, RunTime, convert
from tests.worlds.real_arm import RealArm
from tests.worlds.syntax import Module, annotations
from tests.worlds.world import World, by_every_way, five

PROGRAMS = Path(__file__).parent / "programs"


@dataclass
class Check:
    """What became of a program: outcomes by world, statements, corrected ones, those that keep their names.

    Where targets go through the function: how far from them the real TCP is [mm], and how many came back as they were.
    """

    name: str
    outcomes: list[Outcome] = field(default_factory=list)
    statements: int = 0
    corrected: int = 0
    kept: int = 0
    refused: str = ""
    reached_mm: list[float] = field(default_factory=list)
    came_back: int = 0

    @property
    def faults(self) -> list[tuple[str, str]]:
        return [(o.world, f) for o in self.outcomes for f in o.faults]

    @property
    def verdict(self) -> str:
        if self.refused:
            return "refused"
        return "different" if self.faults else "same"


def tasks(folder: Path = PROGRAMS) -> list[list[Path]]:
    """The programs of a folder, task by task."""
    return grouped(sorted(folder.glob("*.mod")) + sorted(folder.glob("*.sys")))


def grouped(paths: list[Path]) -> list[list[Path]]:
    """Programs by task: its files share what stands before ``_part`` in their names."""
    out: dict[str, list[Path]] = {}
    for path in paths:
        out.setdefault(path.name.split(".")[0].split("_part")[0], []).append(path)
    return [out[k] for k in sorted(out)]


def seed_of(name: str) -> int:
    return 1000 + 10 * (sum(i * ord(c) for i, c in enumerate(name, 1)) % 9973)


def check(
    paths: list[Path], converted: Converted | None = None, run_time: RunTime = "off", every_way: bool = False
) -> Check:
    """Corrects the files of a task and compares them with the originals in five worlds, or by every way."""
    texts = {p.name: p.read_text("latin-1") for p in paths}
    out = Check(paths[0].stem)
    says: dict[str, list[str]] = {}
    for text in texts.values():
        says |= annotations(text)
    result = converted or convert(texts, float(says.get("tolerance", ["0.01"])[0]), run_time)
    if not result.texts:
        out.refused = result.said
        return out
    original, corrected = load(texts.values()), load([*{**texts, **result.texts}.values(), result.module])
    _count(out, original, corrected, result)
    # Statements are known by their lines; those of several files may share one, the larger correction holds.
    bounds: dict[int, float] = {}
    for (_, line), mm in result.corrections.items():
        bounds[line] = max(bounds.get(line, 0.0), mm)
    real = RealArm(result.through)
    worlds = five(seed_of(out.name), says)
    if every_way:
        worlds = by_every_way(seed_of(out.name), says, entries(Interpreter(original, World(0, says=says))))
    out.outcomes = [compare_worlds(original, corrected, bounds, w, real) for w in worlds]
    out.reached_mm, out.came_back = real.distances, real.came_back
    return out


def _count(out: Check, original: list[Module], corrected: list[Module], result: Converted) -> None:
    matched = identities(original, corrected)
    old = {(m.name, r.name, s.index): s for m in original for r in m.routines for s in r.flat}
    for s, (identity, added) in matched.items():
        if s.kind == "call" and s.parts["name"] in ROLES and not added:
            out.statements += 1
            mm = max([0.0, *(v for (_, line), v in result.corrections.items() if line == old[identity].line)])
            if mm > 0:
                out.corrected += 1
                out.kept += name_kept(old[identity], s)
