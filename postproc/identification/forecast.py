"""How much of a search lies behind: the time so far over that and the time that is still expected."""

from __future__ import annotations

import time
from collections import deque
from dataclasses import dataclass, field

import numpy as np

from postproc.watch import Watch, unwatched

FIRST_SHARE = 0.06
"""Of a whole diagnosis, what the fit of the model as it came takes: 0.02 to 0.18 on twelve tables."""


@dataclass
class Forecast:
    """The progress of a search, which examines one state after the other and does not know how many will come.

    A state is examined in two parts: every effect of the library, after a fit, and every curve. What they take is
    measured on the last two, since an error map in the model makes them several times as long; how many will come
    follows from what was found, each part of which is taken out once. On eleven tables 71 % of what is told of the
    remaining time after a quarter of the run was right within a factor of two: the pass back may begin again.

    Args:
        watch: is told the step and the share of the work that is done.
        at_last: states that take as long as the fit on all rows.
        begun: when the work began [s]; reported: when the last part ended; effects, curves: what the last parts took.
        most: what was found at most so far; back: how many states of the pass back were examined.
    """

    watch: Watch = unwatched
    at_last: float = 1.0
    begun: float = field(default_factory=lambda: time.monotonic())
    reported: float = field(default_factory=lambda: time.monotonic())
    effects: deque[float] = field(default_factory=lambda: deque(maxlen=2))
    curves: deque[float] = field(default_factory=lambda: deque(maxlen=2))
    most: int = 0
    back: int = 0

    def first(self, step: str, rows: float) -> None:
        """Tell the step after the fit of the model as it came.

        Args:
            rows: how many times as many rows there are as are searched.
        """
        self.most, self.back, self.at_last = 0, 0, rows if rows > 1 else 0.3
        self.reported = time.monotonic()
        if self.effects:  # a search is made again where it denies what it assumed of rounded angles
            self._tell(step, 3.0, 2.0)
        else:
            self.watch(step, FIRST_SHARE)

    def examined(self, count: int, further: bool, curves: bool = False) -> None:
        """Tell the progress after all effects were tried in a state, or all curves.

        Args:
            count: effects and curves that were added to the model; further: whether one more may convince.
            curves: whether curves were tried.
        """
        now = time.monotonic()
        (self.curves if curves else self.effects).append(now - self.reported)
        self.reported = now
        if count < self.most or (self.back and not curves):
            self.back += 1
            states, screens = max(self.most - self.back, 0) + 0.5, 0.0
        else:
            self.most, self.back = count, 0
            states, screens = (count + 1.5, 2.0) if further else (count + 0.5, 1.0)
            screens -= curves
        self._tell("effects and curves one after another", states, screens)

    def last(self, step: str, searches: int) -> None:
        """Tell the step after the search: the fit on all rows, and searches for curves without some of them."""
        self._tell(step, float(searches), 2.0 * searches)

    def _tell(self, step: str, states: float, screens: float) -> None:
        """Tell a step, when so many states and screenings of curves are expected to come before the fit on all rows."""
        each = float(np.mean(self.effects or self.curves))  # a search may be for curves alone
        remaining = (states + self.at_last) * each + screens * float(np.mean(self.curves or [0.4 * each]))
        done = time.monotonic() - self.begun
        self.watch(step, done / max(done + remaining, 1e-9))
