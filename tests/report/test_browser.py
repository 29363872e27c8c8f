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
from postproc.identification.planning.plan import plan_poses
from postproc.model.file import default_model
from postproc.report.page import render_certificate, render_page, render_sheet
from postproc.results.certificate import arm_certificate, program_certificate
from postproc.results.improve.addition import addition_document
from postproc.results.improve.comparison import comparison_document
from postproc.results.improve.diagnosis import diagnosis_document
from postproc.results.improve.first_plan import first_plan_document
from postproc.results.improve.fit import fit_document
from postproc.results.improve.plan import plan_document
from postproc.runtime.passes import correct_program
from tests.bench.programs import program
from tests.identification.test_first_plan import planned
from tests.report.build import (
    BACKLASH,
    LONG_NAME,
    added,
    batch_page,
    compared,
    diagnosed,
    folders_page,
    program_page,
    sample,
    seam,
    two_programs_page,
)

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
# Without a graphics card the processor puts pages together faster by itself than through the drawing of WebGL.
QUIET = ("--no-sandbox", "--disable-gpu-compositing", "--disable-gpu-rasterization", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-quic", "--no-first-run", "--disable-background-networking",
         "--disable-component-update", "--disable-sync")  # fmt: skip
DESKTOP, SMALL_WINDOW, PHONE, PAPER = (1400, 1000), (1000, 560), (390, 844), (703, 1000)
Open = Callable[..., Any]

INSIDE = """([outer, inner]) => { const [a, b] = [outer, inner].map((name) => document.querySelector(name).getBoundingClientRect());
    return b.width > 0 && b.left >= a.left && b.right <= a.right && b.top >= a.top && b.bottom <= a.bottom; }"""
HEIGHT = "document.documentElement.scrollHeight"
STATEMENTS, DEVIATION, LISTING = '[data-path="statements"]', '[data-path="deviation"]', '[data-path="text"]'
LONG_ROWS, STEP_NAME = ".long tbody tr", '[data-steps="controls"] output'
TICK = """() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))"""
NO_WEBGL = """HTMLCanvasElement.prototype.getContext = new Proxy(HTMLCanvasElement.prototype.getContext,
    {apply: (f, c, [kind, ...more]) => kind === "webgl2" ? null : f.call(c, kind, ...more)})"""
NO_DRAWING = """for (const name of ["drawArrays", "drawElements", "drawArraysInstanced", "drawElementsInstanced", "clear"])
    WebGL2RenderingContext.prototype[name] = () => {};"""
COUNT_DRAWING = """window.drawing = {calls: 0, uploads: 0}; for (const [names, key] of [[["drawArrays", "drawElements", "drawArraysInstanced",
    "drawElementsInstanced"], "calls"], [["bufferData", "bufferSubData", "texImage2D", "texSubImage2D", "texSubImage3D"], "uploads"]])
    for (const name of names) { const gl = WebGL2RenderingContext.prototype, f = gl[name]; gl[name] = function (...a) { drawing[key]++; return f.apply(this, a); }; }"""
TURN = """async () => { for (let i = 0; i < 10; i++) {
    document.querySelector("canvas").dispatchEvent(new KeyboardEvent("keydown", {key: "ArrowLeft", code: "ArrowLeft"}));
    await new Promise(requestAnimationFrame); } }"""
# What is wrong with what can be seen on a page.
NAMELESS = """() => [...document.querySelectorAll("button, input, select, canvas, svg, table, [role=region], a")].filter((e) =>
    !(e.getAttribute("aria-label") || e.textContent.trim() || e.closest("label")?.textContent.trim())).map((e) => e.outerHTML.slice(0, 80))"""
SMALL = """() => [...document.querySelectorAll("body *")].filter((e) => e.getClientRects().length && e.textContent.trim()
    && !["SCRIPT", "STYLE"].includes(e.tagName)).map((e) => { const size = parseFloat(getComputedStyle(e).fontSize);
    const svg = e.ownerSVGElement; const scale = svg && svg.viewBox.baseVal.width ? svg.getBoundingClientRect().width / svg.viewBox.baseVal.width : 1;
    return [size * scale, e.tagName, e.textContent.slice(0, 30)]; }).filter(([size]) => size < 11.9)"""
CUT_LABELS = """() => [...document.querySelectorAll("svg text")].filter((e) => { const r = e.getBoundingClientRect(), s = e.ownerSVGElement.getBoundingClientRect();
    return r.width && (r.left < s.left - 1 || r.right > s.right + 1); }).map((e) => e.textContent)"""
OVERFLOWING = """() => [...document.querySelectorAll("main *, .what *")].filter((e) => { const text = [...e.childNodes].filter((n) => n.nodeType === 3 && n.data.trim());
    if (!text.length || !e.getClientRects().length || e.closest("svg, .unseen, thead, .ticks, .scale, .uplot, .axes, .tag")) return false;
    let box = e; while (getComputedStyle(box).display.startsWith("inline")) box = box.parentElement;
    const range = document.createRange(), s = box.getBoundingClientRect();
    const scrolls = (p) => p && (["auto", "scroll", "hidden"].includes(getComputedStyle(p).overflowX) || scrolls(p.parentElement));
    return text.some((n) => { range.selectNodeContents(n); const r = range.getBoundingClientRect(); return r.right > s.right + 1 || (r.bottom > s.bottom + 6); }) && !scrolls(e);
    }).map((e) => [e.tagName, e.className, e.textContent.slice(0, 60)])"""
OVERLAPPING = """() => { const boxes = [...document.querySelectorAll("h1, h2, h3, summary, p, dl, table, .rows, .bars, .parameters, figure, .controls, .tools, .space")]
    .filter((e) => e.getClientRects().length && !e.closest(".unseen, .bar, .view")).map((e) => [e, e.getBoundingClientRect()]);
    return boxes.flatMap(([a, r], i) => boxes.slice(i + 1).filter(([b, s]) => Math.min(r.right, s.right) - Math.max(r.left, s.left) > 2
        && Math.min(r.bottom, s.bottom) - Math.max(r.top, s.top) > 2 && !a.contains(b) && !b.contains(a)
        && [a, b].every((e) => { const p = e.parentElement.closest(".rows"); return !p || getComputedStyle(p).overflowY === "visible"; })).map(([b]) => [a.outerHTML.slice(0, 60), b.outerHTML.slice(0, 60)])); }"""
EMPTY = """() => [0, 1].flatMap((half) => { const from = half * innerWidth / 2, to = from + innerWidth / 2;
    const spans = [...document.querySelectorAll("h1, h2, p, dl, .rows, .bars, .parameters, svg, .course, .view, .controls, summary")].map((e) => e.getBoundingClientRect())
        .filter((r) => r.width && Math.min(r.right, to) - Math.max(r.left, from) > 100).map((r) => [r.top, r.bottom]).sort((a, b) => a[0] - b[0]);
    let end = 0, most = 0; for (const [a, b] of spans) { most = Math.max(most, a - end); end = Math.max(end, b); }
    return Math.max(most, document.querySelector("main").getBoundingClientRect().bottom - end); })"""
COLORS = "[getComputedStyle(document.body).backgroundColor, getComputedStyle(document.body).color]"


PAGES: dict[str, Callable[[], str]] = {
    "compensate": lambda: program_page(seam(), "hull_seam.mod"),
    "certificate": lambda: render_certificate(program_certificate("hull_seam.mod", seam())),
    "compare": lambda: render_page(comparison_document("cell.toml", compared())),
    "arm certificate": lambda: render_certificate(arm_certificate("cell.toml", compared())),
    "add": lambda: render_page(addition_document("cell.toml", added("backlash", "transmission_error"))),
    "diagnose": lambda: render_page(diagnosis_document("cell.toml", diagnosed(BACKLASH))),
    "fit": lambda: render_page(fit_document("cell.csv", added("backlash", "transmission_error").fit)),
    "plan": lambda: render_page(plan_document("cell.toml", plan_poses(*sample(BACKLASH), 3))),
    "batch": lambda: batch_page(f"{LONG_NAME}_{i:04d}.mod" for i in range(12)),
    "long batch": lambda: batch_page(f"{LONG_NAME}_{i:04d}.mod" for i in range(250)),
    "diff": folders_page,
    "two programs": two_programs_page,
    "sheet": lambda: render_sheet(first_plan_document("irb4600_60_205", planned("gauge", load=30.0))),
}
PRINTED = ("certificate", "arm certificate", "sheet")  # in a column of a sheet's width


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    if CHROMIUM is None and not os.environ.get("CI"):
        pytest.skip("no chromium on this machine; continuous integration has one")
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        launched = playwright.chromium.launch(executable_path=CHROMIUM, args=list(QUIET))
        yield launched
        launched.close()


@contextmanager
def pages_of(browser: Any, folder: Path) -> Iterator[Open]:
    """Open pages from their files; a message on the console or a request to the network fails the test."""
    messages: list[str] = []
    contexts = []

    def open_page(html: str, size: tuple[int, int] = SMALL_WINDOW, before: str = NO_WEBGL, **how: Any) -> Any:
        path = folder / "a page.html"
        path.write_text(html, encoding="utf-8")
        contexts.append(browser.new_context(viewport={"width": size[0], "height": size[1]}, offline=True, **how))
        contexts[-1].set_default_timeout(20_000)
        contexts[-1].add_init_script(before)
        page = contexts[-1].new_page()
        # The driver, not the page, remarks that software rendering reads pixels back.
        page.on("console", lambda message: "GL Driver Message" in message.text or messages.append(message.text))
        page.on("pageerror", lambda error: messages.append(str(error)))
        page.on("request", lambda request: request.url.startswith("file:") or messages.append(request.url))
        page.goto(path.as_uri())
        return page

    yield open_page
    for context in contexts:
        context.close()
    assert messages == []


@pytest.fixture
def opened(browser: Any, tmp_path: Path) -> Iterator[Open]:
    with pages_of(browser, tmp_path) as open_page:
        yield open_page


@pytest.fixture(scope="module")
def drawn(browser: Any, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    """The page of a program with its picture, for all tests that change what it shows."""
    with pages_of(browser, tmp_path_factory.mktemp("drawn")) as open_page:
        yield open_page(PAGES["compensate"](), before="")


@contextmanager
def changes(page: Any, script: str = "") -> Iterator[None]:
    """The picture, or the value of a script on the page, is another one afterwards."""

    def seen() -> object:
        page.evaluate(TICK)
        return page.evaluate(script) if script else page.locator(".space").first.screenshot()

    before = seen()
    yield
    assert seen() != before


def selected(page: Any) -> str:
    return str(page.inner_text(f'{STATEMENTS} tr[aria-selected="true"] td[data-label="target"]'))


def chart_range(page: Any, k: int = 0) -> str:
    """What the axes of a chart say, drawn on its canvas."""
    return str(page.evaluate(f"document.querySelectorAll('.uplot canvas')[{k}].toDataURL()"))


def saved(page: Any, button: str) -> bytes:
    """What a click on a button saves."""
    with page.expect_download() as download:
        page.evaluate(f"document.querySelector('{button}').click()")
    return bytes(download.value.path().read_bytes())


def test_everything_on_the_page_of_a_program_shows_the_same_place(drawn: Any) -> None:
    assert selected(drawn) == "pSeam90"  # the largest deviation of a weld is chosen first
    with changes(drawn):
        drawn.click(f'{STATEMENTS} tr:has-text("pSeam40")')
    assert "pSeam40" in drawn.inner_text(".tag:not(.dot)")
    assert "pSeam40" in drawn.inner_text(f'{LISTING} tr[aria-selected="true"]')
    assert drawn.evaluate("document.querySelector('.dot').getBoundingClientRect().top") >= 0  # in sight beside a table
    drawn.click(f'{LISTING} tr:has-text("ArcL pSeam20")')
    assert selected(drawn) == "pSeam20"
    whole = chart_range(drawn)
    drawn.click('[data-path="seams"] tr:has-text("rShellSeam")')  # the charts show the seam alone
    assert chart_range(drawn) != whole
    over = drawn.locator('[data-path="joints"] .u-over').first
    over.click(position={"x": 0.5 * over.bounding_box()["width"], "y": 50})
    assert selected(drawn) == "pSeam50"
    assert drawn.evaluate(INSIDE, [".space", ".dot"])  # where the chosen place is
    drawn.focus(f"{DEVIATION} figure")
    with changes(drawn, f"document.querySelector('{DEVIATION} .u-legend').innerText"):
        for _ in range(3):
            drawn.keyboard.press("ArrowRight")


def test_a_target_is_named_when_it_is_pointed_at(drawn: Any) -> None:
    drawn.click(f'{STATEMENTS} tr:has-text("pSeam40")')
    drawn.evaluate(TICK)
    box = drawn.locator(".dot").bounding_box()
    drawn.mouse.move(box["x"] + 6, box["y"] + 6)
    drawn.mouse.move(box["x"] + 7, box["y"] + 6)
    assert all(word in drawn.inner_text(".tip") for word in ("pSeam", "before", "after"))


def test_slider_buttons_keys_and_mouse_change_the_picture(drawn: Any) -> None:
    with changes(drawn):
        drawn.fill('[aria-label="how many times as large the deviation is drawn"]', "80")
    assert "times as large" in drawn.inner_text('[data-path="legend"] output')
    for button in ("before", "whole arm", "from above", "from the side"):
        with changes(drawn):
            drawn.click(f'[data-path="controls"] button:text-is("{button}")')
    drawn.focus("canvas")
    for key in ("ArrowLeft", "ArrowDown", "+"):
        with changes(drawn):
            drawn.keyboard.press(key)
    box = drawn.locator("canvas").first.bounding_box()
    with changes(drawn):
        drawn.mouse.move(box["x"] + 100, box["y"] + 100)
        drawn.mouse.down()
        drawn.mouse.move(box["x"] + 200, box["y"] + 150)
        drawn.mouse.up()


def test_charts_are_zoomed_together(drawn: Any) -> None:
    for button in ("along the length", "along the time", "whole program"):
        drawn.click(f'{DEVIATION} button:text-is("{button}")')
    before = [chart_range(drawn, k) for k in (0, 4)]
    box = drawn.locator(f"{DEVIATION} .u-over").first.bounding_box()
    drawn.mouse.move(box["x"] + 100, box["y"] + 30)
    drawn.mouse.down()
    drawn.mouse.move(box["x"] + 180, box["y"] + 30)
    drawn.mouse.up()
    drawn.evaluate(TICK)
    after = [chart_range(drawn, k) for k in (0, 4)]
    assert all(a != b for a, b in zip(before, after, strict=True))
    drawn.click(f'{DEVIATION} button:text-is("whole program")')


def test_the_address_says_place_and_view_and_charts_are_saved(drawn: Any) -> None:
    drawn.click(f'{STATEMENTS} tr:has-text("pSeam40")')
    drawn.click('[data-path="controls"] button:text-is("from above")')
    drawn.wait_for_timeout(250)  # the address is written a moment later
    assert "place=" in drawn.url and "view=" in drawn.url
    within = """() => { const [a, b] = [".space", ".dot"].map((name) => document.querySelector(name).getBoundingClientRect());
        return [b.left - a.left, b.top - a.top]; }"""
    drawn.evaluate(TICK)
    shown, address = drawn.evaluate(within), drawn.url
    drawn.goto("about:blank")
    drawn.goto(address)
    drawn.evaluate(TICK)
    assert selected(drawn) == "pSeam40" and drawn.evaluate(within) == pytest.approx(shown, abs=1.0)
    rows = saved(drawn, f'{DEVIATION} [aria-label$="as CSV"]'.replace("'", '"')).decode().splitlines()
    assert rows[0] == "time [s],length [m],before [mm],in the model after [mm]"
    assert max(float(row.split(",")[2] or 0) for row in rows[1:]) == pytest.approx(0.452, abs=0.001)
    assert saved(drawn, '.course [aria-label$="as PNG"]').startswith(b"\x89PNG")


def test_a_printed_page_has_its_pictures(drawn: Any) -> None:
    drawn.emulate_media(color_scheme="dark")
    pdf = drawn.pdf(format="A4")
    assert pdf.startswith(b"%PDF") and pdf.count(b"/Type /Page\n") <= 6
    assert drawn.evaluate("document.documentElement.classList.contains('paper')") is False


def test_without_webgl_the_page_says_so_and_shows_its_charts(opened: Open) -> None:
    page = opened(PAGES["compensate"]())
    assert "no WebGL" in page.inner_text(".space") and page.locator(".u-over").count() == 5
    page.click(f'{STATEMENTS} tr:has-text("pSeam40")')
    assert "pSeam40" in page.inner_text(f'{LISTING} tr[aria-selected="true"]')


def test_a_program_of_a_batch_is_named_with_the_decimals_of_its_tolerance(opened: Open) -> None:
    page = opened(batch_page(f"p{i}.mod" for i in range(3)))
    names = [each.get_attribute("aria-label") for each in page.locator(".dumbbell").all()]
    assert names[0] == "before 2.10 mm, after in the model 0.00 mm, tolerance 0.10 mm, on the arm not known"


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
    """Turning it takes little of the processor, few calls, and sends nothing to the graphics card again."""
    page = opened(
        program_page(correct_program(Source("long.mod", program(700)), default_model(), Options())),
        before=COUNT_DRAWING,
    )
    assert page.evaluate(HEIGHT) < 4000
    assert page.locator(f"{LISTING} tr").count() < 100 and page.locator(f"{STATEMENTS} tbody tr").count() < 100
    page.fill(f"{STATEMENTS} input[type=search]", "702")
    page.click(f'{STATEMENTS} tr:has-text("702")')
    assert page.inner_text(f'{LISTING} tr[aria-selected="true"] span') == "702"
    metrics = page.context.new_cdp_session(page)
    metrics.send("Performance.setTimeDomain", {"timeDomain": "threadTicks"})
    metrics.send("Performance.enable")

    def script_seconds() -> float:
        known = metrics.send("Performance.getMetrics")["metrics"]
        return float(next(entry["value"] for entry in known if entry["name"] == "ScriptDuration"))

    page.evaluate(TURN)
    page.evaluate("Object.assign(drawing, {calls: 0, uploads: 0})")
    before = script_seconds()
    page.evaluate(TURN)
    assert (script_seconds() - before) / 10 < 0.02  # processor time of a frame [s]: 50 frames a second
    drawing = page.evaluate("drawing")
    assert 0 < drawing["calls"] / 10 < 50 and drawing["uploads"] == 0
    page.wait_for_timeout(100)
    assert page.evaluate("drawing.calls") == drawing["calls"]  # nothing is drawn while nothing changes


def test_the_error_falls_from_step_to_step_of_a_model(opened: Open) -> None:
    """A page opens with the model as it came beside the last one, and all of it follows the step."""
    page = opened(PAGES["add"](), before="", reduced_motion="reduce")
    evidence, charts = page.locator('[data-steps="evidence"] svg'), page.locator('[data-steps="charts"]')
    assert page.inner_text(STEP_NAME) == "0.145 \u2192 0.029 mm" and evidence.count() >= 4
    assert charts.locator(".came").count() == charts.locator(".found").count() > 0
    with changes(page):
        page.click('[data-shows="0"]')
    assert page.inner_text(STEP_NAME) == "0.145 mm" and evidence.count() == 1
    assert charts.locator(".found").count() == 0
    with changes(page, "document.querySelector('[data-steps=evidence]').innerHTML"), changes(page):
        page.click('[data-step="1"]')  # its bar
    assert page.locator('[data-steps="program"] mark').count() > 0
    page.wait_for_function("location.hash.includes('step=1')")
    page.evaluate("document.activeElement.blur()")
    page.keyboard.press("ArrowRight")
    assert page.get_attribute('[data-shows="2"]', "aria-pressed") == "true"
    page.click("text=watch the error fall >> nth=0")
    page.wait_for_selector('[data-shows="0"][aria-pressed="true"]')
    page.wait_for_selector('[data-shows="2"][aria-pressed="true"]', timeout=8000)


def test_a_difference_is_shown_in_both_paths(opened: Open) -> None:
    page = opened(PAGES["two programs"](), before="")
    marks = page.locator('.differences tr[aria-selected="true"]')
    # The largest is chosen first.
    assert "RelTool(pSeam90,0,0,-60)" in marks.inner_text() and marks.locator("mark").count() >= 2
    with changes(page):
        page.click('.differences tr:has-text("pSeam40")')
    lines, moved = (marks.locator("td").nth(k).inner_text().splitlines()[0] for k in (0, 1))
    assert page.inner_text(".space .tag:not(.dot)") == f"line {lines}: {moved} mm"
    with changes(page):
        page.fill('[aria-label="how many times as large the distance is drawn"]', "80")


def test_the_worst_pose_is_shown_with_the_arm(opened: Open) -> None:
    page = opened(PAGES["compare"](), before="")
    with changes(page):
        page.click('[data-steps="worst"] tbody tr >> nth=0')
    with changes(page):
        page.fill('[aria-label="how many times as large the residuals are drawn"]', "80")
    page.click("summary >> nth=0")
    assert page.locator("details[open] svg").count() > 3


@pytest.mark.parametrize("name", PAGES)
def test_a_page_is_whole_on_a_desk_and_on_a_phone(opened: Open, name: str) -> None:
    """Nothing is cut off, small, nameless or over something else; its link is copied, and its charts are saved."""
    without = NO_DRAWING if name == "compensate" else NO_WEBGL
    page = opened(PAGES[name](), DESKTOP, before=without, color_scheme="light", has_touch=True)
    if name not in PRINTED:
        assert max(page.evaluate(EMPTY)) < 420  # both halves are used
    page.evaluate("document.querySelectorAll('details').forEach((e) => { e.open = true; })")
    for width, height in (DESKTOP, PHONE):
        page.set_viewport_size({"width": width, "height": height})
        page.evaluate(TICK)
        assert page.evaluate("document.documentElement.scrollWidth") <= width
        wrong = {check: page.evaluate(check) for check in (NAMELESS, SMALL, CUT_LABELS, OVERFLOWING, OVERLAPPING)}
        assert {check: found for check, found in wrong.items() if found} == {}
    page.set_viewport_size({"width": PAPER[0], "height": PAPER[1]})
    page.emulate_media(media="print")
    page.evaluate("dispatchEvent(new Event('beforeprint'))")
    assert page.evaluate("document.documentElement.scrollWidth") <= PAPER[0] and page.evaluate(OVERLAPPING) == []
    page.evaluate("dispatchEvent(new Event('afterprint'))")
    page.emulate_media(media="screen")
    assert page.evaluate(COLORS) == ["rgb(255, 255, 255)", "rgb(28, 33, 39)"]
    page.emulate_media(color_scheme="dark")
    assert page.evaluate(COLORS) == ["rgb(20, 24, 29)", "rgb(228, 232, 236)"]
    assert page.evaluate("document.documentElement.lang") == "en"
    if name not in PRINTED:
        page.emulate_media(color_scheme="light")
        page.evaluate("navigator.clipboard.writeText = async (text) => { window.copied = text; }")
        page.click("text=copy link")
        assert page.evaluate("window.copied === location.href && location.pathname.endsWith('page.html')")
    charts, saves = page.locator("figure").count(), page.locator("figure .exports button")
    assert 2 * charts == saves.count() and (charts or name not in ("compensate", "compare", "add", "diagnose", "fit"))
    for kind in ("drawn", "course"):
        if page.locator(f"figure.{kind}").count():
            assert len(saved(page, f'figure.{kind} [aria-label$="as CSV"]').splitlines()) > 20
            assert saved(page, f'figure.{kind} [aria-label$="as PNG"]').startswith(b"\x89PNG")


def test_a_sheet_is_one_printed_page(opened: Open) -> None:
    pdf = opened(PAGES["sheet"]()).pdf(prefer_css_page_size=True, format="A4")
    assert pdf.startswith(b"%PDF") and pdf.count(b"/Type /Page\n") == 1


def test_the_boxes_of_a_sheet_hold_their_words_on_a_phone(opened: Open) -> None:
    page = opened(PAGES["sheet"](), PHONE)
    cut = "[...document.querySelectorAll('td')].filter((e) => e.scrollHeight > e.clientHeight + 1).length"
    assert page.evaluate("document.querySelectorAll('td.box').length") == 48 and page.evaluate(cut) == 0
    assert page.evaluate("document.documentElement.scrollWidth") <= PHONE[0]
