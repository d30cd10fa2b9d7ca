"""Fuel tables: every manoeuvre at its own mass, inertia and centre of gravity."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from aerosid.aircraft import Aircraft, load_aircraft
from aerosid.aircraft.declared_model import declared_model
from aerosid.aircraft.loading import at_own_loading, with_mass
from aerosid.aircraft.reading import aircraft_from_text
from aerosid.effects import ActiveEffect, frozen
from aerosid.effects.cg_shift import cg_shift
from aerosid.errors import AircraftError
from aerosid.estimation.declared_effects import declared_effects
from aerosid.estimation.effect_columns import with_columns_of
from aerosid.estimation.manoeuvre import prepare
from aerosid.estimation.maximum_likelihood import refine
from aerosid.flight_model.simulation import fly, three_two_one_one, trim
from aerosid.flight_model.terms import parse_term
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


def test_derivatives_are_those_about_the_declared_centre_whatever_was_burnt() -> None:
    """Flown 300 kg lighter, 0.05 m further forward and with less inertia; reduced with and without the table."""
    declared = aircraft(TABLE)
    model = declared_model(declared, 100.0)
    shift = frozen(ActiveEffect(cg_shift("x"), (0.05,)))
    flown = with_columns_of(model, (shift,))
    flown = replace(flown, constants=flown.constants._replace(I_yy=6700.0))
    time = np.arange(0.0, 12.0, 0.02)
    trimmed = trim(flown, 100.0, 0.9077, 1980.0, further_inputs={"cg_shift_x": 0.05})
    noise = {"V": 0.02, "alpha": 2e-4, "q": 2e-4, "theta": 2e-4, "a_z": 0.01, "a_x": 0.005, "delta_e": 0.0}
    log = fly(
        flown,
        trimmed,
        time,
        three_two_one_one(time, 1.0, 0.5, 0.02),
        density=0.9077,
        mass=1980.0,
        noise=noise,
        seed=1,
        further_inputs={"cg_shift_x": np.full(time.size, 0.05)},
    )
    recorded = {name: log[name] for name in log.channels if name != "cg_shift_x"}
    recorded |= {"fuel_used": np.full(time.size, 300.0), "thrust": np.full(time.size, trimmed.thrust)}
    log = FlightLog("light", time, recorded, dict.fromkeys(recorded, "1"))
    slope = ("C_m", parse_term("alpha"))

    def reduced(loaded: Aircraft, reduced_log: FlightLog) -> float:
        start = declared_model(loaded, 100.0)
        manoeuvres = [prepare(reduced_log, loaded, start.columns)]
        given = declared_effects(loaded, ("delta_e",), manoeuvres)
        free = tuple((each.coefficient, each.term) for each in loaded.derivatives)
        return refine(with_columns_of(start, given), manoeuvres, free, effects=given).model.value(slope)

    loaded, (own,), _ = at_own_loading(declared, [log])
    assert reduced(loaded, own) == pytest.approx(-0.729, abs=0.015)
    # As declared: another mass, inertia and centre, 0.05 m of 1.5875 m times C_Z_alpha alone are 0.18.
    assert abs(reduced(declared, log) + 0.729) > 0.1
