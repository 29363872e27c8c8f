"""What is expected on the arm comes first, with the same figures in all that a conversion writes."""

from __future__ import annotations

import json
import re
from html import unescape
from pathlib import Path

import pytest

from postproc.compensation.judgement.figures import legend
from postproc.numbers import SHARE_DECIMALS, above, on_arm_text, percent_range, range_text
from postproc.results.convert.figures import figure_table
from tests.compensation.build import PROCESS, effect, small

from .conftest import Call

SEAM_BODY = f"MoveL @{{1300,-500}},v200,fine,tT; ArcLStart @{{1300,-400}},{PROCESS},fine,tT; ArcLEnd @{{1300,-200}},{PROCESS},fine,tT;"
SEAM = small(SEAM_BODY)
FITTED = (
    'robot = "irb4600_60_205"\n'
    + effect("joint_compliance", "compliance_rad_per_Nm = [4e-6, 4e-7, 3e-7, 2e-6, 2e-6, 3e-6]")
    + '[fit]\nparameters = ["joint_compliance.compliance_rad_per_Nm[1]"]\ncovariance = [[1.6e-15]]\nunexplained_mm = 0.04\n'
)
STIFFNESS = "he stiffness of this arm is not measured: with that of its type {} to {} % of its own deflection remain"
READINGS = "ix set-ups of a dial gauge leave about {} to {} % of it: `postproc plan irb4600_40_255 -n 6 --kind gauge --load 40 --pull 100 -o gauge.csv`"


def words_of(path: Path) -> str:
    """What a page or a certificate says, without its marks; cells have blanks between them."""
    body = re.sub(r"<(script|style).*?</\1>", "", path.read_text("utf-8"), flags=re.DOTALL)
    return " ".join(unescape(re.sub(r"<.*?>", " ", re.sub(r"</?code>|`", "", body))).split())


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
    (task,), weld = batch["tasks"], document["figures"][0]
    assert task.get("expected_on_arm_mm") == expected == weld["expected_on_arm_mm"] and (expected is None) == (
        arm == "user"
    )
    assert task["figures"] == document["figures"] and weld["place"] == "weld"
    text = "not known" if expected is None else f"{expected[0]:.2f} to {expected[1]:.2f} mm"
    before, after = (f"{weld[f'{when}_mm']:.2f}" for when in ("before", "after"))
    assert expected is None or 0.0 < weld["after_mm"] <= expected[0] < expected[1]
    header = [line.strip() for line in out.read_text("latin-1").splitlines()]
    (row,) = re.findall(r"^  seam\.mod  compensated  (.+)", shown, re.MULTILINE)
    line = rf"weld +{before} +{after} +0\.10 +{text.removesuffix(' mm')}$"
    # terminal, header, page, certificate, row of the batch
    assert re.search(rf"^  {line}", made.err, re.MULTILINE) and re.search(
        rf"^ *! {line}", "\n".join(header), re.MULTILINE
    )
    on_arm = (
        "what the arm does is not known" if expected is None else f"on the arm {text} are expected while the arc burns"
    )
    assert header[2] == f"! The tolerance of 0.1 mm is kept in the model; {on_arm}."
    assert header[2].removeprefix("! ") == document["verdict_sentence"] == task["verdict_sentence"]
    assert re.match(rf"{text.removesuffix(' mm')} +{before} +{after} +0\.10 ", row)
    assert f"seam.mod: on the arm {text}, in the model {before} -> {after} mm" in shown
    for words in (f"expected on the arm, while the arc burns {text} ", f"before, while the arc burns {before} mm ",
                  f"after in the model, while the arc burns {after} mm "):  # fmt: skip
        assert words in words_of(page)
    assert f"while the arc burns {before} {after} {text.removesuffix(' mm')} 0.1 in the model" in words_of(certificate)
    assert document["acceleration_limits"] == "estimated"
    assert "from limits of acceleration that are estimated." in words_of(page)
    stiffness = document["expected_remaining_fraction"]
    if arm == "type":
        shares = STIFFNESS.format(*(f"{100 * x:.0f}" for x in stiffness))
        readings = READINGS.format(*(f"{100 * x:.0f}" for x in document["expected_remaining_fraction_after_gauge"]))
        assert f"fit a model of it: {readings.partition(': ')[2]}\n" in made.err  # CMP027: the whole command
        for where in ("\n".join(header), made.err, shown):
            assert shares in where and readings in where
        for where in (words_of(page), words_of(certificate)):
            assert shares in where and readings.replace("`", "") in where
    else:
        assert "dial gauge" not in "".join((*header, made.err, shown, words_of(page), words_of(certificate)))


LEFT = "The tolerance of 0.1 mm is not kept: 2 weld statements are left as they are."


def test_a_weld_that_is_left_is_said_first_in_all_that_is_written(call_as_written: Call, tmp_path: Path) -> None:
    program, out, arm = tmp_path / "in" / "left.mod", tmp_path / "out.mod", ("--robot", "irb4600_60_205")
    program.parent.mkdir()
    unknown = f"ArcLStart Offs(p1,0,200*n,0),{PROCESS},fine,tT; ArcLEnd Offs(p1,0,200*n+100,0),{PROCESS},fine,tT;"
    body = SEAM_BODY + f"n:=GInput(gi1); MoveL @{{1300,0}},v200,fine,tT; {unknown}"
    program.write_text(small(body, "p1 1300 100", "VAR num n;\n"), "latin-1")
    (program.parent / "whole.mod").write_text(SEAM, "latin-1")
    page, certificate = tmp_path / "page.html", tmp_path / "certificate.html"
    made = call_as_written("compensate", program, *arm, "-o", out, "--report", page, "--certificate", certificate)
    assert LEFT in made.err
    header = [line.strip() for line in out.read_text("latin-1").splitlines()]
    assert header[2] == f"! {LEFT}"
    assert re.search(rf'<header class="lost">\s*<h1[^>]*>{re.escape(LEFT)}</h1>', page.read_text("utf-8"))
    assert f"The tolerance is not kept. {LEFT}" in words_of(certificate)
    shown = call_as_written("batch", program.parent, *arm, "-o", tmp_path / "tree", "--require", "model").err
    assert f"left.mod: {LEFT[0].lower()}{LEFT[1:-1]}; on the arm " in shown
    assert "2 of 2 programs are corrected" in shown and "; in 1 of them the tolerance is not kept.\n" in shown
    assert f"\n`left.mod`: {LEFT}\nFarthest off is `" in shown
    assert re.search(r"^  left\.mod   compensated, not kept ", shown, re.MULTILINE)
    assert re.match(r"`--require model`: .* in 1 of 2 programs, the worst: `left\.mod`, ", shown.splitlines()[-1])


def test_statements_are_counted_alike_by_every_command(call_as_written: Call, tmp_path: Path) -> None:
    program, out, arm = tmp_path / "seam.mod", tmp_path / "out.mod", ("--robot", "irb4600_60_205")
    program.write_text(SEAM, "latin-1")
    made = call_as_written("compensate", program, *arm, "-o", out).err
    (corrected,) = re.findall(r"^  (\d+ of \d+ motion statements) corrected", made, re.MULTILINE)
    checked = call_as_written("compensate", program, *arm, "--check").err.splitlines()[-1]
    compared = call_as_written("diff", program, out).out.splitlines()[0]
    assert corrected == "3 of 3 motion statements"
    assert checked.startswith(f"`{program}` would change: {corrected} differ, by up to ")
    assert compared.rstrip(".") == checked.partition(": ")[2]


def test_rows_without_a_tolerance_stand_where_they_say_something_with_what_they_are() -> None:
    places = [("weld", 0.04, 0.1), ("air", 0.05, 0.2), ("speed_changes", 0.09, None), ("correction_jumps", 0.3, None)]
    figures = [
        {"place": place, "before_mm": 1.0, "after_mm": after, "tolerance_mm": tolerance, "expected_on_arm_mm": None}
        for place, after, tolerance in places
    ]
    table = figure_table({"tolerance_mm": 0.1, "figures": figures, "from_programmed_path": None})
    assert [row[0] for row in table.rows] == ["weld", "air", "correction jumps"]
    jumps = "correction jumps: a load changes or a joint turns back, without the arc. No tolerance holds there."
    assert legend(figures) == jumps and legend(figures[:3]) == ""


def test_an_interval_whose_ends_read_alike_is_one_figure() -> None:
    assert on_arm_text([0.211, 0.214], 2) == "0.21 mm" and on_arm_text([0.211, 0.214], 3) == "0.211 to 0.214 mm"
    assert (percent_range([0.351, 0.353]), percent_range([0.03, 0.45])) == ("35 %", "3 to 45 %")
    for share in (0.0449, 1.2449, 1.24451, 1.32499, 1.325):  # as told, and as read again from the document
        assert percent_range([share, share]) == percent_range([round(share, SHARE_DECIMALS)] * 2)
    assert range_text([0.04, 0.06], 2, "mm", guess=True) == "0.04 to 0.06 mm, a guess"


def test_what_is_beyond_a_limit_reads_so() -> None:
    assert [above(value, 0.1, 2) for value in (0.06, 0.1, 0.101, 0.10004, 0.134)] == [
        *("0.06", "0.10", "0.101", "0.10004", "0.13"),
    ]
    assert above(0.1 + 1e-9, 0.1, 2) == "0.10000"
