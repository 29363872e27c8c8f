"""``postproc diff``: two programs, or two folders of them, compared by meaning."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from postproc.cli.inputs import read_source
from postproc.cli.options import CheckFlag, Distance, ReportFile
from postproc.cli.output import check_outputs, present
from postproc.cli.printing import show
from postproc.cli.programs import sound_program
from postproc.cli.progress import watching
from postproc.diagnostics import PostprocError
from postproc.files import real

if TYPE_CHECKING:
    from postproc.report.blocks import Document


def run(
    a: str,
    b: str,
    /,
    *,
    tolerance: Distance = 0.001,
    angle_tolerance: Distance = 0.01,
    report: ReportFile = None,
    json: CheckFlag = False,
) -> int:
    """Compare two programs, folders or backups by meaning; exit 1 if they differ by more than the tolerance.

    Files of two folders are paired by their path; what is no RAPID module counts by its bytes.

    Args:
        a: RAPID module, or folder.
        b: RAPID module, or folder.
        tolerance: distance between targets that is still the same [mm].
        angle_tolerance: angle between their orientations, or between joints, that is still the same [deg].
        json: print the postproc/diff/1 document, of folders postproc/diff-folders/1.
    """
    folders, near = [Path(name).is_dir() for name in (a, b)], (tolerance, angle_tolerance)
    if any(folders) and not all(folders):
        folder, other = (a, b) if folders[0] else (b, a)
        text, help_ = f"`{folder}` is a folder, and `{other}` is none", "name two programs, or two folders"
        raise PostprocError.of("CLI003", text, help=help_)
    check_outputs(() if all(folders) else (a, b), report)
    document, equal = _folders(Path(a), Path(b), near, report) if all(folders) else _files(a, b, near)
    present(document, report, json=json)
    return int(not equal)


def _files(a: str, b: str, near: tuple[float, float]) -> tuple[Document, bool]:
    """Compare two programs by meaning.

    Args:
        a, b: names of their files, or ``-``. near: tolerances [mm], [deg].

    Returns:
        The document, and whether the programs are equal.
    """
    from postproc.rapid.diff.compare import compare_programs
    from postproc.results.convert.difference import difference_document

    programs = []
    for name in (a, b):
        programs.append(sound_program(read_source(name)))
        show(programs[-1].diagnostics)
    with watching(f"comparing `{a}` and `{b}`"):
        difference = compare_programs(programs[0], programs[1], *near)
    names = (Path(a).name, Path(b).name) if Path(a).name != Path(b).name else (a, b)
    return difference_document(*names, difference, (programs[0], programs[1])), difference.equal


def _folders(a: Path, b: Path, near: tuple[float, float], report: Path | None) -> tuple[Document, bool]:
    """Compare two folders.

    Args:
        near: tolerances [mm], [deg]. report: page to write, which must be outside of both folders.

    Returns:
        The document, and whether all files are equal.
    """
    from postproc.batch.differences import compare_folders
    from postproc.results.convert.difference import folders_document

    if report is not None and any(real(report).is_relative_to(real(folder)) for folder in (a, b)):
        text = f"`{report}` stands in a folder that is compared"
        raise PostprocError.of("CLI007", text, help="name a file outside of both folders")
    with watching("comparing") as watch:
        differences = compare_folders(a, b, *near, watch)
    return folders_document(str(a), str(b), differences, near), all(file.status == "equal" for file in differences)
