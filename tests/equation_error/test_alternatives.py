"""What could stand in place of a chosen hypothesis: asked again within other limits, and given up where it cannot."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from equations_decided import decided, proved

from aerosid.equation_error.regression.estimate import likeliest_numbers
from aerosid.equation_error.selection.alternatives import in_place_of
from aerosid.equation_error.selection.candidates import of_sensors, within_reach
from aerosid.equation_error.selection.deletion import Selected
from aerosid.equation_error.selection.proved_faults import ProvedFaults
from aerosid.flight_model.term_grammar import parse_term
from benchmarks.turbulent_flights import BODIES, aircraft_of, flown

LATE = 0.02
"""s that the vane is late."""


def late_vane() -> ProvedFaults:
    body = BODIES[0]
    log = flown("one", body, 7001, air=0.0, seconds=24.0)
    late = np.interp(log.time - LATE, log.time, log["alpha"])
    moved = replace(log, channels={**log.channels, "alpha": late})
    return proved(replace(aircraft_of(body, 0.08, np.random.default_rng(7)), length=12.0), [moved], [])


def test_what_is_asked_again_within_other_limits_is_as_if_it_were_asked_first() -> None:
    selected = late_vane().selected
    (each,) = [each for each in selected.chosen if each.hypothesis.where == "alpha"]
    wide = [h for h in late_vane().asked if of_sensors(h)]
    narrow = [within_reach(h, 1.5, 1.0) for h in wide]
    fresh = Selected(selected.estimate, selected.chosen)
    in_place_of(selected, each, wide)
    again, first = in_place_of(selected, each, narrow), in_place_of(fresh, each, narrow)
    assert [row.hypothesis.label for row in again] == [row.hypothesis.label for row in first]
    assert [(row.value, row.behind, row.std_error) for row in again] == [
        (row.value, row.behind, row.std_error) for row in first
    ]
    assert {row.hypothesis.label for row in first} & {("sensor_lag", "alpha", ""), ("sensor_delay", "alpha", "")}


def test_a_search_that_cannot_win_ends_before_its_first_step() -> None:
    found = late_vane().selected.estimate
    start = replace(found.point, effects=tuple(a.perturbed(0, 0.5 * a.values[0]) for a in found.point.effects))
    promised: list[float] = []

    def may_win(full: object) -> bool:
        promised.append(full.log_likelihood)  # type: ignore[attr-defined]
        return False

    ended = likeliest_numbers(found.frame, start, found.solution.weights, may_win=may_win)
    assert len(promised) == 1
    assert ended.point.effects == start.effects
    # What the step promised is about what the whole search reaches, and more than where it ended.
    assert ended.log_likelihood < promised[0]
    assert abs(promised[0] - found.log_likelihood) < 0.2 * (found.log_likelihood - ended.log_likelihood)


def test_lift_of_the_elevator_is_no_centre_of_gravity_far_from_where_it_was_weighed() -> None:
    """A tail's lift and an accelerometer .3 chords away look alike; only with the latter would C_m_alpha be unknown."""
    body = BODIES[0]
    aircraft = aircraft_of(body, 0.08, np.random.default_rng(9301))
    known = [d for d in aircraft.derivatives if (d.coefficient, str(d.term)) != ("C_Z", "delta_e")]
    logs = [flown(name, body, 9420 + i, air=0.4, seconds=16.0) for i, name in enumerate("ab")]
    found = decided(replace(aircraft, derivatives=tuple(known)), logs[:1], logs[1:])
    assert [row.hypothesis.label for row in found.findings] == [("aero_term", "C_Z", "delta_e")]
    assert all(row.hypothesis.kind != "cg_shift" for row in found.alternatives)
    place = found.completed.design.unknowns.index(("term", ("C_m", parse_term("alpha"))))
    deviation = float(np.sqrt(found.covariance[place, place]))
    assert deviation < 0.03
    assert abs(found.completed.solution.values[place] - body.terms["C_m", "alpha"]) < 3.0 * deviation
