"""Draw follows.svg: the first charts of the page of ``compare`` on samples/measurements/simulated_backlash.csv.

Run ``python docs/figures/draw_follows.py`` in the root of the repository.
"""

from __future__ import annotations

import re
from pathlib import Path

from postproc.diagnostics import Source
from postproc.effects.registry import effect_library
from postproc.fit.least_squares import fit_model
from postproc.measure.read.table import read_measurements
from postproc.model.arm import Model
from postproc.report.charts import SIZE
from postproc.report.page import asset
from postproc.report.residuals import channel_sections
from postproc.robot.catalogue import load_robot

ROOT = Path(__file__).resolve().parents[2]
BASE = ("instrument_frame", "tool_frame", "joint_offset", "joint_compliance")
CHARTS = 3
WIDTH, HEIGHT = SIZE


def main() -> None:
    table = ROOT / "samples" / "measurements" / "simulated_backlash.csv"
    robot = load_robot("irb4600_60_205")
    library = effect_library()
    data = read_measurements(Source(table.name, table.read_bytes()), robot)
    fit = fit_model(Model(robot), data, [library[key].null() for key in BASE])
    charts = re.findall(r"<svg.*?</svg>", channel_sections(fit, folded=True)[0].html)[:CHARTS]
    size = f'width="{CHARTS * WIDTH}" height="{HEIGHT}"'
    placed = [chart.replace("<svg ", f'<svg x="{i * WIDTH}" ', 1) for i, chart in enumerate(charts)]
    style = f"<style>{asset('page.css')}</style>"
    inside = f'{style}<rect {size} fill="#fff"/>{"".join(placed)}'
    page = f'<svg xmlns="http://www.w3.org/2000/svg" class="paper" {size}>{inside}</svg>\n'
    (ROOT / "docs" / "figures" / "follows.svg").write_text(page, encoding="utf-8")


if __name__ == "__main__":
    main()
