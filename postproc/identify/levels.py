"""What was found, asked for levels of a channel that no fit has seen: the figures and their words."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from postproc.fit.errors import mm

CLEARLY = 0.98
"""Share of the error without an effect below which a level is predicted better with it."""


@dataclass(frozen=True)
class Level:
    """One level that was held out.

    Args:
        name: the level; rows: how many it has. before, after: rms of what was observed there, predicted by a fit
            without these rows [m], [rad] of angles: of the model as it came, and with all that was found.
        without: the same with all but one of the effects that were found, by its key. untold: effects of which the
            other levels determine nothing.
    """

    name: str
    rows: int
    before: float
    after: float
    without: Mapping[str, float]
    untold: tuple[str, ...] = ()

    def carries(self, key: str) -> bool | None:
        """Whether an effect predicts this level better than the others do without it; None where no fit can tell."""
        return None if key in self.untold else self.after < CLEARLY * self.without[key]


@dataclass(frozen=True)
class Intervention:
    """What was found, asked for each level of one channel that no fit has seen."""

    channel: str
    levels: tuple[Level, ...]
    unit: str

    def fails(self, key: str) -> list[str]:
        """Levels to which an effect that was found does not carry over."""
        return [level.name for level in self.levels if level.carries(key) is False]

    def as_json(self) -> dict[str, Any]:
        """An entry of a diagnosis, ``hold_out``."""
        return {
            "channel": self.channel,
            "levels": [
                {
                    "level": level.name,
                    "rows": level.rows,
                    f"rms_{self.unit}": mm(level.before),
                    f"rms_{self.unit}_after": mm(level.after),
                    "does_not_carry_over": [key for key in level.without if level.carries(key) is False],
                    "cannot_be_told": list(level.untold),
                }
                for level in self.levels
            ],
        }

    def text(self) -> str:
        """A line for each level, then the names that do not carry over."""
        lines = [f"Held out by {self.channel}, {self.unit} on rows of a level that no fit has seen:"]
        width = max(len(level.name) for level in self.levels)
        for level in self.levels:
            lines.append(
                f"  {level.name:{width}s}  {level.rows:5d} rows   {1e3 * level.before:.3f} as it came, "
                f"{1e3 * level.after:.3f} with what was found"
            )
        for key in self.levels[0].without:
            if levels := self.fails(key):
                lines.append(f"`{key}` does not carry over to {', '.join(levels)}: doubt that it is the cause.")
        return "\n".join(lines)
