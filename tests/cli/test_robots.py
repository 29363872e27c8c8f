"""``robots list`` and ``robots show``."""

from __future__ import annotations

import json

from .conftest import Call


def test_list_says_what_each_arm_can_do(call: Call) -> None:
    outcome = call("robots", "list")
    assert (outcome.code, outcome.err) == (0, "")
    lines = {line.split()[0]: line for line in outcome.out.splitlines()}
    assert "elasticity known" in lines["irb4600_60_205"]
    assert "elasticity to be fitted" in lines["irb4600_40_255"]
    assert "forward models and fitting only" in lines["ur10"]


def test_show_gives_every_number_with_its_source(call: Call) -> None:
    outcome = call("robots", "show", "irb4600_60_205")
    assert outcome.code == 0
    assert "torque [N m]            not known" in outcome.out
    assert "estimate" in outcome.out
    document = json.loads(call("robots", "show", "irb4600_60_205", "--json").out)
    assert document["schema"] == "postproc/robot/1"
    assert document["limits_deg"][1] == [-90.0, 150.0]
    assert document["closed_form_inverse"] is True
    assert json.loads(call("robots", "show", "ur10", "--json").out)["closed_form_inverse"] is False
    assert "Table 2" in document["sources"]["joints.stiffness_Nm_per_rad"]


def test_unknown_robot(call: Call) -> None:
    outcome = call("robots", "show", "irb9999")
    assert (outcome.code, outcome.out) == (2, "")
    assert outcome.err.startswith("error[KIN006]: there is no robot `irb9999`\n  = help: known: `irb4600_20_250`, ")
