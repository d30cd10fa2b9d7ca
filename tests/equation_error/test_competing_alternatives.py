"""Alternatives explain what the selected effect explains: another weak effect beside it is none."""

import numpy as np
from equations_decided import frames_of

from aerosid.equation_error.equations.points import Point
from aerosid.equation_error.regression.estimate import estimate
from aerosid.equation_error.selection.alternatives import alternatives_of
from aerosid.equation_error.selection.candidates import with_hypothesis
from aerosid.equation_error.selection.competing_alternatives import competing_alternatives
from aerosid.equation_error.selection.structure import SelectedEffect, SelectedStructure
from aerosid.flight_model.terms import parse_term
from aerosid.search.hypotheses import term_hypotheses
from benchmarks.turbulent_flights import BODIES, Wrong, aircraft_of, flown

SEED = 7600
"""Of tests; published tables and trials begin elsewhere."""


def test_a_weak_effect_of_another_coefficient_is_no_alternative_and_a_collinear_one_is() -> None:
    body = BODIES[2]
    weak = Wrong(terms={("C_m", "alpha^2"): -1.0, ("C_X", "alpha^2"): 0.35})
    logs = [flown("a", body, SEED, air=0.2, wrong=weak, seconds=20.0)]
    aircraft = aircraft_of(body, 0.08, np.random.default_rng(SEED))
    names = [("C_m", "alpha^2"), ("C_m", "alpha^3"), ("C_X", "alpha^2")]
    missing, *others = term_hypotheses([(coefficient, parse_term(term)) for coefficient, term in names])
    model, _, fitted = frames_of(aircraft, logs, [], [*missing.entries, *others[0].entries])
    declared = Point(model, tuple((d.coefficient, d.term) for d in aircraft.derivatives), ())
    base = estimate(fitted, declared)
    found = estimate(fitted, with_hypothesis(declared, missing), base.solution.weights)
    selected = SelectedStructure(found, (SelectedEffect(missing, kinematic=False, gain=found.gain_over(base)),))
    similar = {row.hypothesis.label: row for row in alternatives_of(selected, others)}
    assert set(similar) == {each.label for each in others}
    # With both in the regression, the collinear one adds next to nothing and the other one all that it explains.
    for other in others:
        both = estimate(fitted, with_hypothesis(found.point, other), found.solution.weights)
        share = both.gain_over(found) / similar[other.label].gain
        assert share > 0.8 if other.entries[0][0] == "C_X" else share < 0.2
    assert [row.hypothesis.label for row in competing_alternatives(selected, others)] == [others[0].label]
