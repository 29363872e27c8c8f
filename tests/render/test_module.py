"""The module that is written: the header's place, the marker, what is kept byte for byte."""

from __future__ import annotations

import re
from collections.abc import Callable

import pytest

from postproc.diagnostics import Source
from postproc.rapid.program.program import Program, read_program
from tests.build import DATA, codes, convert, module, target, written

P1 = f"CONST robtarget p1:={target(1350, -500)};"
PLAIN = module(P1, f"MoveJ p1,v200,fine,tT;\nMoveL {target(1350, -400)},v50,fine,tT;")
HEADER = re.compile(rb"(?:^[ \t]*! (?:postproc|model|on the TCP|deviation|0 targets)[^\n]*\n){5}", re.M)
NUMBER = re.compile(rb"[+-]?\d+\.?\d*(?:E[+-]?\d+)?")
LINE_ENDS = pytest.mark.parametrize("newline", ["\n", "\r\n"])


def output(text: str | bytes) -> bytes:
    return written(convert(text)).encode("latin-1")


def around_header(data: bytes) -> tuple[bytes, bytes]:
    """What stands above and below the header, of which there is one."""
    above, below = HEADER.split(data)
    return above, below


def read(data: bytes) -> Program:
    program = read_program([Source("m.mod", data)])
    assert not program.diagnostics
    return program


def after(text: str, more: str) -> Callable[[str], str]:
    return lambda s: s.replace(text, text + more, 1)


def module_line(text: str) -> Callable[[str], str]:
    return lambda s: s.replace("MODULE M\n", text)


VARIANTS: dict[str, Callable[[str], str]] = {
    "plain": str,
    "a comment on the line": module_line("MODULE M ! welding of the bulkhead\n"),
    "attributes": module_line("MODULE M (SYSMODULE, VIEWONLY)\n"),
    "attributes on the next line": module_line("MODULE M\n  (SYSMODULE)\n"),
    "attributes and a comment": module_line("MODULE M(NOSTEPIN) ! no steps\n"),
    "attributes below a comment": module_line("MODULE M ! bulkhead\n  (SYSMODULE)\n"),
    "blanks behind": module_line("MODULE  M  \t\n"),
    "the name on the next line": module_line("MODULE\n  M\n"),
    "blank line below": module_line("MODULE M\n\n"),
    "a first line before it": "%%%\n  VERSION:1\n  LANGUAGE:ENGLISH\n%%%\n\n".__add__,
    "comments above": "! backup of 3 May\n\n".__add__,
    "another module in a comment": "! MODULE X\n".__add__,
    "a byte order mark": "\xef\xbb\xbf".__add__,
    "lower case": lambda s: s.replace("MODULE M\n", "module m\n").replace("ENDMODULE", "endmodule"),
    "upper case": str.upper,
    "CRLF": lambda s: s.replace("\n", "\r\n"),
    "no final newline": lambda s: s.rstrip("\n"),
    "CRLF, no final newline": lambda s: s.rstrip("\n").replace("\n", "\r\n"),
    "mixed line ends": lambda s: s.replace("PROC main()\n", "PROC main()\r\n").replace("tT;\n", "tT;\r\n", 1),
    "text behind the module": after("ENDMODULE", "\n\n"),
    "tabs": lambda s: s.replace("    ", "\t"),
    "the end in a string": after("PROC main()\n", '    TPWrite "ENDMODULE";\n'),
    "the marker in a string": after("PROC main()\n", '    TPWrite "postproc 0.1.0: compensated";\n'),
    "words of the marker": after("PROC main()\n", "    ! the postproc 0.1 never compensated this\n"),
    "words of the marker in another order": after("PROC main()\n", "    ! compensated by postproc 1.0\n"),
}


@pytest.mark.parametrize("name", VARIANTS)
def test_the_header_is_added_and_nothing_else(name: str) -> None:
    before = VARIANTS[name](PLAIN).encode("latin-1")
    text = output(before)
    above, below = around_header(text)
    assert NUMBER.sub(b"#", before) == NUMBER.sub(b"#", above + below)
    assert re.search(rb"(?im)(^|\xbf)module\s+m\b", above) and b"PERS" not in above
    assert [m.name.lower() for m in read(text).modules] == ["m"]


def test_the_same_input_gives_the_same_bytes_with_the_line_ends_of_the_file() -> None:
    first, again = convert(PLAIN), convert(PLAIN)
    assert (again.output, again.report) == (first.output, first.report)
    assert output(PLAIN.replace("\n", "\r\n")) == output(PLAIN).replace(b"\n", b"\r\n")


def test_a_number_in_another_base_is_replaced_by_a_decimal() -> None:
    text = PLAIN.replace("[1350,", "[0x546,")
    assert around_header(output(text)) == around_header(output(PLAIN)) and codes(convert(text)) == codes(convert(PLAIN))


def test_the_header_says_what_was_done() -> None:
    found = convert(PLAIN)
    [header] = [match[0].decode() for match in HEADER.finditer(found.output or b"")]
    r = found.report
    assert re.search(r"! postproc \d+\.\d+\.\d+: compensated for irb4600_60_205", header)
    errors = f"{r['max_error_before_mm']:.3f} mm before, {r['max_error_after_mm']:.3f} mm after"
    for text in ("joint_compliance", "force 200, -200, -200 N", errors, f"{r['added_targets']} targets added"):
        assert text in header


@LINE_ENDS
def test_no_program_is_compensated_twice_while_it_has_the_header(newline: str) -> None:
    data = output(PLAIN)
    again = convert(data.replace(b"\n", newline.encode()))
    assert codes(again) == ["CMP001"] and again.exit_code == 1 and not again.outputs
    assert again.diagnostics[0].place.startswith("m.mod:2:")
    assert convert(b"".join(around_header(data))).exit_code == 0


SECOND = f"MODULE N\n  CONST robtarget p9:={target(1350, -300)};\n  PROC other()\n    MoveL p9,v50,fine,tT;\n  ENDPROC\nENDMODULE\n"
SHAPES = {
    "code on the module line": PLAIN.replace("MODULE M\n", "MODULE M VAR num n:=3; "),
    "all on one line": re.sub(r"\s*\n\s*", " ", PLAIN),
    "two modules": PLAIN.replace("  ENDPROC\nENDMODULE", "    other;\n  ENDPROC\nENDMODULE") + SECOND,
    "only the second module moves": f"MODULE Data\n{DATA}ENDMODULE\n" + PLAIN.replace(DATA, ""),
}


@LINE_ENDS
@pytest.mark.parametrize("name", SHAPES)
def test_modules_of_any_shape_are_corrected_and_have_one_marker(name: str, newline: str) -> None:
    """Where everything stands on one line, the header gets lines of its own and comments nothing out."""
    text = SHAPES[name].replace("\n", newline)
    found = convert(text)
    assert {o.status for o in found.outcomes} == {"compensated"} and found.report["max_error_after_mm"] <= 0.01
    before, after = (read(data) for data in (text.encode(), output(text)))
    assert [m.name for m in after.modules] == [m.name for m in before.modules]
    assert [d.name for d in after.declarations] == [d.name for d in before.declarations]
    assert len(after.statements) == len(before.statements) and written(found).count("! postproc") == 1
    assert not any(place in written(found) for place in re.findall(r"\[\[\d+,-\d+,700\]", text))
    assert codes(convert(output(text))) == ["CMP001"]


@LINE_ENDS
def test_a_line_with_several_statements_stays_one_line(newline: str) -> None:
    """Targets that are added between two statements of a line break no line: all outside of the statements is kept."""
    body = f"MoveJ p1,v200,fine,tT; WaitTime 1; MoveL {target(1350, 100)},v50,fine,tT; WaitTime 2;"
    body += f"\nIF TRUE THEN MoveL {target(1300, -500)},v50,fine,tT; ENDIF"
    found = convert(module(P1, body).replace("\n", newline))
    lines = written(found).splitlines()
    assert len(read(written(found).encode()).statements) == 3 + found.report["added_targets"] >= 5
    first, second = (line for line in lines if "WaitTime 1;" in line or "IF TRUE" in line)
    assert first.count("MoveL") >= 2 and first.endswith("WaitTime 2;")
    assert second.count("MoveL") >= 2 and second.endswith("ENDIF")


@LINE_ENDS
def test_comments_inside_a_replaced_argument_stay(newline: str) -> None:
    place = f"RelTool({target(1350, -400)}, ! the seam's end\n      0,0,-2 ! above it\n      )"
    body = f"MoveJ {target(1350, -500)},v200,fine,tT;\nMoveL {place},v50,fine,tT;"
    found = convert(module("", body).replace("\n", newline))
    text = written(found)
    assert found.outcomes[1].edited == "derived" and target(1350, -400) not in text
    assert f"], ! the seam's end{newline}    0,0,-2 ! above it{newline}    ),v50,fine,tT;" in text
    assert text.count("\n") == text.count(newline)


@pytest.mark.parametrize("moves", [False, True], ids=["kept", "changed"])
def test_of_the_files_of_a_task_those_are_edited_that_change(moves: bool) -> None:
    data = Source("data.sys", f"MODULE Data(SYSMODULE)\r\n{DATA}{P1 if moves else ''}\nENDMODULE".encode())
    text = PLAIN.replace(DATA, "").replace(P1 if moves else "none", "")
    found = convert(text, more=[data])
    assert found.report["max_error_after_mm"] <= 0.01 and HEADER.search(found.outputs["m.mod"])
    edited = found.outputs["data.sys"]
    if moves:
        assert HEADER.search(edited) and P1.encode() not in edited
    else:
        assert edited == data.data
    again = convert(found.outputs["m.mod"], more=[Source("data.sys", edited)])
    assert set(codes(again)) == {"CMP001"} and not again.outputs
