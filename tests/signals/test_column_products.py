"""Products of columns in groups: those that are wanted are the plain ones, the others are left out."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from aerosid.signals.column_products import column_products, columns_apart, output_products

GROUPS = st.lists(st.lists(st.integers(1, 9), min_size=1, max_size=4, unique=True), max_size=6)


@given(GROUPS, st.integers(0, 2**32 - 1))
def test_products_are_those_of_the_whole_where_some_group_or_none_holds_both(
    groups: list[list[int]], seed: int
) -> None:
    block = np.random.default_rng(seed).standard_normal((30, 3, 10))[:, 1, :]
    wanted = np.ones((10, 10), dtype=bool)
    grouped = sorted({column for group in groups for column in group})
    wanted[np.ix_(grouped, grouped)] = False
    for group in groups:
        wanted[np.ix_(group, group)] = True
    wanted[grouped, grouped] = True
    found = column_products(block, columns_apart(block.shape[1], groups))
    assert_allclose(found, np.where(wanted, block.T @ block, 0.0), rtol=1e-12, atol=1e-12)


@given(st.sets(st.integers(0, 4)), st.integers(0, 2**32 - 1))
def test_products_of_all_outputs_are_those_of_each(measured: set[int], seed: int) -> None:
    block = np.random.default_rng(seed).standard_normal((30, 5, 7))
    block[:, sorted(set(range(5)) - measured)] = 0.0
    found = output_products(block, np.array(sorted(measured), dtype=np.int64))
    for i in range(5):
        assert_allclose(found[i], block[:, i].T @ block[:, i], rtol=1e-12, atol=1e-12)
