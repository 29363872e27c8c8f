"""Which part of the written program belongs to which statement of the original."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from postproc.arrays import Array
from postproc.compensate.samples import Samples
from postproc.compensate.targets import Pieces
from postproc.motion.values import Index
from postproc.rapid.edits import Edit
from postproc.rapid.events import MotionEvent


def owners_of(
    events: Sequence[MotionEvent], ran: Sequence[MotionEvent], edits: Mapping[str, Sequence[Edit]]
) -> list[int] | None:
    """Original event of every event of the corrected program; added statements belong to the one behind them."""
    places: dict[str, dict[int, int]] = {}
    for path, changes in edits.items():
        starts = sorted({e.statement.span[0] for e in events if e.statement.source.path == path})
        ordered = sorted(changes, key=lambda e: (e.start, e.end))
        shift, k = 0, 0
        places[path] = {}
        for start in starts:
            while k < len(ordered) and ordered[k].end <= start:
                shift += len(ordered[k].text) - (ordered[k].end - ordered[k].start)
                k += 1
            places[path][start + shift] = start
    owners: list[int] = []
    at = 0
    for event in ran:
        original = places[event.statement.source.path].get(event.statement.span[0])
        if at >= len(events):
            return None
        owners.append(at)
        if original is not None:
            if original != events[at].statement.span[0]:
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
