"""Bad files of every kind: ``python -m tests.fuzz.files [--count N] [--seed S]``; the suite runs a few of them.

One file of a good call is changed (values of other kinds, numbers that are none, bytes, parts repeated many times) or is
a pipe, a device, a folder or a link in a circle. Each call runs in a process of its own with 20 s of work and a gigabyte:
it ends with 0, 1 or 2, what stood there before is as it was, and an output is whole or absent.
"""

from __future__ import annotations

import argparse
import contextlib
import hashlib
import io
import json
import os
import re
import resource
import signal
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from random import Random
from typing import Any

import postproc.convert
import postproc.identification.diagnose  # so that a child finds what it needs loaded
from postproc.batch import executors
from postproc.cli import hooks
from postproc.cli.app import build
from postproc.cli.run import run
from postproc.files import resource as shipped
from tests.batch.build import backup, program, write

SECONDS, WAITING, MEGABYTES = 20, 60, 1000
ARM = ("--robot", "irb4600_60_205")
SAMPLES = shipped("samples")
ODD_VALUES = (
    "true", "false", "nan", "-inf", "1e300", "-1", "0", "1e-300", "3.0", '"1"', '""', '"\\u0000"', '"../../x"', '"/dev/zero"',
    "[]", "[[]]", "{}", "{a = 1}", "[3.0]", "[true]", '["1"]', "2020-01-01", "1" + "0" * 40, '"' + "x" * 5000 + '"', "[1, 2, 3]",
    "[nan, 1, 2]", "[1e200, 1e200, 1e200]", '"\\uFFFF"', "0x7fffffffffffffff", "99999999999999999999999", '["a", "a"]',
)  # fmt: skip
ODD_JSON = (None, True, [], {}, "", "\ud800", "../x", -1, 1e308, 10**40, [[]], {"a": []}, "x" * 3000, 3.5)
ROBOT = """payload_kg = 6.0
[dh]
a_mm = [0, -425, -392.25, 0, 0, 0]
d_mm = [89.2, 0, 0, 109.3, 94.75, 82.5]
alpha_deg = [90, 0, 0, 90, -90, 0]
[joints]
limits_deg = [[-360, 360], [-360, 360], [-360, 360], [-360, 360], [-360, 360], [-360, 360]]
"""
URDF = (
    '<robot name="a">'
    + "".join(f'<link name="l{i}"/>' for i in range(7))
    + "".join(
        f'<joint name="j{i}" type="revolute"><parent link="l{i}"/><child link="l{i + 1}"/><origin xyz="0.1 0 0.4" '
        f'rpy="1.5708 0 0"/><axis xyz="0 0 1"/><limit lower="-3" upper="3" effort="9" velocity="2"/></joint>'
        for i in range(6)
    )
    + "</robot>"
)
CELL = (
    '[[external_axes]]\naxis = "a"\nkind = "linear"\ncarries = "robot"\nxyz_mm = [0, 0, 0]\nlimits = [-100.0, 3000.0]\n'
)
MAP = 'separator = ","\n[columns]\nq1_deg = { name = "q1_deg", unit = "deg" }\nx_mm = "x_mm"\n'
SETTINGS = (
    'robot = "irb4600_60_205"\nforce = [200, -200, -200]\ntolerance_mm = 0.1\ninertia = false\nscope = "all"\n'
    'with = ["p.mod"]\nchannel = { temperature = 20.0 }\ntaught = ["pA"]\n[batch]\nworkers = 1\n'
)
JOBS = '[[job]]\nfiles = ["a.mod"]\nname = "A"\nrobot = "irb4600_60_205"\n[[job]]\nfolder = "sub"\nonly = ["*"]\nrobot = "irb4600_60_205"\n'
PGF = '<?xml version="1.0" encoding="ISO-8859-1" ?>\n<Program>\n\t<Module>a.mod</Module>\n\t<Module>p.mod</Module>\n</Program>\n'
RECORD = {
    "name": "a.mod", "key": "k", "status": "compensated", "outputs": {"a.mod": "00"},
    "figures": {"added_targets": 0, "unproved_statements": 0, "cycle_time_s": 1.0, "max_error_before_mm": 0.1, "max_error_after_mm": 0.01,
                "statements": {"compensated": 1, "run_time": 0, "unchanged": 0, "skipped": 0}},
    "findings": [{"code": "RAP001", "severity": "info", "message": "m", "path": None, "line": 1, "column": 1, "offset": 0, "help": None}],
}  # fmt: skip


@dataclass(frozen=True)
class Kind:
    """A kind of file: its name, its content where nothing is wrong, how it is changed, and the calls that read it."""

    name: str
    file: str
    data: Callable[[], bytes]
    change: Callable[[Random, bytes], bytes]
    calls: tuple[tuple[str, ...], ...]


def workbook() -> bytes:
    from openpyxl import Workbook

    book, out = Workbook(), io.BytesIO()
    for line in (SAMPLES / "measurements" / "simulated_backlash.csv").read_text("utf-8").splitlines()[:40]:
        book.active.append([float(c) if re.fullmatch(r"-?\d+\.?\d*", c) else c for c in line.split(",")])
    book.save(out)
    return out.getvalue()


def sample(*parts: str, rows: int | None = None) -> Callable[[], bytes]:
    return lambda: b"".join(SAMPLES.joinpath(*parts).read_bytes().splitlines(keepends=True)[:rows])


def changed_bytes(random: Random, data: bytes) -> bytes:
    """Bytes that flip, parts that are lost, moved or repeated many times."""
    for _ in range(random.choice((1, 1, 2, 5))):
        if not data:
            break
        at = random.randrange(len(data))
        part = data[at : at + random.choice((1, 2, 5, 30, 200))]
        way = random.randrange(7)
        if way == 0:
            data = data[:at] + bytes([random.randrange(256)]) + data[at + 1 :]
        elif way == 1:
            data = data[:at]
        elif way == 2:
            data = data[:at] + part * random.choice((2, 100, 3000)) + data[at:]
        elif way == 3:
            data = data[:at] + data[at + len(part) :]
        elif way == 4:
            data = (
                data[:at]
                + random.choice(
                    (b"\0", b"\xff\xfe", b" " * 20_000, b"(" * 3000, b"[" * 9000, b'"', b"<Module>" + b" " * 4000)
                )
                + data[at:]
            )
        elif way == 5:
            data = (
                data[:at]
                + random.choice((b"9" * 400, b"nan", b"1e999", b"-1e308", b"0x1", b"1_0", b"\n" * 5000))
                + data[at + len(part) :]
            )
        else:
            data = data[at:] + data[:at]
    return data[:3_000_000]


def changed_toml(random: Random, data: bytes) -> bytes:
    """Values of another kind, lines that stand twice or are lost; now and then bytes."""
    if random.random() < 0.2:
        return changed_bytes(random, data)
    lines = data.decode().split("\n")
    for _ in range(random.choice((1, 1, 2))):
        at = random.choice([i for i, line in enumerate(lines) if line.strip()])
        way, (key, mark, _) = random.random(), lines[at].partition("=")
        if way < 0.6 and mark:
            lines[at] = f"{key}= {random.choice(ODD_VALUES)}"
        elif way < 0.7 and mark:
            lines[at] = f"{key.strip()}{'.a' * random.choice((1, 60, 9000))} = 1"
        elif way < 0.8:
            lines.insert(at, lines[at])
        elif way < 0.9:
            del lines[at]
        else:
            lines.insert(
                at, f"{random.choice(('own', 'robot', 'effects', '[fit]', 'with'))} = {random.choice(ODD_VALUES)}"
            )
        lines = lines or [""]
        if not any(line.strip() for line in lines):
            break
    return "\n".join(lines).encode()


def changed_json(random: Random, data: bytes) -> bytes:
    """A value of another kind somewhere inside."""
    if random.random() < 0.2:
        return changed_bytes(random, data)
    value: Any = json.loads(data)
    places: list[tuple[Any, Any]] = []

    def collect(here: Any) -> None:
        for key in here if isinstance(here, dict) else range(len(here)) if isinstance(here, list) else ():
            places.append((here, key))
            collect(here[key])

    collect(value)
    for _ in range(random.choice((1, 2))):
        here, key = random.choice(places)
        with contextlib.suppress(KeyError, IndexError):
            if isinstance(here, dict) and random.random() < 0.2:
                here[random.choice(("../x", "\ud800", "", "/etc/passwd", "x" * 300))] = here.pop(key)
            else:
                here[key] = random.choice(ODD_JSON)
    return json.dumps(value).encode()


def changed_record(random: Random, data: bytes) -> bytes:
    """The record of a task as a batch might have written it, with a value of another kind in it."""
    changed = changed_json(random, data)
    return hashlib.sha256(changed).hexdigest().encode() + b"\n" + changed


TABLE = "t.csv"
FIT = ("fit", TABLE, *ARM, "--effects", "joint_compliance", "-o", "o.out")
KINDS = (
    Kind("program", "a.mod", lambda: program("A").encode() if isinstance(program("A"), str) else program("A"), changed_bytes,
         (("compensate", "a.mod", *ARM, "-o", "o.out"), ("inspect", "a.mod", *ARM), ("diff", "a.mod", "p.mod"),
          ("batch", "sub", *ARM, "--with", "a.mod", "-o", "out", "--workers", "1"), ("hooks", "read", "--sarif", "o.out", "--programs", ".", "a.mod"))),
    Kind("settings", "postproc.toml", SETTINGS.encode, changed_toml,
         (("compensate", "a.mod", "-o", "o.out"), ("inspect", "a.mod"), ("batch", "sub", "-o", "out", "--workers", "1"),
          ("hooks", "check", "--programs", ".", "a.mod"))),
    Kind("model", "m.toml", sample("models", "hull_cell.toml"), changed_toml,
         (("inspect", "a.mod", "-m", "m.toml"), ("compensate", "a.mod", "-m", "m.toml", "-o", "o.out"), ("predict", "m.toml", TABLE, "-o", "o.out"),
          ("compare", "m.toml", TABLE), ("add", "m.toml", "backlash", TABLE, "-o", "o.out"), ("effects", "list"))),
    Kind("jobs", "jobs.toml", JOBS.encode, changed_toml, (("batch", "jobs.toml", "-o", "out", "--workers", "1"),)),
    Kind("record", "out/.postproc/0.json", lambda: json.dumps(RECORD).encode(), changed_record,
         (("batch", "sub", *ARM, "-o", "out", "--workers", "1"),)),
    Kind("column map", "map.toml", MAP.encode, changed_toml,
         ((*FIT, "--columns", "map.toml"), ("predict", "m.toml", TABLE, "--columns", "map.toml", "-o", "o.out"))),
    Kind("cell", "cell.toml", CELL.encode, changed_toml,
         (("compensate", "a.mod", *ARM, "--cell", "cell.toml", "-o", "o.out"), ("inspect", "a.mod", *ARM, "--cell", "cell.toml"))),
    Kind("robot", "r.toml", ROBOT.encode, changed_toml,
         (("robots", "show", "r.toml"), ("inspect", "a.mod", "--robot", "r.toml"), ("fit", TABLE, "--robot", "r.toml", "-o", "o.out"))),
    Kind("urdf", "r.urdf", URDF.encode, changed_bytes, (("robots", "show", "r.urdf"), ("inspect", "a.mod", "--robot", "r.urdf"))),
    Kind("table", TABLE, sample("measurements", "simulated_backlash.csv", rows=60), changed_bytes,
         (FIT, ("predict", "m.toml", TABLE, "-o", "o.out"), ("compare", "m.toml", TABLE), ("fit", TABLE, *ARM, "--joints", "t2.csv", "-o", "o.out"))),
    Kind("spreadsheet", "t.xlsx", workbook, changed_bytes,
         (("fit", "t.xlsx", *ARM, "--effects", "joint_compliance", "-o", "o.out"), ("predict", "m.toml", "t.xlsx", "-o", "o.out"))),
    Kind("list of modules", "sub/p.pgf", PGF.encode, changed_bytes,
         (("batch", "sub", *ARM, "-o", "out", "--workers", "1"), ("batch", "sub/p.pgf", *ARM, "-o", "out", "--workers", "1"))),
    Kind("points", "seam.csv", sample("seam.csv"), changed_bytes, (("seam", "seam.csv", *ARM, "-o", "o.out"),)),
    Kind("template", "tpl/target.j2", shipped("templates", "target.j2").read_bytes, changed_bytes,
         (("compensate", "a.mod", *ARM, "--template", "tpl", "-o", "o.out"),)),
    Kind("system", "b/SYSPAR/SYS.cfg", lambda: b"", changed_bytes, (("batch", "b", "-o", "out", "--workers", "1"), ("robots", "show", "b"))),
    Kind("motion", "b/SYSPAR/MOC.cfg", lambda: b"", changed_bytes,
         (("batch", "b", "-o", "out", "--workers", "1"), ("compensate", "b/RAPID/TASK1/PROGMOD/Seam.mod", "-o", "o.out"), ("robots", "show", "b"),
          ("inspect", "a.mod", *ARM, "--cell", "b/SYSPAR/MOC.cfg"))),
    Kind("backinfo", "b/BACKINFO/backinfo.txt", lambda: b"", changed_bytes, (("batch", "b", "-o", "out", "--workers", "1"),)),
)  # fmt: skip
SPECIAL = ("fifo", "device", "folder", "circle", "link to a fifo")


@dataclass(frozen=True)
class Case:
    kind: Kind
    call: tuple[str, ...]
    seed: int
    special: str = ""


def cases(count: int, seed: int) -> Iterator[Case]:
    """Kinds in turn, calls in turn; every sixth file is no regular one."""
    random = Random(seed)
    for number in range(count):
        kind = KINDS[number % len(KINDS)]
        turn = number // len(KINDS)
        special = SPECIAL[turn // 6 % len(SPECIAL)] if turn % 6 == 5 else ""
        yield Case(kind, kind.calls[turn % len(kind.calls)], random.randrange(10**9), special)


def prepare(case: Case) -> None:
    """What stands in the folder of a call."""
    backup(Path("b"))
    write(
        Path(), {"p.mod": program("P"), "sub/a.mod": program("A"), "sub/p.mod": program("P"), "t2.csv": b"q1_deg\n1\n"}
    )
    for kind in KINDS:
        path = Path(kind.file)
        if kind.name in ("program", "model", "table") or kind is case.kind:
            path.parent.mkdir(parents=True, exist_ok=True)
            good = kind.data() or path.read_bytes()
            path.write_bytes(case.kind.change(Random(case.seed), good) if kind is case.kind else good)
    path = Path(case.kind.file)
    if case.special:
        path.unlink()
        if "fifo" in case.special:
            os.mkfifo(path if case.special == "fifo" else "pipe")
        if case.special == "folder":
            path.mkdir()
        target = {"device": "/dev/zero", "circle": path.name, "link to a fifo": os.path.abspath("pipe")}.get(
            case.special
        )
        if target:
            path.symlink_to(target)


def state() -> Mapping[str, str]:
    """Hash of every file but the outputs."""
    found = (p for p in Path().rglob("*") if p.is_file() and p.parts[0] not in ("out", "o.out"))
    return {str(p): hashlib.sha256(p.read_bytes()).hexdigest() for p in found if not p.is_symlink()}


def make(case: Case) -> str | None:
    """Make a call; what is wrong with how it ended, None where nothing is."""
    with tempfile.TemporaryDirectory() as name, contextlib.chdir(name):
        prepare(case)
        before, begin = state(), time.monotonic()
        child = os.fork()
        if child == 0:
            _call(case)
        while (ended := os.wait4(child, os.WNOHANG))[0] == 0 and time.monotonic() - begin < WAITING:
            time.sleep(0.005)
        if ended[0] == 0:
            os.kill(child, signal.SIGKILL)
            ended = os.wait4(child, 0)
        code, peak = os.waitstatus_to_exitcode(ended[1]), ended[2].ru_maxrss / 1000
        after = state()
        said = Path("o.out.said").read_text("utf-8", "replace")[-300:] if Path("o.out.said").exists() else ""
        lost = [path for path in before if after.get(path) != before[path]]
        left = [str(path) for path in Path().rglob(".postproc-*")]
        half = Path("o.out").exists() and not Path("o.out").read_bytes()
        if code not in (0, 1, 2) or lost or left or half or peak > MEGABYTES:
            return f"{case.kind.name} {case.special} {case.seed} {case.call}: {code}, {peak:.0f} MB, changed {lost}, left {left}: {said}"
        return None


def _call(case: Case) -> None:
    """The call itself, in a process of its own that never returns."""
    code = 99
    try:
        resource.setrlimit(resource.RLIMIT_CPU, (SECONDS, SECONDS + 2))
        resource.setrlimit(resource.RLIMIT_DATA, (2 * 10**9, 2 * 10**9))
        out = os.open("o.out.said", os.O_WRONLY | os.O_CREAT)
        os.dup2(out, 1)
        os.dup2(out, 2)
        sys.stdout, sys.stderr = (open(n, "w", errors="backslashreplace", closefd=False) for n in (1, 2))  # noqa: SIM115
        sys.stdin = open(os.devnull)  # noqa: SIM115
        # Started afresh, a worker takes seconds; tests/batch kills real ones.
        executors.local_pool = lambda workers: executors.Pool(lambda count: ThreadPoolExecutor(1), 1)
        code = hooks.main(case.call[1:]) if case.call[0] == "hooks" else run(build(), case.call)
    except BaseException as error:
        print(f"{type(error).__name__}: {error}", file=sys.stderr)
    finally:
        with contextlib.suppress(OSError):
            sys.stdout.flush()
            sys.stderr.flush()
        os._exit(code)


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz.files")
    parser.add_argument("--count", type=int, default=600)
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    assert postproc.convert and postproc.identification.diagnose
    wrong, done = [], Counter[str]()
    for case in cases(given.count, given.seed):
        done[case.kind.name] += 1
        if (text := make(case)) is not None:
            wrong.append(text)
            print(text, flush=True)
    print(", ".join(f"{count} {kind}" for kind, count in done.items()))
    print(f"{sum(done.values())} bad files, {len(wrong)} that ended badly; seed {given.seed}")
    return int(bool(wrong))


if __name__ == "__main__":
    sys.exit(main())
