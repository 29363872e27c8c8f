"""Draw seam.svg: the weld of samples/hull_seam.mod as programmed, uncompensated and compensated.

Run ``python docs/figures/draw_seam.py`` in the root of the repository.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

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
MAGNIFIED = 100.0
WIDTH, LEFT, RIGHT = 960.0, 70.0, 40.0


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


def nearest(curve: Array, points: Array) -> tuple[Array, Array]:
    """Offsets (n, 3) of points from a polyline and the fraction of its length (n,) at which each foot stands."""
    step = np.diff(curve, axis=0)
    along = np.einsum("nkj,kj->nk", points[:, None] - curve[None, :-1], step) / (step**2).sum(axis=1)
    along = np.clip(along, 0.0, 1.0)
    foot = curve[None, :-1] + along[..., None] * step
    k = np.argmin(np.linalg.norm(points[:, None] - foot, axis=2), axis=1)
    rows = np.arange(len(points))
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(step, axis=1))])
    s = length[k] + along[rows, k] * (length[k + 1] - length[k])
    inside = (s > 0) & (s < length[-1])  # beyond the ends there is no path to be distant from
    return (points - foot[rows, k])[inside], s[inside]


def polyline(x: Array, y: Array, style: str) -> str:
    points = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x, y, strict=True))
    return f'<polyline points="{points}" fill="none" {style}/>'


def label(x: float, y: float, text: str, color: str = "#333", anchor: str = "start", size: int = 15) -> str:
    return f'<text x="{x:.0f}" y="{y:.0f}" font-size="{size}" fill="{color}" text-anchor="{anchor}">{text}</text>'


def draw() -> str:
    source = Source("samples/hull_seam.mod", (ROOT / "samples" / "hull_seam.mod").read_bytes())
    model = default_model()
    result = correct_program(source, model, Options(force=FORCE, inertia=False))
    assert result.output is not None
    programmed, before = weld(model, source.data)
    _, after = weld(model, result.output)
    off_before, s_before = nearest(programmed, before)
    off_after, s_after = nearest(programmed, after)
    length = float(np.linalg.norm(np.diff(programmed, axis=0), axis=1).sum())
    scale = (WIDTH - LEFT - RIGHT) / length

    # Seen from the side of the shell: along the seam to the right, up is up.
    s_programmed = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(programmed, axis=0), axis=1))])
    z = programmed[:, 2]
    top = 70.0 + (z.max() - z.min()) * scale

    def side(s: Array, offset: Array) -> tuple[Array, Array]:
        base = np.interp(s, s_programmed, z)
        return LEFT + s * scale, top - (base - z.min() + offset[:, 2] * MAGNIFIED) * scale

    grey, red, blue = "#9aa0a6", "#c5221f", "#174ea6"
    zero = np.zeros((len(programmed), 3))
    worst_before, worst_after = (1e3 * np.linalg.norm(o, axis=1).max() for o in (off_before, off_after))
    parts = [
        label(
            LEFT,
            30,
            "A hull seam of 1.4 m under [200, -200, -200] N, seen from the side; deviations drawn 100 times",
            size=17,
        ),
        polyline(
            *side(s_programmed, zero), f'stroke="{grey}" stroke-width="9" stroke-opacity="0.55" stroke-linecap="round"'
        ),
        polyline(*side(s_before, off_before), f'stroke="{red}" stroke-width="2.5"'),
        polyline(*side(s_after, off_after), f'stroke="{blue}" stroke-width="2.5"'),
    ]

    # Below: the distance from the programmed path along the seam.
    floor, tall = 380.0, 130.0
    most = np.ceil(worst_before * 2) / 2
    for value in np.arange(0.0, most + 0.01, 0.5):
        y = floor - value / most * tall
        parts.append(f'<line x1="{LEFT}" x2="{WIDTH - RIGHT}" y1="{y:.1f}" y2="{y:.1f}" stroke="#ddd"/>')
        parts.append(label(LEFT - 8, y + 5, f"{value:.1f}", anchor="end", size=13))
    for x_m in np.arange(0.0, length, 0.2):
        parts.append(label(LEFT + x_m * scale, floor + 20, f"{x_m * 1e3:.0f}", anchor="middle", size=13))
    parts.append(
        label(
            LEFT, floor - tall - 14, "distance from the programmed path [mm] over the way along the seam [mm]", size=13
        )
    )
    for s, offset, color in ((s_before, off_before, red), (s_after, off_after, blue)):
        y = floor - 1e3 * np.linalg.norm(offset, axis=1) / most * tall
        parts.append(polyline(LEFT + s * scale, y, f'stroke="{color}" stroke-width="2.5"'))

    y = 432.0
    for x, color, text in (
        (LEFT, grey, "programmed"),
        (LEFT + 170, red, f"uncompensated: up to {worst_before:.2f} mm"),
        (LEFT + 470, blue, f"compensated: up to {worst_after:.4f} mm"),
    ):
        parts.append(f'<rect x="{x}" y="{y - 9}" width="22" height="6" rx="3" fill="{color}"/>')
        parts.append(label(x + 30, y, text))
    body = "\n".join(parts)
    head = f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH:.0f} 455" font-family="sans-serif">'
    return f'{head}\n<rect width="{WIDTH:.0f}" height="455" fill="white"/>\n{body}\n</svg>\n'


if __name__ == "__main__":
    (Path(__file__).parent / "seam.svg").write_text(draw(), encoding="utf-8")
