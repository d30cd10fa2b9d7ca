"""Part of an undeclared alphadot derivative in C_m q_hat, against a regression whose target contains one."""

from dataclasses import replace

import numpy as np
import pytest
from equations_decided import decided

from aerosid.effects.hypothesis import Hypothesis
from aerosid.equation_error.equations.points import Point
from aerosid.equation_error.regression.least_squares import solve
from aerosid.equation_error.selection.candidates import term_candidates
from aerosid.equation_error.selection.damping_collinearity import (
    DAMPING,
    DOWNWASH,
    AliasedDerivative,
    DampingCollinearity,
    downwash_prior,
)
from aerosid.equation_error.selection.penalties import SelectionCriterion
from aerosid.flight_model.aerodynamics import AerodynamicModel
from aerosid.flight_model.axes import LONGITUDINAL, input_columns_of
from aerosid.flight_model.constants import Constants
from aerosid.flight_model.terms import parse_term
from aerosid.loop.equation_error_notes import note_on_damping
from benchmarks.turbulent_flights import BODIES, aircraft_of, flown


def test_an_omitted_alphadot_biases_the_pitch_rate_derivative_by_the_aliased_fraction() -> None:
    body = BODIES[0]
    logs = [flown(name, body, 6100 + n, air=0.3, seconds=24.0) for n, name in enumerate(("one", "two"))]
    decision = decided(aircraft_of(body, 0.08, np.random.default_rng(6)), logs[:1], logs[1:])
    assert decision.findings == ()
    damping = decision.damping
    assert damping is not None
    found = decision.completed
    downwash = ("C_m", DOWNWASH)
    (candidate,) = term_candidates(found.problem, found, [Hypothesis("aero_term", *map(str, downwash), (downwash,))])
    lacking = -6.0
    held = replace(found.design, target=found.design.target + lacking * candidate.columns[:, 0])
    moved = solve(held, found.solution.weights).values - solve(found.design, found.solution.weights).values
    place = found.design.unknowns.index(("term", ("C_m", DAMPING)))
    assert moved[place] == pytest.approx(damping.aliased * lacking, rel=1e-6)
    assert damping.independent < 0.01
    assert damping.aliased > 0.5
    assert {other.term for other in damping.others} == {"alpha", "delta_e"}
    for other in damping.others:
        place = found.design.unknowns.index(("term", ("C_m", parse_term(other.term))))
        assert moved[place] == pytest.approx(other.aliased * lacking, rel=1e-6)
        assert other.std_error == pytest.approx(float(np.sqrt(decision.covariance[place, place])))


def test_what_the_usual_alphadot_changes_beyond_a_standard_error_is_told() -> None:
    small, large = AliasedDerivative("delta_e", 0.001, 0.05), AliasedDerivative("alpha", 0.01, 0.05)
    damping = DampingCollinearity(value=-24.0, aliased=0.8, independent=0.002, others=(small, large))
    least, most = damping.changes(large)
    assert least == pytest.approx(0.01 * 0.3 * damping.parts[1])
    assert most == pytest.approx(0.01 * 0.5 * damping.parts[0])
    assert damping.beyond_errors == (large,)
    assert "−0.058 to −0.086 of C_m alpha (standard error 0.050)" in note_on_damping(damping)
    assert "delta_e" not in note_on_damping(damping)


def test_the_parts_and_a_usual_alphadot_add_up_to_the_estimate() -> None:
    least, most = DampingCollinearity(value=-24.0, aliased=0.8, independent=0.002).parts
    assert least * (1.0 + 0.8 * 0.5) == pytest.approx(-24.0)
    assert most * (1.0 + 0.8 * 0.3) == pytest.approx(-24.0)


@pytest.mark.parametrize(("value", "unusual"), [(12.0, 0.5), (-12.0, 0.5), (98.7, 33.82), (0.0, 0.0)])
def test_the_prior_penalty_of_an_alphadot_is_half_its_squared_ratio_to_half_the_damping(
    value: float, unusual: float
) -> None:
    columns, constants = input_columns_of(LONGITUDINAL), Constants(1.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0)
    damped, downwash = ("C_m", DAMPING), ("C_m", DOWNWASH)
    lift, drag = ("C_Z", DOWNWASH), ("C_X", parse_term("alpha"))
    declared = AerodynamicModel((damped, drag), np.array([-24.0, 0.3]), columns, constants)
    usual = downwash_prior(declared)
    assert set(usual) == {downwash}
    found = AerodynamicModel((damped, downwash, lift), np.array([-150.0, value, -40.0]), columns, constants)

    def excess(entry: tuple[str, object]) -> float:
        omitted = Hypothesis("aero_term", *map(str, entry), entries=(entry,))  # type: ignore[arg-type]
        criterion = SelectionCriterion({omitted.label: 1.0}, 1000, 0.01, prior_sizes=usual)
        return criterion.penalty_at(omitted, Point(found, (), ())) - criterion.penalty(omitted)

    assert excess(downwash) == pytest.approx(unusual, abs=0.01)
    assert excess(lift) == 0.0
