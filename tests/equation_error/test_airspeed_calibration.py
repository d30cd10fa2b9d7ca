"""Errors of the airspeed that were not identified: posterior over their shapes by quadrature, and the derivatives."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from equations_decided import decided, identified
from numpy.testing import assert_allclose
from problems import entry
from scipy.integrate import quad
from scipy.stats import norm

from aerosid.effects.family import at_null
from aerosid.effects.sensor import sensor_scale
from aerosid.equation_error.decision import EquationErrorDecision
from aerosid.equation_error.selection.airspeed_calibration import mean_airspeed, shown_bias, uncertain_airspeed
from aerosid.equation_error.selection.calibration import PITOT_TUBE, Calibration, kinematic_scale, posterior_sizes
from aerosid.equation_error.selection.instrument_errors import InstrumentErrors
from aerosid.equation_error.selection.structure import SelectedStructure
from aerosid.loop.equation_error_notes import notes_on_calibration
from benchmarks.turbulent_flights import BODIES, NOTHING, Wrong, aircraft_of, flown

SEEDS = 653_000
"""Of these flights."""

Decided = tuple[InstrumentErrors, EquationErrorDecision]


def flights(seed: int, wrong: Wrong = NOTHING) -> Decided:
    body = BODIES[0]
    aircraft = aircraft_of(body, 0.08, np.random.default_rng(SEEDS + seed))
    one, two = (flown(name, body, SEEDS + 10 * seed + n, air=0.8, wrong=wrong) for n, name in enumerate(("one", "two")))
    return identified(aircraft, [one], [two]), decided(aircraft, [one], [two])


@pytest.fixture(scope="module")
def clean() -> Decided:
    return flights(1)


def uncertain(errors: InstrumentErrors, decision: EquationErrorDecision) -> dict[str, float]:
    """Distance of each error of the airspeed from its null, as a part of the airspeed."""
    found = {active.effect.kind: active.held[0] for active in decision.uncertain_scales if active.effect.where == "V"}
    return {"scale": found["sensor_scale"] - 1.0, "bias": found["sensor_bias"] / mean_airspeed(decision.completed)}


def integrated(evidence: list[tuple[float, float]], usual: Calibration) -> list[float]:
    """Root mean squares of the parts of each shape by quadrature over its size, the likelihood one at none."""

    def moment(power: int, found: float, error: float) -> float:
        def density(size: float) -> float:
            calibrated = (1.0 - usual.probability) * norm.pdf(size, 0.0, usual.accuracy)
            prior = calibrated + usual.probability * norm.pdf(size, 0.0, usual.uncalibrated)
            likelihood = norm.pdf(size, found, error) / norm.pdf(0.0, found, error)
            return float(size**power * likelihood * prior)

        return float(quad(density, -0.5, 0.5, points=[0.0, found], limit=800)[0])

    total = sum(moment(0, *each) for each in evidence)
    return [float(np.sqrt(moment(2, *each) / total)) for each in evidence]


@pytest.mark.parametrize("bias", [(0.0, 0.02), (0.04, 0.02), (-0.05, 0.012)])
@pytest.mark.parametrize("scale", [(0.001, 0.004), (0.03, 0.01)])
def test_the_sizes_are_those_of_the_posterior_by_quadrature(
    scale: tuple[float, float], bias: tuple[float, float]
) -> None:
    assert_allclose(posterior_sizes([scale, bias], PITOT_TUBE), integrated([scale, bias], PITOT_TUBE), rtol=1e-6)


def test_without_evidence_both_shapes_together_are_the_prior() -> None:
    sizes = posterior_sizes([(0.0, np.inf), (0.0, np.inf)], PITOT_TUBE)
    assert_allclose(np.hypot(*sizes), np.sqrt(0.9 * 0.005**2 + 0.1 * 0.03**2))
    assert_allclose(sizes[0], sizes[1])


def test_a_known_scale_factor_leaves_the_bias() -> None:
    """Kinematics that show no scale factor within a part in a thousand say nothing of a constant error."""
    scale, bias = posterior_sizes([(0.0, 0.001), (0.0, np.inf)], PITOT_TUBE)
    assert scale < 0.002
    assert bias > 0.008


def test_the_derivatives_contain_both_errors_of_the_airspeed(clean: Decided) -> None:
    errors, decision = clean
    shown = uncertain(errors, decision)
    size = np.hypot(*shown.values())
    deviations, design = np.sqrt(np.diag(decision.covariance)), decision.completed.design
    for name in (("C_Z", "alpha"), ("C_m", "alpha"), ("C_m", "delta_e")):
        place = design.unknowns.index(("term", entry(*name)))
        assert deviations[place] > 1.8 * size * abs(decision.completed.solution.values[place])
    (bias,) = (active for active in decision.uncertain_scales if active.name == ("sensor_bias", "V"))
    (note,) = notes_on_calibration(
        [replace(bias, held=(0.012 * mean_airspeed(decision.completed),))], decision.completed
    )
    assert "all derivatives contain twice the error of V, known to 1.2 %" in note


def test_a_declared_calibration_of_the_airspeed_is_believed(clean: Decided) -> None:
    errors, decision = clean
    declared = (at_null(sensor_scale("V")),)
    assert not uncertain_airspeed(errors.selected, errors.hypotheses, declared, decision.completed)


def test_a_scale_factor_that_no_pitot_tube_has_is_no_evidence() -> None:
    """An airspeed twelve per cent off, beyond a plausible error: the prior is left, not the belief in none."""
    errors, decision = flights(7, Wrong(scale={"V": 1.12}))
    unknown = SelectedStructure(errors.declared, ())
    (scale, bias) = ({h.kind: h for h in errors.hypotheses if h.where == "V"}[f"sensor_{k}"] for k in ("scale", "bias"))
    assert abs(kinematic_scale(unknown, scale)[0]) > PITOT_TUBE.plausible
    at, (value, error) = mean_airspeed(decision.before), shown_bias((errors.declared, decision.before), bias)
    expected, _ = posterior_sizes([(0.0, np.inf), (value / at, error / at)], PITOT_TUBE)
    (shown, _) = uncertain_airspeed(unknown, errors.hypotheses, (), decision.before)
    assert_allclose(abs(shown.held[0] - 1.0), expected)


@pytest.mark.slow
def test_the_derivatives_of_an_airspeed_with_a_bias_are_within_their_standard_errors() -> None:
    """Two per cent off, four times what a calibrated one retains: of its scale factor alone 83 % were within two."""
    distances = []
    for seed in range(20, 26):
        for size in (-0.02, 0.02):
            _, decision = flights(seed, Wrong(bias={"V": size * BODIES[0].airspeed}))
            distances += in_standard_errors(decision)
    assert np.mean(np.abs(distances) < 2.0) > 0.86
    assert np.mean(np.abs(distances) < 3.0) > 0.97


def in_standard_errors(decision: EquationErrorDecision) -> list[float]:
    """Errors of the derivatives of the first aircraft."""
    deviations, values = np.sqrt(np.diag(decision.covariance)), decision.completed.solution.values
    rows = []
    for n, unknown in enumerate(decision.completed.design.unknowns):
        if unknown[0] == "term" and unknown[1][1].factors:  # type: ignore[index]
            true = BODIES[0].terms[unknown[1][0], str(unknown[1][1])]  # type: ignore[index]
            rows.append(float((values[n] - true) / deviations[n]))
    return rows
