"""Replacements of a selected hypothesis: cached under their limits, and abandoned where they cannot win."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from equations_decided import decided, identified

from aerosid.equation_error.regression.estimate import maximise_likelihood
from aerosid.equation_error.selection.airspeed_calibration import mean_airspeed
from aerosid.equation_error.selection.alternatives import replacements_of
from aerosid.equation_error.selection.candidates import is_instrument_error, with_aircraft_limits
from aerosid.equation_error.selection.instrument_errors import InstrumentErrors
from aerosid.equation_error.selection.structure import SelectedStructure
from aerosid.flight_model.term_grammar import parse_term
from benchmarks.turbulent_flights import BODIES, aircraft_of, flown

AT_CENTRE = {channel: np.zeros(3) for channel in ("alpha", "V", "a_x", "a_z")}

LATE = 0.02
"""Time delay of the vane, s."""


def late_vane() -> InstrumentErrors:
    body = BODIES[0]
    log = flown("one", body, 7001, air=0.0, seconds=24.0)
    late = np.interp(log.time - LATE, log.time, log["alpha"])
    moved = replace(log, channels={**log.channels, "alpha": late})
    return identified(replace(aircraft_of(body, 0.08, np.random.default_rng(7)), length=12.0), [moved], [])


def test_cached_replacements_do_not_depend_on_earlier_limits() -> None:
    selected = late_vane().selected
    (each,) = [each for each in selected.chosen if each.hypothesis.where == "alpha"]
    wide = [h for h in late_vane().hypotheses if is_instrument_error(h)]
    narrow = [with_aircraft_limits(h, AT_CENTRE, 1.5, 1.0) for h in wide]
    fresh = SelectedStructure(selected.estimate, selected.chosen)
    replacements_of(selected, each, wide)
    again, first = replacements_of(selected, each, narrow), replacements_of(fresh, each, narrow)
    assert [row.hypothesis.label for row in again] == [row.hypothesis.label for row in first]
    assert [(row.value, row.deficit, row.std_error) for row in again] == [
        (row.value, row.deficit, row.std_error) for row in first
    ]
    assert {row.hypothesis.label for row in first} & {("sensor_lag", "alpha", ""), ("sensor_delay", "alpha", "")}


def test_an_unpromising_estimate_ends_before_its_first_step() -> None:
    found = late_vane().selected.estimate
    start = replace(found.point, effects=tuple(a.perturbed(0, 0.5 * a.values[0]) for a in found.point.effects))
    promised: list[float] = []

    def is_promising(full: object) -> bool:
        promised.append(full.log_likelihood)  # type: ignore[attr-defined]
        return False

    ended = maximise_likelihood(found.problem, start, found.solution.weights, is_promising=is_promising)
    assert len(promised) == 1
    assert ended.point.effects == start.effects
    # The first-order gain is close to that of the converged estimate, and higher than where the search ended.
    assert ended.log_likelihood < promised[0]
    assert abs(promised[0] - found.log_likelihood) < 0.2 * (found.log_likelihood - ended.log_likelihood)


def test_an_implausible_centre_of_gravity_is_no_alternative_of_elevator_lift() -> None:
    """Tail lift and an accelerometer .3 chords away look alike; only with the latter is C_m_alpha unknown."""
    body = BODIES[0]
    aircraft = aircraft_of(body, 0.08, np.random.default_rng(9301))
    known = [d for d in aircraft.derivatives if (d.coefficient, str(d.term)) != ("C_Z", "delta_e")]
    logs = [flown(name, body, 9420 + i, air=0.4, seconds=16.0) for i, name in enumerate("ab")]
    found = decided(replace(aircraft, derivatives=tuple(known)), logs[:1], logs[1:])
    assert [row.hypothesis.label for row in found.findings] == [("aero_term", "C_Z", "delta_e")]
    assert all(row.hypothesis.kind != "cg_shift" for row in found.alternatives)
    place = found.completed.design.unknowns.index(("term", ("C_m", parse_term("alpha"))))
    deviation, value = float(np.sqrt(found.covariance[place, place])), found.completed.solution.values[place]
    sizes = {scale.name: scale.held[0] for scale in found.uncertain_scales}
    vane, bias = abs(sizes["sensor_scale", "alpha"] - 1.0), sizes["sensor_bias", "V"] / mean_airspeed(found.completed)
    airspeed = np.hypot(sizes["sensor_scale", "V"] - 1.0, bias)
    # Their parts are tested in test_calibration.py.
    beside_scales = np.sqrt(deviation**2 - (value * vane) ** 2 - (2.0 * value * airspeed) ** 2)
    assert beside_scales < 0.025
    assert abs(value - body.terms["C_m", "alpha"]) < 3.0 * deviation
