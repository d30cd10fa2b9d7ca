"""The angle of attack at the centre of gravity is that which the simulated vane was turned by."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from aerosid.flight_model.vane import alpha_at_centre

RATE = st.floats(-0.1, 0.1)
ARM = st.floats(-6.0, 6.0)


@given(st.floats(-0.3, 0.3), st.tuples(ARM, ARM, ARM), RATE, RATE, RATE, st.floats(60.0, 200.0))
def test_it_is_the_inverse_of_the_vane_s_flow_to_first_order_in_the_rates(
    alpha: float, place: tuple[float, float, float], p: float, q: float, r: float, speed: float
) -> None:
    x, y, z = place
    u, w = speed * np.cos(alpha), speed * np.sin(alpha)
    at_vane = float(np.arctan2(w + p * y - q * x, u + q * z - r * y))
    turned = (abs(p * y) + abs(q * x) + abs(q * z) + abs(r * y)) / speed
    assert abs(alpha_at_centre(at_vane, place, p, q, r, speed) - alpha) <= 2.0 * turned**2 + 1e-12
