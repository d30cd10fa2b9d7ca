"""Fuel tables: every manoeuvre at its own mass, inertia and centre of gravity."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from aerosid.aircraft import Aircraft, load_aircraft
from aerosid.aircraft.loading import at_own_loading, with_mass
from aerosid.aircraft.reading import aircraft_from_text
from aerosid.errors import AircraftError
from aerosid.logs.flight_log import FlightLog, with_fuel_used
from aerosid.logs.formats import read_log

TABLE = """
[fuel]
used = [0.0, 100.0, 300.0]
mass = [2280.0, 2180.0, 1980.0]
I_yy = [6940.0, 6900.0, 6700.0]
x_cg = [0.0, 0.02, 0.05]
"""


def aircraft(table: str) -> Aircraft:
    return aircraft_from_text(load_aircraft("light_transport").text + table, "file.toml", "")


def log(used: np.ndarray | None = None, **more: np.ndarray) -> FlightLog:
    time = np.linspace(0.0, 10.0, 101)
    channels = {"V": np.full(time.size, 100.0), **more}
    if used is not None:
        channels["fuel_used"] = used
    return FlightLog("flight", time, channels, dict.fromkeys(channels, "1"))


def test_mass_inertia_and_centre_follow_the_table() -> None:
    used = np.linspace(190.0, 210.0, 101)
    loaded, (flown,), (seen,) = at_own_loading(aircraft(TABLE), [log(used)], [log(used + 100.0)])
    np.testing.assert_allclose(flown["mass"], 2280.0 - used)
    np.testing.assert_allclose(seen["mass"][-1], 1980.0)  # level beyond the last entry
    assert loaded.I_yy == pytest.approx(6800.0)
    (shift,) = loaded.effects
    assert (shift.kind, shift.where) == ("cg_shift", "x")
    assert shift.value == pytest.approx(0.035)
    assert any("I_yy 6800" in note for note in flown.notes)


def test_without_columns_mass_falls_by_what_is_burnt_and_the_rest_stays() -> None:
    declared = aircraft("[fuel]\nused = [0.0, 500.0]\n")
    loaded, (flown,), _ = at_own_loading(declared, [log(np.full(101, 80.0))])
    np.testing.assert_allclose(flown["mass"], declared.mass - 80.0)
    assert (loaded.I_yy, loaded.effects) == (declared.I_yy, declared.effects)


def test_a_recorded_mass_wins() -> None:
    held = log(np.full(101, 80.0), mass=np.full(101, 2000.0))
    assert with_mass(held, aircraft(TABLE)) is held


def test_nothing_changes_without_fuel_or_table() -> None:
    declared = aircraft(TABLE)
    assert at_own_loading(declared, [log()])[0] is declared
    bare = load_aircraft("light_transport")
    assert at_own_loading(bare, [log(np.full(101, 80.0))])[0] is bare


def test_two_loadings_in_one_estimate_are_told() -> None:
    logs = [log(np.full(101, used)) for used in (0.0, 300.0)]
    _, (first, _), _ = at_own_loading(aircraft(TABLE), logs)
    assert "one for all logs" in first.notes[-1]
    assert "one centre for all logs" in first.notes[-1]


def test_flow_is_integrated_from_the_beginning_before_anything_is_cut(tmp_path: Path) -> None:
    time = np.arange(0.0, 100.5, 0.5)
    rows = "\n".join(f"{t},{90.0},{360.0 + 3.6 * t}" for t in time)
    path = tmp_path / "flight.csv"
    path.write_text(f"time [s],V [m/s],fuel_flow [kg/hour]\n{rows}\n")
    flight = read_log(path)
    # 0.1 kg/s rising by 0.001 kg/s^2: 0.1 t + 0.0005 t^2.
    np.testing.assert_allclose(flight["fuel_used"], 0.1 * time + 5e-4 * time**2, rtol=1e-9, atol=1e-9)
    late = flight.between(80.0, 90.0)
    assert late["fuel_used"][0] == pytest.approx(0.1 * 80.0 + 5e-4 * 80.0**2)


def test_recorded_fuel_used_is_kept() -> None:
    held = log(np.full(101, 7.0), fuel_flow=np.ones(101))
    assert with_fuel_used(held) is held
    assert "fuel_used" in with_fuel_used(replace(held, channels={"fuel_flow": held["fuel_flow"]}))


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ("[fuel]\nused = [0.0, 0.0]\n", "does not increase"),
        ("[fuel]\nused = [0.0]\n", "fuel.used"),
        ("[fuel]\nused = [0.0, 1.0]\nmass = [1.0]\n", "fuel.mass holds 1 numbers and fuel.used 2"),
        ("[fuel]\nused = [0.0, 1.0]\nIyy = [1.0, 1.0]\n", "I_yy"),
        ("[fuel]\nmass = [0.0, 1.0]\n", "fuel.used"),
    ],
)
def test_a_wrong_table_is_refused_in_one_sentence(table: str, words: str) -> None:
    with pytest.raises(AircraftError) as caught:
        aircraft(table)
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)
