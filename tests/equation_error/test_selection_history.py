"""A forward selection continued from its history against one that was never stopped."""

from __future__ import annotations

import numpy as np
from equations_decided import frames_of

from aerosid.compiled.sent_results import packed, unpacked
from aerosid.equation_error.equations.points import Point
from aerosid.equation_error.regression.estimate import estimate
from aerosid.equation_error.selection.penalties import criterion_for
from aerosid.equation_error.selection.stepwise import SelectionHistory, forward_selection
from aerosid.equation_error.selection.structure import SelectedStructure
from aerosid.search.candidate_terms import candidate_entries
from aerosid.search.hypotheses import term_hypotheses
from benchmarks.turbulent_flights import BODIES, Wrong, aircraft_of, flown

SEEDS = 8_100
"""Of tests; published tables and trials begin elsewhere."""

BODY = BODIES[0]
WRONG = Wrong(terms={("C_m", "alpha^2"): -3.0, ("C_Z", "alpha^2"): -4.0, ("C_X", "alpha^2"): 2.0})


def test_a_selection_that_was_stopped_and_sent_continues_to_the_same_structure() -> None:
    aircraft = aircraft_of(BODY, 0.08, np.random.default_rng(SEEDS))
    logs = [flown(name, BODY, SEEDS + n, air=0.1, wrong=WRONG, seconds=20.0) for n, name in enumerate("ab")]
    candidates = candidate_entries(aircraft, logs)
    model, whole, _ = frames_of(aircraft, logs[:1], logs[1:], candidates)
    free = tuple((d.coefficient, d.term) for d in aircraft.derivatives)
    base = estimate(whole, Point(model.without(set(candidates) - set(free)), free, ()))
    hypotheses = term_hypotheses(candidates)
    settings = whole.settings
    criterion = criterion_for(hypotheses, base.design.target.size, settings.false_alarm, settings.factor_odds)

    def selection(first: SelectedStructure, history: SelectionHistory) -> list[SelectedStructure]:
        return list(
            forward_selection(first, criterion, hypotheses, kinematic=False, most=settings.most, history=history)
        )

    *_, expected = selection(SelectedStructure(base, ()), SelectionHistory())
    assert len(expected.chosen) >= 3

    history = SelectionHistory()
    path = forward_selection(
        SelectedStructure(base, ()), criterion, hypotheses, kinematic=False, most=settings.most, history=history
    )
    stopped = next(found for found in path if len(found.chosen) == 2)
    last, sent = unpacked(packed((stopped, history.before(stopped)), [whole]), [whole])
    assert len(sent.visited) == len(history.visited) - 1
    continued = selection(last, sent)
    assert continued[0] is last
    assert continued[-1].labels == expected.labels
    assert continued[-1].estimate.solution.values.tobytes() == expected.estimate.solution.values.tobytes()
    # And the structures that were visited before are still known to have been.
    assert len(sent.visited) == len(history.visited) - 1 + len(continued)
