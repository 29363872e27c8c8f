"""Statements as moves in SI units and what is wrong with them: a row for each in ``corpus.txt``."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from postproc.motion.path.moves import read_moves
from postproc.motion.values import Move
from postproc.rapid.execution.walk import walk
from tests.corpus import Case, cases, short
from tests.motion.build import ROBOT
from tests.rapid.build import program

# What a row can show beside kind, speed [mm/s] and stop or zone [mm], and the value that is not written.
FACETS = {
    "row": (lambda m: m.row, None),
    "first": (lambda m: m.starts_chain, False),
    "welding": (lambda m: m.welding, False),
    "ease": (lambda m: m.ease, 1.0),
    "time": (lambda m: m.duration, None),
    "mass": (lambda m: m.payload_mass, 0.001),
    "center": (lambda m: tuple(m.payload_center), None),
    "turning": (lambda m: round(float(np.degrees(m.rotation_speed)), 6), 500.0),
    "reorientation": (lambda m: (m.zone_rotation, round(float(np.degrees(m.zone_angle)), 6)), None),
    "place": (lambda m: tuple(m.T_work_tcp[:3, 3].round(6) + 0.0), None),
    "via": (lambda m: None if m.T_work_via is None else tuple(m.T_work_via[:3, 3].round(6) + 0.0), None),
    "joints": (lambda m: tuple(np.degrees(m.q).round(2) + 0.0), None),
}


def row(moves: list[Move], facets: tuple[str, ...]) -> str:
    parts = []
    for move in moves:
        text = f"{move.kind} {1e3 * move.speed:.6g} {'fine' if move.fine else f'z{1e3 * move.zone:.6g}'}"
        for name in facets:
            value, usual = FACETS[name][0](move), FACETS[name][1]
            if value != usual:
                text += f" {name}" if value is True else f" {name} {short(value)}"
        parts.append(text)
    return "  = " + (" | ".join(parts) or "nothing")


ALL = list(cases(Path(__file__).with_name("corpus.txt")))


@pytest.mark.parametrize("case", ALL, ids=[case.place for case in ALL])
def test_a_program_becomes_the_moves_of_its_row(case: Case) -> None:
    axes = "".join(facet.removeprefix("free-") for facet in case.facets if facet.startswith("free-"))
    read = program(case.text)
    moves, findings = read_moves(ROBOT, walk(read), axes)
    facets = tuple(facet for facet in case.facets if facet in FACETS)
    lines = [row(moves, facets)]
    for d in findings:
        place = "" if d.source is None or d.span is None else " at: " + d.source.data[slice(*d.span)].decode("latin-1")
        advice = f" help: {d.help}" if "help" in case.facets else ""
        lines.append(f"  ! {d.code} {d.severity}: {d.message}{place}{advice}")
    assert "\n".join(lines) == case.expected, case.text
