"""Which insignificant derivatives keep their declared values, on a flight whose regression is known."""

from dataclasses import replace

import lateral_flights as commuter
import numpy as np
import pytest
from equations_decided import decided, questioned

from aerosid.loop.insignificant_derivatives import fix_insignificant
from aerosid.search.attribution import Attribution
from aerosid.search.equation_error_attribution import attribute_by_equations
from aerosid.search.settings import AttributionSettings
from aerosid.search.structure_search import StructureSearch

USUAL = AttributionSettings()

AGREES, DISAGREES = ("C_n", "p_hat"), ("C_n", "r_hat")
AIRCRAFT = commuter.aircraft(commuter.SIDE, 0.93)


@pytest.fixture(scope="module")
def regressed() -> tuple[Attribution, StructureSearch]:
    logs = [commuter.Lateral(seed=seed, size=1.3).log(mirrored=other) for seed, other in ((9311, False), (9312, True))]
    manoeuvre = questioned(AIRCRAFT, logs[0])[1]
    found = attribute_by_equations(decided(AIRCRAFT, logs[:1], logs[1:]), [manoeuvre])
    return found, StructureSearch((manoeuvre,), (), AIRCRAFT.coefficients, found.before, USUAL)


@pytest.mark.parametrize("away", [0.0, 1.0, 12.0])
def test_of_two_insignificant_derivatives_that_alone_keeps_its_declared_value_which_agrees_with_it(
    regressed: tuple[Attribution, StructureSearch], away: float
) -> None:
    """A joint test of both rejects the declared values; only one of them is the reason."""
    found, search = regressed
    beside = found.completed_deviations.beside_effects
    assert beside is not None
    names = [(coefficient, str(term)) for coefficient, term in found.completed.free]
    own = np.sqrt(np.diag(beside))
    wide = found.completed_deviations.corrected.copy()
    values = {}
    for entry, distance in ((AGREES, 0.1), (DISAGREES, away)):
        place = names.index(entry)
        estimate = found.completed.model.value(found.completed.free[place])
        wide[place] = 2.0 * abs(estimate)
        values[entry] = estimate + distance * float(own[place])
    found = replace(found, completed_deviations=replace(found.completed_deviations, corrected=wide))
    declared = replace(
        AIRCRAFT,
        derivatives=tuple(
            replace(each, value=values.get((each.coefficient, str(each.term)), each.value))
            for each in AIRCRAFT.derivatives
        ),
    )
    completion = fix_insignificant(found, declared, search, excited=True)
    asked = {AGREES, DISAGREES}  # beside constants of an aircraft that is nearly symmetric
    fixed = asked & {(coefficient, str(term)) for coefficient, term in completion.fixed}
    contradicted = asked & {(coefficient, str(term)) for coefficient, term in completion.contradicted}
    assert fixed == ({AGREES} if away > 5.0 else {AGREES, DISAGREES})
    assert contradicted == ({DISAGREES} if away > 5.0 else set())
    told = {(coefficient, str(term)): errors for (coefficient, term), errors in completion.contradicted.items()}
    assert told.get(DISAGREES) == (pytest.approx(away) if away > 5.0 else None)
    assert completion.found.completed.model.value(found.completed.free[names.index(AGREES)]) == values[AGREES]


@pytest.mark.parametrize("declared_is_true", [True, False])
def test_validation_flights_decide_whether_an_insignificant_derivative_keeps_its_declared_value(
    regressed: tuple[Attribution, StructureSearch], declared_is_true: bool
) -> None:
    """Each coefficient of the other flight is predicted as well as by the better of both values, and it is said so."""
    found, search = regressed
    entry = next(entry for entry in found.completed.free if (entry[0], str(entry[1])) == DISAGREES)
    place = found.completed.free.index(entry)
    estimate, truth = found.completed.model.value(entry), commuter.SIDE[DISAGREES]
    assert abs(estimate / truth - 1.0) < 0.1
    wide = found.completed_deviations.corrected.copy()
    wide[place] = 2.0 * abs(estimate)
    far = estimate + 0.6 * abs(estimate)
    values = found.completed.model.values.copy()
    if declared_is_true:
        values[found.completed.model.index(entry)] = far
    found = replace(
        found,
        completed=replace(found.completed, model=found.completed.model.with_values(values)),
        completed_deviations=replace(found.completed_deviations, corrected=wide, beside_effects=None),
    )
    declared = replace(
        AIRCRAFT,
        derivatives=tuple(
            replace(each, value=truth if declared_is_true else far)
            if (each.coefficient, str(each.term)) == DISAGREES
            else each
            for each in AIRCRAFT.derivatives
        ),
    )
    completion = fix_insignificant(found, declared, search, excited=True)
    assert entry in completion.not_shown
    assert (entry in completion.fixed) is declared_is_true
    assert (entry in completion.by_validation) is not declared_is_true
    other = {(row.log, row.coefficient): row.r2_after for row in completion.found.r_squared}
    assert min(other.values()) > 0.95
