"""The module that is written: the header's place, the marker, what is kept byte for byte."""

from __future__ import annotations

import re

import pytest

from postproc.compensation.conversion import Conversion
from postproc.compensation.options import Options
from postproc.diagnostics import Source
from postproc.rapid.program.program import read_program
from postproc.runtime.passes import correct_program
from tests.build import DATA, arm, codes, convert, module, target, written

PLAIN = module(
    f"CONST robtarget p1:={target(1350, -500)};",
    f"MoveJ p1,v200,fine,tT;\nMoveL {target(1350, -400)},v50,fine,tT;",
)


def header(data: bytes) -> list[bytes]:
    """Lines of the header, in one block."""
    lines = data.splitlines()
    rows = [
        i
        for i, line in enumerate(lines)
        if line.lstrip().startswith((b"! postproc", b"! model", b"! on the TCP", b"! deviation", b"! 0 targets"))
    ]
    assert rows == list(range(rows[0], rows[0] + 5))
    return [lines[i] for i in rows]


def without_header(data: bytes) -> bytes:
    block = header(data)
    for line in block:
        data = re.sub(re.escape(line) + rb"(\r\n|\n)", b"", data, count=1)
    return data


def same_but_numbers(before: bytes, after: bytes) -> bool:
    number = re.compile(rb"[+-]?\d+\.?\d*(?:E[+-]?\d+)?")
    return number.sub(b"#", before) == number.sub(b"#", after)


VARIANTS = {
    "plain": lambda s: s,
    "a comment on the line": lambda s: s.replace("MODULE M\n", "MODULE M ! welding of the bulkhead\n"),
    "attributes": lambda s: s.replace("MODULE M\n", "MODULE M (SYSMODULE, VIEWONLY)\n"),
    "attributes on the next line": lambda s: s.replace("MODULE M\n", "MODULE M\n  (SYSMODULE)\n"),
    "attributes and a comment": lambda s: s.replace("MODULE M\n", "MODULE M(NOSTEPIN) ! no steps\n"),
    "blanks behind": lambda s: s.replace("MODULE M\n", "MODULE  M  \t\n"),
    "a first line of its own": lambda s: "%%%\n  VERSION:1\n  LANGUAGE:ENGLISH\n%%%\n\n" + s,
    "comments above": lambda s: "! backup of 3 May\n\n" + s,
    "lower case": lambda s: s.replace("MODULE M\n", "module m\n").replace("ENDMODULE", "endmodule"),
    "CRLF": lambda s: s.replace("\n", "\r\n"),
    "no final newline": lambda s: s.rstrip("\n"),
    "CRLF, no final newline": lambda s: s.rstrip("\n").replace("\n", "\r\n"),
    "mixed line ends": lambda s: s.replace("PROC main()\n", "PROC main()\r\n").replace("tT;\n", "tT;\r\n", 1),
    "text behind the module": lambda s: s + "\n\n",
    "a byte order mark": lambda s: "\xef\xbb\xbf" + s,
    "tabs": lambda s: s.replace("    ", "\t"),
    "upper case": lambda s: s.upper(),
    "attributes below a comment": lambda s: s.replace("MODULE M\n", "MODULE M ! bulkhead\n  (SYSMODULE)\n"),
    "the name on the next line": lambda s: s.replace("MODULE M\n", "MODULE\n  M\n"),
    "another module in a comment": lambda s: "! MODULE X\n" + s,
    "the end in a string": lambda s: s.replace("PROC main()\n", 'PROC main()\n    TPWrite "ENDMODULE";\n'),
    "blank line below": lambda s: s.replace("MODULE M\n", "MODULE M\n\n"),
}


@pytest.mark.parametrize("name", VARIANTS)
def test_the_header_is_added_and_nothing_else(name: str) -> None:
    before = VARIANTS[name](PLAIN).encode("latin-1")
    after = convert(before).output
    assert after is not None
    assert same_but_numbers(before, without_header(after))
    above = after[: after.index(b"! postproc")]
    assert re.search(rb"(?im)(^|\xbf)module\s+m\b", above) and b"PERS" not in above
    program = read_program([Source("m.mod", after)])
    assert [m.name.lower() for m in program.modules] == ["m"] and not program.diagnostics


def test_the_header_uses_the_files_line_ends() -> None:
    crlf = convert(PLAIN.replace("\n", "\r\n")).output
    assert crlf is not None and crlf.count(b"\n") == crlf.count(b"\r\n")
    lf = convert(PLAIN).output
    assert lf is not None and crlf == lf.replace(b"\n", b"\r\n")


@pytest.mark.parametrize("newline", ["\n", "\r\n"])
def test_code_on_the_module_line(newline: str) -> None:
    """Everything on one line: the header gets lines of its own, the code behind it is not commented out."""
    text = PLAIN.replace("MODULE M\n", "MODULE M VAR num n:=3; ").replace("\n", newline)
    found = convert(text)
    out = written(found)
    assert "VAR num n:=3;" in out.split("prevent compensating twice")[1]
    assert found.report["max_error_after_mm"] <= 0.01
    program = read_program([Source("m.mod", out.encode("latin-1"))])
    assert "n" in {d.name.lower() for d in program.declarations}


@pytest.mark.parametrize("newline", ["\n", "\r\n"])
def test_a_line_with_several_statements_stays_one_line(newline: str) -> None:
    """Targets that are added between two statements of a line break no line: all outside of the statements is kept."""
    body = f"MoveJ p1,v200,fine,tT; WaitTime 1; MoveL {target(1350, 100)},v50,fine,tT; WaitTime 2;"
    body += f"\nIF TRUE THEN MoveL {target(1300, -500)},v50,fine,tT; ENDIF"
    text = module(f"CONST robtarget p1:={target(1350, -500)};", body).replace("\n", newline)
    found = convert(text)
    out = written(found)
    program = read_program([Source("m.mod", out.encode("latin-1"))])
    assert found.report["added_targets"] >= 2 and len(program.statements) == 3 + found.report["added_targets"]
    first, second = (line for line in out.splitlines() if "WaitTime 1;" in line or "IF TRUE" in line)
    assert first.count("MoveL") >= 2 and first.endswith("WaitTime 2;")
    assert second.count("MoveL") >= 2 and second.endswith("ENDIF")


def test_a_whole_module_on_one_line() -> None:
    text = (
        "MODULE M "
        + DATA.replace("\n", " ")
        + f"PROC main() MoveJ {target(1350, -500)},v200,fine,tT; MoveL {target(1350, -400)},v50,fine,tT; ENDPROC ENDMODULE"
    )
    found = convert(text)
    assert found.report["max_error_after_mm"] <= 0.01
    program = read_program([Source("m.mod", written(found).encode("latin-1"))])
    assert len(program.statements) == 2


def test_the_header_says_what_was_done() -> None:
    found = convert(PLAIN)
    text = b"\n".join(header(found.output or b"")).decode()
    r = found.report
    assert re.search(r"! postproc \d+\.\d+\.\d+: compensated for irb4600_60_205", text)
    assert "joint_compliance" in text
    assert "force 200, -200, -200 N" in text
    assert f"{r['max_error_before_mm']:.3f} mm before, {r['max_error_after_mm']:.3f} mm after" in text
    assert f"{r['added_targets']} targets added" in text


@pytest.fixture(scope="module")
def done() -> Conversion:
    return convert(PLAIN)


@pytest.mark.parametrize("newline", ["\n", "\r\n"])
def test_no_program_is_compensated_twice(done: Conversion, newline: str) -> None:
    again = convert(written(done).replace("\n", newline))
    assert codes(again) == ["CMP001"] and again.exit_code == 1 and not again.outputs
    finding = again.diagnostics[0]
    assert finding.span is not None and finding.source is not None
    assert finding.source.position(finding.span[0])[0] == 2


def test_a_program_without_the_lines_may_be_compensated_again(done: Conversion) -> None:
    assert convert(without_header(done.output or b"")).exit_code == 0


@pytest.mark.parametrize(
    "line",
    [
        'TPWrite "postproc 0.1.0: compensated";',
        "! the postproc 0.1 never compensated this",
        "! compensated by postproc 1.0",
    ],
)
def test_words_that_are_no_marker(line: str) -> None:
    assert convert(PLAIN.replace("PROC main()\n", f"PROC main()\n    {line}\n")).exit_code == 0


def test_the_same_input_gives_the_same_bytes(done: Conversion) -> None:
    again = convert(PLAIN)
    assert again.output == done.output
    assert again.report == done.report


def test_two_modules_in_one_file() -> None:
    second = f"MODULE N\n  CONST robtarget p9:={target(1350, -300)};\n  PROC other()\n    MoveL p9,v50,fine,tT;\n  ENDPROC\nENDMODULE\n"
    text = PLAIN.replace("  ENDPROC\nENDMODULE", "    other;\n  ENDPROC\nENDMODULE") + second
    found = convert(text)
    out = written(found)
    assert found.report["max_error_after_mm"] <= 0.01
    assert [o.status for o in found.outcomes] == ["compensated"] * 3
    assert out.count("! postproc") == 1
    assert f"p9:={target(1350, -300)}" not in out
    assert same_but_numbers(text.encode(), without_header(out.encode()))
    assert codes(convert(out)) == ["CMP001"]


def test_only_the_second_module_of_a_file_moves() -> None:
    first = f"MODULE Data\n{DATA}ENDMODULE\n"
    text = first + PLAIN.replace(DATA, "")
    found = convert(text)
    assert found.report["max_error_after_mm"] <= 0.01
    assert codes(convert(written(found))) == ["CMP001"]


def test_a_file_of_the_task_that_needs_no_change_is_kept() -> None:
    data = Source("data.sys", f"MODULE Data(SYSMODULE)\r\n{DATA}ENDMODULE".encode())
    main = Source("main.mod", PLAIN.replace(DATA, "").encode())
    found = correct_program(
        [data, main], arm(), Options(tolerance_m=1e-5, force=(200.0, -200.0, -200.0), inertia=False)
    )
    assert found.outputs["data.sys"] == data.data
    assert b"! postproc" in found.outputs["main.mod"]


def test_targets_in_another_file_of_the_task() -> None:
    data = Source("data.mod", f"MODULE Data\n{DATA}  CONST robtarget p1:={target(1350, -500)};\nENDMODULE\n".encode())
    main = Source(
        "main.mod", PLAIN.replace(DATA, "").replace(f"  CONST robtarget p1:={target(1350, -500)};\n", "").encode()
    )
    options = Options(tolerance_m=1e-5, force=(200.0, -200.0, -200.0), inertia=False)
    found = correct_program([data, main], arm(), options)
    assert b"! postproc" in found.outputs["main.mod"] and b"! postproc" in found.outputs["data.mod"]
    assert f"p1:={target(1350, -500)}".encode() not in found.outputs["data.mod"]
    assert found.report["max_error_after_mm"] <= 0.01
    again = correct_program([Source(p, d) for p, d in found.outputs.items()], arm(), options)
    assert {d.code for d in again.diagnostics} == {"CMP001"} and not again.outputs


@pytest.mark.parametrize("newline", ["\n", "\r\n"])
def test_comments_inside_a_replaced_argument_stay(newline: str) -> None:
    place = f"RelTool({target(1350, -400)}, ! the seam's end\n      0,0,-2 ! above it\n      )"
    done = convert(
        module("", f"MoveJ {target(1350, -500)},v200,fine,tT;\nMoveL {place},v50,fine,tT;").replace("\n", newline)
    )
    text = written(done)
    assert done.outcomes[1].edited == "derived" and target(1350, -400) not in text
    assert f"], ! the seam's end{newline}    0,0,-2 ! above it{newline}    ),v50,fine,tT;" in text
    assert text.count("\n") == text.count(newline)


def test_a_number_in_another_base_is_replaced_by_a_decimal() -> None:
    text = PLAIN.replace("[1350,", "[0x546,")
    assert PLAIN.count("[1350,") == 2 and codes(convert(text)) == codes(convert(PLAIN))
    assert without_header(written(convert(text)).encode()) == without_header(written(convert(PLAIN)).encode())
