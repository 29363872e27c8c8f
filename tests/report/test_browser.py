"""The pages as people use them, in the browser of the system: no errors, no requests, and everything is linked."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from postproc.compensation.options import Options
from postproc.diagnostics import Source
from postproc.model.file import default_model
from postproc.report.page import render_certificate, render_page, render_sheet
from postproc.results.certificate import arm_certificate, program_certificate
from postproc.results.improve.addition import addition_document
from postproc.results.improve.comparison import comparison_document
from postproc.results.improve.diagnosis import diagnosis_document
from postproc.results.improve.first_plan import first_plan_document
from postproc.runtime.passes import correct_program
from tests.bench.programs import program
from tests.identification.test_first_plan import planned
from tests.report.build import (
    BACKLASH,
    LONG_NAME,
    STEP,
    added,
    batch_page,
    compared,
    diagnosed,
    folders_page,
    program_page,
    seam,
    two_programs_page,
)

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
QUIET = ("--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-quic", "--no-first-run", "--disable-background-networking",
         "--disable-component-update", "--disable-sync")  # fmt: skip
DESKTOP, PHONE = (1400, 1000), (390, 844)
Open = Callable[..., Any]

INSIDE = """([outer, inner]) => { const [a, b] = [outer, inner].map((name) => document.querySelector(name).getBoundingClientRect());
    return b.width > 0 && b.left >= a.left && b.right <= a.right && b.top >= a.top && b.bottom <= a.bottom; }"""
HEIGHT = "document.documentElement.scrollHeight"
STATEMENTS, DEVIATION = '[data-path="statements"]', '[data-path="deviation"]'
LONG_ROWS, STEP_NAME = ".long tbody tr", '[data-steps="controls"] output'
WITHIN = """() => { const [a, b] = [".space", ".dot"].map((name) => document.querySelector(name).getBoundingClientRect());
    return [b.left - a.left, b.top - a.top]; }"""
TURN = """async () => { for (let i = 0; i < 10; i++) {
    document.querySelector("canvas").dispatchEvent(new KeyboardEvent("keydown", {key: "ArrowLeft"}));
    await new Promise(requestAnimationFrame); } }"""
NAMELESS = """() => [...document.querySelectorAll("button, input, select, canvas, svg, table, [role=region], a")].filter((e) =>
    !(e.getAttribute("aria-label") || e.textContent.trim() || e.closest("label")?.textContent.trim())).map((e) => e.outerHTML.slice(0, 80))"""
SMALL = """() => [...document.querySelectorAll("body *")].filter((e) => e.getClientRects().length && e.textContent.trim()
    && !["SCRIPT", "STYLE"].includes(e.tagName)).map((e) => { const size = parseFloat(getComputedStyle(e).fontSize);
    const svg = e.ownerSVGElement; const scale = svg && svg.viewBox.baseVal.width ? svg.getBoundingClientRect().width / svg.viewBox.baseVal.width : 1;
    return [size * scale, e.tagName, e.textContent.slice(0, 30)]; }).filter(([size]) => size < 11.9)"""
CUT_LABELS = """() => [...document.querySelectorAll("svg text")].filter((e) => { const r = e.getBoundingClientRect(), s = e.ownerSVGElement.getBoundingClientRect();
    return r.width && (r.left < s.left - 1 || r.right > s.right + 1); }).map((e) => e.textContent)"""
CUT_CELLS = """() => [...document.querySelectorAll("td")].filter((e) => { const range = document.createRange(); range.selectNodeContents(e);
    const r = range.getBoundingClientRect(), s = e.getBoundingClientRect();
    return r.right > s.right + 1 && getComputedStyle(e).overflowX !== "hidden"; }).map((e) => e.textContent)"""
COLORS = "[getComputedStyle(document.body).backgroundColor, getComputedStyle(document.body).color]"


PAGES: dict[str, Callable[[], str]] = {
    "compensate": lambda: program_page(seam(), "hull_seam.mod"),
    "certificate": lambda: render_certificate(program_certificate("hull_seam.mod", seam())),
    "compare": lambda: render_page(comparison_document("cell.toml", compared())),
    "arm certificate": lambda: render_certificate(arm_certificate("cell.toml", compared())),
    "add": lambda: render_page(addition_document("cell.toml", added("backlash", "transmission_error"))),
    "diagnose": lambda: render_page(diagnosis_document("cell.toml", diagnosed(BACKLASH))),
    "unknown": lambda: render_page(diagnosis_document("cell.toml", diagnosed(STEP))),
    "batch": lambda: batch_page(f"{LONG_NAME}_{i:04d}.mod" for i in range(12)),
    "long batch": lambda: batch_page(f"{LONG_NAME}_{i:04d}.mod" for i in range(250)),
    "diff": folders_page,
    "two programs": two_programs_page,
    "sheet": lambda: render_sheet(first_plan_document("irb4600_60_205", planned("gauge", load=30.0))),
}


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
    """Open a page from its file; a message on the console or a request to the network fails the test."""
    messages: list[str] = []
    contexts = []

    def open_page(html: str, size: tuple[int, int] = DESKTOP, before: str = "", **how: Any) -> Any:
        path = tmp_path / "a page.html"
        path.write_text(html, encoding="utf-8")
        contexts.append(browser.new_context(viewport={"width": size[0], "height": size[1]}, offline=True, **how))
        contexts[-1].set_default_timeout(20_000)
        contexts[-1].add_init_script(before)
        page = contexts[-1].new_page()
        page.on("console", lambda message: messages.append(message.text))
        page.on("pageerror", lambda error: messages.append(str(error)))
        page.on("request", lambda request: request.url.startswith("file:") or messages.append(request.url))
        page.goto(path.as_uri())
        return page

    yield open_page
    for context in contexts:
        context.close()
    assert messages == []


def picture(page: Any) -> bytes:
    return bytes(page.locator(".space").first.screenshot())


@contextmanager
def changes(page: Any, script: str | None = None) -> Iterator[None]:
    """The picture, or the value of a script on the page, is another one afterwards."""

    def seen() -> object:
        return picture(page) if script is None else page.evaluate(script)

    before = seen()
    yield
    page.wait_for_timeout(250)
    assert seen() != before


def selected(page: Any) -> str:
    return str(page.inner_text(f'{STATEMENTS} tr[aria-selected="true"] td[data-label="target"]'))


def chart_range(page: Any) -> str:
    """What the axes and the legend of the first chart say, drawn on its canvas."""
    return str(page.evaluate("document.querySelector('[data-path=deviation] .uplot canvas').toDataURL()"))


def test_everything_on_the_page_of_a_program_shows_the_same_place(opened: Open) -> None:
    page = opened(PAGES["compensate"]())
    assert selected(page) == "pSeam90"  # the largest deviation of a weld is chosen first
    with changes(page):
        page.click(f'{STATEMENTS} tr:has-text("pSeam40")')
    assert all("pSeam40" in page.inner_text(place) for place in (".listing .here", ".tag:not(.dot)"))
    assert page.evaluate("document.querySelector('.dot').getBoundingClientRect().top") >= 0  # in sight beside a table
    with changes(page):
        page.click('.listing button:has-text("ArcL pSeam20")')
    assert selected(page) == "pSeam20"
    whole = chart_range(page)
    page.click('[data-path="seams"] tr:has-text("rShellSeam")')  # the charts show the seam alone
    assert chart_range(page) != whole
    over = page.locator('[data-path="joints"] .u-over').first
    box = over.bounding_box()
    over.click(position={"x": 0.5 * box["width"], "y": 50})
    assert selected(page) == "pSeam50"
    assert page.evaluate(INSIDE, [".space", ".dot"])  # where the chosen place is
    page.focus(f"{DEVIATION} figure")
    with changes(page, f"document.querySelector('{DEVIATION} .u-legend').innerText"):
        for _ in range(3):
            page.keyboard.press("ArrowRight")


def test_a_target_is_named_when_it_is_pointed_at(opened: Open) -> None:
    page = opened(PAGES["compensate"]())
    box = page.locator(".dot").bounding_box()
    page.mouse.move(box["x"] + 6, box["y"] + 6)
    page.mouse.move(box["x"] + 7, box["y"] + 6)
    assert all(word in page.inner_text(".tip") for word in ("pSeam", "before", "after"))


def test_slider_buttons_keys_and_mouse_change_the_picture(opened: Open) -> None:
    page = opened(PAGES["compensate"]())
    with changes(page):
        page.fill('[aria-label="how many times as large the deviation is drawn"]', "80")
    assert "times as large" in page.inner_text('[data-path="legend"] output')
    for button in ("before", "from above", "whole arm"):
        with changes(page):
            page.click(f'[data-path="controls"] button:text-is("{button}")')
    page.focus("canvas")
    for key in ("ArrowLeft", "ArrowDown", "+"):
        with changes(page):
            page.keyboard.press(key)
    box = page.locator("canvas").first.bounding_box()
    with changes(page):
        page.mouse.move(box["x"] + 100, box["y"] + 100)
        page.mouse.down()
        page.mouse.move(box["x"] + 200, box["y"] + 150)
        page.mouse.up()
    along_time = chart_range(page)
    page.click(f'{DEVIATION} button:text-is("along the length")')
    assert chart_range(page) != along_time


def test_the_address_says_place_and_view_and_charts_are_saved(opened: Open) -> None:
    page = opened(PAGES["compensate"]())
    page.click(f'{STATEMENTS} tr:has-text("pSeam40")')
    page.click("text=from above")
    page.wait_for_function("location.hash.includes('place=') && location.hash.includes('view=')")
    shown, address = page.evaluate(WITHIN), page.url
    page.goto("about:blank")
    page.goto(address)
    page.wait_for_timeout(300)
    assert selected(page) == "pSeam40" and page.evaluate(WITHIN) == pytest.approx(shown, abs=1.0)
    with page.expect_download() as saved:
        page.click(f'{DEVIATION} [aria-label$="as CSV"] >> nth=0')
    rows = saved.value.path().read_text("utf-8").splitlines()
    assert rows[0] == "time [s],length [m],before [mm],in the model after [mm]"
    assert max(float(row.split(",")[2] or 0) for row in rows[1:]) == pytest.approx(0.452, abs=0.001)
    with page.expect_download() as saved:
        page.click(f'{DEVIATION} [aria-label$="as PNG"] >> nth=0')
    assert saved.value.path().read_bytes().startswith(b"\x89PNG")


def test_without_webgl_the_page_says_so_and_shows_its_charts(opened: Open) -> None:
    page = opened(PAGES["compensate"](), before="HTMLCanvasElement.prototype.getContext = new Proxy("
        "HTMLCanvasElement.prototype.getContext, {apply: (f, c, [kind, ...more]) => kind === 'webgl2' ? null : f.call(c, kind, ...more)})")  # fmt: skip
    assert "no WebGL" in page.inner_text(".space") and page.locator(".u-over").count() == 5
    page.click(f'{STATEMENTS} tr:has-text("pSeam40")')
    assert "pSeam40" in page.inner_text(".listing .here")


def test_a_table_of_twenty_thousand_rows_is_searched_and_sorted_at_once(opened: Open) -> None:
    page = opened(batch_page(f"p{i}.mod" for i in range(20_000)))
    filled = page.locator(f"{LONG_ROWS}:has(td:nth-child(2))")
    assert page.evaluate(HEIGHT) < 4000 and page.locator(LONG_ROWS).count() < 200  # few rows are in the document
    page.fill("input[type=search]", "p19999")
    assert filled.count() == 1 and "1 of 20,000" in page.inner_text(".count")
    page.fill("input[type=search]", "")
    page.click(".long th button:has-text('before')")
    assert "976.1" in filled.first.inner_text()
    page.evaluate("document.querySelector('.rows').scrollTop = 300000")
    page.wait_for_timeout(100)
    assert page.locator(LONG_ROWS).count() < 200 and filled.count() > 10


def test_a_long_program_is_searched_and_turned_at_once(opened: Open) -> None:
    page = opened(program_page(correct_program(Source("long.mod", program(1400)), default_model(), Options())))
    assert page.evaluate(HEIGHT) < 4000
    assert page.locator(".code").count() < 100 and page.locator(f"{STATEMENTS} tbody tr").count() < 100
    page.fill(f"{STATEMENTS} input[type=search]", "1302")
    page.click(f'{STATEMENTS} tr:has-text("1302")')
    assert page.inner_text(".listing .here span") == "1302"
    metrics = page.context.new_cdp_session(page)
    metrics.send("Performance.setTimeDomain", {"timeDomain": "threadTicks"})
    metrics.send("Performance.enable")

    def script_seconds() -> float:
        known = metrics.send("Performance.getMetrics")["metrics"]
        return float(next(entry["value"] for entry in known if entry["name"] == "ScriptDuration"))

    page.evaluate(TURN)
    before = script_seconds()
    page.evaluate(TURN)
    assert (script_seconds() - before) / 10 < 0.02  # processor time of a frame [s]: 50 frames a second


def test_the_error_falls_from_step_to_step_of_a_model(opened: Open) -> None:
    """A page opens with the model as it came beside the last one, and all of it follows the step."""
    page = opened(PAGES["add"]())
    evidence, charts = page.locator('[data-steps="evidence"] svg'), page.locator('[data-steps="charts"]')
    assert page.inner_text(STEP_NAME) == "0.145 \u2192 0.029 mm" and evidence.count() >= 4
    assert charts.locator(".came").count() == charts.locator(".found").count() > 0
    both = picture(page)
    page.click('[data-shows="0"]')
    page.wait_for_timeout(700)
    base = picture(page)
    assert page.inner_text(STEP_NAME) == "0.145 mm" and evidence.count() == 1 and base != both
    assert charts.locator(".found").count() == 0
    with changes(page, "document.querySelector('[data-steps=evidence]').innerHTML"):
        page.click('[data-step="1"]')  # its bar
    page.wait_for_timeout(700)
    assert picture(page) not in (both, base) and page.locator('[data-steps="program"] mark').count() > 0
    page.wait_for_function("location.hash.includes('step=1')")
    page.evaluate("document.activeElement.blur()")
    page.keyboard.press("ArrowRight")
    assert page.get_attribute('[data-shows="2"]', "aria-pressed") == "true"
    with page.expect_download() as saved:
        page.click('[data-steps="charts"] [data-save="csv"] >> nth=0')
    assert len(saved.value.path().read_text("utf-8").splitlines()) > 100
    page.click("text=watch the error fall >> nth=0")
    assert page.inner_text(STEP_NAME) == "0.145 mm"
    page.wait_for_selector('[data-shows="2"][aria-pressed="true"]', timeout=8000)


def test_a_difference_is_shown_in_both_paths(opened: Open) -> None:
    page = opened(PAGES["two programs"]())
    marks = page.locator('.differences tr[aria-selected="true"]')
    assert (
        "RelTool(pSeam90,0,0,-60)" in marks.inner_text() and marks.locator("mark").count() >= 2
    )  # the largest is chosen first
    with changes(page):
        page.click('.differences tr:has-text("pSeam40")')
    lines, moved = (marks.locator("td").nth(k).inner_text().splitlines()[0] for k in (0, 1))
    assert page.inner_text(".space .tag:not(.dot)") == f"line {lines}: {moved} mm"
    with changes(page):
        page.fill('[aria-label="how many times as large the distance is drawn"]', "80")


def test_the_worst_pose_is_shown_with_the_arm(opened: Open) -> None:
    page = opened(PAGES["compare"]())
    with changes(page):
        page.click('[data-steps="worst"] tbody tr >> nth=0')
    page.click("summary >> nth=0")
    assert page.locator("details[open] svg").count() > 3


@pytest.mark.parametrize("name", PAGES)
def test_on_a_phone_nothing_is_cut_off_or_small(opened: Open, name: str) -> None:
    page = opened(PAGES[name](), PHONE, color_scheme="light", has_touch=True)
    page.wait_for_timeout(200)
    assert page.evaluate("document.documentElement.scrollWidth") <= PHONE[0]
    assert [page.evaluate(script) for script in (SMALL, CUT_LABELS, CUT_CELLS)] == [[], [], []]
    assert page.evaluate(COLORS) == ["rgb(255, 255, 255)", "rgb(28, 33, 39)"]
    page.emulate_media(color_scheme="dark")
    assert page.evaluate(COLORS) == ["rgb(20, 24, 29)", "rgb(228, 232, 236)"]


def test_everything_has_a_name_for_who_hears_the_page(opened: Open) -> None:
    for page in map(opened, (PAGES["compensate"](), PAGES["add"]())):
        assert page.evaluate(NAMELESS) == [] and page.evaluate("document.documentElement.lang") == "en"


def test_a_sheet_is_one_printed_page(opened: Open) -> None:
    pdf = opened(PAGES["sheet"]()).pdf(prefer_css_page_size=True, format="A4")
    assert pdf.startswith(b"%PDF") and pdf.count(b"/Type /Page\n") == 1


def test_a_printed_page_has_its_pictures(opened: Open) -> None:
    page = opened(PAGES["compensate"](), color_scheme="dark")
    pdf = page.pdf(format="A4")
    assert pdf.startswith(b"%PDF") and pdf.count(b"/Type /Page\n") <= 6
    assert page.evaluate("document.documentElement.classList.contains('paper')") is False
