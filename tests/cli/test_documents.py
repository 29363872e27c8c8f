"""Every document that ``--json`` prints has the keys and types of docs/documents.md, and no others."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from postproc.identification import regions
from postproc.identification.planning import promise
from tests.batch.build import write
from tests.bench.shop.arms import shop
from tests.bench.shop.sets import csv_of, gauges
from tests.conftest import ROOT

from .conftest import Call, Outcome

TYPES = {"text": str, "number": (int, float), "count": int, "yes/no": bool, "null": type(None)}
ROW = re.compile(r"^\| (`.+?`) \| (.+?) \|", re.MULTILINE)
BASE = "instrument_frame,tool_frame,joint_offset,joint_compliance"
RARE = {
    "at_bound[]",
    "effects.fitted[]",
    "expected_on_arm_mm",
    "for[].expected_on_arm_mm",
    "figures[].expected_on_arm_mm",
    "welds[].expected_on_arm_mm",
    "mass_factor[]",
    "stiffness_factor[]",
    "missing[].not_separable_from[]",
    "missing[].not_seen_beside[]",
    "alternatives[].payloads_kg[]",
    "missing[].structure.NAME",
    "missing[].structure.NAME[]",
    "missing[].effective_parameters",
    "tasks[].expected_accuracy.KEY",
    "tasks[].expected_accuracy.beyond_range[]",
    "tasks[].expected_accuracy.sigma_parts_mm.KEY",
    *(f"missing[].law[].{key}" for key in ("joint", "channel", "unit", "at[]", "turn_mrad[]", "sigma_mrad[]")),
}
"""Described, and not in what the commands print here."""
PROGRAM = """MODULE strange
  PERS tooldata t:=[TRUE,[[0,0,300],[1,0,0,0]],[5,[0,0,100],[1,0,0,0],0,0,0]];
  PROC main()
    MoveAbsJ [[0,0,0,0,1,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,t;
    MoveJ [[900,0,1200],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,t;
    MoveJ [[900,0,1200],[0,0,1,0],[0,-1,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,z10,t;
    MoveL [[9000,0,1200],[0,0,1,0],[0,0,0,0],[0,9E9,9E9,9E9,9E9,9E9]],v100,fine,t;
  ENDPROC
ENDMODULE
"""


def described() -> list[tuple[set[str], dict[str, set[str]]]]:
    """Schemas and types by key, section by section; what all documents have comes first."""
    page = (ROOT / "docs" / "documents.md").read_text("utf-8")
    sections = []
    for section in re.split(r"^## ", page, flags=re.MULTILINE):
        types: dict[str, set[str]] = {}
        for keys, words in ROW.findall(section):
            for key in re.findall(r"`(.+?)`", keys):
                types.setdefault(key, set()).update(re.split(r", | or ", words))
        sections.append((set(re.findall(r"`postproc/([a-z-]+)/1`", section)), types))
    return sections


def leaves(value: Any, at: str = "") -> Iterator[tuple[str, Any]]:
    if isinstance(value, dict):
        for key, inside in value.items():
            yield from leaves(inside, f"{at}.{key.replace('.', '/')}".lstrip("."))
    elif isinstance(value, list):
        for inside in value:
            yield from leaves(inside, f"{at}[]")
    else:
        yield at, value


def fits(key: str, path: str) -> bool:
    words = [r"[^.\[]+" if re.fullmatch("[A-Z]+", word) else re.escape(word) for word in re.split(r"(\.|\[\])", key)]
    return re.fullmatch("".join(words), path) is not None


def is_one_of(value: Any, types: set[str]) -> bool:
    return any(isinstance(value, TYPES[t]) and isinstance(value, bool) == (t == "yes/no") for t in types)


COMMANDS = """
inspect strange.mod
inspect samples/corner_arc.mod
compensate programs/broken.mod
compensate programs/a.mod --run-time all
diff programs/a.mod strange.mod
diff strange.mod turned.mod
diff old new
batch programs -o out --report batch.html
fit backlash.csv --robot irb4600_60_205 --effects BASE -o cell.toml
fit far.csv --robot irb4600_60_205 --effects BASE -o far.toml
fit gauges.csv --robot irb1600_10_145 --effects joint_compliance -o soft.toml
fit few.csv --robot irb4600_60_205 --effects BASE -o few.toml
compare cell.toml far.csv
diagnose cell.toml backlash.csv
fit samples/measurements/simulated_step.csv --robot irb4600_60_205 --effects instrument_frame,tool_frame,joint_compliance -o step.toml
diagnose step.toml samples/measurements/simulated_step.csv --report step.html
add cell.toml backlash transmission_error nonlinear_compliance --data backlash.csv -o better.toml
compensate samples/corner_arc.mod -m better.toml --already geometry,gravity --wobj-taught all
touchups samples/touched_up/drawn.mod samples/touched_up/touched.mod --robot irb4600_60_205
touchups near.mod near_touched.mod --robot irb4600_60_205
plan cell.toml backlash.csv -n 3
plan irb4600_60_205 -n 3 --kind gauge --load 20 --for samples/corner_arc.mod
plan few.toml few.csv -n 3 --between gravity_compensator,transmission_error
runtime write -m better.toml -o ppModel.sys
runtime check ppModel.sys -m better.toml
runtime write -o bounded.sys --bound 0.5
robots list
robots show ur5
robots show irb4600_60_205
effects list
effects show backlash
effects show joint_compliance --model samples/models/irb4600_60_205.toml
effects check own.py
fit nowhere.csv --robot ur5 --effects joint_offset
"""
"""For the samples, and for inputs that bring out what is rare."""
STEP = "diagnose step.toml samples/measurements/simulated_step.csv --report step.html"
"""This one is read as text, too: the document is that of its page."""


@pytest.fixture
def printed(call: Call, samples: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> dict[str, Outcome]:
    """What the commands print, by their words; keys and types are the same with fewer simulated tables and fewer regions."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(promise, "TABLES", 2)
    monkeypatch.setattr(promise, "FEWER", 1)
    monkeypatch.setattr(regions, "SEARCHED_REGIONS", 2)
    Path("samples").symlink_to(samples)
    turned = PROGRAM.replace("[0,-1,0,0]", "[0,-1,0,1]")
    old, new = PROGRAM, turned.replace("v100,z10", "v50,z1").replace("  ENDPROC", "    Stop;\n  ENDPROC")
    lines = (samples / "measurements" / "simulated_backlash.csv").read_text("utf-8").splitlines(keepends=True)
    cells = lines[40].split(",")
    cells[7] = f"{float(cells[7]) + 99:.4f}"  # x_mm
    page = (ROOT / "docs" / "effects.md").read_text("utf-8")
    near = "MODULE N\n  PROC main()\n    MoveJ [[1200,y0,900],[0.09,0.7,0.7,-0.09],[0,-1,1,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v9,fine,tool0;\n"
    near += "    MoveJ [[1200,y1,900],[turn,0.7,0.7,-0.09],[0,-1,1,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v9,fine,tool0;\n  ENDPROC\nENDMODULE\n"
    files: dict[str, str | bytes] = {
        "programs/a.mod": (samples / "paper_case.mod").read_bytes(),
        "programs/broken.mod": "MODULE broken\n  PROC main(\nENDMODULE\n",
        "programs/note.txt": "copied",
        "gauges.csv": csv_of(gauges(np.random.default_rng(3), shop("irb1600_10_145", 3))),
        "strange.mod": PROGRAM,
        "turned.mod": turned.replace("v100,z10", "v50,z1"),
        "old/a.mod": old,
        "old/MOC.cfg": "old",
        "new/MOC.cfg": "new",
        "new/a.mod": new.replace("[900,0,1200]", "[900,0,1201]"),
        "backlash.csv": "".join(lines),
        "few.csv": "".join(lines[:46]),
        "far.csv": "".join([*lines[:40], ",".join(cells), *lines[41:]]),
        "near.mod": near.replace("y0", "100").replace("y1", "140").replace("turn", "0.1"),
        "near_touched.mod": near.replace("y0", "100.5").replace("y1", "140").replace("turn", "0.2"),
        "own.py": page.partition("```python\n")[2].partition("```")[0].encode(),
    }
    write(tmp_path, files)
    lines = COMMANDS.split("\n")[1:-1]
    return {line: call(*line.replace("BASE", BASE).split(), *["--json"] * (line != STEP)) for line in lines}


def test_documents_are_as_described(printed: dict[str, Outcome]) -> None:
    (of_page,) = re.findall(
        r'<script[^>]*id="document"[^>]*>(.*?)</script', Path("step.html").read_text("utf-8"), re.DOTALL
    )
    documents = [json.loads(of_page if line == STEP else outcome.out) for line, outcome in printed.items()]
    (_, everywhere), *sections = described()
    wrong, seen = [], set()
    for document in documents:
        schema = document["schema"].split("/")[1]
        types = everywhere | next((keys for schemas, keys in sections if schema in schemas), {})
        for path, value in leaves(document):
            keys = [key for key in types if fits(key, path)]
            seen |= {(schema, key) for key in keys}
            if not any(is_one_of(value, types[key]) for key in keys):
                wrong.append((schema, path, value))
    assert wrong == []
    assert {document["schema"].split("/")[1] for document in documents} == {"error"}.union(*(s for s, _ in sections))
    for schemas, types in sections:
        assert {key for key in types if not any((schema, key) in seen for schema in schemas)} <= RARE
    # Names that the rows do not tell apart are followed by a plan, and a curve is added with what has a name.
    first, *others = printed[STEP].err.split("next: ")[1].splitlines()
    assert "`postproc add step.toml joint_offset curve --data " in first
    assert any("plan step.toml " in line and "--between joint_offset,joint_error_map -o" in line for line in others)
    assert "and something else that no effect of the library explains" in printed[STEP].out
    # As docs/my-effect.md has it.
    assert re.search(r"joint 4 and follows q4 \(step near -12\.3 ± [\d.]+ deg, 1\.1 mrad in all\)", printed[STEP].out)
