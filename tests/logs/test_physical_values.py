"""Logs with which no flight can be computed are refused with channel, sample, time and remedy; others are not."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import aerosid
from aerosid.aircraft.bundled import bundled_folder
from aerosid.cli.main import main
from aerosid.errors import LogError
from aerosid.logs.flight_log import FlightLog
from aerosid.logs.physical_values import longest_hole, require_moving_control, require_possible_values
from aerosid.logs.quality import Problem, check_log

Values = NDArray[np.float64]

REQUIRED = ("V", "alpha", "q")


@pytest.fixture(scope="module")
def flight() -> FlightLog:
    return aerosid.read_log(bundled_folder("flight_data") / "light_transport_doublet.csv")


def changed(log: FlightLog, **channels: Values) -> FlightLog:
    return replace(log, channels={**log.channels, **channels})


def without(values: Values, first: int, last: int) -> Values:
    values = values.copy()
    values[first : last + 1] = np.nan
    return values


def test_a_flight_is_accepted(flight: FlightLog) -> None:
    require_possible_values(flight, REQUIRED)
    require_moving_control([flight])


@pytest.mark.parametrize("value", [0.0, -5.0])
@pytest.mark.parametrize("name", ["V", "rho", "q_bar", "mass"])
def test_what_is_divided_by_has_to_be_positive(flight: FlightLog, name: str, value: float) -> None:
    values = np.full(flight.samples, 100.0)
    values[[7, 9]] = value
    log = changed(flight, **{name: values})
    with pytest.raises(LogError, match=rf"channel {name} has to be positive \(2 of 470 samples; .*sample 8 at 0.21 s"):
        require_possible_values(log, REQUIRED)
    (finding,) = [each for each in check_log(log).findings if each.problem is Problem.NOT_POSITIVE]
    assert finding.blocking
    assert finding.subject == name


@pytest.mark.parametrize(("first", "last"), [(40, 55), (0, 15), (454, 469)])
def test_a_control_is_not_interpolated_over_half_a_second(flight: FlightLog, first: int, last: int) -> None:
    log = changed(flight, delta_e=without(flight["delta_e"], first, last))
    span = f"16 samples from {flight.time[first]:g} to {flight.time[last]:g} s"
    with pytest.raises(LogError, match=f"channel delta_e lacks {span}"):
        require_possible_values(log, REQUIRED)
    assert any(each.problem is Problem.CONTROL_HOLE and each.blocking for each in check_log(log).findings)


@pytest.mark.parametrize("missing", [slice(40, 44), slice(1, None, 2), slice(466, None)])
def test_a_short_hole_or_a_slower_control_is_used(flight: FlightLog, missing: slice) -> None:
    values = flight["delta_e"].copy()
    values[missing] = np.nan
    log = changed(flight, delta_e=values)
    require_possible_values(log, REQUIRED)
    assert longest_hole(log, "delta_e") is None
    findings = [each for each in check_log(log).findings if each.subject == "delta_e"]
    assert [each.problem for each in findings] == [Problem.FILLED]


def test_time_in_another_unit_is_no_sampling_of_a_recorder(flight: FlightLog) -> None:
    fast = replace(flight, time=1e-3 * flight.time)
    with pytest.raises(LogError, match="correct the unit of time"):
        require_possible_values(fast, REQUIRED)
    assert any(each.problem is Problem.TOO_FAST for each in check_log(fast).findings)


@pytest.mark.parametrize("role", ["fitted", "validation"])
def test_a_log_without_motion_is_refused_in_one_sentence(flight: FlightLog, role: str) -> None:
    still = changed(flight, **{name: np.full(flight.samples, 0.02) for name in flight.channels})
    later = replace(still, name="later", time=100.0 + still.time, sha256="0" * 64)
    aircraft = aerosid.load_aircraft("light_transport")
    logs, unseen = ([still], []) if role == "fitted" else ([flight], [later])
    with pytest.raises(LogError, match=r"no control surface moves|never change"):
        aerosid.close_loop(logs, aircraft, unseen)


def test_a_frozen_control_is_at_rest_and_one_that_moves_elsewhere_is_not(flight: FlightLog) -> None:
    frozen = changed(flight, delta_e=np.full(flight.samples, 0.02))  # the variance of these numbers is not zero
    (finding,) = check_log(frozen).findings
    assert finding.problem is Problem.CONTROL_CONSTANT
    assert finding.blocking
    with pytest.raises(LogError, match=r"no control surface moves \(delta_e is 0.02000 rad throughout\)"):
        require_moving_control([frozen])
    require_moving_control([frozen, flight])  # an oscillation with free controls beside a doublet


SPOILED: dict[str, Callable[[list[str]], list[str]]] = {
    "V": lambda row: [row[0], "0", *row[2:]],
    "time": lambda row: [f"{1e-3 * float(row[0]):.9f}", *row[1:]],
}


@pytest.mark.parametrize("channel", SPOILED)
def test_check_refuses_it_before_the_instruments_are_compared(
    channel: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    lines = (bundled_folder("flight_data") / "light_transport_doublet.csv").read_text().splitlines()
    head = next(n for n, line in enumerate(lines) if not line.startswith("#"))
    rows = [",".join(SPOILED[channel](line.split(","))) for line in lines[head + 1 :]]
    log = tmp_path / "spoiled.csv"
    log.write_text("\n".join([*lines[: head + 1], *rows]) + "\n")
    assert main(["check", str(log), "--quiet"]) == 3
    said = capsys.readouterr()
    assert said.out.startswith(f"The log cannot be used by close-loop: {channel} (")
    assert said.err == ""
