"""A regression with some of its values held, against least squares of what is left."""

import numpy as np
import pytest

from aerosid.loop.kept_derivatives import restricted


@pytest.mark.parametrize("held", [[0], [1, 3]])
def test_held_values_move_the_others_as_least_squares_without_them_would(held: list[int]) -> None:
    generator = np.random.default_rng(7)
    columns = generator.standard_normal((40, 4)) @ generator.standard_normal((4, 4))
    target = columns @ np.array([1.0, -2.0, 0.5, 3.0]) + generator.standard_normal(40)
    covariance = np.linalg.inv(columns.T @ columns)
    values = covariance @ columns.T @ target
    at = [0.3 * (n + 1) for n in held]
    rest = [n for n in range(4) if n not in held]
    expected = np.linalg.lstsq(columns[:, rest], target - columns[:, held] @ np.array(at), rcond=None)[0]
    found = restricted(values, covariance, held, at)
    np.testing.assert_allclose(found[rest], expected, rtol=1e-9)
    np.testing.assert_array_equal(found[held], at)
