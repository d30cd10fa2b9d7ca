"""Delays of sampled signals."""

from __future__ import annotations

import numpy as np
from numpy.testing import assert_allclose

from aerosid.signals.delay_and_lag import delayed


def test_a_delay_is_that_of_its_own_instants_and_size_however_many_came_before() -> None:
    """A cubic is delayed exactly, on grids of one length and with delays that come back."""
    grids = [np.cumsum(np.random.default_rng(seed).uniform(0.01, 0.03, 60)) for seed in range(4)]

    def cubic(at: np.ndarray) -> np.ndarray:
        return np.column_stack([at**3 - at, 2.0 + at**2])

    for delay in (0.02, -0.05, 0.02, 0.11, -0.05):
        for time in grids:
            wanted = cubic(np.clip(time - delay, time[0], time[-1]))
            assert_allclose(delayed(time, cubic(time), delay), wanted, rtol=1e-12, atol=1e-12)
