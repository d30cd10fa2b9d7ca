"""Effects that must not be named although they would explain a flight better, and gross effects that must be found."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from problems import BOTH_SQUARES, LIGHT, NOISE, Problem, declaring, entry, with_channels

from aerosid.aircraft import Aircraft
from aerosid.estimation.maximum_likelihood import refine
from aerosid.flight_model.simulation import fly, trim
from aerosid.logs.flight_log import FlightLog
from aerosid.loop.closed_loop import close_loop
from aerosid.loop.result import ClosedLoop
from aerosid.loop.settings import LoopSettings
from aerosid.loop.verdict import Verdict
from aerosid.search.cross_validation import eliminate_by_cross_validation, prediction_error
from aerosid.search.settings import AttributionSettings
from aerosid.search.structure_search import StructureSearch
from aerosid.signals.noise import calmed

Array = NDArray[np.float64]
QUICK = LoopSettings(paper_chain=False, next_flight=False, linear_analysis=False)
OFF = {("C_m", "alpha"): -0.69, ("C_m", "q_hat"): -15.0, ("C_Z", "alpha"): -5.5, ("C_X", "alpha"): 0.22}
DECLARED = declaring(LIGHT, OFF)


def names(result: ClosedLoop) -> list[tuple[str, str, str]]:
    return [(effect.kind, effect.where, effect.term) for effect in result.effects]


def driven(problem: Problem, seed: int, acting: Array, recorded: Array, name: str = "flight") -> FlightLog:
    """A flight with one elevator deviation, and another in its log with the usual noise."""
    level = trim(problem.truth, 100.0, LIGHT.density, LIGHT.mass)
    body = {"density": LIGHT.density, "mass": LIGHT.mass, "noise": problem.noise, "seed": seed, "name": name}
    log = fly(problem.truth, level, problem.time, acting, **body)
    thrust = np.full(log.time.size, level.thrust)
    return with_channels(log, delta_e=log["delta_e"] - acting + recorded, thrust=thrust)


def limited(time: Array, values: Array, rate: float) -> Array:
    surface = [float(values[0])]
    for step, wanted in zip(np.diff(time), values[1:], strict=True):
        surface.append(surface[-1] + float(np.clip(wanted - surface[-1], -rate * step, rate * step)))
    return np.array(surface)


def of_a_slow_surface(rate: float, declared: Aircraft) -> ClosedLoop:
    problem = Problem(duration=12.0, amplitude=0.08, noise={name: 0.6 * size for name, size in NOISE.items()})
    asked = problem.deflection
    log = driven(problem, 3, limited(problem.time, asked, rate), asked)
    result = close_loop([log], declared, settings=QUICK)
    assert names(result) == [("control_rate_limit", "delta_e", "")]
    return result


def test_a_severe_rate_limit_is_found_though_re_estimated_derivatives_imitate_it() -> None:
    result = of_a_slow_surface(0.1, DECLARED)
    assert result.effects[0].value == pytest.approx(0.1, rel=0.01)
    assert result.effects[0].std_error < 1e-3
    assert not [note for note in result.notes if "never reaches" in note]


@pytest.mark.parametrize("rate", [pytest.param(0.05, marks=pytest.mark.slow), 0.07])
@pytest.mark.parametrize("declared", [*(pytest.param(value, marks=pytest.mark.slow) for value in (-2.2, -1.94)), -1.7])
def test_a_surface_that_never_arrives_shows_its_limit_times_its_effectiveness(rate: float, declared: float) -> None:
    """The elevator is asked for 0.08 rad for a second either way, and the motion is that of the product alone."""
    result = of_a_slow_surface(rate, declaring(LIGHT, {**OFF, ("C_m", "delta_e"): declared}))
    (limit,) = result.effects
    rows = {(row.coefficient, row.term): row for row in result.derivatives}
    power, lift, constant = rows["C_m", "delta_e"], rows["C_Z", "delta_e"], rows["C_m", "1"]
    (note,) = [note for note in result.notes if "never reaches its recorded position" in note]
    product, error = (
        float(text.replace("\N{MINUS SIGN}", "-")) for text in note.split(" rad/s")[0].split(", ")[-1].split(" ± ")
    )
    assert product == pytest.approx(rate * -1.94, abs=3.0 * error)
    assert error < 0.01 * abs(product)
    assert limit.value * power.value == pytest.approx(product, abs=error)
    # Neither of the two is known better than the declared effectiveness.
    for known, truth in ((limit, rate), (power, -1.94), (lift, -0.407), (constant, 0.055)):
        assert known.std_error is not None
        assert abs(known.value - truth) < 2.0 * known.std_error
    assert limit.std_error > 0.2 * limit.value
    assert power.std_error is not None
    assert power.std_error > 0.2 * abs(power.value)


def multisine(time: Array) -> Array:
    swings = [np.sin(2.0 * np.pi * rate * time + phase) for rate, phase in ((0.1, 0.3), (0.17, 2.0), (0.27, 4.1))]
    return np.asarray(0.006 * np.sum(swings, axis=0) * np.clip(time - 1.0, 0.0, 1.0))


@pytest.mark.parametrize("seed", [1, pytest.param(2, marks=pytest.mark.slow), pytest.param(3, marks=pytest.mark.slow)])
def test_a_noisy_record_of_a_smooth_control_is_no_lag_and_no_dead_band(seed: int) -> None:
    """Any average of such a record simulates the motion better."""
    problem = Problem(duration=28.0, interval=0.02, noise={**NOISE, "delta_e": 1e-3})
    asked = multisine(problem.time)
    result = close_loop([driven(problem, seed, asked, asked)], DECLARED, settings=QUICK)
    assert names(result) == []


def test_noise_is_averaged_out_between_corners_which_are_retained() -> None:
    time = 0.02 * np.arange(1000)
    truth = 0.05 * np.sin(0.8 * time) + 0.06 * (time > 7.0) - 0.06 * (time > 9.0)
    noise = 2e-3
    values = truth + noise * np.random.default_rng(2).normal(size=time.size)
    error = calmed(values, noise) - truth
    corners = np.abs(time[:, None] - np.array([7.0, 9.0])).min(axis=1) < 0.7
    assert np.sqrt(np.mean(error[~corners] ** 2)) < 0.45 * noise
    # Its error nowhere exceeds the noise of a single sample.
    assert np.abs(error).max() < 5.0 * noise


def drifting(seed: int, amplitude: float, elevator: str, name: str) -> FlightLog:
    """Drag drifts throughout, which is no power of V_hat, though on one flight it resembles one."""
    problem = Problem(undeclared=BOTH_SQUARES, amplitude=amplitude, elevator=elevator)
    changed = replace(problem, undeclared={**BOTH_SQUARES, ("C_X", "vane_2"): 1.0})
    level = trim(problem.truth, 100.0, LIGHT.density, LIGHT.mass)
    body = {"density": LIGHT.density, "mass": LIGHT.mass, "noise": NOISE, "seed": seed, "name": name}
    vane = -0.015 * problem.time / 12.0
    log = fly(changed.truth, level, problem.time, problem.deflection, further_inputs={"vane_2": vane}, **body)
    return with_channels(log, vane_2=None, thrust=np.full(log.time.size, level.thrust))


def test_a_term_that_worsens_the_prediction_is_eliminated_and_true_terms_are_retained() -> None:
    problem = Problem(DECLARED)
    model, manoeuvre = problem.prepared(drifting(1, 0.06, "doublet", "first"))
    _, other = problem.prepared(drifting(2, -0.045, "3211", "second"))
    false = [entry("C_X", "V_hat"), entry("C_X", "V_hat^2")]
    true = [entry(*key) for key in BOTH_SQUARES]
    before = refine(model, [manoeuvre], model.entries)
    wider = model.extended([*true, *false])
    completed = refine(wider, [manoeuvre], wider.entries)
    search = StructureSearch((manoeuvre,), (), LIGHT.coefficients, before, AttributionSettings())
    assert completed.cost < before.cost
    accepted, refuted = eliminate_by_cross_validation(completed, search, [other])
    assert {part.entry for part in refuted} <= set(false)
    assert refuted
    assert set(true) <= set(accepted.free)
    assert prediction_error(accepted, [other]) < 0.9 * prediction_error(completed, [other])
    # Without validation flights nothing can be eliminated.
    assert eliminate_by_cross_validation(completed, search, []) == (completed, ())


def test_an_effect_shown_only_by_the_validation_flight_is_reported() -> None:
    truth = {("C_m", "alpha^2"): -1.2}
    small = Problem(undeclared=truth, amplitude=0.006)
    large = Problem(undeclared=truth, amplitude=0.06, elevator="3211")
    alone = close_loop([small.fly(1, "small")], DECLARED, settings=QUICK)
    assert alone.verdict is Verdict.NOTHING_MISSING
    result = close_loop([small.fly(1, "small")], DECLARED, [large.fly(2, "large")], QUICK)
    assert result.effects == ()
    assert result.verdict is Verdict.UNEXPLAINED
