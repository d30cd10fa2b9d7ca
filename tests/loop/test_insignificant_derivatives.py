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
