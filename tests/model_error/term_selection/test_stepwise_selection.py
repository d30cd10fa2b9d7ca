"""Terms that a user's own system lacks: the page's examples as they stand, planted and withheld terms, broken input."""

from __future__ import annotations

import contextlib
import io
import re
from pathlib import Path

import numpy as np
import pytest

from aerosid.errors import UsageError
from aerosid.model_error.estimators.weights import continuous_weights, discrete_weights
from aerosid.model_error.term_selection.stepwise_selection import (
    Candidate,
    select_terms_continuous,
    select_terms_discrete,
)

PAGE = Path(__file__).parents[3] / "docs" / "model_error_library.md"


@pytest.fixture(scope="module")
def page():
    """What is left when every block of the page has run."""
    names: dict[str, object] = {"__name__": "page"}
    with contextlib.redirect_stdout(io.StringIO()):
        for block in re.findall(r"^```python\n(.*?)^```$", PAGE.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL):
            exec(compile(block, PAGE.name, "exec"), names)  # noqa: S102
    return names


def test_the_pendulums_friction_is_found_with_its_coefficients(page):
    found = page["found"]
    true = {"rate": -0.15, "rate |rate|": -0.30}
    assert set(found.names) == set(true)
    for name, value, deviation in zip(found.names, found.coefficients, found.deviations, strict=True):
        assert abs(value - true[name]) < 4.0 * deviation
        assert deviation < 0.1 * abs(true[name]) + 0.02


def test_recursive_least_squares_ends_at_the_coefficients_of_the_selection(page):
    found = page["found"]
    # What is left to add at the last pass is within the deviations.
    assert np.all(np.abs(found.recursion.coefficients[: len(found.names)]) < found.deviations)


def test_the_papers_examples_give_the_papers_coefficients(page):
    table, figure = page["table"], page["figure"]
    true = {"X1": 0.5, "X2": 0.623, "X1^3": -0.05}
    assert set(table.names) == set(true)
    for name, value, deviation in zip(table.names, table.coefficients, table.deviations, strict=True):
        assert abs(value - true[name]) < 4.0 * deviation + 0.02 * abs(true[name])
    assert dict(zip(figure.names, figure.coefficients, strict=True)) == {
        "X2": pytest.approx(-0.390625, rel=0.02),
        "X2^3": pytest.approx(-0.01953125, rel=0.05),
    }


def swinging(missing, seed, points=400):
    """A damped oscillator in 20 ms steps of its exact map, with a missing cubic stiffness."""
    states = [np.array([1.0, 0.0])]
    for j in range(points - 1):
        x = states[-1]
        states.append(oscillating(x, None, float(j)) + np.array([0.0, missing * x[0] ** 3]))
    noise = np.random.default_rng(seed).standard_normal((points, 2))
    return np.array(states) + 1e-3 * noise


def oscillating(x, u, j):
    return np.array([x[0] + 0.1 * x[1], 0.97 * x[1] - 0.1 * x[0] + 0.05 * np.sin(0.21 * j)])


def seen(x, u, j):
    return x.copy()


CANDIDATES = (
    Candidate("x", 1, lambda x, u, j: x[0]),
    Candidate("x^2", 1, lambda x, u, j: x[0] ** 2),
    Candidate("x^3", 1, lambda x, u, j: x[0] ** 3),
    Candidate("v", 1, lambda x, u, j: x[1]),
    Candidate("v |v|", 1, lambda x, u, j: x[1] * abs(x[1])),
)
WEIGHTS = discrete_weights(1e-6 * np.eye(2), np.diag([0.0, 1e-4]), 1e-4 * np.eye(2))


def test_a_planted_term_is_found_and_the_completed_model_holds_it():
    found = select_terms_discrete(oscillating, seen, swinging(-0.02, 1), [1.0, 0.0], WEIGHTS, CANDIDATES)
    assert found.names == ("x^3",)
    assert abs(found.coefficients[0] + 0.02) < 4.0 * found.deviations[0]
    x = np.array([2.0, 0.0])
    expected = oscillating(x, None, 0.0) + np.array([0.0, 8.0 * found.coefficients[0]])
    np.testing.assert_allclose(found.completed(x, None, 0.0), expected)


def test_a_perfect_model_lacks_nothing():
    """Twelve records: at one false alarm in a thousand by design, one of them has 1.2 % of chance."""
    alarms = [
        select_terms_discrete(oscillating, seen, swinging(0.0, seed), [1.0, 0.0], WEIGHTS, CANDIDATES).names
        for seed in range(12)
    ]
    assert alarms == [()] * 12


@pytest.mark.parametrize(
    ("candidates", "told"),
    [
        ((), "no candidate"),
        ((CANDIDATES[0], CANDIDATES[0]), "given twice"),
        ((Candidate("x", 2, lambda x, u, j: x[0]),), "equations 0 to 1"),
        ((Candidate("x", 0, lambda x, u, j: x[0]),), "no model error"),
        ((Candidate("1/0", 1, lambda x, u, j: np.inf),), "not finite"),
    ],
)
def test_candidates_that_cannot_be_asked_are_refused_in_one_sentence(candidates, told):
    with pytest.raises(UsageError, match=told):
        select_terms_discrete(oscillating, seen, swinging(0.0, 1, 60), [1.0, 0.0], WEIGHTS, candidates)


def test_time_that_does_not_increase_is_refused():
    weights = continuous_weights(1e-6 * np.eye(2), 0.1, np.diag([0.0, 1.0]), np.eye(2))
    with pytest.raises(UsageError):
        select_terms_continuous(
            lambda x, u, t: np.array([x[1], -x[0]]), seen, np.zeros(50), swinging(0.0, 1, 50), [1.0, 0.0], weights,
            CANDIDATES,
        )  # fmt: skip
