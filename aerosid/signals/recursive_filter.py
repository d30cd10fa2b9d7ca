"""Digital Butterworth low-pass by the bilinear transform, and recursive filters in second-order sections.

scipy.signal has the same; with all that it imports it takes longer to load than a flight takes to filter a thousand
times. It is what the tests compare with.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from aerosid.compiled import njit

FloatArray = NDArray[np.float64]


def butterworth_poles(order: int) -> NDArray[np.complex128]:
    """The (order,) poles of the Butterworth low-pass of unit cut-off, rad/s, evenly spaced on the left half circle."""
    angles = math.pi * (2.0 * np.arange(order) + order + 1.0) / (2.0 * order)
    return np.asarray(np.exp(1j * angles), dtype=np.complex128)


def butterworth_sections(order: int, cut_off_hz: float, interval: float) -> FloatArray:
    """Sections (S, 5) of the digital low-pass, each b0, b1, b2, a1, a2 with a gain of one at rest.

    Parameters
    ----------
    order : int
    cut_off_hz : float
        Half-power frequency, Hz; below half the sampling frequency.
    interval : float
        Between samples, s.

    Raises
    ------
    ValueError
        Where the cut-off is not between 0 and half the sampling frequency.

    Notes
    -----
    s = (1 - z^-1)/(1 + z^-1) turns each pair of poles, K^2/(s^2 + 2 K c s + K^2), into a section; K = tan(pi f T) is
    the cut-off before the transform bends the frequency axis, -c the real part of the pole of unit cut-off.

    References
    ----------
    Oppenheim & Schafer, Discrete-Time Signal Processing, 3rd ed., section 7.2.2.
    """
    if not 0.0 < cut_off_hz * interval < 0.5:
        raise ValueError(f"the cut-off is {cut_off_hz} Hz, expected between 0 and {0.5 / interval} Hz")
    bent = math.tan(math.pi * cut_off_hz * interval)
    poles = butterworth_poles(order)
    sections = []
    if order % 2:
        sections.append([bent / (1.0 + bent), bent / (1.0 + bent), 0.0, (bent - 1.0) / (bent + 1.0), 0.0])
    for damping in -poles.real[: order // 2][::-1]:
        whole = 1.0 + 2.0 * damping * bent + bent**2
        forward = bent**2 / whole
        away = (1.0 - 2.0 * damping * bent + bent**2) / whole
        sections.append([forward, 2.0 * forward, forward, 2.0 * (bent**2 - 1.0) / whole, away])
    return np.array(sections)


def steady_state(sections: FloatArray, values: FloatArray) -> FloatArray:
    """The state (S, 2, C) of low-pass sections of unit gain after constant input `values` (C,) for ever."""
    b0, _, b2, _, a2 = sections.T
    per_unit = np.stack([1.0 - b0, b2 - a2], axis=1)
    return np.asarray(per_unit[:, :, None] * values)


@njit
def filtered(sections: FloatArray, values: FloatArray, state: FloatArray) -> FloatArray:
    """The channels of `values` (N, C) through the sections (S, 5), one after the other.

    `state` (S, 2, C) is that before the first sample, and afterwards that after the last. Transposed direct form II.
    """
    result = values.copy()
    for s in range(sections.shape[0]):
        b0, b1, b2, a1, a2 = sections[s, 0], sections[s, 1], sections[s, 2], sections[s, 3], sections[s, 4]
        for c in range(result.shape[1]):
            near, far = state[s, 0, c], state[s, 1, c]
            for n in range(result.shape[0]):
                entering = result[n, c]
                leaving = b0 * entering + near
                near = b1 * entering - a1 * leaving + far
                far = b2 * entering - a2 * leaving
                result[n, c] = leaving
            state[s, 0, c], state[s, 1, c] = near, far
    return result


def filtered_from_rest(sections: FloatArray, series: FloatArray) -> FloatArray:
    """One series (N,) through the sections, nothing having come before."""
    return filtered(sections, _columns(series), np.zeros((sections.shape[0], 2, 1)))[:, 0]


def filtered_from_steady(sections: FloatArray, values: FloatArray) -> FloatArray:
    """Channels (N, ...) through low-pass sections of unit gain that the first sample had always entered."""
    columns = _columns(values)
    return filtered(sections, columns, steady_state(sections, columns[0])).reshape(values.shape)


def filtered_both_ways(sections: FloatArray, values: FloatArray) -> FloatArray:
    """Channels (N, ...) forward and backward through low-pass sections of unit gain, without lag.

    Both ends are continued by the record turned by 180 degrees about its end value, three times the filter's length.
    """
    columns = _columns(values)
    reach = min(3 * (2 * sections.shape[0] + 1), columns.shape[0] - 1)
    forward = filtered_from_steady(sections, turned_at_ends(columns, columns[0], columns[-1], reach, reach))
    backward = filtered_from_steady(sections, forward[::-1])[::-1]
    return np.asarray(backward[reach : reach + columns.shape[0]].reshape(values.shape))


def turned_at_ends(
    values: FloatArray, first: FloatArray | float, last: FloatArray | float, before: int, after: int
) -> FloatArray:
    """A record continued at both ends by itself, turned by 180 degrees about its end values.

    Parameters
    ----------
    values : ndarray, shape (N, ...)
        Any unit.
    first, last : ndarray, shape (...), or float
        The end values: those of the record, or smoothed ones.
    before, after : int
        Samples that are added at the beginning and at the end, fewer than N.
    """
    beginning, end = 2.0 * first - values[before:0:-1], 2.0 * last - values[-2 : -after - 2 : -1]
    return np.concatenate([beginning, values, end])


def _columns(values: FloatArray) -> FloatArray:
    return np.ascontiguousarray(values, dtype=np.float64).reshape(values.shape[0], -1)
