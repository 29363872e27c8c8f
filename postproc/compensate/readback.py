"""Which part of the written program belongs to which statement of the original."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np

from postproc.arrays import Array
from postproc.compensate.samples import Samples
from postproc.compensate.targets import Pieces
from postproc.compensate.values import Insertion, key_of
from postproc.motion.values import Index
from postproc.rapid.events import MotionEvent
from postproc.rapid.program import Program


def owners_of(
    program: Program,
    written: Program,
    insertions: Sequence[Insertion],
    events: Sequence[MotionEvent],
    ran: Sequence[MotionEvent],
) -> list[int] | None:
    """Original event of every event of the written program; added statements belong to the one behind them.

    Statements are told apart by their order in the text: before each original stand as many added ones as were planned.
    None where the written program does not run the same statements.
    """
    added = Counter(key_of(i.statement) for i in insertions)
    planned = [key for s in program.statements for key in [None] * added[key_of(s)] + [key_of(s)]]
    if len(planned) != len(written.statements):
        return None
    original = dict(zip(map(key_of, written.statements), planned, strict=True))
    owners: list[int] = []
    at = 0
    for event in ran:
        if at >= len(events):
            return None
        owners.append(at)
        key = original[key_of(event.statement)]
        if key is not None:
            if key != key_of(events[at].statement):
                return None
            at += 1
    return owners if at == len(events) else None


def places_of(programmed: Samples, ran: Samples, owner: Index, pieces: Sequence[Pieces]) -> Array:
    """(n,) where the samples of the program that ran stand on the programmed path, as move + fraction.

    Args:
        owner: (moves of ran,) programmed moves; the parts of a divided move follow each other.
        pieces: how moves were divided.
    """
    edges = {p.move: [0.0, *(float(programmed.u[g]) for g in p.goals), 1.0] for p in pieces if p.goals}
    low, high = np.zeros(len(owner)), np.ones(len(owner))
    part = 0
    for j, i in enumerate(owner.tolist()):
        part = part + 1 if j > 0 and owner[j - 1] == i else 0
        if i in edges:
            low[j], high[j] = edges[i][part], edges[i][part + 1]
    place: Array = owner[ran.move] + low[ran.move] + (high - low)[ran.move] * ran.u
    return place
