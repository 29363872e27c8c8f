"""Branches that set data and move nothing, on what only the controller knows: which station, which part.

    TEST GInput(giStation) CASE 1: wAct:=wLeft; CASE 2: wAct:=wRight; ENDTEST

Where motions need what they set, the program is followed once for each choice, the same at the same branch every time.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence, Set
from dataclasses import dataclass
from itertools import product
from math import prod

from postproc.rapid.data.events import MotionEvent
from postproc.rapid.data.values import Data
from postproc.rapid.unknown import Kind, Unknown

MOST_COMBINATIONS = 8  # of arms that are followed, each in a walk of its own

Place = tuple[str, int]  # path and offset of a statement
Ends = Mapping[int, Mapping[str, Data] | None]


@dataclass(frozen=True, slots=True)
class Choice:
    """What is known of an IF or TEST that moves nothing and of which several arms are possible.

    Args:
        arms: numbers of the possible arms; the number of all arms stands for taking none of them.
        keys: keys of the data that the branch may change.
        certain: those keys that every arm sets, to the same value whenever that arm is taken, also in a loop. A counter
            is not among them, nor is data that one arm sets and another does not.
        values: for each arm, the data at its end by key.
        may_return: an arm may end the routine by RETURN.
    """

    arms: tuple[int, ...]
    keys: frozenset[str]
    certain: frozenset[str]
    values: Mapping[int, Mapping[str, Data | None]]
    may_return: bool


class SplitBranches:
    """IF and TEST statements that set data, move nothing, and are decided by what only the controller knows.

    Each arm of them can be followed in a walk of its own.

    Args:
        forced: by the place of a branch, number of the arm that this walk takes; the number of all arms: none of them.
        choices: what is known of each branch, also from earlier walks, by place.
    """

    def __init__(self, forced: Mapping[Place, int] | None = None, choices: dict[Place, Choice] | None = None) -> None:
        """Start a walk in which the branches in ``forced`` take these arms; ``choices`` is shared by all walks."""
        self.forced = forced or {}
        self.choices = {} if choices is None else choices
        self.taken: set[Place] = set()

    def again(self, place: Place) -> bool:
        """Record that the forced branch at this place is run; True if this walk has run it before."""
        before = place in self.taken
        self.taken.add(place)
        return before

    def met(self, place: Place, ends: Ends, keys: Set[str], written: Sequence[Set[str]], may_return: bool) -> None:
        """Record a branch that moves nothing and of which several arms are possible.

        Args:
            ends: data by key at the end of each arm, by the arm's number; None for the way on which no arm is taken.
            keys: keys of the data that the branch may change; written: those that each arm may change.
            may_return: whether an arm may end the routine by RETURN.
        """
        if len(ends) > MOST_COMBINATIONS:  # too many to follow, whatever they set
            self.choices[place] = Choice((), frozenset(keys), frozenset(), {}, may_return)
            return
        setting = {arm: written[arm] for arm, end in ends.items() if end is not None and written[arm]}
        values = {arm: {key: (ends[arm] or {}).get(key) for key in keys} for arm in setting}
        known = self.choices.get(place)
        if known is None:
            set_by_all = frozenset(keys).intersection(*setting.values())
            known = Choice((), frozenset(keys), frozenset(k for k in set_by_all if k[0] != "%"), {}, may_return)
        certain = frozenset(
            key
            for key in known.certain
            for now in [[at_end[key] for at_end in values.values()]]
            if not any(isinstance(value, Unknown) for value in now)
            and all(known.values.get(arm, at_end)[key] == at_end[key] for arm, at_end in values.items())
        )
        arms = tuple(sorted({*known.arms, *ends}))
        self.choices[place] = Choice(
            arms, known.keys | keys, certain, {**values, **known.values}, known.may_return or may_return
        )

    def lacking(self, events: Iterable[MotionEvent]) -> dict[Place, tuple[int, ...]]:
        """The possible arms, by place, of branches not forced that set data which some motion needs but lacks."""
        undecided = {
            unknown.root.key for event in events for unknown in event.unknowns if unknown.root.kind is Kind.UNDECIDED
        }
        return {
            place: choice.arms
            for place, choice in self.choices.items()
            if place not in self.forced
            and not (choice.may_return and choice.keys - choice.certain)
            and not undecided.isdisjoint(choice.certain)
        }


def combinations(branches: Mapping[Place, tuple[int, ...]]) -> list[dict[Place, int]]:
    """Every choice of one arm for each branch, by place; an empty list if there are more than ``MOST_COMBINATIONS``.

    Args:
        branches: numbers of the possible arms of each branch, by its place.
    """
    if prod(map(len, branches.values())) > MOST_COMBINATIONS:
        return []
    return [dict(zip(branches, chosen, strict=True)) for chosen in product(*branches.values())]
