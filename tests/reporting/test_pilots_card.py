"""The pilot's card in cockpit quantities: pressure altitude, calibrated airspeed, stick, load factor, footnotes."""

from __future__ import annotations

import dataclasses
import re

import numpy as np
import pytest
from hostile_pages import Page
from problems_report import closed_loop

from aerosid.loop.next_flight.planned_flight import (
    NextFlight,
    PlannedHistory,
    PlannedInput,
    PlannedPeak,
    PlannedStep,
    Question,
)
from aerosid.loop.result import ClosedLoop
from aerosid.reporting import report_html

TIME = np.linspace(0.0, 10.0, 501)
KNOT = 1852.0 / 3600.0


def planned(*, given: bool) -> PlannedInput:
    """A doublet at 3000 m and 120 m/s, with 1.6 g in the pull and 0.4 g in the push."""
    load = np.where((TIME > 1.0) & (TIME < 3.0), 1.6, np.where((TIME >= 3.0) & (TIME < 5.0), 0.4, 1.0))
    return PlannedInput(
        name="doublet",
        steps=(PlannedStep(1.0, 2.0, -0.03, "delta_e"), PlannedStep(3.0, 2.0, 0.03, "delta_e")),
        amplitude=0.03,
        rate=0.5,
        time=TIME,
        deflections={"delta_e": np.zeros_like(TIME)},
        peaks=(
            PlannedPeak("n_z", "1", 1.0, 0.4, 1.6, 0.2, 1.8, given),
            PlannedPeak("V", "m/s", 120.0, 115.0, 125.0, 100.0, 140.0, False),
            PlannedPeak("q", "rad/s", 0.0, -0.1, 0.1, None, None, False),
        ),
        airspeed=120.0,
        density=0.90925,
        expected={"a_z": PlannedHistory("m/s^2", -9.80665 * load, None)},
        rival="",
    )


def flown_next(*, given: bool) -> ClosedLoop:
    question = Question("alternative", "C_m alpha^2", "control_lag of delta_e", 3.0, 40.0, 20.0, 0.97, 1, "")
    ahead = NextFlight(planned(given=given), (question,), 12, "")
    return dataclasses.replace(closed_loop(samples=60), next_flight=ahead)


def card(result: ClosedLoop) -> str:
    html = report_html(result, interactive=False)
    return " ".join(Page(html[html.index('<article class="card"') : html.index("</article>") + 10]).text.split())


def test_the_card_is_in_pilots_quantities() -> None:
    text = card(flown_next(given=True))
    # Standard day, 3000 m = 9843 ft, density 0.90925 kg/m^3: 120 m/s are 202 kt CAS.
    for words in (
        "202 kt CAS",
        "9840 ft",
        "pull 1.6",
        "push 0.4",
        "Purpose: distinguish C m α 2 from control lag of δ e",
    ):
        assert words in text, words
    assert "120 ft lower for each °C" in text
    assert "calibrated airspeed kt 202 193 to 210" in text
    assert "rad" not in text
    assert "m/s" not in text


@pytest.mark.parametrize("given", [True, False])
def test_every_footnote_has_its_sign_and_every_sign_its_footnote(given: bool) -> None:
    text = card(flown_next(given=given))
    assert "0.20 to 1.80 " + ("†" if given else "‡") in text
    assert ("† limit given" in text) == given
    assert text.count("†") == (2 if given else 0)
    assert text.count("‡") == (2 if given else 3)


def test_every_table_stands_in_a_region_that_scrolls_on_a_phone() -> None:
    html = report_html(flown_next(given=True), interactive=False)
    before = html.split("<table")[:-1]
    assert len(before) > 8
    for text in before:
        assert re.search(r'<div class="wide"[^>]*>\s*$', text), text[-120:]


@pytest.mark.parametrize(
    ("probability", "words"),
    [(2.38e-22, "less than 0.1 %"), (0.801, "80.1 %"), (0.9999, "more than 99.9 %")],
)
def test_a_probability_is_a_percentage_that_a_person_reads(probability: float, words: str) -> None:
    question = Question("alternative", "C_m alpha^2", "C_m q_hat", 3.0, 40.0, 20.0, probability, 1, "")
    result = flown_next(given=True)
    assert result.next_flight is not None
    ahead = dataclasses.replace(result.next_flight, questions=(question,))
    text = Page(report_html(dataclasses.replace(result, next_flight=ahead), interactive=False)).text
    assert f"with a probability of {words}" in text


def test_a_trim_that_rounds_to_zero_has_no_sign() -> None:
    level = PlannedPeak("alpha", "rad", -0.0004, -0.1, 0.1, -0.2, 0.2, True)
    made = flown_next(given=True)
    assert made.next_flight is not None
    ahead = dataclasses.replace(made.next_flight, input=dataclasses.replace(planned(given=True), peaks=(level,)))
    text = card(dataclasses.replace(made, next_flight=ahead))
    assert "−5.7 to 5.7" in text
    assert not re.search(r"[−-]0\.0(?!\d)", text)
