"""Sine and cosine in one pass."""

from __future__ import annotations

import cmath

import numpy as np
from numpy.testing import assert_allclose

from aerosid.signals.sine_and_cosine import sine_and_cosine


def test_they_are_the_parts_of_the_exponential_also_of_every_other_element() -> None:
    angle = np.linspace(-7.0, 7.0, 41)
    for each in (angle, angle[::2]):
        sine, cosine = sine_and_cosine(each)
        turned = np.array([cmath.exp(1j * value) for value in each.tolist()])
        assert_allclose(cosine + 1j * sine, turned, rtol=1e-15, atol=1e-15)
