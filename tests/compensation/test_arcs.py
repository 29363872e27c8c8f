"""Targets on arcs: the function that is written into the program, and that what calls it follows the three points."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

from tests.build import convert, events, independent, lines_of, module, target, written
from tests.worlds import functions, interpreter, values
from tests.worlds.interpreter import Interpreter, load
from tests.worlds.world import World

A, B, C = target(1350, -300), target(1330, -250, 720), target(1280, -230, 730)
TEXT = module(
    "".join(f"CONST robtarget {name}:={place};\n" for name, place in zip("abc", (A, B, C), strict=True)),
    "MoveJ a,v200,fine,tT;\nMoveC b,c,v50,fine,tT;",
)


def on_circle(start: np.ndarray, via: np.ndarray, goal: np.ndarray, share: float) -> np.ndarray:
    """The point after a share of the arc, by turning the radius about the axis of the circle (Rodrigues)."""
    normal = np.cross(via - start, goal - start)
    axis = normal / np.linalg.norm(normal)
    rows = np.array([via - start, goal - start, normal])
    center = np.linalg.solve(rows, [(via @ via - start @ start) / 2, (goal @ goal - start @ start) / 2, normal @ start])
    radius = start - center
    sine, cosine = np.cross(radius, goal - center) @ axis, radius @ (goal - center)
    angle = share * (np.arctan2(sine, cosine) % (2 * np.pi))
    point: np.ndarray = center + np.cos(angle) * radius + np.sin(angle) * np.cross(axis, radius)
    return point


Place = list[Any]


@pytest.fixture
def exactly(monkeypatch: pytest.MonkeyPatch) -> None:
    """What is written as a formula, without the rounding of a controller."""
    for part in (values, functions, interpreter):
        monkeypatch.setattr(part, "single", float)


def written_function(call: str, of: str, *names: str) -> Callable[..., Any]:
    """A function of a corrected program, run by the independent interpreter, of a share and targets.

    Args:
        call: of the function, with these names and `share`; of: statements whose correction needs it.
    """
    text = written(convert(of, tolerance_m=5e-6, free_axes="a"))
    data = "".join(f"  VAR robtarget {name};\n" for name in names) + "  VAR robtarget found;\n"
    ask = f"  PROC ask()\n    found:={call};\n  ENDPROC\nENDMODULE"
    text = text.replace("MODULE M\n", f"MODULE M\n{data}  VAR num share;\n", 1).replace("ENDMODULE", ask)
    task = Interpreter(load([text]), World(0))

    def function(share: float, *targets: Place) -> Any:
        for name, value in (*zip(names, targets, strict=True), ("share", share)):
            task.shared[name].set(value, task.records)
        task.steps = 0
        task.run_routine(task.routines["ask"], ())
        return task.shared["found"].get()

    return function


def at(place: np.ndarray, turn: Sequence[float] = (1, 0, 0, 0), cf1: int = 0) -> Place:
    return [[float(x) for x in place], [float(x) for x in turn], [cf1, 0, 0, 0], [9e9] * 6]


TRACK = TEXT.replace("[9E9,", "[300,")
ARC = "ppArcPoint(pA,pB,pC,share,0,0,0)", TEXT, "pa", "pb", "pc"


@pytest.mark.parametrize("seed", range(5))
def test_the_function_gives_points_on_the_circle_through_its_three(exactly: None, seed: int) -> None:
    """Arcs below and beyond a half circle."""
    draw, function = np.random.default_rng(seed), written_function(*ARC)
    center, turn = draw.normal(0, 500, 3), np.linalg.qr(draw.normal(size=(3, 3)))[0]
    sweep = draw.uniform(0.2, 2 * np.pi - 0.2)
    angles = np.array([0.0, sweep * draw.uniform(0.2, 0.8), sweep])
    places = center + draw.uniform(5, 400) * np.array([[np.cos(a), np.sin(a), 0.0] for a in angles]) @ turn.T
    for share in (0.0, 0.1, 0.5, 0.93, 1.0):
        found = function(share, *map(at, places))
        np.testing.assert_allclose(found[0], on_circle(*places, share), atol=1e-6)


TURNS = [(0.0, 0.0, 0.0), (0.1, -0.25, 0.2), (0.9, 0.4, -1.1)]


@pytest.mark.parametrize("sweep", [0.7, np.pi, 4.0])
@pytest.mark.parametrize("to_goal", TURNS)
@pytest.mark.parametrize("long_way", [False, True])
def test_the_tool_turns_with_the_arc_and_external_axes_go_evenly(
    exactly: None, sweep: float, to_goal: tuple[float, float, float], long_way: bool
) -> None:
    """As a controller interpolates on an arc; the circle point decides whether the tool goes the long way round."""
    function = written_function(ARC[0], TRACK, *ARC[2:])
    draw = np.random.default_rng(3)
    frame, first = Rotation.random(random_state=1), Rotation.random(random_state=2)
    via = 0.4
    places = draw.normal(0, 300, 3) + frame.apply(
        [[90 * np.cos(a), 90 * np.sin(a), 0] for a in (0, via * sweep, sweep)]
    )
    turn = np.array(to_goal)
    if long_way:
        turn = turn - 2 * np.pi * (turn / np.linalg.norm(turn) if turn.any() else np.zeros(3))

    def along(share: float) -> Rotation:
        return (
            frame
            * Rotation.from_rotvec([0, 0, share * sweep])
            * frame.inv()
            * first
            * Rotation.from_rotvec(share * turn)
        )

    ends = [
        at(place, along(share).as_quat(scalar_first=True), conf)
        for place, share, conf in zip(places, (0, via, 1), (1, 2, 3), strict=True)
    ]
    for end, axis in zip(ends, (300.0, -70.0, 420.0), strict=True):
        end[3][0] = axis
    for share in (0.0, 0.2, 0.5, 0.9, 1.0):
        _, rot, conf, axes = function(share, *ends)
        assert (Rotation.from_quat(rot, scalar_first=True) * along(share).inv()).magnitude() < 1e-6
        assert np.linalg.norm(rot) == pytest.approx(1.0, abs=1e-6)
        assert conf == ends[0 if share < 0.5 else 2][2]
        assert axes == pytest.approx([300.0 + 120.0 * share, *[9e9] * 5])


def test_a_target_in_another_quadrant_than_the_nearer_end_says_the_quarter_turns() -> None:
    """On a line and on an arc of one program, whose other added targets are in the configuration of an end."""
    text = written(convert(CORNER, tolerance_m=5e-6))
    calls = re.findall(r"(?<!robtarget )\bpp(?:Line|Arc)Point\((?:[^()]|\([^()]*\))*\)", text)
    for name in ("ppLinePoint", "ppArcPoint"):
        own = [call for call in calls if call.startswith(name)]
        assert 0 < sum("\\turns:=[" in call for call in own) < len(own)


def test_points_on_one_line_are_divided_as_a_line(exactly: None) -> None:
    line = [at(np.array([10.0 * k, 0, 5])) for k in (0, 1, 4)]
    assert written_function(*ARC)(0.25, *line)[0] == pytest.approx([10.0, 0.0, 5.0])


def test_added_targets_follow_the_points_of_their_arc() -> None:
    """`a` and `b` taught 5 mm elsewhere: every added target stays on the circle through what is taught."""
    text = written(convert(TEXT, tolerance_m=5e-6))
    assert "ppArcPoint(a,b,c," in text
    report = independent(TEXT, convert(TEXT, tolerance_m=5e-6))
    assert report.violations == [] and report.after <= 0.005 < 1.0 < report.before

    def taught(line: str) -> str:
        moved = re.match(r"(CONST robtarget [ab]:=\[\[)([-\d.]+)(,.*)", line)
        return f"{moved[1]}{float(moved[2]) + 5:.3f}{moved[3]}" if moved else line

    after = events("\n".join(map(taught, lines_of(text))))
    plain = events("\n".join(map(taught, lines_of(TEXT))))
    circle = [np.array(t.trans) for t in (plain[0].target, plain[1].via, plain[1].target)]
    points = [np.array(t.trans) for e in after[1:] for t in (e.via, e.target)]
    assert len(points) >= 4
    dense = np.array([on_circle(*circle, share) for share in np.linspace(0, 1, 2001)])
    for point in points:
        assert np.linalg.norm(dense - point, axis=1).min() < 1.6  # the correction itself is 1.5 mm


LINE = module(
    f"CONST robtarget p:={target(1350, -500)};\nCONST robtarget q:={target(1350, -20)};",
    "MoveJ p,v200,fine,tT;\nMoveL q,v50,fine,tT;",
)
CORNER = (Path(__file__).parents[2] / "samples/corner_arc.mod").read_text()


@pytest.mark.parametrize("written_by", [str.upper, str])
@pytest.mark.parametrize(
    ("text", "function", "renamed"),
    [
        (TEXT, "ppArcPoint", "ppArcPoint"),
        (LINE, "ppLinePoint", "ppLinePoint2"),
        *((LINE, "ppLinePoint", f"pp{name}") for name in ("LineKeep", "LineConf", "LineBend", "BendKeep", "BendConf")),
        *((TEXT, "ppArcPoint", f"pp{name}") for name in ("ArcKeep", "ArcConf")),
    ],
)
def test_a_corrected_program_without_its_header_is_known_by_its_function(
    text: str, function: str, renamed: str, written_by: Callable[[str], str]
) -> None:
    """Somebody takes all comments out, and an editor changes the case of the words; also of an earlier version."""
    corrected = written(convert(text, tolerance_m=5e-6)).replace(function, renamed)
    stripped = "\n".join(line for line in lines_of(corrected) if not line.lstrip().startswith("!"))
    assert "compensated" not in stripped and f" {renamed}(" in stripped
    again = convert(written_by(stripped))
    assert [d.code for d in again.diagnostics] == ["CMP001"] and not again.outputs


@pytest.mark.parametrize("seed", range(4))
def test_the_function_of_a_line_moves_and_turns_evenly(exactly: None, seed: int) -> None:
    """Against Slerp of scipy, turns of a hundredth to 170 degrees, q or -q."""
    draw = np.random.default_rng(seed)
    ends = f"CONST robtarget p:={target(1350, -500)};\nCONST robtarget q:={target(1350, -20)};"
    text = module(ends, "MoveJ p,v200,fine,tT;\nMoveL q,v50,fine,tT;")
    function = written_function("ppLinePoint(pS,pG,share,1,-2,0.5)", text, "ps", "pg")
    first = Rotation.random(rng=draw)
    axis = draw.normal(size=3)
    for degrees in (0.0, 0.01, 0.3, 5.0, 90.0, 170.0):
        last = first * Rotation.from_rotvec(np.radians(degrees) * axis / np.linalg.norm(axis))
        rots = [r.as_quat(scalar_first=True) * sign for r, sign in ((first, 1), (last, draw.choice([1, -1])))]
        trans = draw.normal(0, 500, (2, 3))
        for share in (0.0, 0.2, 0.5, 0.9, 1.0):
            place, rot, conf, axes = function(share, at(trans[0], rots[0], 0), at(trans[1], rots[1], 1))
            np.testing.assert_allclose(place, trans[0] + share * (trans[1] - trans[0]) + [1, -2, 0.5], atol=1e-9)
            even = Slerp([0, 1], Rotation.concatenate([first, last]))(share)
            assert (even.inv() * Rotation.from_quat(rot, scalar_first=True)).magnitude() < 1e-6
            assert np.linalg.norm(rot) == pytest.approx(1.0, abs=1e-5)
            assert conf[0] == (share >= 0.5) and min(axes) > 8e9


def test_a_name_does_not_grow_onto_the_instruction() -> None:
    """Numbers may follow it without a blank, the function that takes their place may not."""
    data = f"CONST robtarget a:={target(1200, -600)};\nCONST robtarget g:={target(1400, -300)};"
    found = convert(module(data, f"MoveJ a,v300,fine,tT;\nMoveC{target(1330, -470)},g,v50,fine,tT;"), tolerance_m=2e-6)
    assert [line.split("(")[0] for line in lines_of(written(found)) if "MoveC" in line] == ["MoveC ppArcPoint"] * 2
