"""Sheets of the report: no word or number broken in a table, no sheet half empty, every strip with scale and unit."""

from __future__ import annotations

import dataclasses
import io
import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from problems_report import closed_loop
from pypdf import PageObject, PdfReader
from reportlab.pdfbase.pdfmetrics import stringWidth
from reportlab.platypus import CondPageBreak, LongTable, Paragraph

from aerosid.loop.model_validation.goodness import CorrelationMatrix
from aerosid.loop.result import ClosedLoop
from aerosid.reporting.figures.chart import Chart, Line
from aerosid.reporting.figures.layout import Row, Tile, parted, scale, stacked, tick_texts, tiled
from aerosid.reporting.page import compose
from aerosid.reporting.paper import report_pdf
from aerosid.reporting.paper.blocks import allow_breaks
from aerosid.reporting.paper.elements import parsed
from aerosid.reporting.paper.typeface import registered, style

MOST_SHEETS = 9
FOOT = 70.0
"""pt, above the line with the number of the sheet."""


def paper(result: ClosedLoop) -> PdfReader:
    return PdfReader(io.BytesIO(report_pdf(result, compose(result))))


@pytest.fixture(scope="module")
def eight_seconds() -> ClosedLoop:
    """One flight of 8 s, every 0.03 s."""
    return closed_loop(samples=267, validated=False)


def lowest_text(page: PageObject) -> float:
    """Height, pt above the sheet's edge, of the lowest text above its footer."""
    heights = [842.0]

    def visit(text: str, _matrix: list[float], place: list[float], _font: object, _size: float) -> None:
        if text.strip() and place[5] > FOOT:
            heights.append(place[5])

    page.extract_text(visitor_text=lambda t, cm, tm, f, s: visit(t, cm, [*tm[:4], tm[4] + cm[4], tm[5] + cm[5]], f, s))
    return min(heights)


def test_eight_seconds_of_flight_take_nine_sheets(eight_seconds: ClosedLoop) -> None:
    assert len(paper(eight_seconds).pages) <= MOST_SHEETS


@pytest.mark.parametrize("validated", [False, True])
def test_no_sheet_but_the_last_is_half_empty(validated: bool) -> None:
    pages = paper(closed_loop(validated=validated)).pages
    for number, page in enumerate(pages[:-1], start=1):
        assert lowest_text(page) < 0.5 * 842.0, number


def wide(result: ClosedLoop) -> ClosedLoop:
    """Names and numbers of the greatest length, in every column of the derivative table."""
    rows = tuple(
        dataclasses.replace(
            row, value=-12345.678, std_error=0.01234, filter_error=-12345.678, filter_error_std_error=0.1
        )
        for row in result.derivatives
    )
    return dataclasses.replace(result, derivatives=rows)


@pytest.mark.parametrize("change", [lambda result: result, wide])
def test_no_word_and_no_number_of_a_table_is_broken(eight_seconds: ClosedLoop, change) -> None:
    made = change(eight_seconds)
    reader = paper(made)
    printed = set(" ".join(page.extract_text() for page in reader.pages).split())
    report = compose(made)
    for body in (report.title, *(body for _, body in report.parts)):
        tree = parsed(re.sub(r"<svg .*?</svg>", "", str(body), flags=re.DOTALL))
        for tag in ("td", "th"):
            for cell in tree.all(tag):
                plain = all(isinstance(child, str) for child in cell.children)
                for word in cell.text().split() if plain and "track" not in cell.classes else ():
                    if len(word) < 25:
                        assert word in printed, (word, cell.text())


def test_every_strip_has_a_scale_and_a_unit(eight_seconds: ClosedLoop) -> None:
    strips = [
        panel for figure in compose(eight_seconds).figures if figure.chart.timeline for panel in figure.chart.panels
    ]
    assert len(strips) > 12
    for panel in strips:
        assert len(panel.y.ticks) >= 2, panel.y.label
        assert re.search(r"\[.+\]$", panel.y.label), panel.y.label
        assert panel.marks


@given(st.floats(-1e6, 1e6), st.floats(1e-6, 1e6), st.integers(2, 6))
def test_a_scale_has_two_numbers_within_its_limits(low: float, span: float, most: int) -> None:
    high = low + span
    if high - low < 1e-9 * max(abs(low), 1.0):
        return
    found = scale((low, high), most)
    assert len(found) >= 2
    assert all(low - 1e-6 * span <= tick <= high + 1e-6 * span for tick in found)


@given(st.floats(1e-6, 1e4), st.floats(-3.0, 3.0), st.integers(2, 3))
def test_numbers_below_a_tile_do_not_touch_one_another(span: float, low: float, columns: int) -> None:
    limits = (low * span, (low + 1.0) * span)
    points = np.array(limits)
    chart = tiled([Tile("x", "y", limits, (0.0, 1.0), (Line(points, points, "after"),))] * columns, columns)
    panel = chart.panels[0]
    texts = tick_texts(panel.x.ticks)
    places = panel.width * (np.array(panel.x.ticks) - limits[0]) / span
    half = np.array([0.5 * stringWidth(text, registered(), 7.5) for text in texts])
    assert len(texts) >= 1
    assert np.all(np.diff(places) > half[1:] + half[:-1])


@given(st.floats(1e-6, 1e4), st.floats(-3.0, 3.0), st.floats(24.0, 80.0))
def test_numbers_beside_a_strip_do_not_touch_one_another(span: float, low: float, height: float) -> None:
    limits = (low * span, (low + 1.0) * span)
    time = np.array([0.0, 1.0])
    line = Line(time, np.array(limits), "after")
    (panel,) = stacked([Row(height, 4.0, "x [m]", limits, (line,))], (0.0, 1.0), "flight").panels
    assert len(panel.y.ticks) >= 2
    assert np.all(np.diff(panel.y.ticks) * panel.height / span > 6.5)


def strips(groups: int) -> Chart:
    time = np.linspace(0.0, 8.0, 50)
    rows = []
    for n in range(groups):
        rows.append(Row(60.0, 12.0, f"x{n} [m]", (-1.0, 1.0), (Line(time, np.sin(n + time), "after"),)))
        rows.append(Row(30.0, 4.0, f"Δx{n} [m]", (-1.0, 1.0), (Line(time, np.cos(n + time), "after"),), quiet=True))
    return stacked(rows, (0.0, 8.0), "flight")


@given(st.integers(1, 9), st.floats(0.0, 1200.0))
def test_a_parted_chart_loses_nothing(groups: int, room: float) -> None:
    whole = strips(groups)
    parts = parted(whole, room)
    if parts is None:
        return
    first, second = parts
    assert first.height <= room
    labels = [panel.y.label for panel in (*first.panels, *second.panels)]
    assert labels == [panel.y.label for panel in whole.panels]
    for part in parts:
        assert not part.panels[0].quiet
        assert [panel.x.bare for panel in part.panels] == [True] * (len(part.panels) - 1) + [False]
        bottoms = np.array([panel.bottom for panel in part.panels])
        assert np.all(np.diff(bottoms) < 0.0)
        assert bottoms[-1] > 0.0
        assert part.panels[0].bottom + part.panels[0].height < part.height


def test_a_chart_is_parted_where_enough_fits() -> None:
    assert parted(strips(7), 10_000.0) is not None
    assert parted(strips(7), 400.0) is not None
    assert parted(strips(7), 120.0) is None


def test_the_paper_is_the_same_whether_or_not_the_page_was_drawn(eight_seconds: ClosedLoop) -> None:
    assert report_pdf(eight_seconds, compose(eight_seconds, inline=False)) == report_pdf(
        eight_seconds, compose(eight_seconds)
    )


@pytest.mark.parametrize("count", [3, 7, 8])
def test_tiles_with_one_axis_are_marked_below_the_lowest_also_when_parted(count: int) -> None:
    limits = (0.0, 20.0)
    points = np.array(limits)
    tile = Tile("lag", "y", limits, (0.0, 1.0), (Line(points, points, "after"),))
    whole = tiled([tile] * count, 4, 52.0, shared=True)
    assert [panel.x.bare for panel in whole.panels] == [i + 4 < count for i in range(count)]
    parts = parted(whole, 110.0)
    assert (parts is None) is (count <= 4)
    for part in parts or ():
        assert not any(panel.x.bare for panel in part.panels)
        assert min(panel.bottom for panel in part.panels) >= 24.0


def test_a_text_between_heading_and_long_table_stays_with_its_table() -> None:
    heading = Paragraph("Heading", style(10.0, together=True))
    text = Paragraph("text", style(8.0))
    rows = LongTable([["row"]] * 40)
    first, *others = allow_breaks([heading, text, rows])
    assert isinstance(first, CondPageBreak)
    assert others == [heading, text, rows]
    long = Paragraph("a long text " * 100, style(8.0))
    assert [type(part) for part in allow_breaks([heading, long])] == [CondPageBreak, Paragraph, Paragraph]


@given(st.floats(1e-4, 1e4))
def test_tick_values_of_a_low_symmetric_strip_are_what_they_say(reach: float) -> None:
    """Its outer two alone may remain, with a step of 1 from -0.5 to 0.5: no decimal of the step is needed there."""
    chart = stacked([Row(14.0, 0.0, "Δp [deg/s]", (-reach, reach), ())], (0.0, 30.0), "a flight")
    values = chart.panels[0].y.ticks
    texts = tick_texts(values)
    assert len(values) >= 2
    assert "−0" not in texts
    if not any("·" in text for text in texts):
        assert [float(text.replace("−", "-")) for text in texts] == pytest.approx(values, rel=1e-6)


def test_outer_tick_values_of_a_low_strip_keep_their_decimals() -> None:
    assert tick_texts((-0.5, 0.5)) == ["−0.5", "0.5"]
    assert tick_texts((-0.25, 0.25)) == ["−0.25", "0.25"]
    assert tick_texts((-0.2, 0.0, 0.2)) == ["−0.2", "0.0", "0.2"]


@pytest.mark.parametrize("count", [16, 24, 30])
def test_no_correlation_of_a_large_model_is_broken(count: int) -> None:
    names = tuple(f"C_{'XYZlmn'[n % 6]} delta_{'ear'[n % 3]}" for n in range(count))
    values = -0.97 * np.ones((count, count)) + 1.97 * np.eye(count)
    values[::3] = np.clip(values[::3], -0.08, None)
    result = dataclasses.replace(
        closed_loop(samples=60), correlation=CorrelationMatrix(names, tuple(map(tuple, values.tolist())))
    )
    text = " ".join(" ".join(sheet.extract_text().split()) for sheet in paper(result).pages)
    body = text.partition("Correlations of the estimates")[2].partition("From the covariance")[0]
    assert "estimate" in body
    below = values[np.tril_indices(count, -1)]
    shown = below if count <= 24 else below[np.abs(below) >= 0.5]
    assert len(re.findall(r"−0\.97(?!\d)", body)) == int(np.sum(shown == -0.97))
    assert not re.search(r"−0\.(?!\d)", body)
