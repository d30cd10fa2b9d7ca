"""Accelerometers in one unit in pitch, where the likelihood of the simulated motion decides."""

from dataclasses import replace
from pathlib import Path

import pytest

from aerosid.aircraft import load_aircraft
from aerosid.logs.flight_log import FlightLog
from aerosid.logs.formats import read_log
from aerosid.loop.closed_loop import close_loop
from aerosid.loop.result import ClosedLoop
from benchmarks.displaced_accelerometers import written

NUMBER = 12
"""Of the tuning seed: a unit 1.5 m behind its place and .3 m above."""


def closed(folder: Path, positions: dict[str, tuple[float, float, float]]) -> ClosedLoop:
    written(folder, "calm", 8601, NUMBER)

    def log(role: str) -> FlightLog:
        return replace(read_log(folder / f"{role}.csv"), positions=positions)

    return close_loop([log("identification")], load_aircraft(folder / "aircraft.toml"), [log("validation")])


@pytest.mark.slow
def test_it_takes_the_place_of_a_vane_with_terms_of_the_axial_force(tmp_path: Path) -> None:
    """The vane 1.6 m ahead with C_X q_hat*delta_e was told: C_Z alpha and delta_e 67 and 76 standard errors off."""
    result = closed(tmp_path, {})
    assert result.decided_by == "likelihood"
    found = {(each.kind, each.where, each.along): each for each in result.effects}
    assert set(found) == {("sensor_position", "accelerometers", "x"), ("sensor_position", "a_x", "z")}
    unit = found["sensor_position", "accelerometers", "x"]
    assert unit.std_error is not None
    assert unit.value == pytest.approx(-1.50, abs=3.0 * unit.std_error)


@pytest.mark.slow
def test_accelerometers_that_are_declared_apart_are_no_unit(tmp_path: Path) -> None:
    result = closed(tmp_path, {"a_x": (0.5, 0.0, 0.0), "a_z": (0.0, 0.0, 0.0)})
    named = {each.where for each in (*result.effects, *result.alternatives) if each.kind == "sensor_position"}
    assert "accelerometers" not in named
