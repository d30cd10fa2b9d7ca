"""The attribution of an equation-error decision: a structure with fewer parts, re-estimated by the same regression."""

import numpy as np
import pytest
from equations_decided import decided, questioned

from aerosid.search.equation_error_attribution import attribute_by_equations
from aerosid.search.settings import AttributionSettings
from aerosid.search.structure_search import StructureSearch
from benchmarks.turbulent_flights import BODIES, Wrong, aircraft_of, flown

USUAL = AttributionSettings()

BODY = BODIES[0]
SEED = 7320


@pytest.mark.parametrize(
    ("wrong", "name"),
    [
        (Wrong(delay={"alpha": 0.12}), "alpha"),
        (Wrong(terms={("C_m", "alpha^2"): -4.0}), "alpha^2"),
        (Wrong(elevator_delay=0.08), "delta_e"),
    ],
)
def test_without_its_only_effect_the_structure_is_the_declared_one_as_regressed(wrong: Wrong, name: str) -> None:
    aircraft = aircraft_of(BODY, 0.08, np.random.default_rng(SEED))
    log, other = (flown(each, BODY, SEED + n, air=0.6, wrong=wrong, seconds=24.0) for n, each in enumerate("ab"))
    manoeuvre = questioned(aircraft, log)[1]
    decision = decided(aircraft, [log], [other])
    found = attribute_by_equations(decision, [manoeuvre])
    search = StructureSearch((manoeuvre,), (), aircraft.coefficients, found.before, USUAL)
    (part,) = search.parts(found.completed, None)
    assert name in part.label

    lacking = found.re_estimated(search.reduced_structure(found.completed, [part]), [manoeuvre])

    expected = decision.before
    assert lacking.effects == ()
    moved = []
    for entry in expected.point.free:
        if ("term", entry) in expected.design.unknowns:
            place = expected.design.unknowns.index(("term", entry))
            deviation = float(np.sqrt(expected.solution.covariance[place, place]))
            assert lacking.model.value(entry) == pytest.approx(expected.value(("term", entry)), abs=0.05 * deviation)
            moved.append(abs(found.completed.model.value(entry) - lacking.model.value(entry)) / deviation)
    assert max(moved) > 1.0
