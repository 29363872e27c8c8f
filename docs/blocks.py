"""The shell blocks of the pages, and how they are run: each page from a fresh folder, its blocks one after another.

A page is a session that a reader types. In a block marked ``sh`` lines that begin with ``postproc`` run in this
process (a start of Python costs a second), all others in ``sh``; ``# exit code 1`` says what a command returns.
``<!-- file: NAME -->`` before a block writes it into the folder, ``<!-- not run: REASON -->`` leaves a block out.
What stands between ``<!-- made: NAME -->`` and ``<!-- end -->``, a figure in a sentence or a table, is made by
``docs/made.py``; ``<!-- output N -->`` before a block is what the page's command N prints.
"""

from __future__ import annotations

import contextlib
import io
import os
import re
import shlex
import subprocess
import sys
import threading
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
FENCE = re.compile(
    r"^(?:<!-- (?P<mark>file|not run): (?P<what>[^\n]+?) -->\n+)?```(?P<kind>\w+)\n(?P<text>.*?)^```$", re.M | re.S
)
OUTPUT = re.compile(r"(^<!-- output (\d+) -->\n```text\n)(.*?)(^```$)", re.M | re.S)
MADE = re.compile(r"(<!-- made: (\S+) -->\n?)(.*?)(<!-- end -->)", re.S)
NUMBER = re.compile(r"\d+(?:\.\d+)?")
EXIT_CODE = re.compile(r"#.*exit code (\d+)")


@dataclass(frozen=True)
class Block:
    """A fenced block that a reader runs or saves.

    Args:
        name: of the file to save, empty for commands. not_run: why nobody can run it here.
    """

    page: str
    line: int
    text: str
    name: str = ""
    not_run: str = ""


@dataclass(frozen=True)
class Ran:
    """One command line as it ran: what it printed on both streams, and its exit code."""

    block: Block
    line: str
    output: str
    code: int
    expected: int


def read_blocks(page: Path) -> list[Block]:
    """The blocks of a page in their order, as far as a reader runs or saves them."""
    text = page.read_text("utf-8")
    found = []
    for fence in FENCE.finditer(text):
        mark, what = fence["mark"], fence["what"] or ""
        if fence["kind"] != "sh" and mark != "file":
            continue
        line = text.count("\n", 0, fence.start("text"))
        name, why = (what if mark == key else "" for key in ("file", "not run"))
        found.append(Block(page.name, line, fence["text"], name, why))
    return found


def run_page(page: Path, folder: Path) -> Iterator[Ran]:
    """Run what a page shows, in a folder with samples and package beside it, as in a clone."""
    for name in ("samples", "postproc"):
        (folder / name).symlink_to(ROOT / name)
    variables: dict[str, str] = {}
    with contextlib.chdir(folder):
        for block in read_blocks(page):
            if block.name:
                Path(block.name).write_text(block.text, encoding="utf-8")
            elif not block.not_run:
                for line in block.text.replace("\\\n", "").splitlines():
                    if assigned := re.fullmatch(r"([A-Z]+)=(\S+)", line):
                        variables[assigned[1]] = assigned[2]
                    elif line.partition("#")[0].strip():
                        yield _run(block, line, variables)


def _run(block: Block, line: str, variables: dict[str, str]) -> Ran:
    expected = EXIT_CODE.search(line)
    text = re.sub(r"\$([A-Z]+)", lambda name: variables.get(name[1], name[0]), line)
    words = shlex.split(text, comments=True)
    if words[0] != "postproc":
        code, output = _shell(text)
    elif ">" in words:
        at = words.index(">")
        code, output = run_postproc(words[1:at], Path(words[at + 1]))
    else:
        code, output = run_postproc(words[1:])
    return Ran(block, line, output, code, int(expected[1]) if expected else 0)


class _Screen(io.TextIOWrapper):
    """What a command prints, but for how far it is, which a thread tells on a machine that is slow at the moment."""

    def __init__(self) -> None:
        super().__init__(io.BytesIO(), encoding="utf-8", write_through=True)
        self.thread = threading.current_thread()

    def write(self, text: str) -> int:
        return super().write(text) if threading.current_thread() is self.thread else len(text)


def run_postproc(arguments: list[str], stdout: Path | None = None) -> tuple[int, str]:
    """Exit code and text on both streams of a command; stdout goes into a file where one is given."""
    from postproc.cli.app import build
    from postproc.cli.run import run

    out = _Screen()
    said = out if stdout is None else _Screen()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(said):
        code = run(build(), arguments)
    if stdout is not None:
        stdout.write_bytes(_written(out))
    return code, _written(said).decode("utf-8", "replace")


def _written(stream: io.TextIOWrapper) -> bytes:
    assert isinstance(stream.buffer, io.BytesIO)
    return stream.buffer.getvalue()


def _shell(text: str) -> tuple[int, str]:
    """A line in ``sh`` with the commands of this environment first, as after ``. .venv/bin/activate``."""
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", "")])
    changed = {**os.environ, "LC_ALL": "C", "PATH": path}
    done = subprocess.run(["sh", "-ec", text], capture_output=True, text=True, check=False, env=changed)
    return done.returncode, done.stdout + done.stderr


def with_outputs(page: str, outputs: list[str]) -> str:
    """The text of a page with what its commands print in the blocks behind ``<!-- output N -->``."""
    return OUTPUT.sub(lambda found: f"{found[1]}{outputs[int(found[2]) - 1].rstrip()}\n{found[4]}", page)


def made_names(page: str) -> list[str]:
    """Names of what is made for a page."""
    return [found[2] for found in MADE.finditer(page)]


def with_made(page: str, texts: Mapping[str, str]) -> str:
    """The text of a page with what is made for it, by name, between the marks."""
    return MADE.sub(lambda found: f"{found[1]}{texts[found[2]]}{found[4]}", page)


def is_same(shown: str, now: str) -> bool:
    """Whether two texts have the same words, and numbers within 5 % or two of the last digit: machines differ."""
    if NUMBER.sub("#", shown).split() != NUMBER.sub("#", now).split():
        return False
    return all(
        abs(float(a) - float(b)) <= max(0.05 * abs(float(a)), 2.1 * 10.0 ** -len(a.partition(".")[2]))
        for a, b in zip(NUMBER.findall(shown), NUMBER.findall(now), strict=True)
    )
