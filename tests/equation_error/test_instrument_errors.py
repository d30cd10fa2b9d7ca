"""Instrument errors identified by kinematics: sensor positions on the aircraft, priors of biases, noise ratio."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from equations_decided import identified

from aerosid.aircraft import Aircraft, load_aircraft
from aerosid.compatibility import check_kinematics
from aerosid.effects.hypothesis import Hypothesis
from aerosid.effects.kinds import ActiveEffect, PositionEffect
from aerosid.effects.sensor_position import sensor_place
from aerosid.equation_error.regression.estimate import Estimate
from aerosid.equation_error.selection.instrument_errors import is_off_aircraft
from aerosid.equation_error.selection.structure import SelectedEffect, SelectedStructure
from aerosid.equation_error.settings import EquationErrorSettings
from aerosid.logs.flight_log import FlightLog
from aerosid.logs.formats import read_log
from benchmarks.field_detection import FIRST
from benchmarks.field_detection import written as field_written
from benchmarks.turbulent_flights import BODIES, Wrong, aircraft_of, flown
from benchmarks.wide_detection import written

ARM = 2.5
"""Position error of the vane, ahead of its declared position, m."""

BEHIND = (-1.0, 0.0, 0.5)
"""Declared position of an accelerometer, m."""


@pytest.mark.slow
def test_a_position_outside_the_aircraft_is_replaced_by_its_alternative() -> None:
    body = BODIES[0]
    aircraft = aircraft_of(body, 0.08, np.random.default_rng(7))
    log = flown("one", body, 7001, air=0.0, seconds=24.0)
    moved = replace(log, channels={**log.channels, "alpha": log["alpha"] - log["q"] * ARM / log["V"]})

    found = identified(replace(aircraft, length=12.0), [moved], [])
    (place,) = [active for active in found.selected.estimate.point.effects if isinstance(active.effect, PositionEffect)]
    # Kinematics determine the distance of vane and accelerometer, not which of them is displaced.
    expected = {"alpha": ARM, "a_z": -ARM}[place.effect.where]
    assert abs(place.values[0] - expected) < 0.3

    held = identified(replace(aircraft, length=2.0), [moved], [])
    kinds = {each.hypothesis.kind for each in held.selected.chosen}
    assert "sensor_position" not in kinds
    assert kinds & {"sensor_delay", "sensor_lag"}
    # The compatibility check of a log alone uses the aircraft's length only.
    for length, placed in ((None, True), (2.0, False)):
        agreement = check_kinematics([moved], length=length)
        assert agreement is not None
        assert any(finding.kind == "sensor_position" for finding in agreement.findings) is placed
    places = [h for h in held.hypotheses if h.kind == "sensor_position"]
    assert all(h.effects[0].effect.parameters[0].highest <= 1.3 for h in places)


@pytest.fixture(scope="module")
def placed() -> Estimate:
    """The kinematic equations of a flight whose vane is 4 m ahead and whose accelerometer is behind the centre."""
    body = BODIES[0]
    log = replace(flown("one", body, 7001, air=0.0, seconds=12.0), positions={"alpha": (4.0, 0.0, 0.0), "a_z": BEHIND})
    return identified(aircraft_of(body, 0.08, np.random.default_rng(7)), [log], []).declared


@pytest.mark.parametrize(
    ("channel", "axes", "further", "length", "is_off"),
    [
        # Of 10 m length a vane is on a boom of up to 6.5 m, an accelerometer within 5 m.
        ("alpha", "x", (2.4,), 10.0, False),
        ("alpha", "x", (2.6,), 10.0, True),
        ("alpha", "x", (-10.4,), 10.0, False),
        ("alpha", "x", (-10.6,), 10.0, True),
        ("a_z", "x", (5.9,), 10.0, False),
        ("a_z", "x", (6.1,), 10.0, True),
        # The distance along all axes together: hypot(4, 5) = 6.40, hypot(4, 5.2) = 6.56; hypot(6, 2.4), hypot(6, 2.6).
        ("alpha", "z", (5.0,), 10.0, False),
        ("alpha", "z", (5.2,), 10.0, True),
        ("alpha", "xz", (2.0, 2.4), 10.0, False),
        ("alpha", "xz", (2.0, 2.6), 10.0, True),
        # Declared beyond 3.25 m of a shorter aircraft: it may be nearer than that, not further.
        ("alpha", "x", (-0.5,), 5.0, False),
        ("alpha", "x", (0.1,), 5.0, True),
    ],
)
def test_a_position_is_off_the_aircraft_by_its_whole_distance_from_the_centre_of_gravity(
    placed: Estimate, channel: str, axes: str, further: tuple[float, ...], length: float, is_off: bool
) -> None:
    moved = ActiveEffect(sensor_place(channel, axes), further)
    found = replace(placed, point=placed.point.with_effects([moved]))
    place = SelectedEffect(Hypothesis(moved.effect.kind, channel, effects=(moved,)), kinematic=True, gain=0.0)
    bias = SelectedEffect(Hypothesis("sensor_bias", channel), kinematic=True, gain=0.0)
    assert is_off_aircraft(SelectedStructure(found, (place,)), place, length) is is_off
    assert not is_off_aircraft(SelectedStructure(found, (bias,)), bias, length)


def test_an_unusually_large_gyro_error_is_identified_if_certain() -> None:
    """The usual size is a prior and no bound: a fifth too much is four of its deviations, which the gain outweighs."""
    body = BODIES[6]
    aircraft = aircraft_of(body, 0.08, np.random.default_rng(9))
    logs = [flown(name, body, 7040 + n, air=0.3, wrong=Wrong(scale={"q": 1.2})) for n, name in enumerate("ab")]
    (chosen,) = identified(aircraft, logs[:1], logs[1:]).selected.chosen
    assert (chosen.hypothesis.kind, chosen.hypothesis.where) == ("sensor_scale", "q")


def test_a_vane_is_not_a_fifth_off_where_a_late_accelerometer_explains_its_path_as_well(tmp_path: Path) -> None:
    """A glider in gusts whose a_z lags by .087 s: vanes are calibrated to some per cent, so a fifth has prior odds."""
    field_written(tmp_path, [FIRST, 166, 5], 5)
    logs = [read_log(tmp_path / f"{role}.csv") for role in ("identification", "validation")]
    found = identified(load_aircraft(tmp_path / "aircraft.toml"), logs[:1], logs[1:]).selected
    ((kind, where, _),) = found.labels
    assert kind in ("sensor_delay", "sensor_lag")
    assert where == "a_z"
    (lateness,) = found.estimate.point.effects[-1].values
    assert abs(lateness - 0.0867) < 0.02


def ratio_of(logs: list[FlightLog], aircraft: Aircraft) -> float:
    return identified(aircraft, logs[:1], logs[1:]).noise_ratio


@pytest.mark.parametrize(("number", "interval"), [(8, 0.01), (0, 0.04)])
def test_the_noise_ratio_of_white_noise_is_one_at_any_sampling_rate(
    tmp_path: Path, number: int, interval: float
) -> None:
    written(tmp_path, "none", [77, number], number)
    logs = [read_log(tmp_path / f"{role}.csv") for role in ("identification", "validation")]
    assert np.isclose(np.diff(logs[0].time).mean(), interval)
    # A chi distribution of some hundred degrees of freedom, and noise of the integrated rate and accelerations.
    assert 0.85 < ratio_of(logs, load_aircraft(tmp_path / "aircraft.toml")) < 1.5


def test_gusts_below_vane_noise_are_detected_in_the_band() -> None:
    """At 50 Hz the noise of a sample hides them; the band of the motion has a sixth of its power."""
    body = BODIES[4]
    logs = [flown(name, body, 7060 + n, air=0.3, interval=0.02) for n, name in enumerate("ab")]
    noisy = [
        replace(
            log,
            channels={
                **log.channels,
                "alpha": log["alpha"] + np.random.default_rng(n).normal(0.0, 0.003, log.time.size),
            },
        )
        for n, log in enumerate(logs)
    ]
    assert ratio_of(noisy, aircraft_of(body, 0.08, np.random.default_rng(10))) > EquationErrorSettings().closed
