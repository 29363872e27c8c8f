"""Real programs: ``python -m tests.fuzz.corpus FOLDER..``, every RAPID file below the folders, none of them is changed.

Each must read without a crash, keep its bytes, and have every motion statement followed and listed by ``inspect``; words
that look like a motion instruction are counted apart from the reader. Exit code 1 if one file fails.
"""

from __future__ import annotations

import re
import sys
import traceback
from collections import Counter
from hashlib import sha256
from pathlib import Path

from postproc.diagnostics import Source
from postproc.rapid.execution.walk import walk_program
from postproc.rapid.program.program import is_encrypted, read_program
from postproc.rapid.program.signatures import SIGNATURES
from tests.fuzz import checks

SUFFIXES = {".mod", ".modx", ".prg", ".sys", ".sysx"}
# Modula, Go and B&R files end in .mod, .prg or .sys as well.
RAPID = re.compile(rb"(?im)^[^\n!]*\b(?:MODULE\s+\w+|PROC\s+\w+\s*\(|(?:CONST|PERS|VAR)\s+\w+\s+\w+)")
QUIET = re.compile(rb'"(?:[^"\n]|"")*"|![^\n]*')
INSTRUCTIONS = "|".join(sorted(map(re.escape, SIGNATURES), key=len, reverse=True)).encode()
MOTION = re.compile(rb'(?i)(?<![\w.\\%"])(?:' + INSTRUCTIONS + rb")(?=[\s\\\[])(?!\s*(?::=|\())")


def main(folders: list[str]) -> int:
    model = checks.shipped_model()
    files: dict[bytes, Path] = {}
    for path in sorted(path for folder in folders for path in Path(folder).rglob("*")):
        if path.suffix.lower() in SUFFIXES and path.is_file():
            data = path.read_bytes()
            if RAPID.search(data) or is_encrypted(data):
                files.setdefault(sha256(data).digest(), path)
    failures = statements = words = 0
    classes: Counter[str] = Counter()
    for path in files.values():
        data = path.read_bytes()
        try:
            checks.check_program(data)
            checks.check_inspection(data, model)
        except Exception:
            failures += 1
            print(f"{path}: {traceback.format_exc(limit=-4)}")
            continue
        program = read_program(Source(path.name, data))
        statements += len(program.statements)
        read = {s.span[0] for s in program.statements}
        if not is_encrypted(data):
            at = {m.start() for m in MOTION.finditer(QUIET.sub(lambda m: b"_" * len(m[0]), data))}
            words += len(at - read)
            for offset in sorted(at - read)[:1]:
                print(
                    f"{path}:{program.sources[0].position(offset)[0]}: looks like a motion instruction and is none to the reader"
                )
        reasons: dict[int, str | None] = {}
        for event in walk_program(program).events:
            reason = event.reason and re.sub("`[^`]*`", "`..`", event.reason.split("; ")[0])
            first = reasons.setdefault(event.statement.span[0], reason)
            reasons[event.statement.span[0]] = first and reason
        classes.update(reason or "target, tool and work object known" for reason in reasons.values())
    for reason, count in classes.most_common():
        print(f"{count:7} {reason}")
    print(f"{len(files)} different files, {failures} failed, {statements} motion statements, {words} words beside them")
    return int(failures > 0)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
