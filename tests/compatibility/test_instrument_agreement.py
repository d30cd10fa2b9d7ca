"""Data compatibility result from the instrument errors of the kinematic equations, against the simulated ones."""

import re
from pathlib import Path

import numpy as np
import pytest
from equations_decided import identified
from problems import LIGHT, Problem, with_channels

from aerosid.aircraft import load_aircraft
from aerosid.compatibility import Agreement, KinematicConsistency
from aerosid.compatibility.instrument_agreement import agreement_of, equivalent_biases
from aerosid.logs.formats import read_log
from benchmarks.turbulent_flights import BODIES, NOTHING, Wrong, aircraft_of, flown


def compatibility_with(wrong: Wrong) -> KinematicConsistency:
    body = BODIES[0]
    logs = [flown(name, body, 6200 + n, air=0.3, wrong=wrong, seconds=24.0) for n, name in enumerate(("one", "two"))]
    return agreement_of(identified(aircraft_of(body, 0.08, np.random.default_rng(6)), logs[:1], logs[1:]))


def test_nothing_is_reported_for_consistent_instruments() -> None:
    agreement = compatibility_with(NOTHING)
    assert agreement.verdict is Agreement.CONSISTENT
    assert agreement.logs == ("one", "two")
    assert {row.channel for row in agreement.channels} == {"theta", "alpha", "V", "h"}
    assert all(row.after == pytest.approx(row.before) for row in agreement.channels)


def test_a_vane_delay_is_reported_with_its_value_and_gain() -> None:
    agreement = compatibility_with(Wrong(delay={"alpha": 0.12}))
    assert agreement.verdict is Agreement.CORRECTED
    (finding,) = agreement.findings
    assert (finding.where, finding.unit) == ("alpha", "s")
    assert finding.value == pytest.approx(0.12, abs=4.0 * finding.std_error)
    assert finding.p_value < 1e-6
    assert all(row.after < 0.8 * row.before for row in agreement.channels if row.channel == "alpha")
    assert finding.kind.removeprefix("sensor_") in agreement.sentence


@pytest.mark.parametrize(("channel", "size"), [("a_x", 0.2), ("theta", -0.02)])
def test_a_drift_of_airspeed_is_stated_as_the_bias_that_makes_it(channel: str, size: float) -> None:
    """A bias of a_x and one of theta make one drift: g times as much, with the other sign."""
    problem = Problem(duration=16.0)
    log = problem.fly(seed=5, name="one")
    errors = identified(LIGHT, [with_channels(log, **{channel: log[channel] + size})], [])
    text = equivalent_biases(errors.declared)
    found = re.search(r": (\S+) m/s² of a_x or (\S+) rad of theta \((\d+) % of the variance of one\)", text)
    assert found is not None, text
    of_a_x, of_theta = (float(number.replace("−", "-")) for number in found.groups()[:2])
    assert of_a_x == pytest.approx(size if channel == "a_x" else -9.80665 * size, rel=0.1)
    assert of_theta == pytest.approx(-of_a_x / 9.80665, rel=0.05)
    assert int(found[3]) > 90


def test_an_alternative_is_listed_once() -> None:
    """The vane of the Navion may be displaced along x, or along x and another axis: one name, and one row."""
    folder = Path(__file__).parents[2] / "flight_data"
    logs = [read_log(folder / f"navion_{name}.csv") for name in ("identify", "validate")]
    agreement = agreement_of(identified(load_aircraft("navion"), logs[:1], logs[1:]))
    assert agreement.inseparable
    for group in agreement.inseparable:
        names = [(each.kind, each.where, each.axis) for each in group]
        assert len(set(names)) == len(names)
    assert agreement.sentence.count("position of beta along x") == 1
