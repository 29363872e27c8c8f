"""Files at the boundary: kind and size are looked at before one is read; what may be written, and how.

An output is checked against all that a command reads before it begins, and is written whole or not at all. Templates,
samples and pages of the documentation come with the package.
"""

from __future__ import annotations

import errno
import os
import re
import stat
import tempfile
from collections.abc import Iterable
from pathlib import Path, PurePosixPath

from postproc.diagnostics import Diagnostic, Matter, PostprocError, Source

SPACE = "make space, or write elsewhere"
LARGEST_FILE_BYTES = 64_000_000
"""Bytes of a file that is read: twenty times the largest program, table or model that is known."""
FILE_KINDS = {stat.S_IFIFO: "a pipe", stat.S_IFCHR: "a device", stat.S_IFBLK: "a device", stat.S_IFSOCK: "a socket"}
MISREAD = {
    FileNotFoundError: ("CLI002", "there is no file `{}`", "check the spelling and the folder"),
    IsADirectoryError: ("CLI003", "`{}` is a folder", "name one file"),
}
"""What the command line says of a name that is that of no file."""
Place = tuple[int, int, tuple[str, ...]]
_PROGRAM = re.compile(r"\s*(?:%%%|(?:(?:!|#)[^\n]*\n\s*)*MODULE\s+[A-Za-z]\w*\s*(?:\n|\(|!))", re.IGNORECASE)
SEPARATORS = ",;\t"
"""Of a table, one kind in all of its lines."""
_SECTION = re.compile(r"^## ([A-Z]{3}\d{3})\b.*?(?=^## |\Z)", re.MULTILINE | re.DOTALL)


def read_file(name: str | Path) -> bytes:
    """Return the bytes of a regular file.

    Raises:
        OSError: there is none, it cannot be read, is a pipe or a device (reading these may never end), or too large.
    """
    try:
        status = os.stat(name)
        if stat.S_ISDIR(status.st_mode):
            raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(name))
        if not stat.S_ISREG(status.st_mode):
            kind = FILE_KINDS.get(stat.S_IFMT(status.st_mode), "no regular file")
            raise OSError(errno.EINVAL, f"it is {kind}, and only regular files are read", str(name))
        with open(name, "rb") as file:
            data = file.read(LARGEST_FILE_BYTES + 1)  # files of the system state no size
    except ValueError:  # NUL, half of a surrogate pair
        raise OSError(errno.EINVAL, "no file can have that name", str(name)) from None
    if len(data) > LARGEST_FILE_BYTES:
        raise OSError(
            errno.EFBIG, f"it is larger than {LARGEST_FILE_BYTES // 1_000_000} MB, the most that is read", str(name)
        )
    return data


def read_source(name: str | Path, code: str = "", read_only: bool = False) -> Source:
    """Read a file with its name.

    Args:
        code: of the error where it cannot be read; empty for that of the command line, CLI002 to CLI004.
        read_only: it is used by a program and never changed.

    Raises:
        PostprocError: it cannot be read.
    """
    try:
        return Source(str(name), read_file(name), read_only)
    except OSError as error:
        reason = error.strerror or str(error)
        error_code, text, help_ = code, f"cannot read `{name}`: {reason}", "check the name and its rights"
        if not code:
            other = ("CLI004", f"cannot read `{{}}`: {reason}", "check the rights of the file")
            error_code, text, help_ = MISREAD.get(type(error), other)
        message = text.replace("{}", str(name))
        raise PostprocError(Diagnostic(error_code, "error", message, help=help_, matter=Matter.UNREADABLE)) from error


def is_program(text: str) -> bool:
    """Return whether a text begins as a RAPID module does: a file header (``%%%``) or the line ``MODULE name``."""
    return _PROGRAM.match(text) is not None


def is_table(text: str) -> bool:
    """Return whether the first two lines of a text, neither key = value nor a comment, have equally many separators."""
    lines = [line for line in text[:10_000].splitlines() if line.strip()][:2]
    if len(lines) < 2 or any("=" in line or line.lstrip()[0] in "#[" for line in lines):
        return False
    return any(lines[0].count(mark) == lines[1].count(mark) > 0 for mark in SEPARATORS)


def place(path: Path, follow: bool = True) -> Place:
    """Return a key that is equal for all paths of one file, also of one that does not exist yet.

    It has device and number of the nearest existing folder, and the names below it.

    Args:
        follow: where the last part is a link, the file that it points to; False is the link itself.
    """
    at = real(path) if follow else real(path.parent) / path.name
    folder = next(parent for parent in (*at.parents, at) if parent.is_dir())
    names = at.relative_to(folder).parts
    status = folder.stat()
    return status.st_dev, status.st_ino, tuple(name.casefold() for name in names) if _caseless(folder) else names


def short_path(path: Path, folder: Path) -> str:
    """Return a path as a document states it: as it was given, or if absolute, from the working folder or another one.

    A path that shares only the root, or no more than what lies above the user's home, is stated by its name alone.

    Args:
        folder: of what the document is about.
    """
    if not path.is_absolute():
        return str(path)
    path, home, ways = Path(os.path.normpath(path)), Path.home(), list[str]()
    for base in (Path.cwd(), folder.absolute()):
        if path.anchor == base.anchor:
            shared = Path(os.path.commonpath([path, base]))
            if shared != Path(path.anchor) and not (home != shared and home.is_relative_to(shared)):
                ways.append(os.path.relpath(path, base))
    return min(ways, key=len, default=path.name)


def real(path: Path) -> Path:
    """Return a path with all links followed; broken or circular links are no error."""
    return Path(os.path.realpath(path))


def _caseless(folder: Path) -> bool:
    """Tell whether the file system takes names that differ in case for one; tried on the folder's own name."""
    other = folder.with_name(folder.name.swapcase()) if folder.name else folder
    return other.name != folder.name and other.is_dir() and other.samefile(folder)


def stays_inside(name: str) -> bool:
    """Tell whether a relative path with forward slashes stays inside any folder it is joined to."""
    try:
        os.fsencode(name)
    except UnicodeEncodeError:  # half of a surrogate pair
        return False
    parts = PurePosixPath(name).parts
    return bool(parts) and not name.startswith("/") and ".." not in parts and "\0" not in name


def check_writes(reads: Iterable[str | Path | None], *writes: Path | None) -> None:
    """Refuse outputs of a command before it does anything.

    Args:
        reads: names of all files that are read; None is skipped.
        writes: all files that will be written; None is skipped.

    Raises:
        PostprocError: an output is an input or another output (CLI007), or cannot be written (CLI008).
    """
    _check_each({place(Path(name)): f"the input `{name}`" for name in reads if name is not None}, *writes)


def _check_each(taken: dict[Place, str], *writes: Path | None) -> None:
    """Refuse outputs as `check_writes` does.

    Args:
        taken: what stands, or will stand, in each place; the outputs are added to it.
    """
    for output in writes:
        if output is None:
            continue
        if output.is_dir():
            raise PostprocError.of("CLI008", f"cannot write `{output}`: it is a folder", help="name a file")
        nearest = next(folder for folder in output.absolute().parents if folder.exists())
        if not nearest.is_dir():
            raise PostprocError.of(
                "CLI008", f"cannot write `{output}`: `{nearest}` is no folder", help="name another folder"
            )
        at = place(output)
        if at in taken:
            text = f"the output `{output}` is {taken[at]}"
            raise PostprocError.of("CLI007", text, help="choose another name")
        taken[at] = "another output too"


def check_tree(
    root: Path, names: Iterable[str], state: Iterable[str], reads: Iterable[Path], report: Path | None
) -> None:
    """Refuse a tree of outputs that would leave its folder or overwrite an input, before anything in it is written.

    Args:
        root: the folder of the tree.
        names: files of the tree, relative to the folder, with forward slashes.
        state: files, relative too, that the batch keeps for itself there, in folders of their own.
        reads: all files that are read. report: another file that will be written, None for none.

    Raises:
        PostprocError: BAT015, or as `check_writes`.
    """
    tree, state = dict.fromkeys(names), tuple(state)
    inside = real(root)
    for name in (*tree, *state):
        # A link in the place of a file is replaced by renaming; what is opened, is followed.
        path = root / name
        where = real(path.parent if name in tree else path)
        if not stays_inside(name) or not where.is_relative_to(inside):
            text = f"the output `{path}` is not in the folder `{root}`"
            raise PostprocError.of("BAT015", text, help="take the link out of that folder, or give another one with -o")
    kept = {root / PurePosixPath(name).parts[0] for name in state}
    links = [path for folder in sorted(kept) for path in (folder, *folder.rglob("*")) if path.is_symlink()]
    if links:
        text = f"the output `{links[0]}` is a link, where the batch keeps its own state"
        raise PostprocError.of("BAT015", text, help="take the link out, or give another folder with -o")
    taken = {place(path): f"the input `{path}`" for path in reads}
    for name in tree:
        at = place(root / name, follow=False)
        if at in taken:
            text = f"the output `{root / name}` is {taken[at]}"
            raise PostprocError.of("BAT015", text, help="give another folder with -o, or another name to the file")
        taken[at] = f"the output `{root / name}`"
    _check_each(taken, report)
    if report is not None and any(real(report).is_relative_to(real(folder)) for folder in kept):
        text = f"the output `{report}` stands where the batch keeps its own state"
        raise PostprocError.of("CLI007", text, help="choose another place")


def write_atomically(target: Path, data: bytes, scratch: Path | None = None) -> None:
    """Write a file atomically: under a temporary name, forced to the disk, then renamed.

    Folders that are not there are made; the rights of a file that is replaced stay.

    Args:
        scratch: folder for what is unfinished, on the same disk; by default that of the file.

    Raises:
        OSError: the file cannot be written; what was there is untouched.
    """
    target.parent.mkdir(parents=True, exist_ok=True)
    handle, temporary = tempfile.mkstemp(prefix=".postproc-", dir=scratch or target.parent)
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        os.chmod(temporary, target.stat().st_mode & 0o777 if target.exists() else 0o666 & ~_umask())
        os.replace(temporary, target)
    except BaseException:
        Path(temporary).unlink(missing_ok=True)
        raise


def why(error: OSError) -> tuple[str, str]:
    """Return what the operating system says of an error, and a help text."""
    help_ = SPACE if error.errno == errno.ENOSPC else "check the folder and its rights"
    return error.strerror or str(error), help_


def _umask() -> int:
    """Return the process's mask for the rights of new files."""
    mask = os.umask(0)
    os.umask(mask)
    return mask


def resource(*parts: str) -> Path:
    """Return the path of a file or folder that ships with the package, such as ``resource("templates", "module.j2")``.

    A wheel carries these folders inside the package. In a checkout (also when installed with ``pip install -e``, which
    leaves a stale copy in site-packages that must not be read) they stand beside it.

    Args:
        parts: of the path, from the package or the root of the checkout.
    """
    package = Path(__file__).resolve().parent
    packaged = package.joinpath(parts[0])
    root = package if packaged.is_dir() else package.parent
    return root.joinpath(*parts)


def explanations() -> dict[str, str]:
    """Return every diagnostic's section of ``docs/diagnostics`` as Markdown, by code."""
    pages = sorted(resource("docs", "diagnostics").glob("*.md"))
    return {match[1]: match[0].strip() for page in pages for match in _SECTION.finditer(page.read_text("utf-8"))}
