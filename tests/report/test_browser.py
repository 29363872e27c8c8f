"""The pages as people use them, in the browser of the system: no errors, no requests, and everything is linked."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from postproc.batch.document import batch_document
from postproc.batch.values import Batch, TaskOutcome
from postproc.compensation.conversion import Conversion
from postproc.compensation.options import Options
from postproc.diagnostics import Source
from postproc.identification.add import add_effects
from postproc.identification.compare import compare
from postproc.model.file import default_model
from postproc.rapid.diff.difference import Difference, FileDiff, ProgramDiff
from postproc.report.page import render_certificate, render_page
from postproc.results.addition import addition_document
from postproc.results.certificate import arm_certificate, program_certificate
from postproc.results.comparison import comparison_document
from postproc.results.conversion import conversion_document
from postproc.results.diagnosis import diagnosis_document
from postproc.results.difference import folders_document
from postproc.runtime.passes import correct_program
from postproc.tasks.task import Task
from tests.bench.programs import program
from tests.report.test_improve import diagnosed, sample

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
QUIET = ("--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
         "--disable-component-update", "--disable-sync")  # fmt: skip
DESKTOP, PHONE = (1400, 1000), (390, 844)
Open = Callable[..., Any]


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    if CHROMIUM is None and not os.environ.get("CI"):
        pytest.skip("no chromium on this machine; continuous integration has one")
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        launched = playwright.chromium.launch(executable_path=CHROMIUM, args=list(QUIET))
        yield launched
        launched.close()


@pytest.fixture
def opened(browser: Any, tmp_path: Path) -> Iterator[Open]:
    """Open a page from its file; what it says on the console and what it asks of the network fails the test."""
    said: list[str] = []
    contexts = []

    def open_page(html: str, size: tuple[int, int] = DESKTOP, **how: Any) -> Any:
        path = tmp_path / "a page.html"
        path.write_text(html, encoding="utf-8")
        contexts.append(browser.new_context(viewport={"width": size[0], "height": size[1]}, offline=True, **how))
        page = contexts[-1].new_page()
        page.on("console", lambda message: said.append(message.text))
        page.on("pageerror", lambda error: said.append(str(error)))
        page.on("request", lambda request: request.url.startswith("file:") or said.append(request.url))
        page.goto(path.as_uri())
        return page

    yield open_page
    for context in contexts:
        context.close()
    assert said == []


@contextmanager
def changes(page: Any, script: str) -> Iterator[None]:
    """What a script tells of the page is something else afterwards."""
    before = page.evaluate(script)
    yield
    page.wait_for_timeout(250)
    assert page.evaluate(script) != before


def picture(selector: str = "canvas") -> str:
    """Script that tells the picture of a canvas."""
    return f"document.querySelector('{selector}').toDataURL()"


def selected(page: Any) -> str:
    return str(page.inner_text('[data-path="statements"] tr[aria-selected="true"] td:nth-child(4)'))


@pytest.fixture(scope="module")
def corrected(seam: Conversion) -> str:
    return render_page(conversion_document("hull_seam.mod", seam))


@pytest.fixture(scope="module")
def improved() -> str:
    return render_page(
        addition_document(
            "cell.toml", add_effects(*sample("simulated_backlash.csv"), ["backlash", "transmission_error"])
        )
    )


def test_everything_on_the_page_of_a_program_shows_the_same_place(opened: Open, corrected: str) -> None:
    page = opened(corrected)
    assert selected(page) == "pSeam90"  # the largest deviation is chosen first
    with changes(page, picture()):
        page.click('[data-path="statements"] tr:has-text("pSeam40")')
    assert "pSeam40" in page.inner_text(".listing .here")
    assert "pSeam40" in page.inner_text('[data-path="deviation"] .readout')
    with changes(page, picture()):
        page.click('.listing button:has-text("ArcL pSeam20")')
    assert selected(page) == "pSeam20"
    with changes(page, "document.querySelector('[data-path=deviation] svg .line').getAttribute('d')"):
        page.click('[data-path="seams"] tr:has-text("rShellSeam")')  # the charts show the seam alone
    chart = page.locator('[data-path="joints"] svg').first
    box = chart.bounding_box()
    page.mouse.click(box["x"] + 0.4 * box["width"], box["y"] + 50)
    assert selected(page) == "pSeam50"
    # A click on the picture: the target that was chosen last is where its ring is.
    page.locator("canvas").scroll_into_view_if_needed()
    page.click("text=from above")
    page.wait_for_timeout(100)
    ring = page.evaluate(
        """() => { const c = document.querySelector("canvas"), d = c.getContext("2d").getImageData(0, 0, c.width, c.height).data;
        let x = 0, y = 0, n = 0;
        for (let i = 0; i < d.length; i += 4) if (d[i] === 26 && d[i + 1] === 86 && d[i + 2] === 176) { x += (i / 4) % c.width; y += Math.floor(i / 4 / c.width); n++; }
        return n > 20; }"""
    )
    assert ring
    page.focus('[data-path="deviation"] svg')
    before = page.inner_text('[data-path="deviation"] .readout')
    page.keyboard.press("ArrowRight")
    assert page.inner_text('[data-path="deviation"] .readout') != before


def test_a_target_is_named_when_it_is_pointed_at(opened: Open, corrected: str) -> None:
    page = opened(corrected)
    canvas = page.locator("canvas")
    canvas.scroll_into_view_if_needed()
    box = canvas.bounding_box()
    places = ((x, y) for x in range(20, int(box["width"]), 25) for y in range(20, int(box["height"]), 25))
    for x, y in places:
        page.mouse.move(box["x"] + x, box["y"] + y)
        if page.is_visible(".tip") and "pSeam" in page.inner_text(".tip"):
            break
    said = page.inner_text(".tip")
    assert "pSeam" in said and "before" in said and "after" in said


def test_slider_view_and_search(opened: Open, corrected: str) -> None:
    page = opened(corrected)
    slider = '[aria-label="how many times as large the deviation is drawn"]'
    with changes(page, picture()):
        page.fill(slider, "80")
    assert "times as large" in page.inner_text('[data-path="controls"] output')
    for button in ("before", "from above", "with the arm"):
        with changes(page, picture()):
            page.click(f'[data-path="controls"] button:text-is("{button}")')
    page.focus("canvas")
    for key in ("ArrowLeft", "ArrowDown", "+"):
        with changes(page, picture()):
            page.keyboard.press(key)
    box = page.locator("canvas").bounding_box()
    with changes(page, picture()):
        page.mouse.move(box["x"] + 100, box["y"] + 100)
        page.mouse.down()
        page.mouse.move(box["x"] + 200, box["y"] + 150)
        page.mouse.up()
    with changes(page, "document.querySelector('[data-path=deviation] svg text:nth-of-type(9)')?.textContent"):
        page.click('[data-path="deviation"] button:text-is("along the length")')
    assert page.get_attribute('[data-path="deviation"] svg', "data-axis") == "length"


def test_twenty_thousand_targets_stay_fluid(opened: Open) -> None:
    """A table of 20,000 rows: few of them are in the document, and search and sort answer at once."""
    figures = ({"max_error_before_mm": 0.1 + i % 977, "max_error_after_mm": 0.001 * (i % 499 + 1), "added_targets": 0}
               for i in range(20_000))  # fmt: skip
    done = tuple(TaskOutcome(Task(f"p{i}.mod", ()), "compensated", False, f, ()) for i, f in enumerate(figures))
    page = opened(render_page(batch_document("cell", Batch(done, 0, ()))))
    assert page.evaluate("document.documentElement.scrollHeight") < 4000
    assert page.locator(".long tbody tr").count() < 200
    page.fill("input[type=search]", "p19999")
    assert page.locator(".long tbody tr:has(td:nth-child(2))").count() == 1
    assert "1 of 20,000" in page.inner_text(".count")
    page.fill("input[type=search]", "")
    page.click(".long th button:has-text('before')")
    top = page.inner_text(".long tbody tr:has(td:nth-child(2)) >> nth=0")
    assert "976.1" in top
    page.evaluate("document.querySelector('.rows').scrollTop = 300000")
    page.wait_for_timeout(100)
    assert (
        page.locator(".long tbody tr").count() < 200
        and page.locator(".long tbody tr:has(td:nth-child(2))").count() > 10
    )


@pytest.fixture(scope="module")
def long_program() -> Conversion:
    return correct_program(Source("long.mod", program(1400)), default_model(), Options())


def test_a_long_program(opened: Open, long_program: Conversion) -> None:
    page = opened(render_page(conversion_document("long.mod", long_program)))
    assert page.evaluate("document.documentElement.scrollHeight") < 4000
    assert page.locator(".code").count() < 100 and page.locator('[data-path="statements"] tbody tr').count() < 100
    page.fill('[data-path="statements"] input[type=search]', "1302")
    page.click('[data-path="statements"] tr:has-text("1302")')
    assert page.inner_text(".listing .here span") == "1302"
    took = page.evaluate(
        """async () => { const start = performance.now(); for (let i = 0; i < 10; i++) {
        document.querySelector("canvas").dispatchEvent(new KeyboardEvent("keydown", {key: "ArrowLeft"}));
        await new Promise(requestAnimationFrame); } return (performance.now() - start) / 10; }"""
    )
    assert took < 500  # [ms] a frame without a graphics card, on a busy machine


def test_watch_the_error_fall(opened: Open, improved: str) -> None:
    page = opened(improved)
    said = '[data-steps="controls"] output'
    assert "+ transmission_error" in page.inner_text(said)
    laws = page.locator('[data-steps="laws"] svg').count()
    assert laws >= 3
    page.fill('[aria-label="step of the model"]', "0")
    page.wait_for_timeout(700)
    assert page.inner_text(said) == "0.144 mm the model as it came"
    assert page.locator('[data-steps="laws"] svg').count() == 0
    base = page.evaluate(picture())
    with changes(page, "document.querySelector('[data-steps=charts]').innerHTML"):
        page.keyboard.press("ArrowRight")
    page.wait_for_timeout(700)
    assert page.evaluate(picture()) != base
    assert page.inner_text(said).endswith("+ backlash")
    assert page.locator('[data-steps="program"] mark').count() > 0
    page.click('[data-step="0"]')
    assert page.inner_text(said).endswith("the model as it came")
    page.click("text=watch the error fall >> nth=0")
    page.wait_for_function(
        "document.querySelector('[data-steps=controls] output').textContent.includes('transmission')", timeout=8000
    )


def test_the_worst_pose_is_shown_with_the_arm(opened: Open, seam: Conversion) -> None:
    page = opened(PAGES["compare"](seam))
    with changes(page, picture()):
        page.click('[data-steps="worst"] tbody tr >> nth=0')
    page.click("summary >> nth=0")
    assert page.locator("details[open] svg").count() > 3


def page_of_a_batch(count: int) -> str:
    """Programs with long names; more than 200 make a long table."""
    figures = ({"max_error_before_mm": 0.1 + i, "max_error_after_mm": 0.001 * (i + 1), "added_targets": 0}
               for i in range(count))  # fmt: skip
    names = (f"stern_section_of_the_hull/program_with_a_really_long_name_{i:04d}.mod" for i in range(count))
    pairs = zip(names, figures, strict=True)
    done = tuple(TaskOutcome(Task(name, ()), "compensated", False, f, ()) for name, f in pairs)
    return render_page(batch_document("cell", Batch(done, 0, ())))


def page_of_folders() -> str:
    """A file that differs in many statements, one that is gone."""
    difference = Difference(
        "changed", "motion", "HullSeam.rShellSeam", "ArcL", 1234, 1240, 0.5, 0.02,
        shift_mm=(0.1, -0.2, 0.4), speed_mm_s=(8.0, 7.0),
    )  # fmt: skip
    found = ProgramDiff((difference,) * 250, 300, 0.5, 0.02)
    files = [
        FileDiff("RAPID/TASK1/PROGMOD/a_program_with_a_really_long_name.mod", "changed", None, found),
        FileDiff("gone.mod", "removed"),
    ]
    return render_page(folders_document("approved", "out", files, (0.001, 0.01)))


def compared() -> Any:
    return compare(default_model(), sample("simulated_backlash.csv")[1])


PAGES: dict[str, Callable[[Conversion], str]] = {
    "compensate": lambda seam: render_page(conversion_document("hull_seam.mod", seam)),
    "certificate": lambda seam: render_certificate(program_certificate("hull_seam.mod", seam)),
    "compare": lambda _: render_page(comparison_document("cell.toml", compared())),
    "arm certificate": lambda _: render_certificate(arm_certificate("cell.toml", compared())),
    "diagnose": lambda _: render_page(diagnosis_document("cell.toml", diagnosed("simulated_backlash.csv"))),
    "unknown": lambda _: render_page(diagnosis_document("cell.toml", diagnosed("simulated_step.csv"))),
    "batch": lambda _: page_of_a_batch(12),
    "long batch": lambda _: page_of_a_batch(250),
    "diff": lambda _: page_of_folders(),
}


@pytest.mark.parametrize("name", PAGES)
def test_on_a_phone_nothing_is_cut_off_or_small(opened: Open, seam: Conversion, name: str) -> None:
    page = opened(PAGES[name](seam), PHONE, color_scheme="light", has_touch=True)
    page.wait_for_timeout(200)
    assert page.evaluate("document.documentElement.scrollWidth") <= PHONE[0]
    small = page.evaluate(
        """() => [...document.querySelectorAll("body *")].filter((e) => e.getClientRects().length && e.textContent.trim()
        && !["SCRIPT", "STYLE"].includes(e.tagName)).map((e) => { const size = parseFloat(getComputedStyle(e).fontSize);
        const svg = e.ownerSVGElement; const scale = svg && svg.viewBox.baseVal.width ? svg.getBoundingClientRect().width / svg.viewBox.baseVal.width : 1;
        return [size * scale, e.tagName, e.textContent.slice(0, 30)]; }).filter(([size]) => size < 11.9)"""
    )
    assert small == []
    cut = page.evaluate(
        """() => [...document.querySelectorAll("svg text")].filter((e) => { const r = e.getBoundingClientRect(), s = e.ownerSVGElement.getBoundingClientRect();
        return r.width && (r.left < s.left - 1 || r.right > s.right + 1); }).map((e) => e.textContent)"""
    )
    assert cut == []
    beside = page.evaluate(
        """() => [...document.querySelectorAll("td")].filter((e) => { const range = document.createRange(); range.selectNodeContents(e);
        const r = range.getBoundingClientRect(), s = e.getBoundingClientRect();
        return r.right > s.right + 1 && getComputedStyle(e).overflowX !== "hidden"; }).map((e) => e.textContent)"""
    )
    assert beside == []
    colors = "[getComputedStyle(document.body).backgroundColor, getComputedStyle(document.body).color]"
    assert page.evaluate(colors) == ["rgb(255, 255, 255)", "rgb(28, 33, 39)"]
    page.emulate_media(color_scheme="dark")
    assert page.evaluate(colors) == ["rgb(20, 24, 29)", "rgb(228, 232, 236)"]


def test_everything_has_a_name_for_who_hears_the_page(opened: Open, corrected: str, improved: str) -> None:
    for html in (corrected, improved):
        page = opened(html)
        nameless = page.evaluate(
            """() => [...document.querySelectorAll("button, input, select, canvas, svg, table, [role=region], a")].filter((e) =>
            !(e.getAttribute("aria-label") || e.textContent.trim() || e.closest("label")?.textContent.trim())).map((e) => e.outerHTML.slice(0, 80))"""
        )
        assert nameless == []
        assert page.evaluate("document.documentElement.lang") == "en"


def test_a_printed_page_has_its_pictures(opened: Open, corrected: str, tmp_path: Path) -> None:
    page = opened(corrected, color_scheme="dark")
    pdf = page.pdf(format="A4")
    assert pdf.startswith(b"%PDF") and pdf.count(b"/Type /Page\n") <= 6
    assert page.evaluate("document.documentElement.classList.contains('paper')") is False
