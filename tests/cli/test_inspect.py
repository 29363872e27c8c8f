"""``inspect``: every motion statement is accounted for, and bad input never ends in a traceback."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from postproc.robot.catalogue import load_robot
from postproc.robot.type_names import ARMS

from .conftest import Call


@pytest.mark.parametrize("name", ["hull_seam.mod", "corner_arc.mod", "panel_300.mod", "paper_case.mod"])
def test_samples_are_reachable_as_they_are(call: Call, samples: Path, name: str) -> None:
    outcome = call("inspect", samples / name, "--json")
    assert outcome.code == 0, outcome.err
    document = json.loads(outcome.out)
    weightless = [("MOT012", "info")] if name == "paper_case.mod" else []  # as in the study
    assert [(d["code"], d["severity"]) for d in document["diagnostics"]] == weightless
    assert document["statements"]
    for row in document["statements"]:
        assert row["notes"] == []
        assert row["runs"] >= 1
        assert len(row["position_mm"]) == 3
        assert (row["reason"] is None) == (row["edited"] is not None) == (row["instruction"] != "MoveAbsJ")


def test_the_study_is_reachable_for_both_geometries(call: Call, samples: Path) -> None:
    assert call("inspect", samples / "paper_case.mod", "--robot", "irb4600_60_205_seed").code == 0


def test_rows_say_where_and_with_what(call: Call, samples: Path) -> None:
    text = call("inspect", samples / "panel_300.mod").out.splitlines()
    tacks = [line for line in text if "rTacks" in line]
    assert len(tacks) == 3
    assert [line.split(", 48 times; ")[1] for line in tacks] == [
        "an offset is written into its argument",
        "its array element is edited",
        "it moves with the target that it is derived from",
    ]
    # The work object is turned by a third of a degree only, so base and work object positions nearly add up.
    first = next(line for line in text if "ArcLStart" in line).split()
    assert [float(x) for x in first[3:6]] == pytest.approx([1010 + 12.5 + 116, -8 - 475, 430], abs=6.0)
    assert first[6:] == ["tTorch", "5.6", "kg,", "wPanel;", "its", "declaration", "is", "edited"]


def edited(samples: Path, tmp_path: Path, *changes: tuple[str, str]) -> Path:
    """The hull seam with some text changed."""
    text = (samples / "hull_seam.mod").read_bytes().decode()
    for before, after in changes:
        assert before in text
        text = text.replace(before, after, 1)
    path = tmp_path / "edited.mod"
    path.write_bytes(text.encode())
    return path


@pytest.mark.parametrize(
    ("before", "after", "code", "words"),
    [
        ("[[698.15,5.53,0.48]", "[[698.15,-1405.53,0.48]", "KIN001", "reach"),
        ("[0,-1,0,0]", "[2,-1,0,0]", "KIN002", "configuration"),
        ("[-1,0,-1,0]", "[-1,0,-1,7]", "KIN002", "configuration"),
    ],
)
def test_what_the_arm_cannot_do(
    call: Call, samples: Path, tmp_path: Path, before: str, after: str, code: str, words: str
) -> None:
    path = edited(samples, tmp_path, (before, after))
    outcome = call("inspect", path)
    assert outcome.code == 1
    assert f"error[{code}]" in outcome.err
    assert f"--> {path}:" in outcome.err
    assert "= help: " in outcome.err
    assert words in outcome.err


@pytest.mark.parametrize(
    ("content", "code", "exit_code"),
    [
        (b"", "error[CLI005]", 2),
        (bytes(range(256)) * 4, "error[RAP002]", 2),
        (b"MoveL p1,v100,fine,tool0;", "error[RAP011]", 2),
        (b"\xfc\x81\x00\x01" * 40, "info[RAP013]", 0),  # an encrypted module is nobody's fault
    ],
)
def test_what_is_no_program(call: Call, tmp_path: Path, content: bytes, code: str, exit_code: int) -> None:
    path = tmp_path / "odd.mod"
    path.write_bytes(content)
    outcome = call("inspect", path)
    assert (outcome.code, outcome.out) == (exit_code, "")
    assert code in outcome.err.splitlines()[min(1, outcome.err.count("\n") - 1)] or outcome.err.startswith(code)
    assert str(path) in outcome.err


@pytest.mark.parametrize("content", [b"", b"\xff\xfe"])
def test_a_file_that_is_no_model_is_named(call: Call, samples: Path, tmp_path: Path, content: bytes) -> None:
    model = tmp_path / "m.toml"
    model.write_bytes(content)
    outcome = call("inspect", samples / "hull_seam.mod", "-m", model)
    assert (outcome.code, outcome.out) == (2, "")
    assert outcome.err.startswith("error[") and str(model) in outcome.err


SHARED = """MODULE shared
  PERS tooldata t:=[TRUE,[[0,0,350],[1,0,0,0]],[5,[0,0,100],[1,0,0,0],0,0,0]];
  CONST robtarget p1:=[[1200,0,900],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget p2:=[[1300,200,900],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    MoveJ p1,v100,fine,t;
    FOR i FROM 1 TO 4 DO
      MoveL RelTool([[1200,0,900],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],0,100*i,0),v100,fine,t;
    ENDFOR
    MoveL Offs(p2,0,0,50),v100,fine,t;
    MoveL p2,v100,fine,t;
    MoveL [[1250,100,900],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,t;
    MoveL p1,v100,fine,tool0;
  ENDPROC
ENDMODULE
"""


def test_the_decision_for_every_statement_is_that_of_compensate(call: Call, tmp_path: Path) -> None:
    """p1 serves two tools: its numbers serve one, an Offs the other; one Offs serves the four runs of the loop."""
    path = tmp_path / "shared.mod"
    path.write_text(SHARED)
    (tmp_path / "postproc.toml").write_text("tolerance_mm = 0.01\n")
    rows = json.loads(call("inspect", path, "--json").out)["statements"]
    decided = ["declaration", "argument", "argument", "declaration", "aggregate", "argument"]
    assert [row["edited"] for row in rows] == decided
    document = json.loads(call("compensate", path, "--json").out)
    assert [row["edited"] for row in document["statements"]] == decided


def test_an_arm_of_unknown_stiffness_is_looked_at_as_it_is(call: Call, samples: Path, tmp_path: Path) -> None:
    lines = (ARMS / "irb4600_20_250.toml").read_text(encoding="utf-8").splitlines()
    mine = tmp_path / "mine.toml"
    mine.write_text("\n".join(line for line in lines if not line.startswith("stiffness")), encoding="utf-8")
    outcome = call("inspect", samples / "hull_seam.mod", "--robot", mine, "--json")
    assert outcome.code == 0
    document = json.loads(outcome.out)
    assert {row["edited"] for row in document["statements"]} == {None}


def test_the_help_names_the_file_that_declares_what_is_missing(call: Call, tmp_path: Path) -> None:
    tool, rest = SHARED.splitlines(keepends=True)[1], SHARED.splitlines(keepends=True)
    (tmp_path / "PROGMOD").mkdir()
    (tmp_path / "SYSMOD").mkdir()
    path, system = tmp_path / "PROGMOD" / "a.mod", tmp_path / "SYSMOD" / "user.sys"
    path.write_text("".join([rest[0], *rest[2:]]))
    system.write_text(f"MODULE user\n{tool}ENDMODULE\n")
    (path.parent / "b.mod").write_text(f"MODULE b\nLOCAL {tool}ENDMODULE\n")  # serves its own module alone
    missing = call("inspect", path, "--alone")
    assert missing.code == 1
    assert "b.mod" not in missing.err
    assert f"`{system}` declares it: add `--with {system}`" in missing.err
    assert call("inspect", path, "--with", system).code == 0
    assert call("compensate", path, "--with", system, "-o", tmp_path / "out.mod").code == 0
    assert system.read_text() == f"MODULE user\n{tool}ENDMODULE\n"


def test_names_in_values_and_zones_are_looked_for_beside_the_file(call: Call, tmp_path: Path) -> None:
    path, cell = tmp_path / "a.mod", tmp_path / "cell.mod"
    place = "[[0,0,0],[0,1,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]"
    body = "q.trans.z:=zHeight;\nMoveL q,v100,zAir,tool0;"
    path.write_text(f"MODULE a\nVAR robtarget q:={place};\nPROC main()\n{body}\nENDPROC\nENDMODULE\n")
    cell.write_text("MODULE cell\nCONST num zHeight:=5;\nCONST zonedata zAir:=[FALSE,1,1,1,0.1,1,0.1];\nENDMODULE\n")
    told = call("inspect", path, "--alone").err
    assert "`zHeight` has no value" in told and "`zAir` states is not known" in told
    assert told.count(f"`{cell}` declares it: add `--with {cell}`") == 2


def test_data_near_a_program_is_read_along_and_that_is_said(call: Call, tmp_path: Path) -> None:
    tool, rest = SHARED.splitlines(keepends=True)[1], SHARED.splitlines(keepends=True)
    (tmp_path / "PROGMOD").mkdir()
    (tmp_path / "SYSMOD").mkdir()
    path, system = tmp_path / "PROGMOD" / "a.mod", tmp_path / "SYSMOD" / "user.sys"
    path.write_text("".join([rest[0], *rest[2:]]))
    system.write_text(f"MODULE user\n{tool}ENDMODULE\n")
    for command in (["inspect", path], ["compensate", path, "-o", tmp_path / "out.mod"]):
        outcome = call(*command)
        assert outcome.code == 0
        assert f"info[RAP038]: `{system}` near it is read along: it declares `t`" in outcome.err
        assert json.loads(call(*command, "--json").out)["diagnostics"][0]["code"] == "RAP038"
    whole = tmp_path / "whole.mod"
    whole.write_text(SHARED)
    same = [
        line.strip() for line in call("compensate", whole).out.splitlines() if "robtarget" in line or "Move" in line
    ]
    got = [
        line.strip()
        for line in (tmp_path / "out.mod").read_text().splitlines()
        if "robtarget" in line or "Move" in line
    ]
    assert got == same
    assert system.read_text() == f"MODULE user\n{tool}ENDMODULE\n"
    assert call("compensate", path, "-o", system).code == 2
    (tmp_path / "postproc.toml").write_text("alone = true\n")
    assert "RAP020" in call("compensate", path, "-o", tmp_path / "out.mod").err


def test_of_values_that_differ_none_is_taken(call: Call, tmp_path: Path) -> None:
    tool, rest = SHARED.splitlines(keepends=True)[1], SHARED.splitlines(keepends=True)
    (tmp_path / "a.mod").write_text("".join([rest[0], *rest[2:]]))
    (tmp_path / "b.mod").write_text(f"MODULE b\n{tool}ENDMODULE\n")
    (tmp_path / "c.mod").write_text(f"MODULE c\n{tool.replace('TRUE,[[0', 'TRUE,[[1')}ENDMODULE\n")
    outcome = call("compensate", tmp_path / "a.mod", "-o", tmp_path / "out.mod")
    assert outcome.code == 1
    assert f"`{tmp_path / 'b.mod'}` and `{tmp_path / 'c.mod'}` near it declare different values of `t`" in outcome.err
    assert call("compensate", tmp_path / "a.mod", "--with", tmp_path / "c.mod", "-o", tmp_path / "out.mod").code == 0


def test_what_belongs_together_is_left_to_batch(call: Call, tmp_path: Path) -> None:
    listing = tmp_path / "p.pgf"
    listing.write_text("<Program><Module>a.mod</Module></Program>")
    for name in (tmp_path, listing):
        outcome = call("compensate", name)
        assert outcome.code == 2
        assert f"postproc batch {name} -o FOLDER" in outcome.err


def test_the_posture_and_what_is_nearest(call: Call, samples: Path) -> None:
    """Compared with the joint values of every target, which a line between them comes a little nearer than."""
    outcome = call("inspect", samples / "hull_seam.mod", "--json")
    document = json.loads(outcome.out)
    rows = [row for row in document["statements"] if row["joints_deg"]]
    q = np.array([row["joints_deg"] for row in rows])
    robot = load_robot("irb4600_60_205")
    lower, upper = np.degrees([robot.lower, robot.upper])
    at_targets = np.minimum(q - lower, upper - q).min()
    limit, wrist, arm = document["nearest"]
    assert limit["distance_deg"] == pytest.approx(at_targets, abs=0.05)
    assert limit["distance_deg"] <= at_targets + 1e-9  # a line may come nearer than its ends
    assert limit["distance_deg"] == pytest.approx(
        min(limit["angle_deg"] - lower[limit["joint"] - 1], upper[limit["joint"] - 1] - limit["angle_deg"])
    )
    assert 0 < np.abs(q[:, 4]).min() - wrist["distance_deg"] < 0.3
    assert (wrist["joint"], wrist["angle_deg"]) == (5, pytest.approx(wrist["distance_deg"]))
    assert 0.2 < arm["singular_value_ratio"] < 1 and arm["distance_deg"] is None
    quarters = np.floor(q[:, [0, 3, 5]] / 90 + 1e-9)
    assert [row["confdata"][:3] for row in rows] == quarters.astype(int).tolist()
    text = call("inspect", samples / "hull_seam.mod").out.splitlines()[-4:]
    assert text[0] == "start: joints 0.0, -25.0, 25.0, 0.0, 65.0, 0.0 deg, confdata [0,0,0,0]; line 35, MoveAbsJ"
    assert [line.split(":")[0] for line in text[1:]] == [f"nearest to a {near['to']}" for near in document["nearest"]]


def test_a_line_comes_nearer_to_a_limit_than_its_ends(call: Call, tmp_path: Path) -> None:
    """Between two targets at either side the arm turns straight ahead: joint 5 is straightest there."""
    tool = "[TRUE,[[0,0,350],[1,0,0,0]],[5,[0,0,100],[1,0,0,0],0,0,0]]"
    places = [
        f"[[1300,{y},1100],[0.5,0,0.866025,0],[{c},0,{c},0],[9E9,9E9,9E9,9E9,9E9,9E9]]"
        for y, c in ((-600, -1), (600, 0))
    ]
    moves = "".join(f"{name} {p},v100,fine,t;\n" for name, p in zip(("MoveJ", "MoveL"), places, strict=True))
    path = tmp_path / "a.mod"
    path.write_text(
        f"MODULE a\nPERS tooldata t:={tool};\nPROC main()\nConfL\\Off;\nConfJ\\Off;\n{moves}ENDPROC\nENDMODULE\n"
    )
    document = json.loads(call("inspect", path, "--json").out)
    ends = [abs(row["joints_deg"][4]) for row in document["statements"]]
    wrist = next(near for near in document["nearest"] if near["to"] == "singular wrist")
    assert wrist["distance_deg"] < min(ends) - 5
    assert wrist["line"] == 7


def test_what_only_the_controller_could_correct_is_counted(call: Call) -> None:
    worlds = Path(__file__).resolve().parent.parent / "worlds" / "programs"
    outcome = call("inspect", worlds / "socket_fed.mod", "--robot", "irb4600_60_205")
    assert "info[RUN007]: 3 motion statements could be corrected on the controller" in outcome.err


def test_external_axes_are_listed(call: Call, tmp_path: Path) -> None:
    axes = "[150.5,9E9,-20,9E9,9E9,9E9]"
    (tmp_path / "cell.mod").write_text(
        "MODULE m\n  PERS tooldata t:=[TRUE,[[0,0,300],[1,0,0,0]],[5,[0,0,100],[1,0,0,0],0,0,0]];\n  PROC main()\n"
        f"    MoveL [[1200,0,800],[0,0,1,0],[0,0,0,0],{axes}],v100,fine,t;\n  ENDPROC\nENDMODULE\n",
        encoding="utf-8",
    )
    given = ("inspect", tmp_path / "cell.mod", "--robot", "irb4600_60_205", "--free-axes", "ac")
    assert ", eax_a 150.5, eax_c -20;" in call(*given).out
    assert json.loads(call(*given, "--json").out)["statements"][0]["external_axes"] == {"a": 150.5, "c": -20.0}


def test_what_is_commonly_meant_is_named(call: Call, tmp_path: Path) -> None:
    path = tmp_path / "a.mod"
    path.write_text(SHARED)
    assert "say `--in-place` to write over the program" in call("compensate", path, "-o", path).err
    told = call("batch", tmp_path, "-o", tmp_path / "out", "--check").err
    assert "--channel" not in told and "they belong to `postproc compensate`" in told
