"""The module that is written: the header's place, the marker, what is kept byte for byte."""

from __future__ import annotations

import re

import pytest

from postproc.diagnostics import Source
from postproc.rapid.program.program import Program, read_program
from tests.build import DATA, codes, convert, module, target, written

P1 = f"CONST robtarget p1:={target(1350, -500)};"
PLAIN = module(P1, f"MoveJ p1,v200,fine,tT;\nMoveL {target(1350, -400)},v50,fine,tT;")
OTHER = f"  CONST robtarget p9:={target(1350, -300)};\n  PROC other()\n    MoveL p9,v50,fine,tT;\n  ENDPROC\n"
HEADER = re.compile(
    r"(?:^[ \t]*! (?:postproc|The tolerance|the stiffness|six set-ups|model|on the TCP|deviation|lines|speed|0 targets)[^\n]*\n){9,10}",
    re.M,
)
NUMBER = re.compile(r"[+-]?\d+\.?\d*(?:E[+-]?\d+)?")
LINE_ENDS = pytest.mark.parametrize("newline", ["\n", "\r\n"])


def around_header(text: str) -> tuple[str, str]:
    """What stands above and below the header, of which there is one."""
    above, below = HEADER.split(text)
    return above, below


def read(text: str) -> Program:
    program = read_program([Source("m.mod", text.encode("latin-1"))])
    assert not program.diagnostics
    return program


def with_first_line(text: str) -> str:
    return PLAIN.replace("MODULE M\n", text)


def with_statement(text: str) -> str:
    return PLAIN.replace("PROC main()\n", f"PROC main()\n    {text}\n")


TEXTS = {
    "plain": PLAIN,
    "a comment on the line": with_first_line("MODULE M ! welding of the bulkhead\n"),
    "attributes": with_first_line("MODULE M (SYSMODULE, VIEWONLY)\n"),
    "attributes on the next line": with_first_line("MODULE M\n  (SYSMODULE)\n"),
    "attributes and a comment": with_first_line("MODULE M(NOSTEPIN) ! no steps\n"),
    "attributes below a comment": with_first_line("MODULE M ! bulkhead\n  (SYSMODULE)\n"),
    "blanks behind": with_first_line("MODULE  M  \t\n"),
    "the name on the next line": with_first_line("MODULE\n  M\n"),
    "blank line below": with_first_line("MODULE M\n\n"),
    "code on the line": with_first_line("MODULE M VAR num n:=3; "),
    "all on one line": re.sub(r"\s*\n\s*", " ", PLAIN),
    "lines of a backup before it": f"%%%\n  VERSION:1\n  LANGUAGE:ENGLISH\n%%%\n\n{PLAIN}",
    "comments above": f"! backup of 3 May\n\n{PLAIN}",
    "another module in a comment": f"! MODULE X\n{PLAIN}",
    "a byte order mark": f"\xef\xbb\xbf{PLAIN}",
    "lower case": with_first_line("module m\n").replace("ENDMODULE", "endmodule"),
    "upper case": PLAIN.upper(),
    "no final newline": PLAIN.rstrip("\n"),
    "mixed line ends": PLAIN.replace("PROC main()\n", "PROC main()\r\n").replace("tT;\n", "tT;\r\n", 1),
    "text behind the module": f"{PLAIN}\n\n",
    "tabs": PLAIN.replace("    ", "\t"),
    "the end in a string": with_statement('TPWrite "ENDMODULE";'),
    "the marker in a string": with_statement('TPWrite "postproc 0.1.0: compensated";'),
    "words of the marker": with_statement("! the postproc 0.1 never compensated this"),
    "words of the marker in another order": with_statement("! compensated by postproc 1.0"),
    "two modules": PLAIN.replace("  ENDPROC", "    other;\n  ENDPROC") + f"MODULE N\n{OTHER}ENDMODULE\n",
    "only the second module moves": f"MODULE Data\n{DATA}ENDMODULE\n{PLAIN.replace(DATA, '')}",
}


@LINE_ENDS
@pytest.mark.parametrize("name", TEXTS)
def test_numbers_change_and_a_header_is_added_and_nothing_else(name: str, newline: str) -> None:
    before = TEXTS[name] if newline == "\n" else re.sub(r"\r?\n", newline, TEXTS[name])
    result = convert(before)
    above, below = around_header(written(result))
    kept = [NUMBER.sub("#", text) for text in (above + below, above.rstrip("\r\n") + below)]
    assert NUMBER.sub("#", before) in kept  # code on the line of the module goes to a line below the header
    assert re.search(r"(?i)\bmodule\s+\w+\b", above) and not re.search(r"(?i)\b(pers|var|const|proc)\b", above)
    assert [m.name for m in read(written(result)).modules] == [m.name for m in read(before).modules]
    assert [d.name for d in read(written(result)).declarations] == [d.name for d in read(before).declarations]
    assert {o.status for o in result.outcomes} == {"compensated"} and result.report["max_error_after_mm"] <= 0.01
    assert codes(convert(written(result))) == ["CMP001"]


@LINE_ENDS
def test_a_program_is_compensated_again_without_the_header_alone(newline: str) -> None:
    text = written(convert(PLAIN)).replace("\n", newline)
    again = convert(text)
    assert again.exit_code == 1 and not again.outputs and again.diagnostics[0].place.startswith("m.mod:2:")
    assert convert("".join(around_header(text))).exit_code == 0


def test_the_same_input_gives_the_same_bytes_with_the_line_ends_of_the_file() -> None:
    first, again = convert(PLAIN), convert(PLAIN)
    assert (again.output, again.report) == (first.output, first.report)
    assert written(convert(PLAIN.replace("\n", "\r\n"))) == written(first).replace("\n", "\r\n")


def test_a_number_in_another_base_is_replaced_by_a_decimal() -> None:
    other = convert(PLAIN.replace("[1350,", "[0x546,"))
    assert around_header(written(other)) == around_header(written(convert(PLAIN)))
    assert codes(other) == codes(convert(PLAIN))


def test_the_header_says_what_was_done() -> None:
    result = convert(PLAIN)
    [header] = [match[0] for match in HEADER.finditer(written(result))]
    r = result.report
    figure = r["figures"][0]
    errors = "  ".join(f"{figure[key]:.3f}".rjust(width) for key, width in (("before_mm", 6), ("after_mm", 19)))
    assert re.search(r"! postproc \d+\.\d+\.\d+: compensated for irb4600_60_205", header)
    for text in ("joint_compliance", "force 200, -200, -200 N", errors, f"{r['added_targets']} targets added"):
        assert text in header


@LINE_ENDS
def test_a_line_with_several_statements_stays_one_line(newline: str) -> None:
    """Targets that are added between two statements of a line break no line: all outside of the statements is kept."""
    body = f"MoveJ p1,v200,fine,tT; WaitTime 1; MoveL {target(1350, 100)},v50,fine,tT; WaitTime 2;"
    body += f"\nIF TRUE THEN MoveL {target(1300, -500)},v50,fine,tT; ENDIF"
    result = convert(module(P1, body).replace("\n", newline))
    assert len(read(written(result)).statements) == 3 + result.report["added_targets"] >= 5
    lines = [line for line in written(result).splitlines() if "WaitTime 1;" in line or "IF TRUE" in line]
    assert [line.count("MoveL") >= 2 for line in lines] == [True, True]
    assert lines[0].endswith("WaitTime 2;") and lines[1].endswith("ENDIF")


def test_added_statements_of_a_seam_have_its_data_and_not_the_stop_point_of_its_end() -> None:
    body = f"MoveJ p1,v200,fine,tT;\nArcLStart {target(1350, -490)},v50,sm,wd\\Weave:=wv,fine,tT;"
    body += f"\nArcLEnd {target(1350, -100)},v50,sm,wd\\Weave:=wv,fine\\Inpos:=inpos50,tT;"
    result = convert(module(P1, body))
    assert written(result).count("\\Weave:=wv") == 2 + result.report["added_targets"] > 2
    assert written(result).count("\\Inpos") == 1


@LINE_ENDS
def test_comments_inside_a_replaced_argument_stay(newline: str) -> None:
    place = f"RelTool({target(1350, -400)}, ! the seam's end\n      0,0,-2 ! above it\n      )"
    body = f"MoveJ {target(1350, -500)},v200,fine,tT;\nMoveL {place},v50,fine,tT;"
    result = convert(module("", body).replace("\n", newline))
    assert result.outcomes[1].edited == "derived" and target(1350, -400) not in written(result)
    assert f"], ! the seam's end{newline}    0,0,-2 ! above it{newline}    ),v50,fine,tT;" in written(result)
    assert written(result).count("\n") == written(result).count(newline)


@pytest.mark.parametrize("moves", [False, True], ids=["kept", "changed"])
def test_of_the_files_of_a_task_those_are_edited_that_change(moves: bool) -> None:
    data = Source("data.sys", f"MODULE Data(SYSMODULE)\r\n{DATA}{P1 if moves else ''}\nENDMODULE".encode())
    text = PLAIN.replace(DATA, "").replace(P1 if moves else "none", "")
    outputs = convert(text, more=[data]).outputs
    edited = outputs["data.sys"].decode()
    assert HEADER.search(outputs["m.mod"].decode()) and bool(HEADER.search(edited)) == moves
    assert (P1 not in edited) if moves else outputs["data.sys"] == data.data
    again = convert(outputs["m.mod"], more=[Source("data.sys", outputs["data.sys"])])
    assert set(codes(again)) == {"CMP001"} and not again.outputs
