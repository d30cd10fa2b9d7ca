"""Stepwise selection by d(t): simulated terms, sensors, controls and steps found, withheld ones not replaced."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from problems import BOTH_SQUARES, LIFT_AND_DRAG, LIGHT, NOISE, Problem, Truth, declaring, entry
from scipy.signal import lfilter

from aerosid.aircraft import Aircraft
from aerosid.effects import ActiveEffect, frozen
from aerosid.effects.ground_effect import ground_effect
from aerosid.errors import EstimationError
from aerosid.estimation.effect_columns import with_columns_of
from aerosid.estimation.manoeuvre import prepare
from aerosid.logs.flight_log import FlightLog
from aerosid.loop.identification import declared_with_candidates
from aerosid.loop.identification_problem import IdentificationProblem
from aerosid.loop.methods import by_model_error
from aerosid.loop.settings import LoopSettings
from aerosid.model_error.aircraft_error.forward_estimate import estimate_aircraft_error
from aerosid.model_error.flight_sweeps.sweeps import FlightSweeps
from aerosid.model_error.paper_chain.chain import ChainSettings
from aerosid.search.attribution import Attribution
from aerosid.search.findings import named
from aerosid.search.partial_correlation.attribution import swept_start
from aerosid.search.partial_correlation.settings import ModelErrorSearchSettings
from benchmarks.false_alarms import declared, drawn, flown

QUIET = LoopSettings(method="iebmee")


def question(
    log: FlightLog, aircraft: Aircraft = LIGHT, without: tuple[tuple[str, str], ...] = ()
) -> IdentificationProblem:
    model, candidates = declared_with_candidates([log], [], aircraft)
    withheld = {entry(*key) for key in without}
    kept = tuple(candidate for candidate in candidates if candidate not in withheld)
    return IdentificationProblem(aircraft, model, (), kept, (prepare(log, aircraft, model.columns),), ())


def found_in(log: FlightLog, aircraft: Aircraft = LIGHT, catalogue: str = "terms") -> Attribution:
    settings = replace(QUIET, catalogue=catalogue)  # type: ignore[arg-type]
    return by_model_error(question(log, aircraft), settings, lambda _stage: None).found


def names(found: Attribution) -> set[str]:
    return {named((f.kind, f.where, f.term)) for f in found.findings}


def test_both_terms_of_the_paper_are_found_within_four_standard_errors() -> None:
    found = found_in(Problem(undeclared=BOTH_SQUARES).fly(5), catalogue="all")
    assert names(found) == {"C_X alpha^2", "C_m alpha^2"}
    for finding in found.findings:
        assert abs(finding.value - BOTH_SQUARES[finding.where, finding.term]) < 4.0 * finding.std_error
        assert finding.p_value < 1e-6
    completed, spread = found.completed, found.completed_deviations
    for n, key in enumerate(completed.free):
        true = LIGHT_TRUTH.get((key[0], str(key[1])))
        assert true is None or abs(completed.model.values[n] - true) < 4.5 * spread.corrected[n]


LIGHT_TRUTH = {(d.coefficient, str(d.term)): d.value for d in LIGHT.derivatives}


@pytest.mark.parametrize(
    "undeclared",
    [
        {("C_Z", "alpha^3"): 38.0},
        {("C_m", "alpha*delta_e"): 6.5},
        pytest.param({("C_m", "V_hat"): 0.35}, marks=pytest.mark.slow),
        pytest.param({("C_X", "delta_e"): 0.06}, marks=pytest.mark.slow),
    ],
    ids=str,
)
def test_a_term_is_found_with_wrong_declared_derivatives(undeclared: Truth) -> None:
    wrong = declaring(LIGHT, {key: 1.12 * value for key, value in LIGHT_TRUTH.items() if key[1] != "1"})
    found = found_in(Problem(undeclared=undeclared, amplitude=0.05).fly(6), wrong)
    ((coefficient, term),) = undeclared
    assert names(found) == {f"{coefficient} {term}"}


def test_a_term_in_lift_is_found_in_lift() -> None:
    found = found_in(Problem(LIFT_AND_DRAG, {("C_D", "alpha^2"): 2.5}).fly(7), LIFT_AND_DRAG)
    assert names(found) == {"C_D alpha^2"}


@pytest.mark.slow
def test_a_control_delay_and_a_vane_bias_are_found_and_no_term_in_their_place() -> None:
    flight = Problem().fly(8)
    late = np.interp(flight.time + 0.1, flight.time, flight["delta_e"])  # the recorded control precedes the acting one
    early = replace(flight, channels={**flight.channels, "delta_e": late})
    (one,) = found_in(early, catalogue="all").findings
    assert (one.kind, one.where) == ("control_delay", "delta_e")
    assert one.value == pytest.approx(0.1, abs=5.0 * one.std_error)
    biased = replace(flight, channels={**flight.channels, "alpha": flight["alpha"] + 0.02})
    (one,) = found_in(biased, catalogue="all").findings
    assert (one.kind, one.where) == ("sensor_bias", "alpha")
    assert one.value == pytest.approx(0.02, abs=5.0 * one.std_error)


def test_without_a_missing_effect_nothing_is_named_and_d_is_within_its_standard_deviation() -> None:
    log = Problem().fly(9)
    asked = question(log)
    found = by_model_error(asked, QUIET, lambda _stage: None).found
    assert found.findings == ()
    start = swept_start(
        asked.declared,
        asked.manoeuvres,
        asked.free,
        (),
        LIGHT.coefficients,
        ChainSettings(),
        ModelErrorSearchSettings(),
    )
    sweep = FlightSweeps(asked.manoeuvres, LIGHT.coefficients).estimate(start)
    assert np.all(np.abs(sweep.swept.forces[0]) <= 4.0 * sweep.deviation[0][:, :3] + 1e-9)


def test_the_fixed_interval_d_is_the_missing_term_within_its_deviation() -> None:
    problem = Problem(undeclared={("C_m", "alpha^2"): -1.715})
    log = problem.fly(10)
    asked = question(log)
    fixed = declaring(LIGHT, {}, tuple(LIGHT_TRUTH))
    model, _ = declared_with_candidates([log], [], fixed)
    manoeuvres = (prepare(log, fixed, model.columns),)
    start = swept_start(model, manoeuvres, (), (), LIGHT.coefficients, ChainSettings(), ModelErrorSearchSettings())
    sweep = FlightSweeps(manoeuvres, LIGHT.coefficients).estimate(start)
    silent = replace(problem, noise=dict.fromkeys(NOISE, 0.0)).fly(10)
    expected = -1.715 * silent["alpha"] ** 2
    away = (sweep.swept.forces[0][:, 2] - expected) / sweep.deviation[0][:, 2]
    assert np.sqrt(np.mean(away**2)) < 2.0
    assert asked.declared.entries == model.entries[: len(asked.declared.entries)]
    assert np.corrcoef(sweep.swept.forces[0][:, 2], expected)[0, 1] > 0.99


def test_a_declared_effect_of_the_motion_has_its_input_column_in_the_first_estimate_too() -> None:
    log = Problem().fly(12)
    asked = question(log)
    lift = frozen(ActiveEffect(ground_effect("C_Z", 20.0), (0.3, 20.0)))
    model = with_columns_of(asked.declared, [lift])
    assert len(model.columns) > len(asked.declared.columns)
    numbers = LIGHT.coefficients, ChainSettings(), ModelErrorSearchSettings()
    start = swept_start(model, asked.manoeuvres, asked.free, (lift,), *numbers)
    # Far from the ground the effect is zero, and so is its part of the first d(t).
    plain = swept_start(asked.declared, asked.manoeuvres, asked.free, (), *numbers)
    np.testing.assert_allclose(start.forces[0], plain.forces[0], atol=1e-12)


def test_a_flight_without_the_model_s_columns_is_refused_before_a_kernel_reads_out_of_bounds() -> None:
    asked = question(Problem().fly(12))
    wider = with_columns_of(asked.declared, [frozen(ActiveEffect(ground_effect("C_Z", 20.0), (0.3, 20.0)))])
    with pytest.raises(ValueError, match="input columns"):
        estimate_aircraft_error(wider, asked.manoeuvres[0].flight, np.ones(4), np.ones(4))


@pytest.mark.slow
def test_a_withheld_term_is_not_named_as_a_sensor_error_or_a_step_change() -> None:
    """Nearly collinear terms may replace it; nothing else may."""
    log = Problem(undeclared={("C_m", "alpha^2"): -1.715}).fly(11)
    found = by_model_error(question(log, without=(("C_m", "alpha^2"),)), QUIET, lambda _stage: None).found
    assert {finding.kind for finding in found.findings} <= {"aero_term", "gust"}
    assert {finding.where for finding in found.findings} <= {"C_m", ""}


def test_a_model_that_cannot_be_simulated_is_reported_in_one_sentence() -> None:
    backwards = declaring(LIGHT, {("C_m", "alpha"): 40.0, ("C_m", "q_hat"): 400.0})
    with pytest.raises(EstimationError, match="leaves"):
        found_in(Problem(duration=6.0).fly(12), backwards)


@pytest.mark.slow
def test_false_alarms_are_at_most_two_in_a_hundred() -> None:
    """White and coloured noise; P(three or more) is 1.5e-4 at one in a thousand, .88 at one in twenty."""
    alarms = []
    for seed in range(100):
        log = Problem(elevator="doublet" if seed % 2 else "3211", amplitude=0.045, duration=10.0).fly(1000 + seed)
        if seed % 4 > 1:
            silent = Problem(
                elevator="doublet" if seed % 2 else "3211", amplitude=0.045, duration=10.0,
                noise=dict.fromkeys(NOISE, 0.0),
            ).fly(1000 + seed)  # fmt: skip
            rng = np.random.default_rng(seed)
            outputs = [name for name in NOISE if name != "delta_e"]
            shocks = 0.8 * rng.standard_normal((log.time.size + 50, len(outputs)))
            noise = dict(zip(outputs, lfilter([1.0], [1.0, -0.6], shocks, axis=0)[50:].T, strict=True))
            channels = {name: silent[name] + NOISE[name] * noise[name] for name in outputs}
            log = replace(log, channels={**log.channels, **channels})
        if names(found_in(log, catalogue="all")):
            alarms.append(seed)
    assert len(alarms) <= 2


@pytest.mark.parametrize("number", [75, *(pytest.param(n, marks=pytest.mark.slow) for n in (30, 44))])
def test_d_in_coloured_noise_is_not_named_as_an_accelerometer_error(number: int) -> None:
    """Flights without a missing effect on which an accelerometer error was named, whose noise d(t) had taken in."""
    trial = drawn(number, 9101)
    found = found_in(flown(trial), declared(trial), "all")
    assert not found.findings
