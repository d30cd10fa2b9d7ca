"""Sensor positions that no aircraft has are refused, those that it may have are not."""

from __future__ import annotations

from aerosid.compatibility import Agreement, InstrumentFinding, KinematicConsistency
from aerosid.compatibility.plausible import implausible_positions


def found(**arms: float) -> KinematicConsistency:
    findings = tuple(
        InstrumentFinding("sensor_position", "a_x", axis, value, 0.5, "m", 1e-9, 40.0) for axis, value in arms.items()
    )
    delay = InstrumentFinding("sensor_delay", "alpha", "", 24.0, 0.01, "s", 1e-9, 40.0)
    return KinematicConsistency(("flight",), Agreement.CORRECTED, (*findings, delay), (), (), (), "")


def test_a_sensor_outside_the_aircraft_is_refused() -> None:
    (said,) = implausible_positions(found(z=-24.0), 2.0, 14.0)
    assert "24.0 m" in said
    assert "further than 7.00 m from the centre" in said
    (both,) = implausible_positions(found(x=6.0, z=4.5), 2.0, 14.0)  # 7.5 m away
    assert "7.50 m" in both
    assert implausible_positions(found(x=6.0, z=4.5), 2.0) == ()  # of an aircraft that may be 16 m long


def test_a_sensor_inside_is_not() -> None:
    assert implausible_positions(found(x=4.4, z=-0.6), 2.0, 14.0) == ()
