"""Products of the columns of all outputs: those of each output, and nothing of one that was not measured."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from aerosid.signals.column_products import output_products


@given(st.sets(st.integers(0, 4)), st.integers(0, 2**32 - 1))
def test_products_of_all_outputs_are_those_of_each(measured: set[int], seed: int) -> None:
    block = np.random.default_rng(seed).standard_normal((30, 5, 7))
    block[:, sorted(set(range(5)) - measured)] = 0.0
    found = output_products(block, np.array(sorted(measured), dtype=np.int64))
    for i in range(5):
        assert_allclose(found[i], block[:, i].T @ block[:, i], rtol=1e-12, atol=1e-12)
