"""Expected information of a flight not yet flown, against dense matrices built from finite differences."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from oracles.flight import central_difference, dense_gaussian
from problems import LIGHT, Problem, entry
from scipy.stats import norm

from aerosid.effects import ActiveEffect
from aerosid.effects.sensor import sensor_bias
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.estimation.maximum_likelihood import Refinement, refine
from aerosid.flight_model.axes import LONGITUDINAL
from aerosid.flight_model.flight import simulate_outputs
from aerosid.flight_model.simulation import steps
from aerosid.loop.next_flight.expected_information import (
    expected_deviations,
    expected_difference,
    needed_difference,
    probability_distinguished,
    prospect,
    shared_information,
)
from aerosid.loop.next_flight.predicted_flight import at_steady, planned_manoeuvre, sampling_ratio, steady_flight

Array = NDArray[np.float64]
PROBLEM = Problem(undeclared={("C_m", "delta_e^2"): -0.5}, duration=4.0, interval=0.05, elevator="doublet")
FREE = tuple((d.coefficient, d.term) for d in LIGHT.derivatives)


def fitted(term: str, bias: bool = False) -> tuple[Refinement, Manoeuvre]:
    """The record with one more term, and a sensor's bias where asked for."""
    log = PROBLEM.fly(7)
    model, manoeuvre = PROBLEM.prepared(log)
    free = (*FREE, entry("C_m", term))
    effects = (ActiveEffect(sensor_bias("theta", "rad", 1e-3), (0.0,)),) if bias else ()
    return refine(model.extended(free), [manoeuvre], free, effects=effects), manoeuvre


class Dense:
    """A model on a planned flight, everything stacked: outputs, their slopes by differences, one covariance matrix."""

    def __init__(self, estimate: Refinement, planned: Manoeuvre, state: Array, variance: Array) -> None:
        flight, model = planned.flight, estimate.model
        held = np.isfinite(flight.measured)
        places = model.indices(estimate.free)

        def outputs(values: Array, start: Array, deflection: Array) -> Array:
            inputs = flight.inputs.copy()
            inputs[:, model.columns.index("delta_e")] += deflection
            simulated, _ = simulate_outputs(start, flight._replace(inputs=inputs), values, model.table, model.constants)
            return simulated[held]

        def by_parameters(x: Array) -> Array:
            values = np.array(model.values)
            values[places] = x[: places.size]
            bias = np.zeros_like(flight.measured)
            if estimate.effects:
                bias[:, LONGITUDINAL.outputs.index("theta")] = x[places.size + 5]
            return outputs(values, x[places.size : places.size + 5], np.zeros(flight.time.size)) + bias[held]

        numbers = [value for active in estimate.effects for value in active.values]
        at = np.concatenate([np.array(model.values)[places], state, numbers])
        size = np.array([1e-3] * places.size + [1e-2, 1e-2, 1e-4, 1e-4, 1e-1] + [1e-4] * len(numbers))
        self.predicted = by_parameters(at)
        columns = central_difference(by_parameters, at, size)
        # The order that all flights share: free terms, effects; the initial state last.
        order = [*range(places.size), *range(places.size + 5, at.size), *range(places.size, places.size + 5)]
        self.columns = columns[:, order]
        still = np.zeros(flight.time.size)
        elevator = model.columns.index("delta_e") - 8
        paths = central_difference(
            lambda d: outputs(np.array(model.values), state, d), still, np.full(still.size, 1e-4)
        )
        spread = np.broadcast_to(variance, held.shape)[held]
        self.covariance = np.diag(spread) + flight.input_variance[elevator] * paths @ paths.T


@pytest.fixture(scope="module")
def pair() -> tuple[Refinement, Refinement, Manoeuvre, Array]:
    """The model with delta_e^2, its rival with delta_e^3 and a bias of theta, the planned flight, what it will show."""
    chosen, record = fitted("delta_e^2")
    rival, _ = fitted("delta_e^3", bias=True)
    steady = steady_flight(chosen, record)
    time = np.arange(51) * 0.1
    deflection = steps(time, 0.5, [(0.8, 0.05), (0.8, -0.05), (0.8, 0.025)])
    planned = planned_manoeuvre(record, steady, time, {"delta_e": deflection})
    outputs, _ = simulate_outputs(
        steady.state, planned.flight, np.array(chosen.model.values), chosen.model.table, chosen.model.constants
    )
    measured = np.where(np.isnan(planned.flight.measured), np.nan, outputs)
    shown = replace(planned, flight=planned.flight._replace(measured=measured))
    return chosen, rival, shown, steady.state


def seen(estimate: Refinement, record_interval: float, planned: Manoeuvre, state: Array) -> Refinement:
    ratio = record_interval / float(np.median(np.diff(planned.flight.time)))
    return at_steady(estimate, state, ratio)


def marginal(estimate: Refinement) -> Array:
    """The record's information on what all flights share, from the inverse of the whole."""
    free = len(estimate.free)
    shared = [*range(free), *range(free + 5, estimate.information.shape[0])]
    return np.linalg.inv(np.linalg.pinv(estimate.information, rcond=1e-14, hermitian=True)[np.ix_(shared, shared)])


@pytest.mark.parametrize("repeats", [1, 3])
def test_the_expected_difference_is_that_of_a_dense_least_squares_problem(
    pair: tuple[Refinement, Refinement, Manoeuvre, Array], repeats: int
) -> None:
    _, rival, planned, state = pair
    estimate = seen(rival, PROBLEM.interval, planned, state)
    ahead = prospect(estimate, planned)
    dense = Dense(rival, planned, state, estimate.variance)
    held = np.isfinite(planned.flight.measured)
    residual = planned.flight.measured[held] - dense.predicted
    factor = np.linalg.cholesky(dense.covariance)
    white, columns = np.linalg.solve(factor, residual), np.linalg.solve(factor, dense.columns)
    assert white @ white > 50.0  # something is there to be explained
    known = marginal(rival)
    count = known.shape[0]
    # Every repeat has an initial state of its own; leaving the record's estimate costs what the record knows.
    rows = [np.hstack([np.linalg.cholesky(known).T, np.zeros((count, 5 * repeats))])]
    targets = [np.zeros(count)]
    for n in range(repeats):
        states = np.zeros((white.size, 5 * repeats))
        states[:, 5 * n : 5 * n + 5] = columns[:, count:]
        rows.append(np.hstack([columns[:, :count], states]))
        targets.append(white)
    stacked, target = np.vstack(rows), np.concatenate(targets)
    scale = np.linalg.norm(stacked, axis=0)
    step = np.linalg.lstsq(stacked / scale, target, rcond=1e-13)[0]
    left = target - (stacked / scale) @ step
    found = expected_difference(shared_information(rival), ahead, repeats)
    assert found == pytest.approx(float(left @ left), rel=2e-3)
    assert found < 0.9 * repeats * float(white @ white)  # the rival's freedom counts


def test_expected_deviations_are_those_of_the_dense_fisher_information(
    pair: tuple[Refinement, Refinement, Manoeuvre, Array],
) -> None:
    chosen, _, planned, state = pair
    estimate = seen(chosen, PROBLEM.interval, planned, state)
    dense = Dense(chosen, planned, state, estimate.variance)
    new = dense_gaussian(np.zeros(dense.predicted.size), dense.covariance, dense.columns).information
    count = len(chosen.free)
    total = new.copy()
    total[:count, :count] += marginal(chosen)
    scale = np.sqrt(np.diag(total))
    expected = np.sqrt(np.diag(np.linalg.inv(total / np.outer(scale, scale))))[:count] / scale[:count]
    found = expected_deviations(shared_information(chosen), prospect(estimate, planned))
    assert found == pytest.approx(expected, rel=1e-3)
    before = np.sqrt(np.diag(np.linalg.inv(marginal(chosen))))
    assert np.all(found < before)


def test_a_model_cannot_be_told_from_itself(pair: tuple[Refinement, Refinement, Manoeuvre, Array]) -> None:
    chosen, _, planned, state = pair
    ahead = prospect(seen(chosen, PROBLEM.interval, planned, state), planned)
    assert expected_difference(shared_information(chosen), ahead) == pytest.approx(0.0, abs=1e-9)


def test_noise_scaled_to_the_interval_makes_information_independent_of_it() -> None:
    """Half the samples of half the noise density each: the same flight, the same information to the step's share."""
    chosen, record = fitted("delta_e^2")
    steady = steady_flight(chosen, record)
    spreads = []
    for interval in (0.05, 0.1):
        time = np.arange(round(8.0 / interval) + 1) * interval
        deflection = np.interp(time, [1.0, 1.2, 2.0, 2.4, 3.2, 3.4], [0.0, 0.05, 0.05, -0.05, -0.05, 0.0])
        planned = planned_manoeuvre(record, steady, time, {"delta_e": deflection})
        estimate = at_steady(chosen, steady.state, sampling_ratio(record, time))
        spreads.append(expected_deviations(shared_information(chosen), prospect(estimate, planned)))
    assert spreads[1] == pytest.approx(spreads[0], rel=0.03)


def test_steady_flight_stays_steady() -> None:
    chosen, record = fitted("delta_e^2")
    steady = steady_flight(chosen, record)
    time = np.arange(200) * 0.05
    planned = planned_manoeuvre(record, steady, time, {"delta_e": np.zeros(time.size)})
    model = chosen.model
    _, states = simulate_outputs(steady.state, planned.flight, np.array(model.values), model.table, model.constants)
    assert np.max(np.abs(states[:, :4] - steady.state[:4]), axis=0) == pytest.approx([0.0] * 4, abs=1e-6)
    assert steady.airspeed == pytest.approx(100.0, abs=0.5)


@pytest.mark.parametrize(("difference", "present"), [(4.0, 0.0), (25.0, 3.0), (60.0, 3.0)])
def test_probabilities_are_those_of_simulated_least_squares(difference: float, present: float) -> None:
    """Data of one of two models at a distance: how often -2 ln L speaks for it by the reach."""
    generator = np.random.default_rng(3)
    apart = np.zeros(5)
    apart[2] = np.sqrt(difference)
    noise = generator.standard_normal((200_000, 5))
    rise = np.sum((noise + apart) ** 2, axis=1) - np.sum(noise**2, axis=1)
    share = float(np.mean(rise - present > 6.0))
    assert probability_distinguished(difference, present, 6.0) == pytest.approx(share, abs=0.005)


def test_the_needed_difference_is_where_the_probability_is_95_per_cent() -> None:
    for present, reach in ((0.0, 6.0), (-3.0, 6.0), (5.0, 1.0)):
        needed = needed_difference(present, reach, 0.95)
        assert probability_distinguished(needed, present, reach) == pytest.approx(0.95, abs=1e-9)
        assert probability_distinguished(needed, present, reach) == pytest.approx(
            norm.cdf((needed - abs(present) - reach) / (2.0 * np.sqrt(needed)))
        )


def test_unmeasured_altitude_says_nothing_and_breaks_nothing() -> None:
    chosen, record = fitted("delta_e^2")
    held = np.array([name != "h" for name in LONGITUDINAL.outputs])
    without = replace(
        record,
        outputs=tuple(name for name in record.outputs if name != "h"),
        flight=record.flight._replace(measured=np.where(held, record.flight.measured, np.nan)),
    )
    steady = steady_flight(chosen, without)
    time = np.arange(60) * 0.05
    planned = planned_manoeuvre(without, steady, time, {"delta_e": steps(time, 0.5, [(0.5, 0.05), (0.5, -0.05)])})
    estimate = at_steady(chosen, steady.state, 1.0)
    spread = expected_deviations(shared_information(chosen), prospect(estimate, planned))
    assert np.all(np.isfinite(spread))
    assert np.all(spread > 0.0)
