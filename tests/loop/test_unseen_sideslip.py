"""What is said where no vane shows sideslip, against the accelerometer's equation itself."""

import lateral_flights as commuter
import numpy as np
import pytest
from equations_decided import questioned

from aerosid.loop.unmeasured_sideslip import note_on_unmeasured_sideslip

AIRCRAFT = commuter.aircraft(commuter.SIDE)


def test_nothing_is_said_where_a_vane_shows_it() -> None:
    model, manoeuvre = questioned(AIRCRAFT, commuter.Lateral(duration=4.0).log())
    assert note_on_unmeasured_sideslip(AIRCRAFT, model, [manoeuvre]) == ()


def test_the_number_is_what_a_metre_does_to_the_regression_of_the_accelerometer_on_sideslip() -> None:
    log = commuter.Lateral(noise=0.0).log()
    blind = commuter.without_vane(log)
    model, manoeuvre = questioned(AIRCRAFT, blind)
    (said,) = note_on_unmeasured_sideslip(AIRCRAFT, model, [manoeuvre])
    number = float(said.split("changes by ")[1].split(" per")[0].replace("\u2212", "-"))
    # r' x over q_bar S/m, regressed on all that C_n holds: its slope on beta.
    assert AIRCRAFT.span is not None
    hat = AIRCRAFT.span / (2.0 * commuter.SPEED)
    columns = [log["beta"], hat * log["p"], hat * log["r"], log["delta_a"], log["delta_r"], np.ones(log.time.size)]
    force = 0.5 * commuter.DENSITY * commuter.SPEED**2 * commuter.WING
    read = commuter.MASS * np.gradient(log["r"], log.time) / force
    slope = np.linalg.lstsq(np.column_stack(columns), read, rcond=None)[0][0]
    assert number == pytest.approx(-slope, rel=0.1)
