"""A regression with some of its values fixed, against least squares of what is left."""

import numpy as np
import pytest

from aerosid.signals.restricted_least_squares import restricted_least_squares


@pytest.mark.parametrize("fixed", [[0], [1, 3]])
def test_fixed_values_move_the_others_as_least_squares_without_them_would(fixed: list[int]) -> None:
    generator = np.random.default_rng(7)
    columns = generator.standard_normal((40, 4)) @ generator.standard_normal((4, 4))
    target = columns @ np.array([1.0, -2.0, 0.5, 3.0]) + generator.standard_normal(40)
    covariance = np.linalg.inv(columns.T @ columns)
    values = covariance @ columns.T @ target
    at = [0.3 * (n + 1) for n in fixed]
    rest = [n for n in range(4) if n not in fixed]
    expected = np.linalg.lstsq(columns[:, rest], target - columns[:, fixed] @ np.array(at), rcond=None)[0]
    found = restricted_least_squares(values, covariance, fixed, at)
    np.testing.assert_allclose(found[rest], expected, rtol=1e-9)
    np.testing.assert_array_equal(found[fixed], at)
