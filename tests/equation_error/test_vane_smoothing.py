"""Smoothing time of vanes by likelihood: shorter for a good vane in gusts than for a noisy one in calm air."""

from dataclasses import replace

import numpy as np
import pytest
from equations_decided import declared

from aerosid.equation_error.regression.estimate import estimate
from aerosid.equation_error.regression.vane_smoothing import likelier_vane_smoothing
from benchmarks.turbulent_flights import BODIES, aircraft_of, flown


@pytest.mark.parametrize(("air", "noise", "shorter"), [(1.0, 0.0, True), (0.0, 4e-3, False)], ids=["gusts", "noise"])
def test_a_short_time_is_selected_in_gusts_and_a_long_one_for_a_noisy_vane(
    air: float, noise: float, shorter: bool
) -> None:
    body = BODIES[0]
    logs = []
    for n, name in enumerate(("one", "two")):
        log = flown(name, body, 6300 + n, air=air, seconds=24.0)
        disturbed = log["alpha"] + noise * np.random.default_rng(n).standard_normal(log.time.size)
        logs.append(replace(log, channels={**log.channels, "alpha": disturbed}))
    initial = declared(aircraft_of(body, 0.08, np.random.default_rng(7)), logs[:1], logs[1:])
    found = likelier_vane_smoothing(initial)
    settings = initial.problem.settings
    assert (found.problem.settings.blend < settings.blend) == shorter
    other = replace(initial.problem, settings=replace(settings, blend=settings.blends[0]))
    assert found.log_likelihood >= max(initial.log_likelihood, estimate(other, initial.point).log_likelihood) - 0.1
