"""What a conversion with a function at run time says of it, and the proof of it; the statements are in ``corpus.txt``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from postproc import text as text_of
from postproc.compensation.conversion import Conversion
from postproc.diagnostics import Source
from tests import build
from tests.build import codes, written
from tests.runtime.build import move, program, weld

START = move("p1", "MoveJ")
SEEN = program(START + move("pSeen"))


def converted(text: str, run_time: str = "where-needed", lent: bytes = b"", **options: Any) -> Conversion:
    more = [Source("lent.sys", lent, read_only=True)] if lent else []
    return build.convert(text, None, more, run_time=run_time, air_tolerance_m=2e-4, **options)


def test_the_report_counts_what_goes_through_the_function() -> None:
    conversion = converted(program(START + move("Offs(pSeen,0,0,40)") + move("p2")))
    (row,) = [r for r in conversion.report["statements"] if r["status"] == "run_time"]
    assert (row["edited"], row["shift_mm"]) == ("function", None)
    assert conversion.report["run_time"]["statements"] == 1
    assert ", 1 on the controller," in text_of(conversion)


def test_off_says_how_many_statements_it_would_reach() -> None:
    conversion = converted(program(START + weld("pSeen", "ArcLStart") + weld("Offs(pSeen,9,0,0)", "ArcLEnd")), "off")
    assert conversion.module is None and "ppCorrected" not in written(conversion)
    (finding,) = [d for d in conversion.diagnostics if d.code == "RUN007"]
    assert finding.message == "2 motion statements (2 of them weld) could be corrected on the controller"
    assert "`--run-time where-needed`" in finding.help
    assert "RUN007" not in codes(converted(program(START + move("p2")), "off"))


def test_all_proves_known_targets_that_go_through_the_function() -> None:
    """Ends alone are corrected: what is left in the middle of 200 mm is what the proof finds."""
    text = program(START + weld("p1", "ArcLStart") + weld("p2", "ArcLEnd") + move("Offs(p2,0,0,80)"))
    conversion = converted(text, "all")
    figures, report = conversion.report["run_time"], conversion.report
    assert {o.status for o in conversion.outcomes} == {"run_time"}
    assert figures["known_targets"] >= 3 and 0 < figures["max_known_error_mm"] < 0.001
    after = report["max_arc_error_after_mm"]
    assert 10 * figures["max_known_error_mm"] < after < 0.1 * report["max_arc_error_before_mm"]
    assert "targets that are known it is off by up to 0.000" in written(conversion)
    assert len([x for x in written(conversion).splitlines() if x.strip()[:2] != "! "]) == len(text.splitlines())


@pytest.mark.parametrize("mode", ["off", "where-needed", "all"])
def test_what_was_corrected_before_is_refused(mode: str) -> None:
    """Its text, and the module that is read along."""
    first = converted(SEEN)
    for again in (converted(written(first), mode), converted(SEEN, mode, first.module or b"")):
        assert (codes(again), again.outputs) == (["CMP001"], {})


def test_the_payload_is_data_of_the_module_where_grip_load_states_it() -> None:
    """VAR data, which a restart of the program sets back."""
    conversion = converted(
        program(START + "    GripLoad lPart;\n" + move("p2") + "    GripLoad load0;\n" + move("pSeen"))
    )
    assert b"VAR loaddata ppPayload" in (conversion.module or b"")
    assert conversion.report["run_time"]["loads"] == 2
    assert "GripLoad" not in written(converted(SEEN))


@pytest.mark.parametrize("load", ["load0", "lPart"])
def test_the_module_is_proved_with_the_load_that_the_call_hands_over(load: str, tmp_path: Path) -> None:
    """A module that takes `load0` for a load of 1 g is found out: tenths of a millimetre."""
    text = program(START + move("p2").replace("\\WObj", f"\\TLoad:={load}\\WObj") + move("pSeen"))
    residual = [o.residual_mm for o in converted(text, "all").outcomes if o.residual_mm is not None]
    assert residual and max(residual) < 0.002
    shipped = (Path(__file__).parents[2] / "templates" / "runtime_module.j2").read_text()
    condition = "NOT (TLoad.mass>=0 AND TLoad.mass<={{ no_mass }})"
    assert condition in shipped
    (tmp_path / "runtime_module.j2").write_text(shipped.replace(condition, "TRUE"))
    wrong = converted(text, "all", template_dir=tmp_path)
    after = max((o.residual_mm or 0.0 for o in wrong.outcomes), default=0.0)
    assert (after > 0.02 or not wrong.outputs) == (load == "load0")
