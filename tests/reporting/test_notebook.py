"""A result in a notebook: a one-line repr, data frames with every number, a figure, the files."""

from __future__ import annotations

import dataclasses
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from problems_report import closed_loop

import aerosid
from aerosid.errors import UsageError
from aerosid.loop.result import ClosedLoop
from aerosid.reporting.file_names import FILES
from aerosid.reporting.notebook import Result

LONGEST = 400
"""Characters of a repr: a result of two flights had 1,037,305."""


@pytest.fixture(scope="module")
def result() -> Result:
    return Result.of(closed_loop())


class Cells(HTMLParser):
    """Texts of all cells; any tag that does not belong in a table is an error."""

    def __init__(self) -> None:
        super().__init__()
        self.texts: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        assert tag in {"p", "b", "table", "caption", "thead", "tbody", "tr", "th", "td"}, tag
        assert attrs == []

    def handle_data(self, data: str) -> None:
        self.texts.append(data)


def test_a_repr_is_one_line(result: Result) -> None:
    for thing in (result, closed_loop(), result.aircraft, result.identification[0], result.simulated[0]):
        text = repr(thing)
        assert len(text) < LONGEST
        assert "\n" not in text
    assert "explained" in repr(result)
    assert "C_m alpha^2" in repr(result)


def test_frames_hold_what_the_rows_hold(result: Result) -> None:
    derivatives, errors, effects = result.derivatives_frame(), result.errors_frame(), result.effects_frame()
    assert len(derivatives) == len(result.derivatives)
    for row in result.derivatives:
        held = derivatives.loc[(row.coefficient, row.term)]
        assert held["value"] == row.value
        assert held["shown"] == row.shown
    for row in result.errors:
        held = errors.loc[(row.log, row.channel)]
        assert (held["before"], held["after"], held["role"]) == (row.before, row.after, row.role)
        assert held["reduction"] == pytest.approx(row.before / row.after)
    assert list(effects["value"]) == [effect.value for effect in result.effects]
    assert list(effects["p_value"]) == [effect.evidence.p_value for effect in result.effects]
    assert list(effects.index) == [1, 2]
    nothing = dataclasses.replace(result, effects=())
    assert nothing.effects_frame().empty


def test_html_is_tables_of_escaped_texts(result: Result) -> None:
    hostile = "<script>alert(1)</script>&"
    log = dataclasses.replace(result.identification[0], name=hostile)
    first = dataclasses.replace(result.simulated[0], log=log)
    for made in (result, dataclasses.replace(result, summary=hostile, simulated=(first,))):
        parser = Cells()
        parser.feed(made._repr_html_())
        assert any("not significant" in text for text in parser.texts)
    assert hostile in " ".join(parser.texts)


def test_the_figure_holds_the_histories(result: Result) -> None:
    figure = result.plot()
    strips = figure.get_axes()
    simulated = result.simulated[-1]
    assert len(strips) == len(simulated.measured)
    place = list(simulated.measured).index("q")
    drawn = {line.get_label(): line.get_ydata() for line in strips[place].get_lines()}
    np.testing.assert_allclose(drawn["after"], np.degrees(simulated.after["q"]))
    np.testing.assert_allclose(drawn["measured"], np.degrees(simulated.measured["q"]))
    assert simulated.log.name in figure.get_suptitle()
    assert result.identification[0].name in result.plot(result.identification[0].name).get_suptitle()
    with pytest.raises(UsageError, match="no_such_log"):
        result.plot("no_such_log")


def test_write_writes_the_report(result: Result, tmp_path: Path) -> None:
    files = result.write(tmp_path / "made", interactive=False)
    assert {path.name for path in files} <= set(FILES)
    assert {path.name for path in files} == {path.name for path in (tmp_path / "made").iterdir()}


def test_the_public_close_loop_gives_such_a_result() -> None:
    assert aerosid.Result is Result
    assert issubclass(aerosid.Result, ClosedLoop)
    assert aerosid.close_loop.__annotations__["return"] == "Result"
