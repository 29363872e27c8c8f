"""A program timed leg by leg moves as it does when it is timed as a whole."""

from __future__ import annotations

import numpy as np

from postproc.motion.path.samples import sample_path
from postproc.motion.timing.trajectory import cut_legs, retime
from postproc.motion.values import Move
from tests.motion.build import ROBOT, chain, joint, line, pose


def rows() -> list[Move]:
    """Four welded rows of three targets with a stop at either end, and a lone move after them."""
    steps = [joint(pose(1.1, -0.1, 0.5), fine=True)]
    for row in range(4):
        x = 1.1 + 0.01 * row
        steps += [line(pose(x, y, 0.5), speed=0.02, zone=0.001, fine=y == 0.1, welding=True) for y in (-0.05, 0.0, 0.1)]
        steps.append(line(pose(x + 0.01, -0.1, 0.5), speed=0.5, fine=True))
    steps.append(joint(pose(1.2, 0.2, 0.6), first=True))
    return chain(*steps)


def test_legs_cover_the_program_and_meet_at_stops() -> None:
    moves = tuple(rows())
    legs = list(cut_legs(moves, np.full(len(moves), 10), most=35))
    assert len(legs) > 3
    done = 0
    for first, leg in legs:
        assert leg[0].first
        goes_on = first < done
        assert goes_on == (first == done - 1) and (goes_on or first == done)
        assert not goes_on or moves[first].fine
        assert [m.row for m in leg] == [m.row for m in moves[first : first + len(leg)]]
        done = first + len(leg)
    assert done == len(moves)


def test_legs_are_timed_as_the_whole_is() -> None:
    moves = tuple(rows())[:-1]
    period = 0.1
    path, _ = sample_path(ROBOT, moves)
    whole = retime(ROBOT, path, np.full(len(path.q), period))
    place = path.move + path.u
    begin = 0.0
    for first, leg in cut_legs(moves, np.full(len(moves), 10), most=35):
        part, found = sample_path(ROBOT, leg)
        assert not found
        timed = retime(ROBOT, part, np.full(len(part.q), period))
        inside = slice(1, None)  # a stop may be left at another time than it is reached
        at = (first + part.move + part.u)[inside]
        assert np.isin(at, place).all()
        k = np.searchsorted(place, at)
        assert np.abs(part.q[inside] - path.q[k]).max() < 1e-9
        assert np.abs(begin + timed.t[inside] - whole.t[k]).max() < 1e-3 * whole.t[-1]
        assert np.abs(timed.v[inside] - whole.v[k]).max() < 1e-3
        assert np.abs(timed.a[inside] - whole.a[k]).max() < 0.01 * np.abs(whole.a).max()
        begin += timed.t[-1]
    assert abs(begin - whole.t[-1]) < 1e-3 * whole.t[-1]
