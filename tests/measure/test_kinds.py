"""Kinds of readings in place of positions: what they read, by plain formulas and differences, and how tables name them."""

from __future__ import annotations

import numpy as np
import pytest

from postproc.channels.state import State
from postproc.diagnostics import PostprocError, Source
from postproc.measure.kinds.base import Readings
from postproc.measure.kinds.observed import READING_KINDS, kind_of, observed, start_of
from postproc.measure.measurements import Measurements
from postproc.measure.read.table import read_measurements
from postproc.measure.read.together import read_tables
from postproc.robot.catalogue import load_robot

ROBOT = load_robot("irb4600_60_205")
NAMES = ("tip a", "plane b", "anchor c", "gauge d", "from 7")
UNKNOWN = {
    "tip a": [0.1, -0.2, 0.3, 0, 0, 0],
    "plane b": [0, 0, 0, 0.4, -0.9, 0.7],
    "anchor c": [0.5, 0.2, 0.1, 0, 0, 2e-3],
    "gauge d": [0, 0, 0, 0, 0, 0.4],
    "from 7": [0] * 6,
}


def rows(seed: int = 0) -> tuple[State, Readings, np.ndarray, np.ndarray]:
    """Two rows of each kind, in another order, at random points; the two of the pair are its ends."""
    g = np.random.default_rng(seed)
    setup = np.array([4, 0, 1, 2, 3, 3, 2, 1, 0, 4])
    state = State(q=np.zeros((10, 6)), setup=setup, setup_names=NAMES)
    direction = g.normal(size=(10, 3))
    direction /= np.linalg.norm(direction, axis=1)[:, None]
    sign = np.where(setup == 4, 1.0, 0.0)
    sign[9] = -1.0
    unknown = np.array([UNKNOWN[NAMES[k]] for k in setup], dtype=float)
    return state, Readings(np.zeros((10, 3)), direction, sign), g.normal(size=(10, 3)), unknown


def formula(name: str, p: np.ndarray, x: np.ndarray, n: np.ndarray) -> np.ndarray:
    """What one row reads, written from the definition."""
    if name.startswith("tip"):
        return p - x[:3]
    if name.startswith("anchor"):
        return np.array([np.sqrt(((p - x[:3]) ** 2).sum()) - x[5]])
    if name.startswith("gauge"):
        return np.array([n @ p - x[5]])
    angle = np.hypot(x[3], x[4])  # Rodrigues: z turned about (a, b, 0)
    axis = np.array([x[3], x[4], 0.0]) / angle
    z = np.array([0.0, 0.0, 1.0])
    normal = z * np.cos(angle) + np.cross(axis, z) * np.sin(angle) + axis * (axis @ z) * (1 - np.cos(angle))
    return np.array([normal @ p - x[5]])


def test_rows_read_what_their_formula_says() -> None:
    state, readings, p, x = rows()
    seen = observed(state, readings, p, x)
    for i in range(1, 9):
        wanted = formula(state.setup_of_rows[i], p[i], x[i], readings.direction[i])
        np.testing.assert_allclose(seen.value[i, : len(wanted)], wanted, atol=1e-12)
        assert np.isnan(seen.value[i, len(wanted) :]).all()
    assert seen.value[0, 0] + seen.value[9, 0] == pytest.approx(np.linalg.norm(p[0] - p[9]))


@pytest.mark.parametrize("by", ["point", "unknown"])
def test_derivatives_are_those_of_central_differences(by: str) -> None:
    state, readings, p, x = rows(3)
    seen, h = observed(state, readings, p, x), 1e-6
    for k in range(3 if by == "point" else 6):
        step = np.zeros((10, 3 if by == "point" else 6))
        step[:, k] = h
        ends = (
            [observed(state, readings, p + s * step, x) for s in (1, -1)]
            if by == "point"
            else [observed(state, readings, p, x + s * step) for s in (1, -1)]
        )
        slope = np.nan_to_num(ends[0].value - ends[1].value) / (2 * h)
        exact = seen.by_point[:, :, k] if by == "point" else seen.by_unknown[:, :, k]
        used = np.isin(np.arange(10), range(1, 9))
        if by == "unknown":  # an anchor's zero is -1 in any case, no other kind has a point and a zero
            own = {"tip": (0, 1, 2), "plane": (3, 4, 5), "anchor": (0, 1, 2, 5), "gauge": (5,)}
            used &= np.array([k in own.get(name.split()[0], ()) for name in state.setup_of_rows])
        np.testing.assert_allclose(slope[used], exact[used], atol=1e-8)


def test_both_ends_of_a_pair_add_up_to_the_derivative_of_the_distance() -> None:
    state, readings, p, x = rows(5)
    seen, apart = observed(state, readings, p, x), p[0] - p[9]
    np.testing.assert_allclose(seen.by_point[0, 0], apart / np.linalg.norm(apart), atol=1e-12)
    np.testing.assert_allclose(seen.by_point[9, 0], -apart / np.linalg.norm(apart), atol=1e-12)
    assert seen.by_unknown[0, 0, 5] == -seen.by_unknown[9, 0, 5] != 0
    alone = observed(state.rows(slice(0, 5)), readings.rows(slice(0, 5)), p[:5], x[:5])
    assert np.isnan(alone.value[0, 0])
    assert not alone.by_point[0].any()


@pytest.mark.parametrize("name", NAMES[:4])
def test_a_start_finds_the_set_up_though_a_fifth_of_its_rows_is_wrong(name: str) -> None:
    g, x = np.random.default_rng(1), np.array(UNKNOWN[name], dtype=float)
    n, kind = 25, kind_of(name)
    p, direction = g.normal(size=(n, 3)), np.tile([0.6, 0.0, 0.8], (n, 1))
    if name.startswith("tip"):
        p = x[:3] + 1e-5 * p
    if name.startswith("plane"):
        off = np.array([formula(name, q, x, direction[0])[0] for q in p])
        normal = np.array([formula(name, e, np.append(x[:5], 0.0), direction[0])[0] for e in np.eye(3)])
        p = p - off[:, None] * normal
    x[5] *= name != "anchor c"  # whose zero is only known to be open
    numbers = np.full((n, 3), np.nan)
    reads = name.startswith(("anchor", "gauge"))
    for i in range(n):
        numbers[i, : kind.each] = formula(name, p[i], x, direction[i]) if reads else 0.0
    p[:5] += 0.3
    state = State(q=np.zeros((n, 6)), setup=np.zeros(n, dtype=int), setup_names=(name,))
    found = start_of(state, Readings(numbers, direction, np.zeros(n)), p, name)
    np.testing.assert_allclose(found, x, atol=2e-3)


HEADER = "pose_id," + ",".join(f"q{j}_deg" for j in range(1, 7))


def table(columns: str, *lines: str, map_: str = "", name: str = "t.csv") -> Measurements:
    """A table with six joint angles that differ row by row, then the columns of a test."""
    text = "\n".join(
        [
            f"{HEADER},{columns}",
            *(f"P{i},{10 + i},{20 - i},{5 + i},{3 * i},{40 - i},{i}.5,{line}" for i, line in enumerate(lines)),
        ]
    )
    layout = Source("map.toml", map_.encode()) if map_ else None
    return read_measurements(Source(name, text.encode()), ROBOT, None, layout)


def test_a_row_reads_what_its_columns_say() -> None:
    data = table(
        "tip,plane,anchor,distance_mm,gauge,reading_mm,nx,ny,nz",
        "s,,,,,,,,",
        ",p,,,,,,,",
        ",,A,500.5,,,,,",
        ",,,,g,1.25,0,0,2",
        map_='anchor_offset = "free"\n',
    )
    assert data.readings is not None
    assert data.state.setup_of_rows.tolist() == ["tip s", "plane p", "anchor A", "gauge g"]
    nan = np.nan
    np.testing.assert_allclose(
        data.readings.numbers, [[0, 0, 0], [0, nan, nan], [0.5005, nan, nan], [0.00125, nan, nan]]
    )
    np.testing.assert_allclose(data.readings.direction[3], [0, 0, 1])
    assert data.readings.zero_open
    assert data.sigma is not None
    np.testing.assert_allclose(data.sigma[:3], [k.noise for k in READING_KINDS[:3]])
    assert not np.isfinite(data.position).any()
    assert data.usable.all()


def test_a_distance_between_rows_stands_at_both_ends_and_a_row_without_reading_may_be_an_end() -> None:
    data = table("from,distance_mm", ",", "P0,300", "P0,400")
    assert (len(data), data.listed) == (5, 3)
    assert data.readings is not None
    assert data.readings.sign.tolist() == [0, 1, 1, -1, -1]
    np.testing.assert_allclose(data.readings.numbers[1:, 0], [0.15, 0.2, 0.15, 0.2])
    np.testing.assert_allclose(data.state.q[3], data.state.q[0])
    assert data.row == (1, 2, 3, 2, 3)
    assert data.usable.tolist() == [False, True, True, True, True]
    assert not [d for d in data.diagnostics if d.code == "DAT005"]


def test_two_tables_share_a_tip_and_keep_their_pairs_apart() -> None:
    text = [
        f"{HEADER},tip,from,distance_mm\nP0,{a},20,5,1,40,2,spike,,\nP1,{a},25,5,1,40,9,,P0,500\n" for a in (10, 12)
    ]
    data = read_tables([Source(f"{k}.csv", t.encode()) for k, t in enumerate(text)], ROBOT)
    assert sorted(set(data.state.setup_of_rows.tolist())) == ["from 2 0.csv", "from 2 1.csv", "tip spike"]


@pytest.mark.parametrize(
    ("columns", "line", "said"),
    [
        ("tip,plane", "a,b", "has a `plane` and `tip`"),
        ("tip,x_mm,y_mm,z_mm", "a,1,2,3", "has a `tip` and `x_mm`, `y_mm`, `z_mm`"),
        ("anchor", "a", "no column `distance_mm`"),
        ("gauge,reading_mm", "a,1", "no direction `nx`, `ny`, `nz`"),
        ("gauge,reading_mm,nx,ny,nz", "a,1,0,0,0", "no direction `nx`, `ny`, `nz`"),
        ("from,distance_mm", "Q9,1", "the `pose_id` of no row"),
        ("from,distance_mm", "P0,1", "this row"),
    ],
)
def test_a_row_that_reads_two_things_or_none_is_refused(columns: str, line: str, said: str) -> None:
    with pytest.raises(PostprocError) as refused:
        table(columns, line)
    (finding,) = refused.value.diagnostics
    assert finding.code == "DAT041"
    assert said in finding.message
    assert finding.help


def test_a_scale_is_no_better_than_its_steps_and_repeats_tell_its_noise() -> None:
    same = [f"g,1.{i // 12},0,0,1" for i in range(24)]
    text = "\n".join(
        [f"{HEADER},gauge,reading_mm,nx,ny,nz", *(f"P{i // 12},{i // 12},20,5,1,40,2,{x}" for i, x in enumerate(same))]
    )
    data = read_measurements(Source("g.csv", text.encode()), ROBOT)
    assert data.sigma is not None
    np.testing.assert_allclose(data.sigma, 1e-4 / np.sqrt(12))  # read in tenths, the same every time


def test_set_ups_are_left_out_whole_where_others_tell_the_arm() -> None:
    few = table("plane", *["a"] * 6, *["b"] * 6)
    assert len(np.unique(few.fold_group)) == 12
    many = table("plane", *["a"] * 4, *["b"] * 4, *["c"] * 4)
    assert len(np.unique(many.fold_group)) == 3


@pytest.mark.parametrize(
    ("reading", "said"),
    [("", "`reading_mm` of `P0` is empty"), ("0,01", "`0,01` in column `reading_mm` of line 2 has a decimal comma")],
)
def test_a_reading_that_is_lacking_or_split_is_named(reading: str, said: str) -> None:
    with pytest.raises(PostprocError) as refused:
        table("gauge,nx,ny,nz,reading_mm", f"a,0,0,1,{reading}")
    assert said in refused.value.diagnostics[-1].message
