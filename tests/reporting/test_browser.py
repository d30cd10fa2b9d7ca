"""report.html in a headless Chromium: it loads nothing, logs no errors, draws every figure and zooms it."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import browser
import pytest
from hostile_pages import HOSTILE, hostile_result
from problems_report import closed_loop

from aerosid.loop.result import ClosedLoop
from aerosid.reporting import report_html
from aerosid.reporting.page import compose

pytestmark = [
    pytest.mark.skipif(bool(browser.missing()), reason=f"no browser: {browser.missing()}"),
    pytest.mark.filterwarnings("ignore::ResourceWarning", "ignore::DeprecationWarning"),  # the driver's own
]

RANGES = """
return [...document.querySelectorAll('.live')].map(
  (e) => ({id: e.closest('figure').id, time: e.layout.xaxis.range, height: e.getBoundingClientRect().height,
           lines: e.querySelectorAll('.scatterlayer .trace').length,
           expected: e.data.filter((t) => t.visible !== false).length}));
"""


def opened(driver: Any, result: ClosedLoop, folder: Path, *, interactive: bool = True) -> None:
    """The page of the result in the browser, every figure drawn."""
    from selenium.webdriver.support.wait import WebDriverWait

    page = folder / "report.html"
    page.write_text(report_html(result, interactive=interactive), encoding="utf-8")
    browser.requests(driver)
    browser.complaints(driver)
    driver.get(page.as_uri())
    if interactive:
        state = "return document.documentElement.dataset.figures"
        WebDriverWait(driver, 60).until(lambda d: d.execute_script(state) is not None)
        assert driver.execute_script(state) == "drawn"


@pytest.fixture(scope="module")
def started(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    with browser.chromium(tmp_path_factory.mktemp("profile")) as driver:
        yield driver


@pytest.fixture
def driver(started: Any) -> Any:
    browser.shaped(started)
    return started


def test_every_figure_is_drawn_and_names_stay_text_without_a_request_or_a_complaint(
    driver: Any, tmp_path: Path
) -> None:
    """On a result in which every name is an injection attempt."""
    result = hostile_result()
    opened(driver, result, tmp_path)
    driver.execute_script("document.querySelectorAll('details').forEach((fold) => { fold.open = true; })")
    figures = driver.execute_script(RANGES)
    composed = compose(result).figures
    assert {figure["id"] for figure in figures} == {figure.identity for figure in composed if figure.chart.timeline}
    still = driver.find_elements("css selector", "figure:not(.is-live) .drawing > svg")
    assert len(figures) + len(still) == len(driver.find_elements("css selector", "figure")) == len(composed)
    assert all(drawing.is_displayed() for drawing in still)
    for figure in figures:
        assert figure["lines"] == figure["expected"] > 0, figure["id"]
        assert figure["height"] > 300.0
    assert driver.execute_script("return document.images.length + document.querySelectorAll('svg image').length") == 0
    words = driver.execute_script("return [...document.querySelectorAll('.live text')].map((e) => e.textContent)")
    assert any(text.startswith(HOSTILE[:12]) for text in words)
    assert driver.execute_script("return document.documentElement.scrollWidth") <= 1280
    assert browser.complaints(driver) == []
    assert browser.requests(driver) == []


def test_charts_of_one_flight_are_zoomed_together_by_pointer_button_and_key(driver: Any, tmp_path: Path) -> None:
    from selenium.webdriver import ActionChains, Keys
    from selenium.webdriver.support.wait import WebDriverWait

    result = closed_loop(samples=200)
    opened(driver, result, tmp_path)
    fitted, other = (log.name for log in (*result.identification, *result.validation))
    charts = compose(result).figures
    own = [figure.identity for figure in charts if figure.chart.timeline == fitted]
    theirs = [figure.identity for figure in charts if figure.chart.timeline == other]
    assert len(own) == 3  # d(t) and two strip charts
    assert len(theirs) == 2

    def times() -> dict[str, tuple[float, float]]:
        return {figure["id"]: tuple(figure["time"]) for figure in driver.execute_script(RANGES)}

    def until(happened: Any) -> dict[str, tuple[float, float]]:
        WebDriverWait(driver, 20).until(lambda _: happened(times()))
        return times()

    start = times()
    plot = driver.find_element("css selector", f"#{theirs[0]} .live .nsewdrag")
    driver.execute_script("arguments[0].scrollIntoView({block: 'center'})", plot)
    width = plot.size["width"]
    drag = ActionChains(driver).move_to_element_with_offset(plot, -width // 4, 0).click_and_hold()
    drag.move_by_offset(width // 4, 0).move_by_offset(width // 4, 0).release().perform()
    zoomed = until(lambda now: now[theirs[1]] != start[theirs[1]])
    assert zoomed[theirs[0]] == pytest.approx(zoomed[theirs[1]])
    length = start[theirs[0]][1] - start[theirs[0]][0]
    assert zoomed[theirs[0]][1] - zoomed[theirs[0]][0] == pytest.approx(0.5 * length, rel=0.05)
    assert all(zoomed[name] == start[name] for name in own)
    button = driver.find_element("xpath", f"//*[@id='{theirs[1]}']//button[text()='Whole flight']")
    driver.execute_script("arguments[0].scrollIntoView({block: 'center'})", button)
    button.click()
    until(lambda now: now == start)
    driver.find_element("css selector", f"#{own[1]} .live").send_keys("+", Keys.ARROW_RIGHT)
    keyed = until(lambda now: now[own[0]] == now[own[2]] and now[own[0]][0] > length / 3)
    assert keyed[own[1]] == pytest.approx((0.375 * length, 0.875 * length), rel=1e-6)
    assert browser.complaints(driver) == []


@pytest.mark.slow
def test_a_line_that_is_switched_off_goes(driver: Any, tmp_path: Path) -> None:
    opened(driver, closed_loop(samples=80), tmp_path)
    before = driver.execute_script(RANGES)
    driver.find_element("id", "show-declared").click()
    after = driver.execute_script(RANGES)
    gone = [old["expected"] - new["expected"] for old, new in zip(before, after, strict=True)]
    assert gone == [0, 4, 3, 4, 3]  # none in d(t); in each other figure one line per channel


@pytest.mark.slow
def test_without_scripts_the_still_figures_are_there(driver: Any, tmp_path: Path) -> None:
    page = tmp_path / "report.html"
    result = closed_loop(samples=80)
    page.write_text(report_html(result), encoding="utf-8")
    driver.execute_cdp_cmd("Emulation.setScriptExecutionDisabled", {"value": True})
    try:
        driver.get(page.as_uri())
        drawings = driver.find_elements("css selector", ".drawing > svg")
        assert len(drawings) == len(compose(result).figures)
        shown = [drawing.rect for drawing in drawings if drawing.is_displayed()]  # the others are collapsed
        assert len(shown) > 6
        assert all(place["height"] > 150 and place["width"] > 600 for place in shown)
        assert not driver.find_elements("css selector", ".live")
        assert browser.complaints(driver) == []
    finally:
        driver.execute_cdp_cmd("Emulation.setScriptExecutionDisabled", {"value": False})


@pytest.mark.slow
@pytest.mark.parametrize(("width", "dark"), [(400, True), (1280, False)])
def test_text_stands_out_nothing_hangs_over_and_paper_gets_still_figures(
    driver: Any, tmp_path: Path, width: int, dark: bool
) -> None:
    """Contrast of every text with its background is at least 4.5 (WCAG 2.2, 1.4.3)."""
    browser.shaped(driver, width, dark=dark)
    result = closed_loop(samples=80)
    opened(driver, result, tmp_path)
    assert driver.execute_script("return document.documentElement.scrollWidth") <= width
    poor = driver.execute_script((Path(__file__).parents[1] / "contrast.js").read_text(encoding="utf-8"))
    assert poor == []
    background = "return getComputedStyle(document.body).backgroundColor"
    assert driver.execute_script(background) == ("rgb(20, 23, 27)" if dark else "rgb(255, 255, 255)")
    browser.shaped(driver, width, dark=dark, paper=True)
    shown = driver.execute_script(
        "return ['.drawing', '.live', '.controls'].map((name) => [...document.querySelectorAll(name)]"
        ".filter((e) => getComputedStyle(e).display !== 'none').length)"
    )
    assert shown == [len(compose(result).figures), 0, 0]
    assert browser.complaints(driver) == []
