"""The checker on programs whose right answer is known."""

from __future__ import annotations

import numpy as np
import pytest

from tests.independent import arm as A
from tests.independent import generate_programs, paths, rapid, verify
from tests.independent import inverse as I

FORCE = np.array([200.0, -200, -200])
AXES = "[9E9,9E9,9E9,9E9,9E9,9E9]"
HEAD = """MODULE Seam
  PERS tooldata tTorch:=[TRUE,[[20,-10,350],[1,0,0,0]],[4.5,[10,0,120],[1,0,0,0],0,0,0]];
  PERS seamdata sm:=[0];
  PERS welddata wd:=[10];
"""
TURN = np.array([0.0, 1.0, 0.0, 0.0])


def target(p: np.ndarray, conf: tuple[int, ...] = (-1, 0, -1, 0)) -> str:
    return f"[[{p[0]:.4f},{p[1]:.4f},{p[2]:.4f}],[0,1,0,0],[{','.join(map(str, conf))}],{AXES}]"


def program(points: list[np.ndarray], conf: tuple[int, ...], middle: str = "ArcL", zone: str = "z1") -> str:
    words = ["ArcLStart", *[middle] * (len(points) - 2), "ArcLEnd"]
    lines = [f"    MoveJ {target(points[0] + [0, 0, 50], conf)},v200,z10,tTorch;"]
    for k, (w, p) in enumerate(zip(words, points, strict=True)):
        z = "fine" if k in (0, len(points) - 1) else zone
        lines.append(f"    {w} {target(p, conf)},v20,sm,wd,{z},tTorch;")
    return HEAD + "  PROC main()\n" + "\n".join(lines) + "\n  ENDPROC\nENDMODULE\n"


@pytest.fixture(scope="module")
def seam() -> tuple[list[np.ndarray], tuple[int, ...]]:
    arm = A.irb4600()
    a, b = np.array([1100.0, -350, 500]), np.array([1250.0, 450, 560])
    tool = A.shift(0.02, -0.01, 0.35)
    pose = A.transform(rapid.quaternion_matrix(TURN), a / 1000)
    q = I.inverse(arm, pose[None] @ np.linalg.inv(tool))[0, 0]
    return [a, b], tuple(I.confdata(arm, q)[0])


def compensated(points: list[np.ndarray]) -> list[np.ndarray]:
    """Accumulates p_f <- p_f + (p - p_c) at every point (Eq. 25 with the erratum), on the vertical torch."""
    arm, tool = A.irb4600(), A.shift(0.02, -0.01, 0.35)
    wanted = np.array(points) / 1000
    command = wanted.copy()
    load = A.Load(4.5, np.array([0.01, 0, 0.12]), FORCE)
    for _ in range(8):
        t = A.transform(np.broadcast_to(rapid.quaternion_matrix(TURN), (len(command), 3, 3)), command)
        q = I.inverse(arm, t @ np.linalg.inv(tool))[:, 0]
        reached = A.equilibrium(arm, q, tool, load, A.joint_springs(A.TABLE_2)).frames.tcp[:, :3, 3]
        command += wanted - reached
    return list(command * 1000)


def test_a_perfect_program_passes_and_the_original_does_not(seam: tuple[list[np.ndarray], tuple[int, ...]]) -> None:
    (a, b), conf = seam
    original = program([a, b], conf)
    fine = [a + (b - a) * w for w in np.linspace(0, 1, 12)]
    moved = compensated([a + np.array([0, 0, 50]), *fine])
    output = program(moved[1:], conf).replace(target(moved[1] + [0, 0, 50], conf), target(moved[0], conf))
    report = verify.check(original, output, A.irb4600(), FORCE)
    assert report.violations == []
    assert 0.5 < report.before < 3.0
    assert report.after < 0.01
    assert report.goal_after < 0.001
    assert report.added == 10
    assert report.added_per_metre == pytest.approx(10 / report.seam_metres)
    same = verify.check(original, original, A.irb4600(), FORCE)
    assert same.after == pytest.approx(same.before)
    two_ends = program(moved[1:2] + moved[-1:], conf)
    assert verify.check(original, two_ends, A.irb4600(), FORCE).after > 0.02


def test_illegal_changes_are_found(seam: tuple[list[np.ndarray], tuple[int, ...]]) -> None:
    (a, b), conf = seam
    original = program([a, b], conf)
    middle = (a + b) / 2
    output = program([a, middle, b], conf)
    arm = A.irb4600()
    assert verify.check(original, output, arm, FORCE).violations == []
    cases = {
        "stops": program([a, middle, b], conf, zone="fine"),
        "other data": output.replace("v20,sm,wd,z1", "v50,sm,wd,z1"),
        "welds or not": output.replace("    ArcL [", "    ArcLStart ["),
        "not in the output any more": output.replace("PERS welddata wd:=[10]", "PERS welddata wd:=[11]"),
        "missing": original.replace("    ArcLEnd", "    !ArcLEnd"),
        "neither a move": output.replace("  PROC main", "  VAR num x:=1;\n  PROC main"),
        "longer than 32": output.replace("  PROC main", f"  CONST robtarget {'p' * 33}:={target(a)};\n  PROC main"),
        "confdata": output.replace(
            f"[{','.join(map(str, conf))}],{AXES}],v20,sm,wd,fine", f"[1,1,1,1],{AXES}],v20,sm,wd,fine"
        ),
    }
    for word, text in cases.items():
        assert text != output
        found = verify.check(original, text, arm, FORCE).violations
        assert any(word in v for v in found), (word, found)


def test_circle_through_three_points() -> None:
    u = np.linspace(0, 1, 7)
    a, via, b = (np.array([np.cos(t), np.sin(t), 0.5]) for t in (0.0, 1.0, 2.5))
    c = paths.circle(a, via, b)
    assert c.radius == pytest.approx(1.0)
    assert c.sweep == pytest.approx(2.5)
    assert c.at(u)[-1] == pytest.approx(b)
    assert c.distance(c.at(u) * [1.1, 1.1, 1.0]) == pytest.approx(0.1)
    assert c.distance(np.array([[1.0, -0.3, 0.5]]))[0] == pytest.approx(0.3, rel=1e-6)


def test_corner_stays_within_the_zone(seam: tuple[list[np.ndarray], tuple[int, ...]]) -> None:
    (a, b), conf = seam
    text = program([a, (a + b) / 2 + [40, 0, 0], b], conf, zone="z10")
    legs = paths.play(A.irb4600(), rapid.motions(text)[0])
    cut = paths.cut_corners(legs)
    goal = legs[2].motion.goal[:3, 3]
    off = np.linalg.norm(np.concatenate([cut[2], cut[3]])[:, :3, 3] - goal, axis=1).min()
    assert 1e-5 < off < 0.005
    assert np.linalg.norm(cut[2][-1] - cut[3][0]) < 1e-9


@pytest.mark.parametrize("seed", range(4))
def test_generated_programs_are_playable(seed: int) -> None:
    text = generate_programs.generate(seed)
    moves, skipped = rapid.motions(text)
    assert skipped == []
    assert len(moves) >= 5
    legs = paths.play(A.irb4600(), moves, 0.01)
    assert [leg.problem for leg in legs if leg.problem] == []
    assert not any(leg.conf_wrong for leg in legs)
    assert verify.check(text, text, A.irb4600(), FORCE, step=0.01).violations == []
    assert generate_programs.generate(seed) == text
