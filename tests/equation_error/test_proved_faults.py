"""Faults of instruments that kinematics prove: a sensor's place is one that the aircraft has."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from equations_decided import proved

from aerosid.compatibility import check_kinematics
from aerosid.effects.kinds import PositionEffect
from benchmarks.turbulent_flights import BODIES, Wrong, aircraft_of, flown

ARM = 2.5
"""m that the vane sits ahead of where the log takes it to be."""


def test_a_place_outside_the_aircraft_gives_way_to_what_looks_the_same() -> None:
    body = BODIES[0]
    aircraft = aircraft_of(body, 0.08, np.random.default_rng(7))
    log = flown("one", body, 7001, air=0.0, seconds=24.0)
    moved = replace(log, channels={**log.channels, "alpha": log["alpha"] - log["q"] * ARM / log["V"]})

    found = proved(replace(aircraft, length=12.0), [moved], [])
    (place,) = [active for active in found.selected.estimate.point.effects if isinstance(active.effect, PositionEffect)]
    # Kinematics show how far vane and accelerometer are apart, and not which of them moved.
    expected = {"alpha": ARM, "a_z": -ARM}[place.effect.where]
    assert abs(place.values[0] - expected) < 0.3

    held = proved(replace(aircraft, length=2.0), [moved], [])
    kinds = {each.hypothesis.kind for each in held.selected.chosen}
    assert "sensor_position" not in kinds
    assert kinds & {"sensor_delay", "sensor_lag"}
    # The check of a log knows the aircraft by its length alone.
    for length, placed in ((None, True), (2.0, False)):
        agreement = check_kinematics([moved], length=length)
        assert agreement is not None
        assert any(finding.kind == "sensor_position" for finding in agreement.findings) is placed
    places = [h for h in held.asked if h.kind == "sensor_position"]
    assert all(h.effects[0].effect.parameters[0].highest <= 1.3 for h in places)


def test_a_gyro_far_out_of_calibration_is_named_where_the_record_leaves_no_doubt() -> None:
    """What is usual is a prior and no bound: a fifth too much is four of its deviations, and the record's gain pays."""
    body = BODIES[6]
    aircraft = aircraft_of(body, 0.08, np.random.default_rng(9))
    logs = [flown(name, body, 7040 + n, air=0.3, wrong=Wrong(scale={"q": 1.2})) for n, name in enumerate("ab")]
    (chosen,) = proved(aircraft, logs[:1], logs[1:]).selected.chosen
    assert (chosen.hypothesis.kind, chosen.hypothesis.where) == ("sensor_scale", "q")
