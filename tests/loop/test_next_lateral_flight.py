"""What to fly next with aileron and rudder: one after the other, within limits, and it does what it promises."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hostile_pages import Page
from lateral_flights import (
    CHORD,
    DENSITY,
    INERTIA,
    MASS,
    NOISE,
    PITCH,
    SIDE,
    SOUND,
    SPAN,
    SPEED,
    WING,
    Lateral,
    aircraft,
    level,
    simulate,
)
from oracles.rigid_body import Body
from problems_report import closed_loop

from aerosid.estimation.deviations import deviations
from aerosid.estimation.manoeuvre import Manoeuvre, prepare
from aerosid.estimation.maximum_likelihood import refine
from aerosid.flight_model.axes import LATERAL, SIX, moving_of
from aerosid.flight_model.flight import simulate_outputs
from aerosid.flight_model.terms import parse_term
from aerosid.logs.flight_log import FlightLog
from aerosid.logs.formats import read_log
from aerosid.loop.derivative_table import DerivativeRow
from aerosid.loop.identification import declared_with_candidates
from aerosid.loop.next_flight.flight_limits import RANGES
from aerosid.loop.next_flight.input_design import DesignSettings
from aerosid.loop.next_flight.plan import plan_next_flight
from aerosid.loop.next_flight.planned_flight import NextFlight, PlannedInput
from aerosid.loop.next_flight.predicted_flight import planned_manoeuvre, steady_flight
from aerosid.reporting import report_html, write_report
from aerosid.search.attribution import Attribution

QUICK = DesignSettings(base_times=(0.5, 1.2))
LIMITS = {"beta": (-0.12, 0.12), "phi": (-0.6, 0.6), "delta_a": (-0.1, 0.1), "delta_r": (-0.08, 0.08)}
FREE = tuple((coefficient, parse_term(term)) for coefficient, term in SIDE)
ASKED = (("C_l", "delta_a"), ("C_n", "delta_r"), ("C_l", "r_hat"))


def fitted(log: FlightLog, terms: dict[tuple[str, str], float]) -> tuple[Attribution, Manoeuvre]:
    """The declared structure estimated on a flight."""
    declared = aircraft(terms)
    model, _ = declared_with_candidates([log], [], declared)
    manoeuvre = prepare(log, declared, model.columns)
    free = tuple((coefficient, parse_term(term)) for coefficient, term in terms)
    found = refine(model, [manoeuvre], free)
    return Attribution(found, found, deviations(found, [manoeuvre], quick=True), (), (), ()), manoeuvre


@pytest.fixture(scope="module")
def timid() -> tuple[Attribution, Manoeuvre]:
    """A flight that hardly moves."""
    return fitted(Lateral(size=0.15).log(), SIDE)


@pytest.fixture(scope="module")
def plan(timid: tuple[Attribution, Manoeuvre]) -> NextFlight:
    found, manoeuvre = timid
    rows = []
    for coefficient, term in (*ASKED, ("C_n", "1")):
        n = FREE.index((coefficient, parse_term(term)))
        error = float(found.completed_deviations.corrected[n])
        value = 0.6 * error  # so that a fifth of the present deviation is needed
        row = DerivativeRow(coefficient, term, value, value, value, error, error, None, None, None, False)
        rows.append(row)
    ahead = plan_next_flight(found, [manoeuvre], rows, LIMITS, QUICK)
    assert ahead is not None
    return ahead


def moved(plan: NextFlight) -> PlannedInput:
    assert plan.input is not None
    return plan.input


def flown(planned: PlannedInput) -> FlightLog:
    """The planned input flown by the suite's equations, from level flight."""
    alpha, elevator, thrust = level()
    still = np.zeros(planned.time.size)
    recorded = {
        "delta_e": still + elevator,
        **{name: planned.deflections.get(name, still) for name in ("delta_a", "delta_r")},
    }
    given = {"rho": DENSITY, "mass": MASS, "thrust": thrust, "speed_of_sound": SOUND, **recorded}
    start = [SPEED * np.cos(alpha), 0.0, SPEED * np.sin(alpha), 0.0, 0.0, 0.0, 0.0, alpha, 1500.0, 0.0]
    body = Body(WING, CHORD, SPAN, INERTIA, None, SPEED)
    seen = {**simulate(start, planned.time, given, {**PITCH, **SIDE}, body), **recorded}
    generator = np.random.default_rng(8)
    # As many samples as the record's, whose noise is that of 25 a second.
    step = round(0.04 / float(planned.time[1] - planned.time[0]))
    channels = {name: seen[name] + size * generator.standard_normal(still.size) for name, size in NOISE.items()}
    units = Lateral().log().units
    return FlightLog("next", planned.time[::step], {n: v[::step] for n, v in channels.items()}, units)


def test_both_surfaces_move_one_after_the_other(plan: NextFlight) -> None:
    planned = moved(plan)
    assert set(planned.deflections) == {"delta_a", "delta_r"}
    busy = [np.flatnonzero(deflection) for deflection in planned.deflections.values()]
    assert busy[0][-1] < busy[1][0]
    for step in planned.steps:
        inside = (planned.time > step.start + 0.4) & (planned.time < step.start + step.duration - 0.05)
        np.testing.assert_allclose(planned.deflections[step.surface][inside], step.deflection, atol=1e-12)
    assert " then " in planned.name


def test_constants_of_a_symmetric_aircraft_are_no_question(plan: NextFlight) -> None:
    assert [question.subject for question in plan.questions] == [f"{c} {t}" for c, t in ASKED]


@pytest.mark.slow
def test_what_it_promises_is_what_it_does(timid: tuple[Attribution, Manoeuvre], plan: NextFlight) -> None:
    """Limits hold, and the deviations are those of a fit to both flights."""
    planned = moved(plan)
    log = flown(planned)
    peaks = {peak.name: peak for peak in planned.peaks}
    for name in LIMITS:
        peak, noise = peaks[name], 4.0 * NOISE[name]
        assert peak.given
        assert peak.limit_low is not None
        assert peak.limit_high is not None
        assert peak.limit_low * (1.0 - 0.5 * RANGES.margin) - noise < log[name].min(), name
        assert log[name].max() < peak.limit_high * (1.0 - 0.5 * RANGES.margin) + noise, name
    found, first = timid
    second = prepare(log, aircraft(SIDE), first.columns)
    both = refine(found.completed.model, [first, second], FREE)
    after = np.sqrt(np.diag(both.covariance))
    spread = found.completed_deviations
    for question, (coefficient, term) in zip(plan.questions, ASKED, strict=True):
        n = FREE.index((coefficient, parse_term(term)))
        colour = max(1.0, float(spread.corrected[n] / spread.white[n]))
        assert question.expected is not None
        assert question.expected < 0.5 * spread.corrected[n]
        assert question.expected == pytest.approx(colour * float(after[n]), rel=0.25), question.subject


def test_it_is_written_for_pilot_and_simulator(plan: NextFlight, tmp_path: Path) -> None:
    result = replace(closed_loop(samples=120), next_flight=plan)
    write_report(result, tmp_path, interactive=False)
    log, planned = read_log(tmp_path / "next_input.csv"), moved(plan)
    for name, deflection in planned.deflections.items():
        assert log[name] == pytest.approx(deflection, abs=1e-9)
    text = Page(report_html(result, interactive=False)).text
    for word in (
        "left pedal",
        "Rudder positive trailing edge left",
        "Aileron positive right trailing edge down",
        "bank",
    ):
        assert word in text


@pytest.mark.parametrize("axes", [LATERAL, SIX], ids=lambda axes: axes.name)
def test_steady_flight_stays_steady_in_all_axes(axes: object) -> None:
    """With a constant of C_l and C_n that aileron and rudder have to hold."""
    extra = {("C_l", "1"): 0.002, ("C_n", "1"): -0.003, ("C_Y", "1"): 0.004}
    terms = {**SIDE, **extra} if axes is LATERAL else {**PITCH, **SIDE, **extra}
    found, manoeuvre = fitted(Lateral(extra=extra, size=0.5).log(), terms)
    steady = steady_flight(found.completed, manoeuvre)
    assert abs(steady.trim["delta_a"]) > 0.003
    time = np.arange(200) * 0.05
    planned = planned_manoeuvre(manoeuvre, steady, time, {})
    model = found.completed.model
    _, states = simulate_outputs(steady.state, planned.flight, np.array(model.values), model.table, model.constants)
    places = [model.axes.integrated.index(name) for name in moving_of(model.axes)]
    assert np.abs(states[:, places] - steady.state[places]).max() < 1e-5
