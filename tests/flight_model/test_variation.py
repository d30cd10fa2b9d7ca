"""The response kernel: its states against the plain integrator, its sensitivities against differences of flights."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from numpy.typing import NDArray
from problems import Problem

from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.flight_model.axes import LONGITUDINAL
from aerosid.flight_model.flight import Flight, simulate_outputs
from aerosid.flight_model.response import make_directions, make_trace, make_trace_carry, trace_stretch
from aerosid.flight_model.terms import parse_term
from aerosid.signals.trace import Trace

Array = NDArray[np.float64]
STEPS = (1e-2, 1e-2, 1e-4, 1e-4, 1e-2)


class Case:
    """One flight with terms that make the equations implicit and curved, and changes of its elevator."""

    def __init__(self, substeps: int, interval: float = 0.05) -> None:
        problem = Problem(duration=4.0, interval=interval)
        model, manoeuvre = problem.prepared(problem.fly())
        further = {("C_m", "alpha^2"): -1.7, ("C_m", "alpha_dot_hat"): -4.0, ("C_Z", "pos(alpha + 0.3)^2"): -1.0}
        entries = {(name, parse_term(text)): value for (name, text), value in further.items()}
        model = model.extended(entries)
        values = model.values.copy()
        values[-len(entries) :] = list(entries.values())
        self.model = model.with_values(values)
        self.manoeuvre: Manoeuvre = manoeuvre
        self.flight: Flight = manoeuvre.flight._replace(substeps=substeps)
        generator = np.random.default_rng(1)
        samples, extra = self.flight.time.size, self.flight.inputs.shape[1] - 8
        self.moves = 0.1 * np.cumsum(generator.standard_normal((samples, extra, 2)), axis=0)
        self.free = np.arange(self.model.values.size)
        speed, alpha = 100.0, 0.03
        self.state = np.array([speed * np.cos(alpha), speed * np.sin(alpha), 0.05, alpha, 800.0])

    def traced(self, stretches: int = 1) -> Trace:
        samples, extra = self.flight.time.size, self.moves.shape[1]
        width = 1 + self.free.size + 5 + 2
        moved = [dict(enumerate(along.T)) for along in np.moveaxis(self.moves, 2, 0)]
        directions = make_directions(moved, np.array([width - 1, width - 2]), samples, extra)
        carry = make_trace_carry(self.state, self.free.size, 2)
        parts = []
        bounds = np.linspace(0, samples, stretches + 1).astype(int)
        for begin, stop in itertools.pairwise(bounds.tolist()):
            trace = make_trace(stop - begin, extra, width, LONGITUDINAL)
            constants, table = self.model.constants, self.model.table
            arguments = (np.array(self.model.values), self.free, table, constants, directions, trace)
            assert trace_stretch(begin, stop, carry, self.flight, *arguments)
            parts.append(trace)
        joined = [np.concatenate(arrays) for arrays in zip(*(part[:-1] for part in parts), strict=True)]
        return Trace(*joined, parts[0].sizes)

    def outputs(self, point: Array) -> Array:
        """Outputs with other values, state and elevator: what the columns are slopes of."""
        count = self.free.size
        inputs = self.flight.inputs.copy()
        inputs[:, 8:] += self.moves @ point[count + 5 :][::-1]
        model = self.model.with_values(point[:count])
        flight = self.flight._replace(inputs=inputs)
        found, _ = simulate_outputs(
            point[count : count + 5].copy(), flight, np.array(model.values), model.table, model.constants
        )
        return found

    def differences(self) -> Array:
        """Central differences of the outputs, (N, 8, M), of fourth order."""
        point = np.concatenate([self.model.values, self.state, np.zeros(2)])
        steps = np.concatenate([1e-3 * np.maximum(np.abs(self.model.values), 0.1), STEPS, [1e-3, 1e-3]])
        columns = []
        for n, step in enumerate(steps):
            sides = []
            for share in (2.0, 1.0, -1.0, -2.0):
                beside = point.copy()
                beside[n] += share * step
                sides.append(self.outputs(beside))
            far, near, other, otherwise = sides
            columns.append((8.0 * (near - other) - (far - otherwise)) / (12.0 * step))
        return np.stack(columns, axis=2)


def _error(case: Case, wanted: Array) -> float:
    """Largest error of the columns over the largest number of each column and output."""
    found = case.traced().block[:, :, 1:]
    held = np.isfinite(case.flight.measured).all(axis=0)
    size = np.abs(wanted).max(axis=0)
    return float(np.max((np.abs(found - wanted).max(axis=0) / np.where(size > 0.0, size, 1.0))[held]))


@pytest.mark.parametrize("substeps", [1, 2, 3, 4])
def test_states_are_those_of_the_simulation(substeps: int) -> None:
    case = Case(substeps)
    wanted, _ = simulate_outputs(
        case.state, case.flight, np.array(case.model.values), case.model.table, case.model.constants
    )
    assert_allclose(case.traced().outputs, wanted, rtol=1e-12, atol=1e-12)


def test_sensitivities_converge_to_those_of_the_flight_with_the_fourth_power_of_the_substep() -> None:
    wanted = Case(64).differences()
    counts = np.array([2, 4, 8])
    errors = np.array([_error(Case(int(n)), wanted) for n in counts])
    assert np.polyfit(np.log(counts), np.log(errors), 1)[0] == pytest.approx(-4.0, abs=0.5)
    assert _error(Case(3), wanted) < errors[0]


def test_sensitivities_are_slopes_of_the_simulation_where_the_substep_is_the_usual_one() -> None:
    problem = Problem(duration=4.0, interval=0.03)
    _, manoeuvre = problem.prepared(problem.fly())
    case = Case(manoeuvre.flight.substeps, 0.03)
    assert _error(case, case.differences()) < 3e-6


def test_sensitivities_of_an_elevator_held_between_samples_are_slopes_of_the_simulation() -> None:
    problem = Problem(duration=4.0, interval=0.03)
    _, manoeuvre = problem.prepared(problem.fly())
    case = Case(manoeuvre.flight.substeps, 0.03)
    linear = case.differences()
    case.flight = case.flight._replace(held=np.array([8]), ramp=0.3)
    assert _error(case, case.differences()) < 3e-6
    assert _error(case, linear) > 1e-2


def test_directions_hold_every_change_once() -> None:
    """Of one input, of two, of none and of the last, in an order that is not that of the inputs."""
    generator = np.random.default_rng(2)
    moved = [{j: generator.standard_normal(6) for j in each} for each in ([2], [], [0, 3], [0], [2, 0], [3])]
    places = np.array([7, 3, 9, 4, 8, 5])
    found = make_directions(moved, places, 6, 4)
    dense = np.zeros((6, 4, 10))
    for j, (first, stop, begin) in enumerate(zip(found.first, found.stop, found.begin, strict=True)):
        for d in range(first, stop):
            dense[:, j, found.places[d]] += found.inputs[:, begin + d - first]
    for changes, place in zip(moved, places, strict=True):
        for j in range(4):
            assert_array_equal(dense[:, j, place], changes.get(j, np.zeros(6)))
    assert sorted(found.places) == sorted(places)


def test_a_direction_of_one_input_is_not_held_for_the_others() -> None:
    moved = [{j: np.ones(5)} for j in (1, 0, 1, 2, 0)]
    assert make_directions(moved, np.arange(5), 5, 3).inputs.shape == (5, 5)


@pytest.mark.parametrize("ramp", [1.0, 0.3])
def test_transition_and_inputs_move_the_next_sample(ramp: float) -> None:
    """The linearisation from sample to sample, carried on, gives the columns of the initial state."""
    case = Case(3)
    case.flight = case.flight._replace(held=np.array([8]), ramp=ramp)
    trace = case.traced()
    state, moved = np.eye(5), np.zeros(5)
    count, held = case.free.size, np.isfinite(case.flight.measured[0])
    for k in range(case.flight.time.size - 1):
        found = trace.block[k, held, 1 + count : 6 + count]
        assert_allclose(trace.outputs_x[k][held] @ state, found, atol=1e-8)
        moved = trace.transition[k] @ moved
        moved += trace.start[k] @ case.moves[k, :, 1] + trace.end[k] @ case.moves[k + 1, :, 1]
        state = trace.transition[k] @ state
    wanted = trace.outputs_x[-1] @ moved + trace.outputs_u[-1] @ case.moves[-1, :, 1]
    assert_allclose(trace.block[-1, held, -2], wanted[held], atol=1e-8)


def test_a_record_cut_into_stretches_gives_the_same() -> None:
    case = Case(3)
    whole, cut = case.traced(), case.traced(stretches=3)
    for one, other in zip(whole[:-1], cut[:-1], strict=True):
        assert_allclose(one, other, rtol=1e-12, atol=1e-12)


def test_only_channels_that_were_recorded_have_columns() -> None:
    case = Case(2)
    measured = case.flight.measured.copy()
    measured[5, 1] = np.nan
    measured[:, 4] = np.nan
    case.flight = case.flight._replace(measured=measured)
    block = case.traced().block
    assert block[5, 1].any()  # a slow sensor looks back over what is missing
    assert not block[:, 4].any()
