"""Decimation: every n-th sample of the convolution, however many columns stand side by side."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from aerosid.signals.decimation import decimated


@given(st.integers(1, 12), st.integers(1, 7), st.integers(1, 9), st.integers(1, 8))
def test_every_column_is_its_convolution(rows: int, step: int, length: int, columns: int) -> None:
    random = np.random.default_rng(17)
    weights = random.normal(size=length)
    values = random.normal(size=(length + step * (rows - 1), columns))
    expected = np.column_stack([np.convolve(column, weights, mode="valid")[::step] for column in values.T])
    np.testing.assert_allclose(decimated(weights, values, step), expected, atol=1e-12)


def test_a_column_is_the_same_to_the_last_bit_alone_and_among_others() -> None:
    random = np.random.default_rng(18)
    weights, values = random.normal(size=31), random.normal(size=(203, 9))
    together = decimated(weights, values, 5)
    alone = np.column_stack([decimated(weights, values[:, [c]].copy(), 5)[:, 0] for c in range(values.shape[1])])
    assert np.array_equal(together, alone)
