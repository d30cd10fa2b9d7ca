"""Generalised least squares with autoregressive residuals, against dense covariance matrices."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.linalg import toeplitz
from scipy.signal import lfilter

from aerosid.equation_error.regression.coloured_regression import Colour, colour_of, likeliest_colour
from aerosid.equation_error.regression.design import Design, Weights
from aerosid.equation_error.regression.least_squares import log_likelihoods, regress, solve
from aerosid.equation_error.regression.residual_colours import Coloured, ColourGroups, coloured
from aerosid.equation_error.settings import EquationErrorSettings

Array = NDArray[np.float64]

COLOURS = {
    "white": np.array([1.0]),
    "drift": np.array([1.0, -0.9]),
    "resonance": np.real(np.poly([0.8 * np.exp(0.7j), 0.8 * np.exp(-0.7j), 0.5, -0.3])),
}


def colours_of(parts: list[Array], order: int, longest: float = np.inf, *, may_differ: bool = False) -> Coloured:
    """Colours of residuals that are one group."""
    bounds = np.cumsum([0, *(part.size for part in parts)])
    groups = ColourGroups(np.arange(len(parts)), np.array([0, len(parts)]), np.array([longest]), np.array([may_differ]))
    return coloured(np.concatenate(parts), bounds, np.zeros(len(parts)), groups, order)


def colour_found(parts: list[Array], longest: float) -> Colour:
    """The shared colour of residuals, of order four."""
    return colours_of(parts, 4, longest).colours[0]


def covariance(weights: Array, samples: int) -> Array:
    """Dense covariance of a stationary autoregression with unit innovations, from its long impulse response."""
    impulse = lfilter([1.0], weights, np.concatenate([[1.0], np.zeros(4000)]))
    lags = [float(impulse[: impulse.size - k] @ impulse[k:]) for k in range(samples)]
    return np.asarray(toeplitz(lags))


def regression(weights: Array, seed: int) -> tuple[Design, Weights, Array, list[Array]]:
    """Two segments of one equation of different sizes, with three unknowns."""
    generator = np.random.default_rng(seed)
    lengths, sizes = (60, 45), np.array([0.3, 2.0])
    columns = generator.standard_normal((sum(lengths), 3)).cumsum(axis=0)
    target = columns @ np.array([1.0, -2.0, 0.5]) + generator.standard_normal(sum(lengths))
    bounds = np.array([0, lengths[0], sum(lengths)])
    design = Design(
        ((0, "C_m"), (1, "C_m")),
        (("C_m", 0.1), ("C_m", 0.1)),
        bounds,
        target,
        columns,
        (("term", 0), ("term", 1), ("term", 2)),
        np.zeros(3),
        np.zeros(2),
        (None, None),
    )
    dense = [size**2 * covariance(weights, n) for size, n in zip(sizes, lengths, strict=True)]
    return design, Weights((colour_of(weights),) * 2, sizes), target, dense


@pytest.mark.parametrize("weights", COLOURS.values(), ids=COLOURS)
def test_values_and_covariance_are_those_of_dense_generalised_least_squares(weights: Array) -> None:
    design, given, target, dense = regression(weights, 1)
    inverse = [np.linalg.inv(part) for part in dense]
    rows = [design.rows(0), design.rows(1)]
    gram = sum(design.columns[r].T @ w @ design.columns[r] for r, w in zip(rows, inverse, strict=True))
    right = sum(design.columns[r].T @ w @ target[r] for r, w in zip(rows, inverse, strict=True))
    solution = solve(design, given)
    np.testing.assert_allclose(solution.values, np.linalg.solve(gram, right), rtol=1e-8)
    np.testing.assert_allclose(solution.covariance, np.linalg.inv(gram), rtol=1e-7)


@pytest.mark.parametrize("weights", COLOURS.values(), ids=COLOURS)
def test_the_likelihood_is_that_of_the_dense_normal_distribution(weights: Array) -> None:
    design, given, _, dense = regression(weights, 2)
    solution = solve(design, given)
    exact = 0.0
    for s, part in enumerate(dense):
        left = solution.residuals[design.rows(s)]
        exact -= 0.5 * (np.linalg.slogdet(part)[1] + left @ np.linalg.solve(part, left))
    assert sum(log_likelihoods(design, solution.whitened, given)) == pytest.approx(exact, rel=1e-9)
    assert solution.log_likelihood == pytest.approx(exact, rel=1e-9)


def test_a_prior_is_a_measurement_of_zero() -> None:
    design, given, _, _ = regression(COLOURS["drift"], 3)
    held = Design(
        design.segments,
        design.groups,
        design.bounds,
        design.target,
        design.columns,
        design.unknowns,
        np.array([0.0, 1e6, 0.0]),
        design.floors,
        design.instruments,
    )
    assert abs(solve(held, given).values[1]) < 1e-5


def test_burg_s_method_estimates_the_shared_colour() -> None:
    generator = np.random.default_rng(4)
    weights = COLOURS["resonance"]
    records = [size * lfilter([1.0], weights, generator.standard_normal(4000)) for size in (1.0, 50.0)]
    found = colour_found(records, np.inf)
    np.testing.assert_allclose(found.weights, weights, atol=0.05)


def test_pole_memory_is_bounded() -> None:
    walk = np.random.default_rng(5).standard_normal(800).cumsum()
    found = colour_found([walk], 10.0)
    assert np.max(np.abs(np.roots(found.weights))) <= np.exp(-0.1) + 1e-9
    free = colour_found([walk], np.inf)
    assert np.max(np.abs(np.roots(free.weights))) > 0.97


def two_records_with_steps(seed: int) -> tuple[Design, Array]:
    """One equation of two records of the same colour with steps of twelve innovations; (R,) one step."""
    generator = np.random.default_rng(seed)
    samples, moment = 240, 80
    step = np.repeat([0.0, 1.0], [moment, samples - moment])
    noise = [lfilter([1.0], [1.0, -0.6], generator.standard_normal(samples)) for _ in range(2)]
    target = np.concatenate([12.0 * step + each for each in noise])
    bounds = np.array([0, samples, 2 * samples])
    ones = np.kron(np.eye(2), np.ones((samples, 1)))
    design = Design(
        ((0, "C_X"), (1, "C_X")),
        (("C_X", 0.1), ("C_X", 0.1)),
        bounds,
        target,
        ones,
        (("one", 0), ("one", 1)),
        np.zeros(2),
        np.zeros(2),
        (None, None),
    )
    return design, np.concatenate([step, np.zeros(samples)])


@pytest.mark.parametrize("seed", range(5))
def test_a_step_in_one_record_gains_as_its_score_while_the_other_remains(seed: int) -> None:
    """The shared colour does not become less likely: at that colour the gain is the score's."""
    design, step = two_records_with_steps(seed)
    settings = EquationErrorSettings()
    base = regress(design, settings)
    wide = design.extended(step[:, None], [("trial", 0)])
    at_given_colour = solve(wide, base.weights).log_likelihood - base.log_likelihood
    gain = regress(wide, settings, base.weights, rounds=2).log_likelihood - base.log_likelihood
    assert at_given_colour > 20.0
    assert gain >= at_given_colour


def number_of_colours(parts: list[Array], order: int) -> int:
    """Of residuals whose records may share one."""
    return len({colour.weights.tobytes() for colour in colours_of(parts, order, may_differ=True).colours})


def highest_likelihood(parts: list[Array], order: int) -> float:
    """Ln L of residuals at their likeliest shared colour."""
    bounds, sizes = np.cumsum([0, *(part.size for part in parts)]), np.array([float(np.std(part)) for part in parts])
    return likeliest_colour(np.concatenate(parts), bounds, sizes, np.full(len(parts), 1e-12), order, 0.999)[-1]


def test_records_of_equal_colour_and_different_size_share_it() -> None:
    """Schwarz's penalty of four, 2 ln 800, is exceeded by chance by chi-square of four beyond 26.7: 2 in 1e5."""
    alone = 0
    for seed in range(60):
        generator = np.random.default_rng([31, seed])
        parts = [s * lfilter([1.0], [1.0, -0.6], generator.standard_normal(400)) for s in (1.0, 7.0)]
        alone += number_of_colours(parts, 4) - 1
    assert alone == 0


def test_records_of_different_colours_have_their_own() -> None:
    generator = np.random.default_rng(32)
    parts = [lfilter([1.0], [1.0, -pole], generator.standard_normal(300)) for pole in (0.9, -0.3)]
    assert number_of_colours(parts, 1) == 2
    rise = sum(highest_likelihood([part], 1) for part in parts) - highest_likelihood(parts, 1)
    # The same from dense covariance matrices: each record's maximum-likelihood pole alone, against one for both.

    def dense(pole: float, part: Array) -> float:
        matrix = covariance(np.array([1.0, -pole]), part.size)
        power = float(part @ np.linalg.solve(matrix, part)) / part.size
        return -0.5 * (np.linalg.slogdet(matrix)[1] + part.size * np.log(power))

    poles = np.linspace(-0.5, 0.95, 59)
    levels = np.array([[dense(pole, part) for pole in poles] for part in parts])
    expected = levels.max(axis=1).sum() - levels.sum(axis=0).max()
    assert rise == pytest.approx(expected, rel=0.03)


@pytest.mark.parametrize("seed", range(5))
def test_a_step_in_each_record_gains_as_in_a_single_record(seed: int) -> None:
    design, step = two_records_with_steps(seed)
    settings = EquationErrorSettings()
    first = slice(0, int(design.bounds[1]))
    alone = Design(
        design.segments[:1],
        design.groups[:1],
        design.bounds[:2],
        design.target[first],
        design.columns[first, :1],
        design.unknowns[:1],
        np.zeros(1),
        np.zeros(1),
        (None,),
    )
    base, base_alone = regress(design, settings), regress(alone, settings)
    both = regress(design.extended(step[:, None], [("trial", 0)]), settings, base.weights)
    one = regress(alone.extended(step[first, None], [("trial", 0)]), settings, base_alone.weights)
    gain, gain_alone = both.log_likelihood - base.log_likelihood, one.log_likelihood - base_alone.log_likelihood
    penalty = 0.5 * settings.order * np.log(design.target.size)
    # Burg's colours are within about one unit of ln L per record of the likeliest ones.
    assert gain > gain_alone - penalty - 2.0


def test_only_poles_of_long_memory_are_moved_inward() -> None:
    poles = np.array([0.999, 0.6 + 0.3j, 0.6 - 0.3j, -0.2])
    residuals = lfilter([1.0], np.real(np.poly(poles)), np.random.default_rng(3).standard_normal(20000))
    free, held = (colour_found([residuals], longest).weights for longest in (np.inf, 50.0))
    limit = np.exp(-1.0 / 50.0)
    found = np.roots(free)
    np.testing.assert_allclose(held, np.real(np.poly(found * np.minimum(1.0, limit / np.abs(found)))), atol=1e-12)
    assert np.abs(np.roots(held)).max() == pytest.approx(limit)


def test_segments_are_whitened_by_their_own_colours() -> None:
    generator = np.random.default_rng(4)
    colours = [colour_of(np.array(weights)) for weights in ([1.0, -0.8, 0.2], [1.0], [1.0, -0.5])]
    bounds, sizes = np.array([0, 30, 45, 80]), np.array([0.3, 2.0, 1.0])
    values = generator.standard_normal((80, 3))
    weights = Weights(tuple(colours), sizes)
    expected = [
        colour.whitened(values[a:b]) / size
        for colour, size, a, b in zip(colours, sizes, bounds[:-1], bounds[1:], strict=True)
    ]
    np.testing.assert_allclose(weights.whitened(values, bounds), np.vstack(expected), atol=1e-13)


def test_groups_are_coloured_independently_of_each_other_and_of_their_order() -> None:
    generator = np.random.default_rng(6)
    poles = (0.9, -0.4, 0.9, -0.4, 0.2)
    parts = [lfilter([1.0], [1.0, -pole], generator.standard_normal(300)) for pole in poles]
    bounds, floors = np.cumsum([0, *(part.size for part in parts)]), np.array([0.0, 0.0, 0.0, 50.0, 0.0])
    members, first = np.array([0, 2, 4, 1, 3]), np.array([0, 3, 5])
    groups = ColourGroups(members, first, np.array([np.inf, 20.0]), np.array([True, False]))
    found = coloured(np.concatenate(parts), bounds, floors, groups, 3)
    one = colours_of([parts[0], parts[2], parts[4]], 3, may_differ=True)
    assert len({colour.weights.tobytes() for colour in one.colours}) == 3
    for s, colour in zip((0, 2, 4), one.colours, strict=True):
        np.testing.assert_array_equal(found.colours[s].weights, colour.weights)
        np.testing.assert_array_equal(found.colours[s].start, colour_of(colour.weights).start)
    other = found.colours[1], found.colours[3]
    np.testing.assert_array_equal(other[0].weights, other[1].weights)
    for s, colour in enumerate(found.colours):
        innovations = colour.whitened(parts[s][:, None])[:, 0]
        np.testing.assert_allclose(found.white[bounds[s] : bounds[s + 1]], innovations, atol=1e-12)
        size = max(float(np.sqrt(np.mean(innovations**2))), floors[s])
        assert found.sizes[s] == pytest.approx(size, rel=1e-12)
