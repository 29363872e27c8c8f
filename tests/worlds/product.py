"""The product, asked as its users ask it: programs in, corrected programs and what it says of each statement out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

RunTime = Literal["off", "where-needed", "all"]
ARM, FORCE = "irb4600_60_205", (200.0, -200.0, -200.0)


@dataclass(frozen=True)
class Converted:
    """Texts by path, empty where nothing was written; correction [mm] by line of the file; errors, and all that it said; the module for
    run time, and the lines whose targets go through its function.
    """

    texts: dict[str, str]
    corrections: dict[tuple[str, int], float] = field(default_factory=dict)
    said: str = ""
    told: str = ""
    module: str = ""
    through: frozenset[int] = frozenset()


def convert(
    texts: Mapping[str, str], tolerance_mm: float = 0.01, run_time: RunTime = "off", axes: str = ""
) -> Converted:
    """Corrects the files of one task for the IRB 4600-60/2.05 under a constant force, inertia off.

    Args:
        axes: the external axes of the cell, as a model file states them.
    """
    from postproc.compensation.options import Options
    from postproc.diagnostics import Source
    from postproc.model.file import default_model, parse_model
    from postproc.runtime.passes import correct_program

    options = Options(tolerance_m=1e-3 * tolerance_mm, force=FORCE, inertia=False, run_time=run_time)
    sources = [Source(path, text.encode("latin-1")) for path, text in texts.items()]
    model = default_model(ARM)
    if axes:
        springs = ",".join(repr(float(c)) for c in model.effects[0].compliance_rad_per_Nm)
        effects = f"[effects.joint_compliance]\ncompliance_rad_per_Nm = [{springs}]"
        model = parse_model(Source("cell.toml", f'robot = "{ARM}"\n{effects}\n{axes}'.encode()))
    result = correct_program(sources, model, options)
    said = "; ".join(f"{d.code} {d.message}" for d in result.diagnostics if d.severity == "error")
    told = "; ".join(f"{d.code} {d.message}" for d in result.diagnostics)
    shifts: dict[tuple[str, int], float] = {}
    for s in result.report.get("statements", []):
        key = (s["path"], s["line"])
        shifts[key] = max(shifts.get(key, 0.0), float(s["shift_mm"] or 0.0))
    through = frozenset(s["line"] for s in result.report.get("statements", []) if s["status"] == "run_time")
    texts = {path: data.decode("latin-1") for path, data in result.outputs.items()}
    return Converted(texts, shifts, said, told, (result.module or b"").decode("latin-1"), through)
