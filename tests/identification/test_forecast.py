"""The progress of a search: what is told of the time that remains."""

from __future__ import annotations

import pytest

import postproc.identification.forecast as forecast
from postproc.identification.forecast import Forecast


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    now = [0.0]
    monkeypatch.setattr(forecast.time, "monotonic", lambda: now[0])
    return now


def remaining(told: list[tuple[str, float]], now: float) -> float:
    """The time that follows from the share that was told last [s]."""
    return now / told[-1][1] - now


def test_a_search_that_becomes_slower_tells_what_its_last_states_say(clock: list[float]) -> None:
    """With a map in the model every state takes ten times as long; the fit of four times the rows is expected, too."""
    told: list[tuple[str, float]] = []
    one = Forecast(lambda step, share: told.append((step, share)))
    clock[0] = 0.2
    one.first("every effect alone", 4.0)
    for found, further, curves, took in [
        (0, True, False, 0.5),
        (0, True, True, 0.2),
        (1, False, False, 5.0),
        (1, False, True, 2.0),
        (0, True, False, 5.0),
    ]:
        clock[0] += took
        one.examined(found, further, curves)
    assert 18 < remaining(told, clock[0]) < 26  # half a state and four more
    one.last("all of it on all rows", 0)
    assert remaining(told, clock[0]) == pytest.approx(20.0)


def test_what_is_found_makes_the_rest_longer(clock: list[float]) -> None:
    shares: list[float] = []
    one = Forecast(lambda step, share: shares.append(share))
    one.first("every effect alone", 1.0)
    for found, further in [(0, True), (1, True), (2, True), (3, False)]:
        clock[0] += 1.0
        one.examined(found, further)
    rest = [t / share - t for t, share in zip([1, 2, 3, 4], shares[1:], strict=True)]
    assert rest[0] < rest[1] < rest[2] > rest[3]


def test_a_search_that_is_made_again_has_not_ended(clock: list[float]) -> None:
    told: list[tuple[str, float]] = []
    one = Forecast(lambda step, share: told.append((step, share)))
    for _ in range(2):
        one.first("every effect alone", 1.0)
        assert told[-1][1] < 0.6
        clock[0] += 3.0
        one.examined(0, False)
        one.last("all of it on all rows", 0)
        assert told[-1][1] > 0.7
