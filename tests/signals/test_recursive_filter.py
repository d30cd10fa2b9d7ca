"""Recursive filters and decimation beside scipy.signal, whose design and recursion share nothing with ours."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import signal

from aerosid.signals.decimation import decimated, windowed_sinc
from aerosid.signals.recursive_filter import (
    butterworth_poles,
    butterworth_sections,
    filtered,
    filtered_both_ways,
    filtered_from_rest,
    filtered_from_steady,
    steady_state,
)


@given(order=st.integers(1, 10), share=st.floats(0.01, 0.45), interval=st.sampled_from([0.005, 0.02, 0.1]))
def test_the_design_has_the_response_of_scipys(order: int, share: float, interval: float) -> None:
    ours = butterworth_sections(order, share / interval, interval)
    whole = np.insert(ours, 3, 1.0, axis=1)
    frequencies = np.linspace(0.0, 0.49, 50)
    _, here = signal.sosfreqz(whole, frequencies, fs=1.0)
    _, there = signal.sosfreqz(signal.butter(order, share, fs=1.0, output="sos"), frequencies, fs=1.0)
    np.testing.assert_allclose(here, there, rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("order", [1, 2, 5, 8])
def test_poles_are_those_of_the_analog_prototype(order: int) -> None:
    theirs = signal.buttap(order)[1]
    np.testing.assert_allclose(np.sort_complex(butterworth_poles(order)), np.sort_complex(theirs), atol=1e-14)


@pytest.mark.parametrize("order", [1, 2, 3, 4, 7])
def test_filtering_is_scipys_from_rest_from_the_steady_state_and_both_ways(order: int) -> None:
    values = np.random.default_rng(order).standard_normal((300, 2, 3)).cumsum(axis=0)
    sections = signal.butter(order, 3.0, fs=50.0, output="sos")
    ours = butterworth_sections(order, 3.0, 0.02)
    close = {"rtol": 0.0, "atol": 1e-10 * np.abs(values).max()}
    rest = filtered_from_rest(ours, values[:, 0, 0])
    np.testing.assert_allclose(rest, signal.sosfilt(sections, values[:, 0, 0]), **close)
    first = signal.sosfilt_zi(sections)[:, :, None, None] * values[0]
    steady, _ = signal.sosfilt(sections, values, axis=0, zi=first)
    np.testing.assert_allclose(filtered_from_steady(ours, values), steady, **close)
    both = signal.sosfiltfilt(sections, values, axis=0, padlen=3 * (2 * len(ours) + 1))
    np.testing.assert_allclose(filtered_both_ways(ours, values), both, **close)


def test_a_record_in_pieces_is_filtered_as_a_whole() -> None:
    values = np.random.default_rng(3).standard_normal((200, 4))
    sections = butterworth_sections(4, 2.0, 0.02)
    state = steady_state(sections, values[0])
    pieces = np.concatenate([filtered(sections, part, state) for part in np.split(values, [1, 2, 57])])
    np.testing.assert_array_equal(pieces, filtered_from_steady(sections, values))


@pytest.mark.parametrize("cut_off", [0.0, 25.0, -1.0, np.nan])
def test_a_cut_off_beyond_half_the_sampling_frequency_is_refused(cut_off: float) -> None:
    with pytest.raises(ValueError, match=r"expected between 0 and 25\.0 Hz"):
        butterworth_sections(2, cut_off, 0.02)


@pytest.mark.parametrize(("length", "step"), [(11, 1), (31, 3), (51, 5)])
def test_decimation_is_every_nth_sample_of_the_convolution(length: int, step: int) -> None:
    weights = windowed_sinc(length, 0.9 / step)
    np.testing.assert_allclose(weights, signal.firwin(length, 0.9 / step, window="hamming"), rtol=0.0, atol=1e-15)
    lopsided = weights * np.linspace(0.5, 2.0, length)  # a symmetric filter is the same turned round
    values = np.random.default_rng(step).standard_normal((203, 3))
    ours = decimated(lopsided, values, step)
    for column, result in zip(values.T, ours.T, strict=True):
        np.testing.assert_allclose(result, np.convolve(column, lopsided, mode="valid")[::step], rtol=0.0, atol=1e-12)
