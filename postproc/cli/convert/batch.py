"""``postproc batch``: many programs at once, into a mirrored tree."""

from __future__ import annotations

import os
import re
from contextlib import nullcontext
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter
from cyclopts.validators import Number

from postproc.batch.values import Shard
from postproc.cli.convert.batch_lines import Reporter, arm_lines, reporting
from postproc.cli.convert.finish import say_missed
from postproc.cli.data_names import check_names
from postproc.cli.options import AS_WRITTEN, CheckFlag, Format, ReportFile, Require, RequiredOutput
from postproc.cli.output import check_outputs, present
from postproc.cli.printing import say
from postproc.cli.program_options import TaskOptions
from postproc.cli.run import Outcome
from postproc.diagnostics import PostprocError, Source
from postproc.files import real

if TYPE_CHECKING:
    from postproc.batch.jobs import Ready
    from postproc.batch.values import Batch

Workers = Annotated[int | None, AS_WRITTEN, Parameter(validator=Number(gte=1))]


def run(
    folder_or_jobs: Path,
    /,
    *,
    output: RequiredOutput,
    workers: Workers = None,
    scheduler: str | None = None,
    shard: str = "1/1",
    convert: TaskOptions = TaskOptions(),
    report: ReportFile = None,
    check: CheckFlag = False,
    require: Require = None,
    format: Format = None,
    json: CheckFlag = False,
) -> Outcome:
    """Convert a folder, a controller backup or the tasks of a jobs file; exit 1 if one of them failed.

    The output folder mirrors the input; what is done already is not done again, also after a run that was stopped.

    Args:
        folder_or_jobs: folder with programs, or a jobs file (TOML).
        output: folder for the outputs.
        workers: processes on this machine. Default: what ``[batch]`` of postproc.toml says, else one for each core.
        scheduler: address of a Dask scheduler whose workers are used in place of processes on this machine.
        shard: part of the work that this run does, I/N; all N parts together make the whole tree.
        check: write no output; say what would change in the output folder, exit 1 if anything would.
        json: print the postproc/batch/1 document.
    """
    part, place = _parse_shard(shard), _checked_folder(folder_or_jobs, output)
    settings = convert.settings_at(place)
    check_outputs((folder_or_jobs, *settings.inputs), report)

    def convert_into(folder: Path) -> Batch:
        """Convert into a folder, and print the result."""
        from postproc.batch.document import batch_document
        from postproc.batch.jobs import get_ready
        from postproc.batch.jobsfile import read_plan
        from postproc.robot.controller import read_quietly
        from postproc.settings import made_with

        plan = read_plan(folder_or_jobs, convert.settings_at, folder)
        paths = {path for task, settings in plan.tasks for path in (*task.paths, *settings.side_files)}
        check_names(convert, (Source(str(path), read_quietly(path)) for path in sorted(paths)))
        ready = get_ready(plan, part, folder, report)
        batch, shown = _convert(ready, _workers(workers, scheduler, place), scheduler)
        pages = {
            o.task.name: os.path.relpath(folder / o.page, report.parent) for o in batch.outcomes if o.page and report
        }
        document = batch_document(folder_or_jobs.name, batch, part, made=made_with(settings, place), pages=pages)
        present(document, report, json=json, form=format, text=True, on_stderr=True, root=ready.plan.root)
        say(shown.time_line())
        return batch

    with TemporaryDirectory(prefix="postproc-") if check else nullcontext(output) as made:
        batch = convert_into(Path(made))
        changes = check and _say_changes(output, Path(made))
    lacks = say_missed(require, {o.task.name: o.figures for o in batch.outcomes})
    return Outcome(int(batch.failed) | changes | lacks, changes, lacks)


def _workers(stated: int | None, scheduler: str | None, place: Path) -> int | None:
    """Return the number of worker processes: as stated, else that of the settings file of the folder ``place``."""
    from postproc.settings_files import find_settings

    settings_file = find_settings(place) if stated is None and scheduler is None else None
    return stated if settings_file is None else settings_file[1].batch.workers


def _convert(ready: Ready, workers: int | None, scheduler: str | None) -> tuple[Batch, Reporter]:
    """Convert the tasks of a batch, with a line on stderr for each; who stops it ends this process."""
    from postproc.batch.executors import open_pool
    from postproc.batch.run import run_batch

    for line in arm_lines(ready):
        say(line)
    # Child processes ignore warnings of Python's resource tracker, which it prints when a run was stopped.
    ignored = filter(None, (os.environ.get("PYTHONWARNINGS"), "ignore:resource_tracker"))
    os.environ["PYTHONWARNINGS"] = ",".join(ignored)
    try:
        with open_pool(workers, scheduler) as pool, reporting(len(ready.tasks)) as shown:
            return run_batch(ready, pool, shown.outcome), shown
    except KeyboardInterrupt:
        say("stopped; the same command goes on from here")
        # Nothing is half written, and workers end with this process: waiting for them would gain nothing.
        os._exit(1)


def _say_changes(now: Path, made: Path) -> bool:
    """Say on stderr which files of the output folder would change, and return whether any would.

    Args:
        now: the output folder. made: the same as it would be.
    """
    from postproc.batch.differences import compare_folders
    from postproc.rapid.diff.difference import FileDiff
    from postproc.results.convert.difference import change_lines
    from postproc.tasks.discover import files_below

    if now.is_dir():
        files = compare_folders(now, made, 0.0, 0.0)
    else:
        files = [FileDiff(name, "added") for name in files_below(made) if not name.startswith(".")]
    changed = [file for file in files if file.status != "equal"]
    for line in change_lines(changed) or [f"nothing would change in `{now}`"]:
        say(line)
    return bool(changed)


def _parse_shard(text: str) -> Shard:
    """Return the part of the work that ``I/N`` states; raise BAT014 where it is none."""
    match = re.fullmatch(r"(\d+)/(\d+)", text)
    if match is None or not 1 <= int(match[1]) <= int(match[2]):
        help_ = "write `--shard 2/4` for the second of four parts"
        raise PostprocError.of("BAT014", f"`--shard {text}` is not a part of a whole", help=help_)
    return Shard(int(match[1]), int(match[2]))


def _checked_folder(source: Path, output: Path) -> Path:
    """Return the folder of the input; raise CLI002 where that does not exist, BAT015 where the output would hold it."""
    if not source.exists():
        text = f"there is no file or folder `{source}`"
        raise PostprocError.of("CLI002", text, help="check the spelling and the folder")
    folder = source if source.is_dir() else source.parent
    if real(folder).is_relative_to(real(output)):
        text = f"the input `{folder}` stands in the output folder `{output}`"
        raise PostprocError.of("BAT015", text, help="give another folder with -o")
    return folder
