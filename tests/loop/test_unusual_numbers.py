"""Numbers of the aircraft file that no aircraft has are told where the loop breaks down, and with its verdict."""

from __future__ import annotations

from dataclasses import replace

import pytest

from aerosid.aircraft import load_aircraft
from aerosid.aircraft.bundled import bundled_folder
from aerosid.aircraft.plausibility import blamed_on_unusual_numbers
from aerosid.errors import EstimationError
from aerosid.logs.flight_log import FlightLog
from aerosid.logs.formats import read_log
from aerosid.loop.closed_loop import close_loop
from aerosid.loop.settings import LoopSettings

USUAL = load_aircraft("light_transport")


@pytest.fixture(scope="module")
def doublet() -> FlightLog:
    return read_log(bundled_folder("flight_data") / "light_transport_doublet.csv")


def test_a_loop_that_breaks_down_repeats_the_warning_about_the_aircraft_file(doublet: FlightLog) -> None:
    with pytest.raises(EstimationError, match=r"every start value.*In the aircraft file I_yy/\(mass .* 0\.000121 is"):
        close_loop([doublet], replace(USUAL, I_yy=1e-4 * USUAL.I_yy))


def test_the_verdict_repeats_it_too(doublet: FlightLog) -> None:
    settings = LoopSettings(next_flight=False, paper_chain=False, linear_analysis=False)
    summary = close_loop([doublet], replace(USUAL, I_yy=100.0 * USUAL.I_yy), settings=settings).summary
    assert "In the aircraft file I_yy/(mass mean_chord" in summary


def test_usual_numbers_are_not_blamed() -> None:
    with pytest.raises(EstimationError, match=r"^broken$"), blamed_on_unusual_numbers(USUAL):
        raise EstimationError("broken")
