"""When forward selection has found another structure, and goes on."""

from __future__ import annotations

from dataclasses import replace

import pytest
from problems import LIGHT, Problem

from aerosid.effects import ActiveEffect
from aerosid.effects.step_change import step_change
from aerosid.estimation.fit_settings import TRIAL
from aerosid.estimation.maximum_likelihood import Refinement, refine
from aerosid.search.forward_selection import is_new_structure
from aerosid.search.settings import AttributionSettings
from aerosid.search.structure_search import StructureSearch

INSTANT = 4.0


@pytest.fixture(scope="module")
def search() -> StructureSearch:
    """On two records of the same length, whose clocks both begin at zero."""
    problem = Problem()
    (model, one), (_, two) = (problem.prepared(problem.fly(seed, name)) for seed, name in ((1, "one"), (2, "two")))
    before = refine(model, [one, two], model.entries, settings=TRIAL)
    return StructureSearch((one, two), (), LIGHT.coefficients, before, AttributionSettings())


def with_steps(search: StructureSearch, *instants: tuple[str, float], gain: float = 0.0) -> Refinement:
    """The declared structure with step changes of C_m, each on its log; likelier by `gain` in -2 ln L."""
    interval = search.manoeuvres[0].interval
    steps = (ActiveEffect(step_change("C_m", time, interval), (-0.01, time), log) for log, time in instants)
    return replace(search.declared, effects=tuple(steps), cost=search.declared.cost - gain)


def test_the_same_step_on_a_second_record_is_another_structure(search: StructureSearch) -> None:
    current = with_steps(search, ("one", INSTANT))
    both = with_steps(search, ("one", INSTANT), ("two", INSTANT), gain=1000.0)
    moved = with_steps(search, ("two", INSTANT), gain=1000.0)
    assert is_new_structure(search, both, current)
    assert is_new_structure(search, moved, current)


def test_a_step_that_hardly_moves_and_one_that_gains_less_than_its_penalty_are_none(search: StructureSearch) -> None:
    current = with_steps(search, ("one", INSTANT))
    assert not is_new_structure(search, with_steps(search, ("one", INSTANT + 0.02), gain=1000.0), current)
    assert not is_new_structure(search, with_steps(search, ("one", INSTANT), ("two", INSTANT), gain=1.0), current)
