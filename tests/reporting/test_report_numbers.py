"""All numbers and words of page, paper and console: none in a programming notation."""

from __future__ import annotations

import dataclasses
import io
import re

import pytest
from hostile_pages import Page
from problems_report import closed_loop
from pypdf import PdfReader
from rich.console import Console

from aerosid.flight_model.terms import COEFFICIENTS
from aerosid.loop.result import ClosedLoop
from aerosid.nomenclature import CHANNELS
from aerosid.notation import share
from aerosid.reporting import print_summary, report_html
from aerosid.reporting.page import compose
from aerosid.reporting.paper import report_pdf

COMPUTER = re.compile(r"(?<![\w.])[−-]?\d+(?:\.\d+)?[eE][+-]?\d+(?![\w.])")
SIZES = (1.0349e4, 2.5e7, 3.3e-9, 123456.7)


@pytest.fixture(scope="module")
def result() -> ClosedLoop:
    """Numbers of every magnitude, wherever a table contains one."""
    made = closed_loop(samples=120)
    errors = tuple(
        dataclasses.replace(
            row, declared=size, before=size / 3.0, after=size / 7.0, noise=size / 9e4, trimmed=size / 8.0
        )
        for row, size in zip(made.errors, SIZES * 9, strict=False)
    )
    effects = tuple(
        dataclasses.replace(
            effect,
            value=size,
            std_error=size / 55.0,
            evidence=dataclasses.replace(effect.evidence, likelihood_gain=size, p_value=1e-7),
        )
        for effect, size in zip(made.effects, SIZES, strict=False)
    )
    derivatives = tuple(
        dataclasses.replace(
            row, declared=size, refitted=-size, value=size, std_error=size / 12.0, variance_inflation=size
        )
        for row, size in zip(made.derivatives, SIZES * 9, strict=False)
    )
    screening = tuple(dataclasses.replace(row, gain=size) for row, size in zip(made.screening, SIZES * 9, strict=False))
    fit = tuple(dataclasses.replace(row, theil=1.2e-6, bias=3.4e-11) for row in made.fit)
    tables = dataclasses.replace(made, errors=errors, effects=effects, derivatives=derivatives)
    return dataclasses.replace(tables, screening=screening, fit=fit)


def console_text(result: ClosedLoop) -> str:
    stream = io.StringIO()
    print_summary(result, Console(file=stream, width=160, highlight=False, markup=False))
    return stream.getvalue()


def paper_text(result: ClosedLoop) -> str:
    return " ".join(page.extract_text() for page in PdfReader(io.BytesIO(report_pdf(result, compose(result)))).pages)


@pytest.mark.parametrize(
    "written", [lambda result: Page(report_html(result, interactive=False)).text, paper_text, console_text]
)
def test_no_number_has_the_exponent_of_a_computer(result: ClosedLoop, written) -> None:
    text = written(result)
    assert "10⁷" in text  # large numbers are present
    assert COMPUTER.findall(text) == []
    assert not re.search(r"\d{7,}", re.sub(r"[0-9a-f]{64}", "", text))


@pytest.mark.parametrize(
    ("value", "text"), [(0.0, "0.000"), (2.1e-24, "< 0.001"), (0.00049, "< 0.001"), (0.0123, "0.012"), (1.0, "1.000")]
)
def test_a_share_of_nothing_is_not_a_power_of_ten(value: float, text: str) -> None:
    assert share(value) == text


def test_prose_has_no_names_of_a_program(result: ClosedLoop) -> None:
    """On the page only names of files, and names in the tables of channel sources, contain an underscore."""
    html = re.sub(r"<code[^>]*>.*?</code>", "", report_html(result, interactive=False))
    words = {word.strip(".,;:()'’") for word in Page(html).text.split() if "_" in word}
    files = {"light_transport_doublet", "light_transport_3211", "light_transport", "completed_aircraft.toml"}
    files |= {"flights/light_transport_doublet.csv", "flights/light_transport_3211.csv"}
    files |= {source for log in result.identification for name in log.sources for source in log.sources[name].columns}
    assert words <= files


def test_the_console_names_only_what_files_name(result: ClosedLoop) -> None:
    found = set(re.findall(r"\w*[A-Za-z]_\w+", console_text(dataclasses.replace(result, summary="a control_lag"))))
    known = {*CHANNELS, *COEFFICIENTS, "q_hat", "V_hat", "alpha_dot_hat"}
    assert found <= known | {"light_transport_doublet", "light_transport_3211"}


def test_every_symbol_of_the_flights_is_in_the_glossary(result: ClosedLoop) -> None:
    report = compose(result)
    (glossary,) = (body for section, body in report.parts if section.name == "glossary")
    for log in (*result.identification, *result.validation):
        for name in log.channels:
            assert f"<code>{name}</code>" in glossary
            assert str(CHANNELS[name].name) in glossary
    for term in ("standard error", "log-likelihood difference", "p-value", "open loop", "trimmed", "not significant"):
        assert term in glossary
