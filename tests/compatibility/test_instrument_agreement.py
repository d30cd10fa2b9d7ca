"""Data compatibility result from the instrument errors of the kinematic equations, against the simulated ones."""

import numpy as np
import pytest
from equations_decided import identified

from aerosid.compatibility import Agreement, KinematicConsistency
from aerosid.compatibility.instrument_agreement import agreement_of
from benchmarks.turbulent_flights import BODIES, NOTHING, Wrong, aircraft_of, flown


def told_of(wrong: Wrong) -> KinematicConsistency:
    body = BODIES[0]
    logs = [flown(name, body, 6200 + n, air=0.3, wrong=wrong, seconds=24.0) for n, name in enumerate(("one", "two"))]
    return agreement_of(identified(aircraft_of(body, 0.08, np.random.default_rng(6)), logs[:1], logs[1:]))


def test_nothing_is_reported_for_consistent_instruments() -> None:
    agreement = told_of(NOTHING)
    assert agreement.verdict is Agreement.CONSISTENT
    assert agreement.logs == ("one", "two")
    assert {row.channel for row in agreement.channels} == {"theta", "alpha", "V", "h"}
    assert all(row.after == pytest.approx(row.before) for row in agreement.channels)


def test_a_vane_delay_is_reported_with_its_value_and_gain() -> None:
    agreement = told_of(Wrong(delay={"alpha": 0.12}))
    assert agreement.verdict is Agreement.CORRECTED
    (finding,) = agreement.findings
    assert (finding.where, finding.unit) == ("alpha", "s")
    assert finding.value == pytest.approx(0.12, abs=4.0 * finding.std_error)
    assert finding.p_value < 1e-6
    assert all(row.after < 0.8 * row.before for row in agreement.channels if row.channel == "alpha")
    assert finding.kind.removeprefix("sensor_") in agreement.sentence
