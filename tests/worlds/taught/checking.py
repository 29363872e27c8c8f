"""One generated program through the product and the worlds in which its targets are taught anew."""

from __future__ import annotations

from dataclasses import dataclass, field

from tests.worlds.interpreter import load
from tests.worlds.product import convert
from tests.worlds.taught.anew import CHANGES, world
from tests.worlds.taught.follow import Judged, judge
from tests.worlds.taught.programs import Task
from tests.worlds.world import World


@dataclass
class Check:
    """What became of a program: by world what was judged there; its text, and how many statements are corrected."""

    name: str
    judged: dict[str, Judged] = field(default_factory=dict)
    refused: str = ""
    output: str = ""
    corrected: int = 0

    @property
    def faults(self) -> list[tuple[str, str]]:
        refused = [("", f"refused: {self.refused}")] if self.refused else []
        return refused + [(name, fault) for name, j in self.judged.items() for fault in j.faults]

    @property
    def row(self) -> str:
        motions, added = (sum(getattr(j, what) for j in self.judged.values()) for what in ("motions", "added"))
        before, after = (
            max([0.0, *(getattr(j, f"{what}_mm") for j in self.judged.values())]) for what in ("before", "after")
        )
        return f"{self.name:34}{len(self.judged):7}{motions:9}{added:7}{len(self.faults):7}{before:9.3f}{after:8.3f}"


def check(task: Task) -> Check:
    result = convert({"t.mod": task.text}, axes=task.cell.axes)
    out = Check(
        task.name, output=result.texts.get("t.mod", ""), corrected=sum(mm > 0 for mm in result.corrections.values())
    )
    if not result.texts:
        out.refused = result.said
        return out
    original, corrected = load([task.text]), load([out.output])
    worlds = {change: world(task, change, 100 + i) for i, change in enumerate(CHANGES)}
    for name, w in {"nominal": World(0), **worlds}.items():
        if w is not None:
            out.judged[name] = judge(task.cell, original, corrected, w)
    return out
