"""The libraries that pages carry: the files that are named, whole, with their licence."""

import hashlib
import re

from postproc.files import resource
from postproc.report.page import SCRIPTS, STYLES

FOLDER = resource("templates", "report", "vendor")


def test_libraries_of_the_pages_are_those_of_the_readme() -> None:
    readme = (FOLDER / "README.md").read_text("utf-8")
    stated = dict(re.findall(r"^\| `(\S+)` .* `([0-9a-f]{64})` \|$", readme, re.MULTILINE))
    assert stated == {name: hashlib.sha256((FOLDER / name).read_bytes()).hexdigest() for name in stated}
    used = {f"{name}.js" for names in SCRIPTS.values() for name in names if name.startswith("vendor/")}
    assert {f"vendor/{name}" for name in stated} == used | {
        f"{name}.css" for name in STYLES.values() if name.startswith("vendor/")
    }
    assert sum(map(len, map(bytes, ((FOLDER / name).read_bytes() for name in stated)))) < 1_000_000
    assert all((FOLDER / licence).is_file() for licence in re.findall(r"`(LICENSE\S+)`", readme))
