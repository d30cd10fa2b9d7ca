"""Effects replicated by another record, on flights of which one, both or none has them."""

from __future__ import annotations

import numpy as np
import pytest
from equations_decided import decided, frames_of

from aerosid.effects.hypothesis import Hypothesis
from aerosid.equation_error.equations.points import Point
from aerosid.equation_error.regression.estimate import estimate
from aerosid.equation_error.selection.replication import is_needed, replicated_effects
from aerosid.equation_error.selection.structure import SelectedEffect, SelectedStructure
from aerosid.flight_model.terms import parse_term
from benchmarks.turbulent_flights import BODIES, NOTHING, Wrong, aircraft_of, flown

BENT = Wrong(terms={("C_X", "alpha^2"): 2.0})
SINGLE, GLIDER = BODIES[:2]


@pytest.mark.parametrize(("unseen", "shown"), [(BENT, True), (NOTHING, False)])
def test_a_term_is_replicated_if_the_validation_flight_has_it(unseen: Wrong, shown: bool) -> None:
    aircraft = aircraft_of(SINGLE, 0.08, np.random.default_rng(8300))
    first = flown("one", SINGLE, 8301, air=0.3, wrong=BENT, seconds=24.0)
    other = flown("two", SINGLE, 8302, air=0.3, wrong=unseen, seconds=24.0)
    entry = ("C_X", parse_term("alpha^2"))
    model, whole, fitted = frames_of(aircraft, [first], [other], [entry])
    free = (*((d.coefficient, d.term) for d in aircraft.derivatives), entry)
    point = Point(model.extended([entry]), free, ())
    each = SelectedEffect(Hypothesis("aero_term", "C_X", "alpha^2", entries=(entry,)), kinematic=False, gain=50.0)
    selected = SelectedStructure(estimate(whole, point), (each,))
    reduced = SelectedStructure(estimate(fitted, point), (each,))
    assert reduced.estimate.value(("term", entry)) == pytest.approx(2.0, abs=0.5)
    assert replicated_effects([each], selected=selected, fitted=reduced) == ([each] if shown else [])
    # A flight without information on an effect does not confirm it.
    assert not replicated_effects([each], selected=reduced, fitted=reduced)
    assert is_needed(selected, reduced, each) is shown
    assert not is_needed(reduced, reduced, each)


def test_a_term_shown_by_one_event_is_retained_if_replicated() -> None:
    """A glider's two flights gain 39 in ln L by it; without one block of the first its estimate changes by a third."""
    seed = 5000 + 10 * 43
    aircraft = aircraft_of(GLIDER, 0.08, np.random.default_rng(5043))
    logs = [flown(name, GLIDER, seed + n, air=0.6, wrong=BENT, seconds=24.0) for n, name in enumerate(("one", "two"))]
    (row,) = decided(aircraft, logs[:1], logs[1:]).findings
    assert row.hypothesis.label == ("aero_term", "C_X", "alpha^2")
    assert abs(row.value - 2.0) < 3.0 * row.std_error
    assert row.ratio > 3.0
