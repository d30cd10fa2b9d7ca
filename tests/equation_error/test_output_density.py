"""The determinant by which residuals' density becomes that of the motion, against modes, differences and diffusions."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from equations_decided import frames_of
from lateral_flights import PITCH, SIDE, Lateral, aircraft

from aerosid.equation_error.equations.points import Point
from aerosid.equation_error.regression.estimate import Estimate, estimate
from aerosid.equation_error.regression.least_squares import solve
from aerosid.equation_error.regression.output_density import rates_matrix

AIRCRAFT = {
    "lateral": aircraft(SIDE),
    "six": aircraft({**PITCH, **SIDE}),
    # Its pitching moment depends on the forces, which is a product of derivatives.
    "unsteady": aircraft({**PITCH, **SIDE, ("C_m", "alpha_dot_hat"): -4.0}),
}


@cache
def estimated(name: str = "six") -> Estimate:
    body = AIRCRAFT[name]
    logs = [Lateral(seed=8800 + n, interval=0.04).log(name=f"flight {n}") for n in range(2)]
    model, _, fitted = frames_of(body, logs[:1], logs[1:], ())
    free = tuple((d.coefficient, d.term) for d in body.derivatives)
    return estimate(replace(fitted, of_recorded_motion=True), Point(model, free, ()))


@pytest.mark.parametrize("body", AIRCRAFT)
def test_it_is_the_product_over_modes_and_frequencies(body: str) -> None:
    found = estimated(body)
    density = found.design.density
    assert density is not None
    (motion,) = density.motions
    total = density.logarithm(found.solution.values)
    (recording,) = [each for each in found.problem.recordings if each.fitted]
    modes = np.linalg.eigvals(rates_matrix(found.point.model, recording))
    rows = found.design.rows(0)
    band = recording.time_in_band
    frequencies = (
        2.0 * np.pi * np.fft.rfftfreq(rows.stop - rows.start, band[1] - band[0])[1 : (rows.stop - rows.start + 1) // 2]
    )
    np.testing.assert_allclose(motion.frequencies, frequencies)
    expected = 2.0 * np.sum(np.log(np.abs(1.0 - modes[:, None] / (1j * frequencies))))
    # The constants of the coefficients, which change forces with the airspeed, differ by record.
    assert total == pytest.approx(expected, rel=0.01)


def test_its_gradient_is_that_of_differences() -> None:
    found = estimated()
    density, values = found.design.density, found.solution.values
    assert density is not None
    gradient = density.gradient(values)
    for place in density.places:
        step = 1e-5 * max(abs(values[place]), 1.0)
        sides = [density.logarithm(values + sign * step * np.eye(values.size)[place]) for sign in (1.0, -1.0)]
        assert gradient[place] == pytest.approx((sides[0] - sides[1]) / (2.0 * step), rel=1e-4, abs=1e-4)


def test_in_a_wide_band_it_is_the_damping_of_all_modes_over_half_the_time() -> None:
    """Ito's correction of a diffusion's likelihood: minus half the trace of A, where all modes are damped."""
    found = estimated()
    density = found.design.density
    assert density is not None
    (motion,) = density.motions
    seconds = 2.0 * np.pi / motion.frequencies[0]
    wide = motion._replace(frequencies=motion.frequencies[0] * np.arange(1, 40_000))
    modes = np.linalg.eigvals(motion.known + np.tensordot(found.solution.values[density.places], motion.slopes, axes=1))
    total = replace(density, motions=(wide,)).logarithm(found.solution.values)
    # A sum from the first frequency on lacks half of the term at zero, of modes slower than the record.
    fast = [mode for mode in modes if abs(mode) * seconds > 30.0]
    slow = [mode for mode in modes if abs(mode) * seconds <= 30.0]
    lacking = sum(2.0 * np.sum(np.log(np.abs(1.0 - mode / (1j * wide.frequencies)))) for mode in slow)
    at_zero = sum(np.log(abs(mode) * seconds) for mode in fast)
    assert total - lacking + at_zero == pytest.approx(-np.sum(np.real(fast)) * seconds / 2.0, rel=0.02)


def test_a_regression_ends_where_the_density_of_the_motion_is_highest() -> None:
    found = estimated()
    design, weights = found.design, found.solution.weights
    best = solve(design, weights)
    plain = solve(replace(design, density=None), weights)
    assert design.density is not None
    # Of least squares plus determinant the gradient is zero.
    slope = np.linalg.solve(best.covariance, plain.values - best.values) + design.density.gradient(best.values)
    scale = np.sqrt(np.diag(np.linalg.inv(best.covariance)))
    assert np.max(np.abs(slope / scale)) < 0.02


def test_without_an_unknown_it_is_that_of_the_unknown_at_zero() -> None:
    found = estimated()
    density, values = found.design.density, found.solution.values
    assert density is not None
    place = int(density.places[3])
    other = next(p for p in range(values.size) if p not in density.places)
    zeroed = values.copy()
    zeroed[place] = 0.0
    reduced, rest = density.without({place, other}), np.delete(zeroed, [place, other])
    assert reduced.logarithm(rest) == pytest.approx(density.logarithm(zeroed))
    np.testing.assert_allclose(reduced.gradient(rest), np.delete(density.gradient(zeroed), [place, other]))


def test_derivatives_that_are_hardly_told_apart_stay_where_least_squares_leaves_them() -> None:
    """C_m q_hat and alpha_dot_hat: from white weights their covariance is wide, the determinant not linear in it."""
    found = estimated("unsteady")
    plain = estimate(replace(found.problem, of_recorded_motion=False), found.point)
    errors = np.sqrt(np.diag(plain.solution.covariance))
    assert np.max(np.abs(found.solution.values - plain.solution.values) / errors) < 2.0
