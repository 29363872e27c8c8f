"""Bad calls of the command line: odd names, options, settings, outputs, records and backups.

``python -m tests.fuzz.calls [FIRST]`` makes all of them (from one on); the suite makes every `STEP`-th. Whatever is wrong with a call, it ends
with 0, 1 or 2 within 20 seconds, and no file that stood there before is changed but the output it asks for.
"""

from __future__ import annotations

import contextlib
import hashlib
import io
import itertools
import os
import signal
import sys
import tempfile
from collections import Counter
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

from postproc.cli.app import build
from postproc.cli.run import run
from postproc.files import resource
from tests.batch.build import BACKINFO, MOC, SYS, backup, program, write

STEP = 9
SECONDS, WAITING = 20, 120  # of work, and in all: others may be busy on this machine
ARM = ("--robot", "irb4600_60_205")
NOWHERE = "nowhere://127.0.0.1:9"  # refused at once, where an address that may yet answer is waited for
ODD = os.fsdecode(b"w\xe9ld\xff.mod")
Call = tuple[Callable[[], object] | None, tuple[str, ...]]
DATA = b"MODULE a\nENDMODULE\n"
BYTES = (
    b"", b" \n", b"\0", b"\xff\xfe", b"\xef\xbb\xbf", b"[", b"[]", b"= 1", b"a = ", b"\"\"\"", b"robot = 1", b"robot = ''",
    b"robot = '../../etc'", b"robot = '/dev/null'", b"robot = 'x.urdf'", b"model = '.'", b"model = '\\u0000'", b"with = [1]",
    b"with = ['.']", b"force = ['a', 1, 2]", b"force = [nan, inf, 1]", b"tolerance_mm = nan", b"tolerance_mm = 1e999",
    b"channel = 3", b"channel = { a = 'b' }", b"free_axes = 'z'", b"template = 'a.mod'", b"scope = 3", b"fit = 3",
    b"[batch]\nworkers = 1.5", b"[fit]\neffects = 'x'", b"a = " + b"[" * 3000, b"a = 1" + b"0" * 5000, b"robot = \"\xff\"",
    b"[[job]]", b"[[job]]\nfolder = 3", b"[[job]]\nfiles = []", b"[[job]]\nfiles = ['/']", b"[[job]]\nfiles = ['**/[']",
    b"[[job]]\nfolder = '.'\nonly = ['[']", b"[[job]]\nfolder = '\\u0000'", b"[[job]]\nfiles = ['*.mod']\nname = '../x'",
    b"[[job]]\nfolder = '.'\nentry = 3", b"job = 3", b"[job]\nfolder = '.'",
)  # fmt: skip
"""Settings, models, jobs files and column maps that are none."""
RECORDS = (
    b"{}", b"[]", b"null", b"\xff", b"{" * 50_000, b'{"name":"a.mod"}', b'{"name":"a.mod","key":"k","status":"unchanged","outputs":{"../a.mod":"x"}}',
    b'{"name":"a.mod","key":"k","status":"copy","outputs":{"/etc/passwd":"x"},"figures":7,"findings":[[]]}',
    b'{"name":["a"],"key":"k","status":"failed","outputs":{}}', b'{"name":"a.mod","key":"k","status":"copy","outputs":{"":"x"}}',
)  # fmt: skip


def files(root: Path) -> None:
    """What stands there before a call."""
    write(
        root,
        {
            "a.mod": DATA,
            "p.mod": program("P"),
            "empty.mod": b"",
            "words.mod": b"this is no program",
            "nul.mod": b"\0" * 99,
        },
    )
    write(
        root,
        {
            "utf16.mod": "MODULE a\nENDMODULE\n".encode("utf-16"),
            "deep.mod": b"MODULE a\nCONST num n:=" + b"(" * 4000 + b"1;\nENDMODULE",
        },
    )
    write(
        root,
        {
            "long.mod": b"MODULE a\n!" + b"w" * 2_000 + b"\nENDMODULE",
            "dir.mod/in.mod": DATA,
            "t.csv": b"x,y\n1\n",
            "own.py": b"1/0",
        },
    )
    write(
        root,
        {"esc\x1b[2J\n.mod": DATA, "n" * 250 + ".mod": DATA, "seam.csv": resource("samples", "seam.csv").read_bytes()},
    )
    (root / ODD).write_bytes(DATA)
    (root / "loop.mod").symlink_to("loop.mod")
    (root / "gone.mod").symlink_to("nowhere")
    (root / "m.toml").write_bytes(resource("samples", "models", "irb4600_60_205.toml").read_bytes())


def calls() -> Iterator[Call]:
    """A preparation and the words of each call."""
    names = (
        "empty.mod",
        "words.mod",
        "nul.mod",
        "utf16.mod",
        "deep.mod",
        "long.mod",
        "dir.mod",
        "t.csv",
        "esc\x1b[2J\n.mod",
        ODD,
    )
    names += (
        "n" * 250 + ".mod",
        "loop.mod",
        "gone.mod",
        "missing",
        "a.mod/b.mod",
        "",
        ".",
        "..",
        "/dev/null",
        "~",
        "a\x00b"[:1] * 5000,
        "m.toml",
    )
    for name in names:
        yield None, ("compensate", name, "-o", "new/o.mod", *ARM)
        yield None, ("inspect", name, *ARM)
        yield None, ("diff", name, "a.mod")
        yield None, ("compensate", "a.mod", "--with", name, "--check", *ARM)
        yield None, ("seam", name, "-o", "o.mod", *ARM)
        yield None, ("compensate", "a.mod", "-m", name, "--check")
        yield None, ("predict", "m.toml", name)
        yield None, ("fit", name, *ARM, "-o", "o.toml")
    values = (
        "",
        "nan",
        "inf",
        "-1",
        "1_0",
        "1e999",
        "\u0663",
        "1,2",
        "1,2,3,4",
        ",,",
        "a=",
        "=1",
        "\x1b",
        "--",
        "-",
        "0x1",
        "[1,2,3]",
        "1;2;3",
    )
    options = (
        "--force",
        "--moment",
        "--tolerance",
        "--air-tolerance",
        "--scope",
        "--force-on",
        "--inertia",
        "--channel",
        "--free-axes",
    )
    for option, value in itertools.product(options, values):
        yield None, ("compensate", "a.mod", "--check", *ARM, option, value)
    for option, value in itertools.product(
        ("--robot", "--template", "--effects", "--taught", "--with", "-m"),
        ("", ".", "own.py", "a.mod", "missing", ODD),
    ):
        yield None, ("compensate", "a.mod", "--check", option, value)
    for value in ("0", "-1", "1_0", "a", "1/0", "3/2", "1/2/3", "\u0661/2"):
        yield None, ("batch", "dir.mod", "-o", "out", *ARM, "--shard", value)
        yield None, ("batch", "dir.mod", "-o", "out", *ARM, "--workers", value)
        yield None, ("plan", "m.toml", "t.csv", "-n", value)
    places = (
        "a.mod",
        "./a.mod",
        "dir.mod",
        "a.mod/x",
        "loop.mod",
        "/dev/full",
        "/proc/x",
        "",
        ".",
        "m.toml",
        "own.py",
        "dir.mod/in.mod",
    )
    for place in (*places, "n" * 300):
        yield (
            None,
            ("compensate", "a.mod", "-m", "m.toml", "--with", "dir.mod/in.mod", "--effects", "own.py", "-o", place),
        )
        yield None, ("batch", "dir.mod", "-m", "m.toml", "--with", "a.mod", "--effects", "own.py", "-o", place)
    for place in (
        "dir.mod",
        "a.mod/x",
        "loop.mod",
        "/dev/full",
        "",
        ".",
        "dir.mod/in.mod",
        "dir.mod/out/in.mod",
        "n" * 300,
    ):
        yield None, ("compensate", "a.mod", *ARM, "--with", "dir.mod/in.mod", "--report", place, "--check")
        yield None, ("batch", "dir.mod", *ARM, "-o", "dir.mod/out", "--workers", "1", "--report", place)
    for data in BYTES:
        yield lambda data=data: Path("postproc.toml").write_bytes(data), ("compensate", "a.mod", "--check")
        yield lambda data=data: Path("odd.toml").write_bytes(data), ("inspect", "a.mod", "-m", "odd.toml")
        yield (
            lambda data=data: Path("odd.toml").write_bytes(data),
            ("batch", "odd.toml", "-o", "out", "--scheduler", NOWHERE),
        )
        yield (
            lambda data=data: Path("odd.toml").write_bytes(data),
            ("predict", "m.toml", "t.csv", "--columns", "odd.toml"),
        )
    for data in (*RECORDS, *(hashlib.sha256(text).hexdigest().encode() + b"\n" + text for text in RECORDS)):
        yield (
            lambda data=data: write(Path("out/.postproc"), {"0.json": data}),
            ("batch", "dir.mod", "-o", "out", *ARM, "--workers", "1"),
        )
    for name in (
        "out/.postproc",
        "out/.postproc/copies-all.json/x",
        "out/.postproc/all.lock/x",
        "out/.postproc/all.unfinished",
        "out/in.mod/x",
        "out",
    ):
        yield lambda name=name: write(Path(), {name: b"x"}), ("batch", "dir.mod", "-o", "out", *ARM, "--workers", "1")
    yield from _backups()


def _backups() -> Iterator[Call]:
    broken = {"SYSPAR/SYS.cfg": SYS, "SYSPAR/MOC.cfg": MOC, "BACKINFO/backinfo.txt": BACKINFO}
    for name, text in broken.items():
        for data in (
            b"",
            b"\0" * 50,
            text.encode()[:90],
            text.encode("utf-16"),
            text.replace('"', "").encode(),
            b"-" * 50_000,
        ):
            spoilt = partial(_spoil, name, data)
            yield spoilt, ("compensate", "b/RAPID/TASK1/PROGMOD/Seam.mod", "--check")
            yield spoilt, ("batch", "b", "-o", "out", "--scheduler", NOWHERE)


def _spoil(name: str, data: bytes) -> None:
    write(backup(Path("b")), {name: data})


def make(call: Call) -> str | None:
    """Make a call in a folder of its own; what is wrong with how it ended, None where nothing is."""
    prepare, words = call
    with tempfile.TemporaryDirectory() as name, contextlib.chdir(name):
        files(Path())
        if prepare is not None:
            prepare()
        before = _state()
        said, out = io.StringIO(), io.TextIOWrapper(io.BytesIO(), encoding="utf-8", errors="backslashreplace")
        signal.signal(signal.SIGALRM, _late)
        signal.signal(signal.SIGPROF, _late)
        signal.setitimer(signal.ITIMER_PROF, SECONDS)
        signal.alarm(WAITING)
        try:
            with contextlib.redirect_stdout(out), contextlib.redirect_stderr(said):
                code = run(build(), words)
        except BaseException as error:
            return f"{words}: {type(error).__name__}: {error}"
        finally:
            signal.alarm(0)
            signal.setitimer(signal.ITIMER_PROF, 0)
        after = _state()
        lost = {path for path in before if after.get(path) != before[path]}
        left = [path for path in after if Path(path).name.startswith(".postproc-")]
        if code not in (0, 1, 2) or lost or left:
            return f"{words}: exit code {code}, changed {lost}, left over {left}: {said.getvalue()[-400:]}"
        return None


def _late(*_: object) -> None:
    raise TimeoutError(f"more than {SECONDS} s of work, or {WAITING} s in all")


def _state() -> dict[str, str]:
    """Hash of every file, but those that a batch keeps for itself."""
    found = (p for p in Path().rglob("*") if p.is_file() and not {".postproc"} & {*p.parts})
    return {str(p): hashlib.sha256(p.read_bytes()).hexdigest() for p in found if p.parts[0] != "out"}


def main() -> int:
    wrong: Counter[str] = Counter()
    every = list(calls())[int(sys.argv[1]) if len(sys.argv) > 1 else 0 :]
    for call in every:
        if (text := make(call)) is not None:
            wrong[text] += 1
            print(text, flush=True)
    print(f"{len(every)} bad calls, {len(wrong)} that ended badly")
    return int(bool(wrong))


if __name__ == "__main__":
    sys.exit(main())
