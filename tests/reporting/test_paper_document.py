"""report.pdf, read back by a library that did not write it."""

from __future__ import annotations

import dataclasses
import io

import numpy as np
import pytest
from hostile_pages import HOSTILE, hostile_result
from problems_report import closed_loop, simulated
from pypdf import PageObject, PdfReader
from pypdf.generic import ContentStream

from aerosid.loop.result import ClosedLoop
from aerosid.loop.verdict import Verdict
from aerosid.reporting.page import compose
from aerosid.reporting.paper import report_pdf


def paper(result: ClosedLoop) -> PdfReader:
    return PdfReader(io.BytesIO(report_pdf(result, compose(result))))


def words(reader: PdfReader) -> str:
    return " ".join(" ".join(page.extract_text() for page in reader.pages).split())


@pytest.fixture(scope="module")
def result() -> ClosedLoop:
    return closed_loop()


@pytest.fixture(scope="module")
def reader(result: ClosedLoop) -> PdfReader:
    return paper(result)


def test_every_sheet_is_a4_and_numbered(reader: PdfReader) -> None:
    for number, page in enumerate(reader.pages, start=1):
        assert [round(float(side) * 25.4 / 72.0) for side in page.mediabox[2:]] == [210, 297]
        assert f"page {number} of {len(reader.pages)}" in page.extract_text()


def test_paper_says_what_the_page_says(result: ClosedLoop, reader: PdfReader) -> None:
    text = words(reader)
    report = compose(result)
    for figure in report.figures:
        assert f"Figure {figure.number}." in text
    wanted = [
        "each lack a term in",
        "the model follows the flight down to the noise",
        result.verdict.value,
        "−1.711 ± 0.019",
        "3.593 ± 0.041",
        "time [s]",
        "α [deg]",
    ]
    wanted += ["These manoeuvres cannot distinguish", "The air density is the aircraft file's, 0.9077 kg/m³"]
    wanted += [result.aircraft.sha256]
    for phrase in wanted:
        assert phrase in text, phrase
    assert "Decision summary" in reader.pages[0].extract_text()
    assert [entry["/Title"] for entry in reader.outline] == [section.title for section, _ in report.parts]


def strokes(page: PageObject, colour: tuple[float, ...]) -> list[np.ndarray]:
    """The corners (M, 2) of every line of a colour, in points of its drawing."""
    found, current, lines = [], (), []
    content = page.get_contents()
    assert content is not None
    for operands, operator in ContentStream(content, page.pdf).operations:
        if operator == b"RG":
            current = tuple(float(number) for number in operands)
        elif operator == b"m":
            lines = [[float(number) for number in operands]]
        elif operator == b"l":
            lines.append([float(number) for number in operands])
        elif operator == b"S" and np.allclose(current, colour, atol=1e-3):
            found.append(np.array(lines))
    return found


def test_the_line_on_paper_is_the_simulated_one(result: ClosedLoop, reader: PdfReader) -> None:
    """The first line of the completed model among the flight's strips is its airspeed, up to a scale."""
    flight = next(simulated for simulated in result.simulated if simulated.role == "validation")
    strips = next(figure for figure in compose(result).figures if figure.chart.timeline == flight.log.name)
    page = next(page for page in reader.pages if f"Figure {strips.number}." in page.extract_text())
    green = tuple(part / 255.0 for part in bytes.fromhex("007a55"))
    corners = next(line for line in strokes(page, green) if len(line) > 100)
    history = flight.after["V"]
    assert len(corners) == history.size
    slope, offset = np.polyfit(corners[:, 1], history, 1)
    assert slope > 0.0
    assert np.max(np.abs(slope * corners[:, 1] + offset - history)) < 0.001 * np.ptp(history)
    assert np.ptp(np.diff(corners[:, 0])) < 0.02
    assert not [image for page in reader.pages for image in page.images]


def test_the_same_result_gives_the_same_paper(result: ClosedLoop) -> None:
    assert report_pdf(result, compose(result)) == report_pdf(closed_loop(), compose(closed_loop()))


def test_hostile_and_unprintable_texts_are_printed_as_texts() -> None:
    assert HOSTILE[:20] in words(paper(hostile_result()))
    made = closed_loop(samples=60, verdict=Verdict.UNEXPLAINED)
    odd = simulated("flight_\udcff", "identification", (1, 1), 60)
    changed = dataclasses.replace(made, identification=(odd.log,), validation=(), simulated=(odd,), effects=())
    assert "flight_\\udcff" in words(paper(changed))


def test_a_long_table_begins_where_its_heading_stands(result: ClosedLoop) -> None:
    """Fifty derivatives fit a page of their own; they must not leave the page before them empty."""
    many = dataclasses.replace(result, derivatives=(*result.derivatives, *[result.derivatives[-1]] * 38))
    pages = [" ".join(page.extract_text().split()) for page in paper(many).pages]
    place = next(i for i, text in enumerate(pages) if "re-estimated completed model" in text)
    assert all("re-estimated completed model" in text for text in pages[place : place + 2])
