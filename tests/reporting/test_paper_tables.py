"""Tables on paper: a long narrow one is set in two halves next to each other, and nothing is lost."""

from __future__ import annotations

import io

import pytest
from pypdf import PdfReader
from reportlab.platypus import SimpleDocTemplate

from aerosid.reporting.paper.elements import parsed
from aerosid.reporting.paper.tables import table

WIDTH = 510.0


def set_on_paper(html: str) -> list[tuple[float, float, str]]:
    """Every text on the first sheet: across, down, text; pt."""
    tree = parsed(html)
    (element,) = tree.all("table")
    stream = io.BytesIO()
    SimpleDocTemplate(stream).build([table(element, WIDTH)])
    reader = PdfReader(stream)
    assert len(reader.pages) == 1
    found: list[tuple[float, float, str]] = []

    def visit(text: str, cm: list[float], tm: list[float], _font: object, _size: float) -> None:
        if text.strip():
            found.append((tm[4] + cm[4], -(tm[5] + cm[5]), text.strip()))

    reader.pages[0].extract_text(visitor_text=visit)
    return found


def rows_of(count: int, text: str) -> str:
    body = "".join(f"<tr><td>{text}{n}</td><td>{n}.5</td></tr>" for n in range(count))
    return f"<table><thead><tr><th>name</th><th>value</th></tr></thead><tbody>{body}</tbody></table>"


@pytest.mark.parametrize("count", [13, 20, 31])
def test_a_long_narrow_table_stands_in_two_halves_read_down_the_left_first(count: int) -> None:
    found = set_on_paper(rows_of(count, "row"))
    assert sum(text == "name" for _, _, text in found) == 2
    names = sorted((across, down, text) for across, down, text in found if text.startswith("row"))
    assert [text for *_, text in names] == [f"row{n}" for n in range(count)]
    assert len({across for across, _, _ in names}) == 2


@pytest.mark.parametrize(
    "html",
    [
        rows_of(12, "row"),
        rows_of(20, "a name that alone takes more than half of the width of the sheet, whatever stands beside it, "),
    ],
)
def test_a_short_or_a_wide_table_stays_whole(html: str) -> None:
    assert sum(text == "name" for _, _, text in set_on_paper(html)) == 1


def test_rows_below_a_group_s_name_stay_below_it() -> None:
    html = rows_of(20, "row").replace("<tbody>", '<tbody><tr class="group"><td colspan="2">group</td></tr>')
    assert sum(text == "name" for _, _, text in set_on_paper(html)) == 1
