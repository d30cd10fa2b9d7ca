"""Which insignificant derivatives keep their declared values, on a flight whose regression is known."""

from collections.abc import Iterable
from dataclasses import replace

import lateral_flights as commuter
import numpy as np
import pytest
from equations_decided import decided, questioned

from aerosid.aircraft import Aircraft
from aerosid.loop.completed_aircraft import complete_aircraft, completion_record
from aerosid.loop.identification import identify
from aerosid.loop.insignificant_derivatives import fix_insignificant
from aerosid.loop.provenance import Provenance
from aerosid.loop.settings import LoopSettings
from aerosid.loop.verdict import Verdict
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


def hiding(
    found: Attribution, entry: tuple[str, str], declared: float, value: float | None = None
) -> tuple[Attribution, Aircraft]:
    """The estimate with an insignificant derivative, or another value of it, and the aircraft with a declared one."""
    model, names = found.completed.model, [(coefficient, str(term)) for coefficient, term in found.completed.free]
    place = names.index(entry)
    wide = found.completed_deviations.corrected.copy()
    wide[place] = 2.0 * max(abs(commuter.SIDE[entry]), abs(declared))
    values = model.values.copy()
    if value is not None:
        values[model.index(found.completed.free[place])] = value
    found = replace(
        found,
        completed=replace(found.completed, model=model.with_values(values)),
        completed_deviations=replace(found.completed_deviations, corrected=wide, beside_effects=None),
    )
    derivatives = tuple(
        replace(each, value=declared) if (each.coefficient, str(each.term)) == entry else each
        for each in AIRCRAFT.derivatives
    )
    return found, replace(AIRCRAFT, derivatives=derivatives)


def names(entries: Iterable[tuple[str, object]]) -> set[tuple[str, str]]:
    return {(coefficient, str(term)) for coefficient, term in entries}


@pytest.mark.parametrize("declared_is_true", [True, False])
def test_validation_flights_decide_whether_an_insignificant_derivative_keeps_its_declared_value(
    regressed: tuple[Attribution, StructureSearch], declared_is_true: bool
) -> None:
    """Each coefficient of the other flight is predicted as well as by the better of both values, and it is said so."""
    found, search = regressed
    truth = commuter.SIDE[DISAGREES]
    declared, value = (truth, 1.6 * truth) if declared_is_true else (1.6 * truth, None)
    found, aircraft = hiding(found, DISAGREES, declared, value)
    completion = fix_insignificant(found, aircraft, search, excited=True)
    assert DISAGREES in names(completion.not_shown)
    assert (DISAGREES in names(completion.fixed)) is declared_is_true
    assert (DISAGREES in names(completion.by_validation)) is not declared_is_true
    assert not any(term == "1" for _, term in names(completion.by_validation))
    assert min(row.r2_after for row in completion.found.r_squared) > 0.95


def test_flights_that_excite_nothing_keep_every_declared_value_however_the_others_are_predicted(
    regressed: tuple[Attribution, StructureSearch],
) -> None:
    found, search = regressed
    found, aircraft = hiding(found, DISAGREES, 1.6 * commuter.SIDE[DISAGREES])
    completion = fix_insignificant(found, aircraft, search, excited=False)
    assert set(completion.fixed) == set(found.completed.free)
    assert completion.by_validation == ()
    declared = {(each.coefficient, str(each.term)): each.value for each in aircraft.derivatives}
    for entry in found.completed.free:
        assert completion.found.completed.model.value(entry) == declared[entry[0], str(entry[1])]


@pytest.mark.slow
@pytest.mark.parametrize("declared", [0.8, 1.2, 1.5])
def test_a_named_term_that_a_declared_value_makes_insignificant_stays_and_the_aircraft_can_be_written(
    declared: float,
) -> None:
    """By output error such a term was eliminated, and counted as fixed at a declared value, which it does not have."""
    extra = {("C_n", "beta^3"): 1.2}
    one = commuter.Lateral(seed=21, extra=extra, size=1.3).log(name="one")
    two = commuter.Lateral(seed=22, extra=extra, size=1.3).log(mirrored=True, name="two")
    identified = identify([one], AIRCRAFT, [two], LoopSettings(method="equations", paper_chain=False))
    found, search = identified.found, identified.search
    assert found is not None
    assert search is not None
    (term,) = found.terms
    entry = ("C_n", "r_hat")
    found, aircraft = hiding(found, entry, declared * commuter.SIDE[entry])
    wide = found.completed_deviations.corrected.copy()
    wide[found.completed.free.index(term)] = abs(found.completed.model.value(term)) / 3.02
    found = replace(found, completed_deviations=replace(found.completed_deviations, corrected=wide))
    completion = fix_insignificant(found, aircraft, search, excited=True)
    assert term in completion.found.completed.free
    assert not completion.found.eliminated
    assert term not in completion.not_shown
    record = completion_record(aircraft, {}, Verdict.EXPLAINED, Provenance(), completion.not_shown)
    written = complete_aircraft(aircraft, completion, 1, record)
    assert {(d.coefficient, str(d.term)) for d in written.derivatives} >= {("C_n", "beta^3"), entry}
