"""Restricted estimates: the covariance of derivatives for known parameters of the effects."""

from dataclasses import replace

import lateral_flights as commuter
import numpy as np
import pytest
from equations_decided import decided, questioned

from aerosid.effects import frozen
from aerosid.equation_error.equations.points import value_of
from aerosid.equation_error.regression.least_squares import solve
from aerosid.logs.flight_log import FlightLog
from aerosid.search.equation_error_attribution import attribute_by_equations

SIDE_TERM = ("C_Y", "beta")
"""Without a sideslip vane its derivative and the lateral accelerometer's position are correlated."""


def flown(seed: int, *, mirrored: bool = False) -> FlightLog:
    flight = commuter.Lateral(seed=seed, size=1.3, positions={"a_y": (2.5, 0.0, 0.0)})
    return commuter.without_vane(flight.log(mirrored=mirrored, name=f"flight {seed}"))


@pytest.mark.slow
def test_known_effects_give_the_covariance_of_a_regression_in_which_they_are_held() -> None:
    aircraft = commuter.aircraft(commuter.SIDE, 0.93)
    log = flown(9301)
    found = decided(aircraft, [log], [flown(9302, mirrored=True)])
    uncertainty = attribute_by_equations(found, [questioned(aircraft, log)[1]]).completed_deviations
    point, frame = found.completed.point, found.completed.problem
    held = frame.design(replace(point, effects=tuple(frozen(active) for active in point.effects)))
    covariance = solve(held, found.completed.solution.weights).covariance
    own = [held.unknowns.index(value_of(entry, 0)) for entry in point.free]
    expected = covariance[np.ix_(own, own)]
    size = np.sqrt(np.diag(expected))
    assert uncertainty.beside_effects is not None
    # Its columns are those of the last step but one.
    assert uncertainty.beside_effects / np.outer(size, size) == pytest.approx(expected / np.outer(size, size), abs=0.01)
    place = [(e[0], str(e[1])) for e in point.free].index(SIDE_TERM)
    assert uncertainty.corrected[place] > 3.0 * np.sqrt(uncertainty.beside_effects[place, place])
