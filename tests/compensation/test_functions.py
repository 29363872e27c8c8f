"""The functions that are written for targets on lines and arcs, run by the independent interpreter; what calls them."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

from tests.build import convert, events, independent, lines_of, written
from tests.compensation.build import brief, errors, small
from tests.worlds import functions, interpreter, values
from tests.worlds.interpreter import Interpreter, load
from tests.worlds.world import World

ARC = small("MoveJ a,v200,fine,tT; MoveC b,c,v50,fine,tT;", "a 1350 -300, b 1330 -250 720, c 1280 -230 730")
LINE = small("MoveJ p,v200,fine,tT; MoveL q,v50,fine,tT;", "p 1350 -500, q 1350 -20")
CORNER = (Path(__file__).parents[2] / "samples/corner_arc.mod").read_text()
SHARES = (0.0, 0.1, 0.2, 0.5, 0.9, 1.0)
Place = list[Any]


@pytest.fixture(autouse=True)
def exactly(monkeypatch: pytest.MonkeyPatch) -> None:
    """What is written as a formula, without the rounding of a controller."""
    for part in (values, functions, interpreter):
        monkeypatch.setattr(part, "single", float)


def written_function(of: str, call: str, *names: str) -> Callable[..., Any]:
    """A function of a corrected program, of a share and targets.

    Args:
        of: program whose correction needs it. call: of the function, with these names and `share`.
    """
    text = written(convert(of, tolerance_m=5e-6, free_axes="a"))
    data = "".join(f"  VAR robtarget {name};\n" for name in (*names, "answer")) + "  VAR num share;\n"
    ask = f"  PROC ask()\n    answer:={call};\n  ENDPROC\nENDMODULE"
    task = Interpreter(load([text.replace("MODULE M\n", f"MODULE M\n{data}", 1).replace("ENDMODULE", ask)]), World(0))

    def function(share: float, *targets: Place) -> Any:
        for name, value in (*zip(names, targets, strict=True), ("share", share)):
            task.shared[name].set(value, task.records)
        task.steps = 0
        task.run_routine(task.routines["ask"], ())
        return task.shared["answer"].get()

    return function


def arc_function(of: str = ARC) -> Callable[..., Any]:
    return written_function(of, "ppArcPoint(pA,pB,pC,share,0,0,0)", "pa", "pb", "pc")


def at(place: Any, turn: Sequence[float] = (1, 0, 0, 0), cf1: int = 0, axis: float = 9e9) -> Place:
    return [[float(x) for x in place], [float(x) for x in turn], [cf1, 0, 0, 0], [axis, *[9e9] * 5]]


def on_circle(start: np.ndarray, via: np.ndarray, goal: np.ndarray, share: float) -> np.ndarray:
    """The point after a share of the arc, by turning the radius about the axis of the circle (Rodrigues)."""
    normal = np.cross(via - start, goal - start)
    axis = normal / np.linalg.norm(normal)
    rows = np.array([via - start, goal - start, normal])
    center = np.linalg.solve(rows, [(via @ via - start @ start) / 2, (goal @ goal - start @ start) / 2, normal @ start])
    radius = start - center
    sine, cosine = np.cross(radius, goal - center) @ axis, radius @ (goal - center)
    angle = share * (np.arctan2(sine, cosine) % (2 * np.pi))
    return np.asarray(center + np.cos(angle) * radius + np.sin(angle) * np.cross(axis, radius))


@pytest.mark.parametrize("seed", range(5))
def test_points_of_an_arc_lie_on_the_circle_through_its_three(seed: int) -> None:
    """Arcs below and beyond a half circle."""
    draw, function = np.random.default_rng(seed), arc_function()
    center, turn = draw.normal(0, 500, 3), np.linalg.qr(draw.normal(size=(3, 3)))[0]
    sweep = draw.uniform(0.2, 2 * np.pi - 0.2)
    angles = np.array([0.0, sweep * draw.uniform(0.2, 0.8), sweep])
    places = center + draw.uniform(5, 400) * np.array([[np.cos(a), np.sin(a), 0.0] for a in angles]) @ turn.T
    for share in SHARES:
        np.testing.assert_allclose(function(share, *map(at, places))[0], on_circle(*places, share), atol=1e-6)


def test_points_on_one_line_are_divided_as_a_line() -> None:
    line = [at((10 * k, 0, 5)) for k in (0, 1, 4)]
    assert arc_function()(0.25, *line)[0] == pytest.approx([10.0, 0.0, 5.0])


@pytest.mark.parametrize("sweep", [0.7, np.pi, 4.0])
@pytest.mark.parametrize("to_goal", [(0.0, 0.0, 0.0), (0.1, -0.25, 0.2), (0.9, 0.4, -1.1)])
@pytest.mark.parametrize("long_way", [False, True])
def test_the_tool_turns_with_the_arc_and_external_axes_go_evenly(
    sweep: float, to_goal: tuple[float, float, float], long_way: bool
) -> None:
    """As a controller interpolates on an arc; the circle point decides whether the tool goes the long way round."""
    function = arc_function(ARC.replace("[9E9,", "[300,"))
    frame, first = Rotation.random(random_state=1), Rotation.random(random_state=2)
    angles = np.array([0.0, 0.4, 1.0]) * sweep
    places = np.array([30, -200, 400]) + frame.apply([[90 * np.cos(a), 90 * np.sin(a), 0] for a in angles])
    turn = np.array(to_goal)
    if long_way and turn.any():
        turn = turn - 2 * np.pi * turn / np.linalg.norm(turn)

    def along(share: float) -> Rotation:
        on_arc = frame * Rotation.from_rotvec([0, 0, share * sweep]) * frame.inv()
        return on_arc * first * Rotation.from_rotvec(share * turn)

    rots = [along(share).as_quat(scalar_first=True) for share in (0.0, 0.4, 1.0)]
    ends = list(map(at, places, rots, (1, 2, 3), (300.0, -70.0, 420.0)))
    for share in SHARES:
        _, rot, conf, axes = function(share, *ends)
        assert (Rotation.from_quat(rot, scalar_first=True) * along(share).inv()).magnitude() < 1e-6
        assert np.linalg.norm(rot) == pytest.approx(1.0, abs=1e-6)
        assert conf == ends[0 if share < 0.5 else 2][2]
        assert axes == pytest.approx([300.0 + 120.0 * share, *[9e9] * 5])


@pytest.mark.parametrize("seed", range(4))
def test_points_of_a_line_move_and_turn_evenly(seed: int) -> None:
    """Against Slerp of scipy, turns of a hundredth to 170 degrees, q or -q."""
    draw, function = (
        np.random.default_rng(seed),
        written_function(LINE, "ppLinePoint(pS,pG,share,1,-2,0.5)", "ps", "pg"),
    )
    first, axis = Rotation.random(rng=draw), draw.normal(size=3)
    for degrees in (0.0, 0.01, 0.3, 5.0, 90.0, 170.0):
        last = first * Rotation.from_rotvec(np.radians(degrees) * axis / np.linalg.norm(axis))
        rots = [r.as_quat(scalar_first=True) * sign for r, sign in ((first, 1), (last, draw.choice([1, -1])))]
        trans = draw.normal(0, 500, (2, 3))
        for share in SHARES:
            place, rot, conf, axes = function(share, at(trans[0], rots[0], 0), at(trans[1], rots[1], 1))
            np.testing.assert_allclose(place, trans[0] + share * (trans[1] - trans[0]) + [1, -2, 0.5], atol=1e-9)
            even = Slerp([0, 1], Rotation.concatenate([first, last]))(share)
            assert (even.inv() * Rotation.from_quat(rot, scalar_first=True)).magnitude() < 1e-6
            assert np.linalg.norm(rot) == pytest.approx(1.0, abs=1e-5)
            assert conf[0] == (share >= 0.5) and min(axes) > 8e9


def test_a_target_in_another_quadrant_than_the_nearer_end_says_the_quarter_turns() -> None:
    """On a line and on an arc of one program, whose other added targets are in the configuration of an end."""
    text = written(convert(CORNER, tolerance_m=5e-6))
    calls = re.findall(r"(?<!robtarget )\bpp(Line|Arc)Point\(((?:[^()]|\([^()]*\))*)\)", text)
    for name in ("Line", "Arc"):
        turned = ["\\turns:=[" in arguments for kind, arguments in calls if kind == name]
        assert 0 < sum(turned) < len(turned)


def test_added_targets_follow_the_points_of_their_arc() -> None:
    """`a` and `b` taught 5 mm elsewhere: every added target stays on the circle through what is taught."""
    conversion = convert(ARC, tolerance_m=5e-6)
    assert "ppArcPoint(a,b,c," in written(conversion)
    report = independent(ARC, conversion)
    assert report.violations == [] and report.after <= 0.005 < 1.0 < report.before

    def taught(line: str) -> str:
        moved = re.match(r"(CONST robtarget [ab]:=\[\[)([-\d.]+)(,.*)", line)
        return f"{moved[1]}{float(moved[2]) + 5:.3f}{moved[3]}" if moved else line

    after, plain = (events("\n".join(map(taught, lines_of(text)))) for text in (written(conversion), ARC))
    circle = [np.array(t.trans) for t in (plain[0].target, plain[1].via, plain[1].target)]  # type: ignore[union-attr]
    dense = np.array([on_circle(*circle, share) for share in np.linspace(0, 1, 2001)])
    points = [np.array(t.trans) for e in after[1:] for t in (e.via, e.target)]  # type: ignore[union-attr]
    assert len(points) >= 4
    for point in points:
        assert np.linalg.norm(dense - point, axis=1).min() < 1.6  # the correction itself is 1.5 mm


@pytest.mark.parametrize("case", [str.upper, str])
@pytest.mark.parametrize(
    ("text", "function", "renamed"),
    [
        (ARC, "ppArcPoint", "ppArcPoint"),
        (LINE, "ppLinePoint", "ppLinePoint2"),
        *((LINE, "ppLinePoint", f"pp{name}") for name in ("LineKeep", "LineConf", "LineBend", "BendKeep", "BendConf")),
        *((ARC, "ppArcPoint", f"pp{name}") for name in ("ArcKeep", "ArcConf")),
    ],
    ids=brief,
)
def test_a_corrected_program_without_its_header_is_known_by_its_function(
    text: str, function: str, renamed: str, case: Callable[[str], str]
) -> None:
    """Somebody takes all comments out, and an editor changes the case of the words; also of an earlier version."""
    corrected = written(convert(text, tolerance_m=5e-6)).replace(function, renamed)
    stripped = "\n".join(line for line in lines_of(corrected) if not line.startswith("!"))
    assert "compensated" not in stripped and f" {renamed}(" in stripped
    again = convert(case(stripped))
    assert errors(again) == ["CMP001"] and not again.outputs


def test_a_name_does_not_grow_onto_the_instruction() -> None:
    """Numbers may follow it without a blank, the function that takes their place may not."""
    text = small("MoveJ a,v300,fine,tT; MoveC@{1330,-470},g,v50,fine,tT;", "a 1200 -600, g 1400 -300")
    lines = lines_of(written(convert(text, tolerance_m=2e-6)))
    assert [line.split("(")[0] for line in lines if "MoveC" in line] == ["MoveC ppArcPoint"] * 2
