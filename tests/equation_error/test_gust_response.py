"""A-priori response to gusts: its closed form, dense least squares, and flights in gusts.

In calm air its effect is shown on the Twin Otter (tests/recorded).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from equations_decided import declared
from numpy.testing import assert_allclose

from aerosid.aircraft import load_aircraft
from aerosid.aircraft.declared_model import declared_model
from aerosid.equation_error.equations.gust_response import expected_gust_responses
from aerosid.equation_error.regression.coloured_regression import colour_of
from aerosid.equation_error.regression.design import Design, Weights
from aerosid.equation_error.regression.expected_values import ExpectedValues, gust_responses_among
from aerosid.equation_error.regression.least_squares import regress, solve
from aerosid.flight_model.terms import parse_term
from benchmarks.turbulent_flights import BODIES, aircraft_of, flown

ALPHA = parse_term("alpha")


def test_a_lift_turns_its_sign_and_a_moment_has_the_lever_of_its_force() -> None:
    model = declared_model(load_aircraft("hfb320"), 100.0)
    lift, moment = ("C_L", ALPHA), ("C_m", ALPHA)
    slope, pitch = model.value(lift), model.value(moment)
    expected = expected_gust_responses(model)
    assert set(expected) == {"C_Z", "C_m"}
    assert expected["C_Z"].derivatives == {lift: (-0.5, slope)}
    assert expected["C_Z"].deviation == pytest.approx(0.5 * slope)
    assert expected["C_m"].derivatives == {moment: (0.5, pitch)}
    assert expected["C_m"].deviation == pytest.approx(np.hypot(0.5 * pitch, 0.1 * slope))
    # The relation of a term that is estimated, and of one that keeps its declared value.
    unknowns = [("gust", "C_Z"), ("term", lift), ("gust", "C_m")]
    relations = gust_responses_among({("gust", name): each for name, each in expected.items()}, unknowns)
    assert relations is not None
    for row, value, name in zip(relations.rows, relations.values, ("C_Z", "C_m"), strict=True):
        mean = 0.5 * (-slope if name == "C_Z" else pitch)
        at_mean = np.array([mean, slope, mean])
        one_beside = at_mean + expected[name].deviation * np.array([1.0, 0.0, 1.0])
        assert row @ at_mean == pytest.approx(value, abs=1e-12)
        assert row @ one_beside == pytest.approx(value + 1.0)
    assert gust_responses_among({("gust", "C_Z"): expected["C_Z"]}, [("term", lift)]) is None


def test_relations_between_unknowns_are_further_rows_of_least_squares() -> None:
    generator = np.random.default_rng(5)
    columns, target = generator.standard_normal((40, 4)), generator.standard_normal(40)
    expected = ExpectedValues(generator.standard_normal((2, 3)), generator.standard_normal(2))
    design = Design(
        segments=((0, "C_m"),),
        groups=(("C_m", 0.1),),
        bounds=np.array([0, 40]),
        target=target,
        columns=columns[:, :3],
        unknowns=(("a",), ("b",), ("c",)),
        inverse_deviations=np.array([0.0, 0.7, 0.0]),
        floors=np.zeros(1),
        instruments=(None,),
        expected=expected,
    ).extended(columns[:, 3:], [("d",)])
    found = solve(design, Weights((colour_of(np.ones(1)),), np.array([2.0])))
    rows = np.vstack([columns / 2.0, [0.0, 0.7, 0.0, 0.0], np.column_stack([expected.rows, [0.0, 0.0]])])
    values, *_ = np.linalg.lstsq(rows, np.concatenate([target / 2.0, [0.0], expected.values]))
    assert_allclose(found.values, values, rtol=1e-9)
    assert_allclose(found.covariance, np.linalg.inv(rows.T @ rows), rtol=1e-9)
    left = np.concatenate([[0.7 * values[1]], expected.rows @ values[:3] - expected.values])
    assert found.penalty == pytest.approx(0.5 * float(left @ left))
    # Without an unknown the relations are those of the others.
    fewer = design.without({("b",)})
    assert fewer.expected is not None
    assert_allclose(fewer.expected.rows, expected.rows[:, [0, 2]])


def test_in_gusts_the_record_determines_the_response() -> None:
    body = BODIES[0]
    logs = [flown(name, body, 8700 + n, air=1.0, seconds=24.0) for n, name in enumerate(("one", "two"))]
    found = declared(aircraft_of(body, 0.08, np.random.default_rng(7)), logs[:1], logs[1:])
    free = regress(replace(found.design, expected=None), found.problem.settings)
    for name in ("C_Z", "C_m"):
        place, slope = found.design.unknowns.index(("gust", name)), body.terms[name, "alpha"]
        response, error = float(found.solution.values[place]), float(np.sqrt(free.covariance[place, place]))
        assert error < 0.2 * abs(slope)
        assert abs(response - free.values[place]) < 0.3 * error
        assert response == pytest.approx(slope, abs=3.0 * error)


def test_a_placeholder_in_the_aircraft_file_leaves_the_response_wide() -> None:
    """A fiftieth of every derivative declared: by its own size the response would be held at a fiftieth too."""
    model = declared_model(load_aircraft("hfb320"), 100.0)
    small = expected_gust_responses(model.with_values(0.02 * model.values))
    assert small["C_Z"].deviation == pytest.approx(1.5)
    assert small["C_m"].deviation > 0.3
