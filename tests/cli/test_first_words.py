"""What is expected on the arm comes first, with the same figures in all that a conversion writes."""

from __future__ import annotations

import json
import re
from html import unescape
from pathlib import Path

import pytest

from tests.compensation.build import PROCESS, effect, small

from .conftest import Call

SEAM = small(
    f"MoveL @{{1300,-500}},v200,fine,tT; ArcLStart @{{1300,-400}},{PROCESS},fine,tT; ArcLEnd @{{1300,-200}},{PROCESS},fine,tT;"
)
FITTED = (
    'robot = "irb4600_60_205"\n'
    + effect("joint_compliance", "compliance_rad_per_Nm = [4e-6, 4e-7, 3e-7, 2e-6, 2e-6, 3e-6]")
    + '[fit]\nparameters = ["joint_compliance.compliance_rad_per_Nm[1]"]\ncovariance = [[1.6e-15]]\nunexplained_mm = 0.04\n'
)
WAY = "the stiffness of this arm is not measured: with that of its type {} to {} % of its deflection remain, about {} to {} % after 12 readings with a dial gauge (postproc plan irb4600_40_255 -n 6 --kind gauge --load KG --pull 100)"


def sentence_of(path: Path) -> str:
    """The result that a page or a certificate states, without its marks."""
    found = re.findall(
        r'<(?:h1|p) class="(?:sentence|more|result)">(.*?)</(?:h1|p)>', path.read_text("utf-8"), re.DOTALL
    )
    return unescape(re.sub(r"<b.*?</b> |<.*?>", "", " ".join(found)))


@pytest.mark.parametrize("arm", ["type", "fitted", "user"])
def test_the_same_figures_lead_in_all_that_is_written(call_as_written: Call, tmp_path: Path, arm: str) -> None:
    program, out, model = tmp_path / "in" / "seam.mod", tmp_path / "out.mod", tmp_path / "cell.toml"
    program.parent.mkdir()
    program.write_text(SEAM, "latin-1")
    model.write_text(FITTED if arm == "fitted" else FITTED.partition("[fit]")[0])
    chosen = ("--robot", "irb4600_40_255") if arm == "type" else ("-m", model)
    page, certificate = tmp_path / "page.html", tmp_path / "certificate.html"
    made = call_as_written("compensate", program, *chosen, "-o", out, "--report", page, "--certificate", certificate)
    document = json.loads(call_as_written("compensate", program, *chosen, "--json").out)
    batch = json.loads(call_as_written("batch", program.parent, *chosen, "-o", tmp_path / "json", "--json").out)
    shown = call_as_written("batch", program.parent, *chosen, "-o", tmp_path / "tree").err
    expected = document["expected_on_arm_mm"]
    (task,) = batch["tasks"]
    assert task.get("expected_on_arm_mm") == expected and (expected is None) == (arm == "user")
    text = "not known" if expected is None else f"{expected[0]:.2f} to {expected[1]:.2f} mm"
    assert expected is None or 0.0 < document["max_arc_error_after_mm"] <= expected[0] < expected[1]
    first = f"Expected on the arm while the arc burns: {text}"
    header = [line.strip() for line in out.read_text("latin-1").splitlines()]
    printed = [line for line in made.err.splitlines() if line.startswith("Expected")]
    (row,) = re.findall(r"^  seam\.mod  compensated  (.+)", shown, re.MULTILINE)
    assert header[2] == f"! {first[0].lower()}{first[1:]}"
    assert len(printed) == 1 and printed[0].startswith(f"{first}; ")
    assert sentence_of(page).startswith(f"{first}; ") and sentence_of(certificate).startswith(f"{first}. ")
    assert row.startswith(f"{text}  ") and f"seam.mod: on the arm {text}, in the model " in shown
    if arm == "type":
        shares = [*document["expected_remaining_fraction"], *document["expected_remaining_fraction_after_gauge"]]
        way = WAY.format(*(f"{100 * x:.0f}" for x in shares))
        for where in ("\n".join(header), made.err, shown, sentence_of(page), sentence_of(certificate)):
            assert way[1:] in where.replace("`", "")
    else:
        assert "dial gauge" not in "".join((*header, made.err, shown, sentence_of(page), sentence_of(certificate)))
