"""Flow separation: parameters for which the flow separates within the flown range."""

import numpy as np

from aerosid.effects import ActiveEffect
from aerosid.effects.flow_separation import flow_separation, is_breakdown, longest_separation
from aerosid.effects.limits import OFFERED

HIGHEST = 0.1
"""rad, of the flown angles of attack."""


def separation(alpha_star: float, sharpness: float) -> ActiveEffect:
    return ActiveEffect(flow_separation(HIGHEST, "C_Z", ("C_m",)), (alpha_star, sharpness, 0.0, 0.0, -0.03))


def attached(active: ActiveEffect) -> float:
    """The separation point X at the smallest angle of attack, at rest."""
    return float(0.5 * (1.0 - np.tanh(active.values[1] * (0.0 - active.values[0]))))


def test_an_abrupt_stall_and_a_flow_without_lag_separate() -> None:
    angle, sharpness = separation(0.1, 25.0).effect.parameters[:2]
    assert is_breakdown(separation(0.1, 25.0))
    assert is_breakdown(separation(0.1, sharpness.highest))
    assert attached(separation(0.1, 25.0)) > 0.99
    flattest, farthest = separation(0.1, sharpness.lowest), separation(angle.highest, 25.0)
    assert not is_breakdown(flattest)
    assert not is_breakdown(farthest)
    # The flattest curve has no attached flow at any flown angle.
    assert attached(flattest) < 0.7


def test_a_separation_point_that_follows_a_drift_is_no_stall() -> None:
    stall = separation(0.1, 25.0)
    delay, relaxation = stall.effect.parameters[2:4]
    for number, time in ((2, delay), (3, relaxation)):
        assert is_breakdown(stall.perturbed(number, 0.5 * time.highest))
        assert not is_breakdown(stall.perturbed(number, time.highest))


def test_a_stall_may_be_as_slow_as_the_published_ones_and_no_slower_than_a_hundred_chords() -> None:
    # VFW-614 ATTAS at its stall: 24 chords published, 80 m/s. A short period of the Citation at 124 m/s.
    assert 24.0 * 3.159 / 80.0 < longest_separation(3.159, [120.0, 80.0]) == OFFERED.longest_separation
    longest = longest_separation(2.057, [124.0])
    assert 1.0 < longest < 2.0
    stall = ActiveEffect(flow_separation(HIGHEST, "C_Z", ("C_m",), longest), (0.1, 25.0, 0.2, 0.2, -0.03))
    for number in (2, 3):
        assert is_breakdown(stall.perturbed(number, 0.9 * longest - 0.2))
        assert not is_breakdown(stall.perturbed(number, 2.0 * longest))
