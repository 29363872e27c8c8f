"""A second run does only what changed; parts of the work together make the whole."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

import pytest

from postproc.batch.records import open_tree
from postproc.batch.values import Shard
from postproc.diagnostics import PostprocError
from postproc.settings import Settings

from .folders import EFFECT, ROUGH, TOOL, cached, convert, planned, program, programs, statuses, tree, write

NAMES = {f"line{i % 3}/Seam{i}.mod" for i in range(4)}


def times(root: Path) -> dict[str, int]:
    return {p.relative_to(root).as_posix(): p.stat().st_mtime_ns for p in root.rglob("*.mod")}


def test_a_second_run_touches_nothing(tmp_path: Path) -> None:
    source, out = write(programs(tmp_path / "in", 4), {"bad.mod": "no module", "note.txt": "text"}), tmp_path / "out"
    first, _ = convert(source, out)
    before, stood = times(out), tree(out)
    second, told = convert(source, out)
    assert cached(second) == {*NAMES, "bad.mod"} and len(told) == 5
    assert (times(out), tree(out)) == (before, stood)
    assert [o.figures for o in second.outcomes] == [o.figures for o in first.outcomes]
    assert second.failed and [o.findings for o in second.outcomes] == [o.findings for o in first.outcomes]


def test_what_changed_is_done_again(tmp_path: Path) -> None:
    source, out = programs(tmp_path / "in", 4), tmp_path / "out"
    convert(source, out)
    write(source, {"line0/Seam0.mod": program("Seam0", 1300)})
    (out / "line1/Seam1.mod").write_text("somebody was here")
    (out / "line2/Seam2.mod").unlink()
    again, _ = convert(source, out)
    assert cached(again) == {"line0/Seam3.mod"}
    fresh, _ = convert(source, tmp_path / "fresh")
    left = {path: content for path, content in tree(out).items() if "/edited/" not in path}
    assert left == tree(tmp_path / "fresh") and not fresh.failed


def test_what_somebody_edited_is_put_aside_before_it_is_written_anew(tmp_path: Path) -> None:
    source, out = programs(tmp_path / "in", 2), tmp_path / "out"
    convert(source, out)
    by_hand = (out / "line0/Seam0.mod").read_bytes() + b"! touched up on the pendant\n"
    (out / "line0/Seam0.mod").write_bytes(by_hand)
    write(source, {"line1/Seam1.mod": program("Seam1", 1300)})
    again, _ = convert(source, out)
    told = {o.task.name: [f.code for f in o.findings] for o in again.outcomes}
    assert told == {"line0/Seam0.mod": ["BAT016"], "line1/Seam1.mod": []}
    assert [p.read_bytes() for p in (out / ".postproc/edited").glob("*/line0/Seam0.mod")] == [by_hand]
    quiet, _ = convert(source, out)
    assert cached(quiet) == {"line0/Seam0.mod", "line1/Seam1.mod"} and not any(o.findings for o in quiet.outcomes)


@pytest.mark.parametrize(
    "settings",
    [
        replace(ROUGH, options=replace(ROUGH.options, force=(100.0, 0.0, 0.0))),
        replace(ROUGH, robot="irb4600_60_205_seed"),
    ],
)
def test_another_model_or_option_does_all_again(tmp_path: Path, settings: Settings) -> None:
    source, out = programs(tmp_path / "in", 2), tmp_path / "out"
    convert(source, out)
    again, _ = convert(source, out, settings)
    assert not cached(again)


@pytest.mark.parametrize("name", ["user.sys", "mine.py"])
def test_code_of_effects_and_files_read_along_count(tmp_path: Path, name: str) -> None:
    source = write(tmp_path / "in", {"One.mod": program("One", tool="")})
    files = write(tmp_path, {"user.sys": f"MODULE user\n{TOOL}\nENDMODULE\n", "mine.py": EFFECT})
    settings = replace(ROUGH, side_files=(files / "user.sys",), effects=(files / "mine.py",))
    first, _ = convert(source, tmp_path / "out", settings)
    assert not first.failed and cached(convert(source, tmp_path / "out", settings)[0]) == {"One.mod"}
    other = {"user.sys": f"MODULE user\n{TOOL.replace('[5,', '[6,')}\nENDMODULE\n", "mine.py": f"{EFFECT}# a note\n"}
    write(tmp_path, {name: other[name]})
    assert not cached(convert(source, tmp_path / "out", settings)[0])


def test_a_model_file_counts_by_what_it_says(tmp_path: Path) -> None:
    text = 'robot = "irb4600_60_205"\n[effects.joint_compliance]\ncompliance_rad_per_Nm = [4e-6, 3e-7, 3e-7, 2e-6, 2e-6, 2e-6]\n'
    source, model = programs(tmp_path / "in", 1), write(tmp_path, {"m.toml": text}) / "m.toml"
    settings = replace(ROUGH, model=model, robot=None)
    convert(source, tmp_path / "out", settings)
    model.write_text("# a note\n" + text)
    again, _ = convert(source, tmp_path / "out", settings)
    assert cached(again) == {"line0/Seam0.mod"}
    model.write_text(text.replace("4e-6", "5e-6"))
    again, _ = convert(source, tmp_path / "out", settings)
    assert not cached(again)


def test_what_has_no_input_any_more_goes_and_what_is_not_ours_stays(tmp_path: Path) -> None:
    source, out = (
        write(programs(tmp_path / "in", 4), {"line0/note.txt": "text", "deep/x.mod": program("X")}),
        tmp_path / "out",
    )
    convert(source, out)
    write(out, {"line1/mine.txt": "mine", "line2/Seam2.mod": "edited by hand"})
    for name in ("line0/Seam0.mod", "line0/note.txt", "line1/Seam1.mod", "line2/Seam2.mod", "deep/x.mod"):
        (source / name).unlink()
    batch, _ = convert(source, out)
    assert statuses(batch) == {"line0/Seam3.mod": "compensated"}
    assert set(tree(out, without=[".postproc"])) == {"line0/Seam3.mod", "line1/mine.txt", "line2/Seam2.mod"}
    assert not (out / "deep").exists()


def test_a_program_that_fails_leaves_no_old_output(tmp_path: Path) -> None:
    source, out = programs(tmp_path / "in", 2), tmp_path / "out"
    convert(source, out)
    write(source, {"line0/Seam0.mod": program("Seam0", 9000)})
    for _ in range(2):
        batch, _ = convert(source, out)
        assert statuses(batch)["line0/Seam0.mod"] == "failed"
        assert set(tree(out, without=[".postproc"])) == {"line1/Seam1.mod"}
    write(source, {"line0/Seam0.mod": program("Seam0", 1150)})
    convert(source, out)
    convert(source, tmp_path / "fresh")
    assert tree(out) == tree(tmp_path / "fresh")


@pytest.mark.parametrize("together", [True, False])
def test_shards_make_the_whole(tmp_path: Path, together: bool) -> None:
    source = write(programs(tmp_path / "in", 9), {f"n{i}.txt": f"{i}" for i in range(5)})
    convert(source, tmp_path / "whole")
    whole = tree(tmp_path / "whole", without=[".postproc"])
    union: dict[str, str] = {}
    for index in (3, 1, 2):
        out = tmp_path / ("parts" if together else f"part{index}")
        batch, _ = convert(source, out, shard=Shard(index, 3))
        assert 0 < len(batch.outcomes) < 9
        part = tree(out, without=[".postproc"])
        assert together or not union.keys() & part.keys()
        union |= part
    assert union == whole
    if together:
        gathered, _ = convert(source, tmp_path / "parts")
        assert len(cached(gathered)) == 9
        (source / "n3.txt").unlink()
        (source / "line0/Seam0.mod").unlink()
        convert(source, tmp_path / "parts")
        assert tree(tmp_path / "parts", without=[".postproc"]).keys() == whole.keys() - {"n3.txt", "line0/Seam0.mod"}


def test_one_run_owns_a_folder(tmp_path: Path) -> None:
    source, out = programs(tmp_path / "in", 1), tmp_path / "out"
    with open_tree(out, "all"), pytest.raises(PostprocError) as caught:
        convert(source, out)
    assert caught.value.diagnostics[0].code == "BAT003"
    with open_tree(out, "1-of-2"):
        convert(source, out)


def test_a_program_called_like_its_listing_keeps_both(tmp_path: Path) -> None:
    files = {"P/P.pgf": "<Program><Module>one.mod</Module></Program>", "P/one.mod": program("One")}
    source, out = write(tmp_path / "in", files), tmp_path / "out"
    for _ in range(2):
        convert(source, out)
        assert set(tree(out, without=[".postproc"])) == set(files)


def test_a_link_to_nothing_is_reported(tmp_path: Path) -> None:
    source = programs(tmp_path / "in", 1)
    (source / "gone.txt").symlink_to(tmp_path / "nowhere")
    (source / "gone.mod").symlink_to(tmp_path / "nowhere")
    os.mkfifo(source / "pipe.mod")
    batch, _ = convert(source, tmp_path / "out")
    assert [f.code for f in batch.findings] == ["BAT002"]
    assert statuses(batch) == {"gone.mod": "failed", "line0/Seam0.mod": "compensated"}


def test_an_output_folder_that_cannot_be_written_is_an_error(tmp_path: Path) -> None:
    source = programs(tmp_path / "in", 1)
    (tmp_path / "out").write_text("a file")
    with pytest.raises(PostprocError) as caught:
        convert(source, tmp_path / "out")
    assert caught.value.diagnostics[0].code == "BAT004"


def test_an_output_folder_inside_the_input_is_not_input(tmp_path: Path) -> None:
    source = programs(tmp_path / "in", 2)
    convert(source, source / "out")
    plan = planned(source, source / "out")
    assert len(plan.tasks) == 2 and not plan.copies
