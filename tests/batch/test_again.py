"""A second run does only what changed; parts of the work together make the full tree; pages are outputs like others."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from postproc.batch.records import open_tree
from postproc.batch.values import Shard
from postproc.rapid.diff.difference import FileDiff
from postproc.results.convert.difference import change_lines
from postproc.settings import Settings

from .build import ARM, EFFECT, ROUGH, TOOL, Work, module, program, programs, tree, work_in, write

SEAM = [f"line{i % 3}/Seam{i}.mod" for i in range(4)]


def test_a_second_run_touches_nothing(work: Work) -> None:
    write(programs(work.source, 4), {"bad.mod": "no module", "note.txt": "text"})

    def state() -> object:
        return tree(work.out), [path.stat().st_mtime_ns for path in sorted(work.out.rglob("*.mod"))]

    first, before = work.convert(), state()
    second = work.convert()
    assert second.cached == {*SEAM, "bad.mod"} and len(second.told) == 5 and second.batch.failed
    assert state() == before
    both = [[(o.figures, o.findings) for o in made.batch.outcomes] for made in (first, second)]
    assert both[0] == both[1]


def test_what_changed_is_done_again_and_what_somebody_edited_is_put_aside(work: Work) -> None:
    programs(work.source, 4)
    work.convert()
    work.write({SEAM[0]: program("Seam0", 1300)})
    write(work.out, {SEAM[1]: "touched up on the pendant"})
    (work.out / SEAM[2]).unlink()
    again = work.convert()
    assert again.cached == {SEAM[3]}
    assert [again.codes(name) for name in SEAM] == [[], ["BAT016"], [], []]
    (kept,) = (work.out / ".postproc/edited").glob(f"*/{SEAM[1]}")
    assert work.edited() == [SEAM[1]] and kept.read_text() == "touched up on the pendant"
    fresh = work.into("fresh")
    assert not fresh.convert().batch.failed
    assert {path: hash_ for path, hash_ in tree(work.out).items() if "/edited/" not in path} == tree(fresh.out)
    quiet = work.convert()
    assert quiet.cached == set(SEAM) and not any(o.findings for o in quiet.told)


def test_a_module_that_comes_of_no_program_is_named_with_what_to_do(work: Work) -> None:
    """Its program was deleted, and the records of the run that wrote it are not kept in version control."""
    programs(work.source, 2)
    assert work.convert().batch.findings == ()
    write(work.out, {"line0/old.mod": program("Old"), "note.txt": "mine"})
    again = work.convert()
    (finding,) = again.batch.findings
    assert (finding.code, finding.severity, again.batch.failed) == ("BAT023", "warning", False)
    assert finding.message == f"`{work.out}/line0/old.mod` comes of no program of this batch"
    assert "delete it" in str(finding.help) and (work.out / "line0/old.mod").exists()
    assert work.convert(shard=Shard(1, 2)).batch.findings == ()
    (line,) = change_lines([FileDiff("line0/old.mod", "removed")])
    assert line == "`line0/old.mod` comes of no program any more: delete it, or put its program back"


@pytest.mark.parametrize(
    "settings",
    [
        replace(ROUGH, options=replace(ROUGH.options, force=(100.0, 0.0, 0.0))),
        replace(ROUGH, robot="irb4600_60_205_seed"),
    ],
)
def test_another_model_or_option_does_all_again(work: Work, settings: Settings) -> None:
    programs(work.source, 2)
    work.convert()
    assert not work.convert(settings).cached


MODEL = f'robot = "{ARM}"\n[effects.joint_compliance]\ncompliance_rad_per_Nm = [4e-6, 3e-7, 3e-7, 2e-6, 2e-6, 2e-6]\n'


@pytest.mark.parametrize(
    ("name", "changed", "again"),
    [
        ("user.sys", module("user", TOOL.replace("[5,", "[6,")), True),
        ("mine.py", f"{EFFECT}# a note\n", True),
        ("m.toml", MODEL.replace("4e-6", "5e-6"), True),
        ("m.toml", f"# a note\n{MODEL}", False),  # a model counts by what it says
    ],
)
def test_code_of_effects_models_and_files_read_along_count(work: Work, name: str, changed: str, again: bool) -> None:
    work.write({"One.mod": program("One", tool="")})
    write(work.root, {"user.sys": module("user", TOOL), "mine.py": EFFECT, "m.toml": MODEL})
    side, effects = ((work.root / file,) for file in ("user.sys", "mine.py"))
    settings = replace(ROUGH, robot=None, model=work.root / "m.toml", side_files=side, effects=effects)
    assert not work.convert(settings).batch.failed
    assert work.convert(settings).cached == {"One.mod"}
    write(work.root, {name: changed})
    assert work.convert(settings).cached == (set() if again else {"One.mod"})


def test_what_has_no_input_any_more_goes_and_what_is_not_ours_stays(work: Work) -> None:
    write(programs(work.source, 4), {"line0/note.txt": "text", "deep/x.mod": program("X")})
    work.convert()
    write(work.out, {"line1/mine.txt": "mine", SEAM[2]: "edited by hand"})
    work.remove(*SEAM[:3], "line0/note.txt", "deep/x.mod")
    gone = ["deep/x.mod", SEAM[0], "line0/note.txt", SEAM[1]]
    again = work.convert()
    assert again.statuses == {SEAM[3]: "compensated"}
    assert [f"{f.code} {f.message.replace(f'{work.out}/', '')}" for f in again.batch.findings] == [
        *(f"BAT023 `{name}` is deleted: its input is gone" for name in gone),
        f"BAT023 `{SEAM[2]}` comes of no program of this batch",
    ]
    assert again.batch.copied == 0 and work.convert().batch.findings == again.batch.findings[-1:]
    assert set(work.outputs()) == {SEAM[3], "line1/mine.txt", SEAM[2]}
    assert not (work.out / "deep").exists()


def test_a_program_that_fails_leaves_no_old_output(work: Work) -> None:
    programs(work.source, 2)
    work.convert()
    work.write({SEAM[0]: program("Seam0", 9000)})
    for _ in range(2):
        assert work.convert().statuses[SEAM[0]] == "failed"
        assert set(work.outputs()) == {SEAM[1]}
    programs(work.source, 2)
    for each in (work, work.into("fresh")):
        each.convert()
    assert tree(work.out) == tree(work.root / "fresh")


@pytest.mark.parametrize("together", [True, False])
def test_shards_make_the_full_tree(work: Work, together: bool) -> None:
    write(programs(work.source, 9), {f"n{i}.txt": f"{i}" for i in range(5)})
    work.into("full").convert()
    full, union = work.into("full").outputs(), dict[str, str]()
    for index in (3, 1, 2):
        part = work.into("parts" if together else f"part{index}")
        assert 0 < len(part.convert(shard=Shard(index, 3)).told) < 9
        assert together or not union.keys() & part.outputs().keys()
        union |= part.outputs()
    assert union == full
    if together:
        assert len(part.convert().cached) == 9
        work.remove("n3.txt", SEAM[0])
        part.convert()
        assert part.outputs().keys() == full.keys() - {"n3.txt", SEAM[0]}


def test_one_run_owns_a_folder_that_can_be_written(work: Work) -> None:
    programs(work.source, 1)
    with open_tree(work.out, "all"):
        assert work.refusal().code == "BAT003"
    with open_tree(work.out, "1-of-2"):
        work.convert()
    write(work.root, {"file": "no folder"})
    assert work.into("file").refusal().code == "BAT004"


def test_pages_come_with_a_report_and_go_with_their_programs(work: Work) -> None:
    programs(work.source, 2)
    report = work.root / "page.html"
    assert [o.page for o in work.convert().told] == [None, None] and not list(work.out.rglob("*.html"))
    first = work.convert(report=report)
    assert not first.cached, "each lacked its page"
    assert {o.task.name: o.page for o in first.told} == {name: f"report/{name}.html" for name in SEAM[:2]}
    text = (work.out / f"report/{SEAM[0]}.html").read_text("utf-8")
    assert f"postproc compensate {SEAM[0]}" in text and "MODULE Seam0" in text
    for page in (report, None):  # who wants no pages need not convert again
        assert work.convert(report=page).cached == set(SEAM[:2])
    work.remove(SEAM[0])
    work.convert(report=report)
    assert [p.name for p in work.out.rglob("*.html")] == ["Seam1.mod.html"]


def test_a_page_never_overwrites_an_input(tmp_path: Path) -> None:
    mine = f"out/report/{SEAM[0]}.html"
    jobs = f'[[job]]\nfiles = ["{SEAM[0]}"]\nrobot = "{ARM}"\nwith = ["{mine}"]\n'
    write(programs(tmp_path, 1), {mine: module("Mine"), "jobs.toml": jobs})
    work = work_in(tmp_path, "jobs.toml")
    work.convert()
    finding = work.refusal(report=tmp_path / "page.html")
    assert finding.code == "BAT015" and "is the input" in finding.message
    assert (tmp_path / mine).read_text() == module("Mine")
