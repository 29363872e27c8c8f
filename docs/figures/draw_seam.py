"""Draw seam.svg: the weld of samples/hull_seam.mod, where the arm goes, and what a correction leaves.

Run ``python docs/figures/draw_seam.py`` in the root of the repository.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from postproc import document
from postproc.arrays import Array
from postproc.compensation.options import Options
from postproc.diagnostics import Source
from postproc.model.arm import Model
from postproc.model.equilibrium import predict
from postproc.model.file import default_model
from postproc.motion.path.moves import read_moves
from postproc.motion.path.samples import sample_path
from postproc.rapid.execution.walk import walk
from postproc.rapid.program.program import read_program
from postproc.runtime.passes import correct_program

ROOT = Path(__file__).resolve().parents[2]
FORCE = (200.0, -200.0, -200.0)  # [N]
MAGNIFIED = 50.0
WIDTH, HEIGHT, MARGIN = 720.0, 392.0, 16.0
INK, GREY, RED, BLUE = "#2b2f33", "#9aa0a6", "#c5221f", "#174ea6"
LIGHT = "#d5d9de"


def weld(model: Model, program: bytes) -> tuple[Array, Array]:
    """Where the nominal and the elastic arm are along the weld of a program, (n, 3) [m] both, base axes."""
    events = walk(read_program(Source("seam.mod", program)))
    moves, _ = read_moves(model.robot, events)
    path, _ = sample_path(model.robot, moves)
    burning = np.array([moves[int(i)].welding for i in path.move])
    n = int(burning.sum())
    tool = moves[-1]
    state = model.state(
        path.q[burning],
        payload_mass=np.full(n, tool.payload_mass),
        payload_center=np.tile(tool.payload_center, (n, 1)),
        wrench=np.tile([*FORCE, 0.0, 0.0, 0.0], (n, 1)),
        T_flange_tcp=tool.T_mount_tcp,
    )
    return path.T_work_tcp[burning, :3, 3], predict(model, state)[:, :3, 3]


def polyline(x: Array, y: Array, style: str) -> str:
    points = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x, y, strict=True))
    return f'<polyline points="{points}" fill="none" stroke-linejoin="round" {style}/>'


def label(x: float, y: float, text: str, color: str = INK, anchor: str = "start", size: int = 17) -> str:
    return f'<text x="{x:.0f}" y="{y:.0f}" font-size="{size}" fill="{color}" text-anchor="{anchor}">{text}</text>'


def side_view(programmed: Array, before: Array, after: Array) -> list[str]:
    """The seam from the side: displacements of the whole curve, magnified, so that no line has a step."""
    step = np.linalg.norm(np.diff(programmed, axis=0), axis=1)
    s = np.concatenate([[0.0], np.cumsum(step)])
    chord = (programmed[-1] - programmed[0]) / np.linalg.norm(programmed[-1] - programmed[0])
    scale = (WIDTH - 2 * MARGIN - 70) / s[-1]
    base = 96.0 + (programmed[:, 2].max() - programmed[:, 2]) * scale

    def drawn(curve: Array, style: str) -> str:
        off = MAGNIFIED * (curve - programmed)
        return polyline(MARGIN + 8 + (s + off @ chord) * scale, base - off[:, 2] * scale, style)

    return [
        drawn(programmed, f'stroke="{LIGHT}" stroke-width="13" stroke-linecap="round"'),
        drawn(before, f'stroke="{RED}" stroke-width="3"'),
        drawn(after, f'stroke="{BLUE}" stroke-width="3"'),
        label(MARGIN, 28, f"A seam of 1.4 m seen from the side, {np.linalg.norm(FORCE):.0f} N on the torch", size=19),
        label(MARGIN, 52, f"deviations drawn {MAGNIFIED:.0f} times larger", GREY, size=15),
        label(WIDTH / 2, 146, "without correction, in the model", RED, "middle"),
        label(WIDTH / 2, 84, "as programmed (grey), and corrected, in the model", BLUE, "middle"),
    ]


def bars(rows: list[tuple[str, float, float, str, str]], top: float) -> list[str]:
    """Intervals [mm] on one axis: name, low, high, their text, colour."""
    most, left = max(row[2] for row in rows), 278.0
    scale = (WIDTH - MARGIN - left - 146) / most
    parts = [label(MARGIN, top, "How far the torch is off sideways and in stick-out, at most", size=19)]
    for i, (name, low, high, text, color) in enumerate(rows):
        y = top + 38 + 42 * i
        parts.append(f'<line x1="{left}" x2="{left + most * scale:.1f}" y1="{y}" y2="{y}" stroke="{LIGHT}"/>')
        x, width = left + low * scale, max((high - low) * scale, 5.0)
        parts.append(f'<rect x="{x:.1f}" y="{y - 8}" width="{width:.1f}" height="16" rx="3" fill="{color}"/>')
        parts.append(label(MARGIN, y + 6, name))
        parts.append(label(left + most * scale + 14, y + 6, text, color if color != GREY else INK))
    return parts


def draw() -> str:
    source = Source("samples/hull_seam.mod", (ROOT / "samples" / "hull_seam.mod").read_bytes())
    model = default_model()
    result = correct_program(source, model, Options(force=FORCE))
    assert result.output is not None
    programmed, before = weld(model, source.data)
    _, after = weld(model, result.output)
    said = document(result)
    weld_figures = said["figures"][0]
    was, left = weld_figures["before_mm"], weld_figures["after_mm"]
    low, high = weld_figures["expected_on_arm_mm"]
    share = said["expected_remaining_fraction_after_gauge"]
    gauge = [float(np.hypot(left, part * was)) for part in share]
    rows = [
        ("not corrected, in the model", was, was, f"{was:.2f} mm", RED),
        ("corrected, arm not measured", low, high, f"{low:.2f} to {high:.2f} mm", GREY),
        ("after 6 gauge set-ups", *gauge, f"{gauge[0]:.2f} to {gauge[1]:.2f} mm", BLUE),
        ("corrected, in the model", left, left, f"{left:.2f} mm", BLUE),
    ]
    after = np.stack(
        [np.interp(np.linspace(0, 1, len(programmed)), np.linspace(0, 1, len(after)), c) for c in after.T], axis=1
    )
    parts = [*side_view(programmed, before, after), *bars(rows, 202.0)]
    head = f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH:.0f} {HEIGHT:.0f}" font-family="sans-serif">'
    body = "\n".join(parts)
    return f'{head}\n<rect width="{WIDTH:.0f}" height="{HEIGHT:.0f}" fill="white"/>\n{body}\n</svg>\n'


if __name__ == "__main__":
    (Path(__file__).parent / "seam.svg").write_text(draw(), encoding="utf-8")
