"""Calibration uncertainty of a vane: posterior by numerical integration, and what it adds to derivatives."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from equations_decided import decided, identified
from numpy.testing import assert_allclose
from problems import entry
from scipy.integrate import quad
from scipy.stats import norm

from aerosid.aircraft.reading import aircraft_from_text
from aerosid.effects import ActiveEffect
from aerosid.equation_error.decision import EquationErrorDecision
from aerosid.equation_error.regression.estimate import estimate
from aerosid.equation_error.selection.alternatives import last_parameter
from aerosid.equation_error.selection.calibration import VANE, Calibration, posterior_size, uncertain_scales
from aerosid.equation_error.selection.candidates import with_hypothesis
from aerosid.equation_error.selection.instrument_errors import InstrumentErrors
from aerosid.loop.closed_loop import close_loop
from aerosid.loop.equation_error_notes import notes_on_calibration
from aerosid.loop.settings import LoopSettings
from aerosid.notation import number
from benchmarks.turbulent_flights import BODIES, Wrong, aircraft_of, flown

SEEDS = 650_000
"""Of these flights."""

QUICK = LoopSettings(paper_chain=False, second_opinion=False, linear_analysis=False, next_flight=False)


def flights(seed: int, scale: float, air: float) -> tuple[InstrumentErrors, EquationErrorDecision]:
    body = BODIES[0]
    aircraft = aircraft_of(body, 0.08, np.random.default_rng(SEEDS + seed))
    wrong = Wrong(scale={"alpha": scale})
    one, two = (
        flown(name, body, SEEDS + 10 * seed + n, air=air, wrong=wrong, seconds=30.0)
        for n, name in enumerate(("one", "two"))
    )
    return identified(aircraft, [one], [two]), decided(aircraft, [one], [two])


@pytest.fixture(scope="module")
def uncertain() -> tuple[InstrumentErrors, EquationErrorDecision]:
    """A vane that shows 3 % too much in gusts, which is not identified."""
    return flights(3, 1.03, 0.8)


def test_the_posterior_is_that_of_the_prior_and_the_kinematics(
    uncertain: tuple[InstrumentErrors, EquationErrorDecision],
) -> None:
    errors, _ = uncertain
    assert not errors.selected.chosen
    scale = of_vane(uncertain_scales(errors.selected, errors.hypotheses, ()))
    base = errors.selected.estimate
    (hypothesis,) = [h for h in errors.hypotheses if h.label == ("sensor_scale", "alpha", "")]
    found = estimate(base.problem, with_hypothesis(base.point, hypothesis), base.solution.weights)
    _, value, error = last_parameter(found, hypothesis)

    expected = integrated(value - 1.0, error, VANE)
    (shown,) = scale.held
    assert_allclose(abs(shown - 1.0), expected, rtol=0.05)
    assert (shown > 1.0) == (value > 1.0)


def of_vane(scales: Sequence[ActiveEffect]) -> ActiveEffect:
    """That of the vane; the others are those of the airspeed."""
    (vane,) = (scale for scale in scales if scale.effect.where == "alpha")
    return vane


def integrated(found: float, error: float, usual: Calibration) -> float:
    """Root mean square of the posterior of a scale factor error, by quadrature."""

    def density(size: float) -> float:
        calibrated = (1.0 - usual.probability) * norm.pdf(size, 0.0, usual.accuracy)
        prior = calibrated + usual.probability * norm.pdf(size, 0.0, usual.uncalibrated)
        return float(norm.pdf(size, found, error) * prior)

    total, square = (
        quad(lambda size, p=power: size**p * density(size), -1.0, 1.0, points=[0.0, found], limit=400)[0]
        for power in (0, 2)
    )
    return float(np.sqrt(square / total))


@pytest.mark.parametrize("found", [0.0, 0.03, -0.106, 0.2])
@pytest.mark.parametrize("error", [0.005, 0.03, 0.08])
def test_the_size_is_that_of_the_posterior_by_quadrature(found: float, error: float) -> None:
    assert_allclose(posterior_size(found, error, VANE), integrated(found, error, VANE), rtol=1e-6)


def test_without_kinematics_the_prior_is_left_and_a_contradiction_is_believed() -> None:
    """A calibrated vane that kinematics put .1 +- .03 off is probably none; a normal prior would leave it .035 off."""
    prior = np.sqrt(0.9 * 0.02**2 + 0.1 * 0.1**2)
    assert_allclose(posterior_size(0.0, np.inf, VANE), prior)
    assert_allclose(posterior_size(0.3, 1e6, VANE), prior, rtol=1e-6)
    assert posterior_size(0.1, 0.03, Calibration(0.02, 0.0, 0.1)) < 0.036
    assert posterior_size(0.1, 0.03, VANE) > 0.06


def test_a_vane_whose_scale_was_identified_is_not_uncertain() -> None:
    errors, _ = flights(7, 1.1, 0.2)
    assert ("sensor_scale", "alpha", "") in errors.selected.labels
    scales = uncertain_scales(errors.selected, errors.hypotheses, errors.selected.estimate.point.effects)
    assert not scales


def test_the_derivatives_by_alpha_are_as_uncertain_as_the_scale(
    uncertain: tuple[InstrumentErrors, EquationErrorDecision],
) -> None:
    errors, decision = uncertain
    truth = BODIES[0].terms
    scale = of_vane(uncertain_scales(errors.selected, errors.hypotheses, ()))
    deviations = np.sqrt(np.diag(decision.covariance))
    values = decision.completed.solution.values
    unknowns = decision.completed.design.unknowns
    for name in (("C_Z", "alpha"), ("C_m", "alpha")):
        n = unknowns.index(("term", entry(*name)))
        assert abs(values[n] - truth[name]) < 3.0 * deviations[n]
        assert deviations[n] > 0.8 * abs(values[n]) * abs(scale.held[0] - 1.0)


def test_the_note_gives_the_scale_and_how_to_declare_a_calibration(
    uncertain: tuple[InstrumentErrors, EquationErrorDecision],
) -> None:
    _, decision = uncertain
    scale = of_vane(decision.uncertain_scales)
    (note,) = notes_on_calibration([scale], decision.completed)
    assert f"known to {number(100.0 * abs(scale.held[0] - 1.0), 2)} %" in note
    assert 'kind = "sensor_scale", where = "alpha"' in note
    assert not notes_on_calibration([replace(scale, held=(1.001,))], decision.completed)


def test_an_airspeed_off_by_one_and_a_half_per_cent_leaves_the_derivatives_within_three_standard_errors() -> None:
    body = BODIES[0]
    wrong = Wrong(scale={"V": 1.015})
    logs = [flown(name, body, SEEDS + 70 + n, air=0.8, wrong=wrong) for n, name in enumerate(("one", "two"))]
    decision = decided(aircraft_of(body, 0.08, np.random.default_rng(SEEDS + 7)), logs[:1], logs[1:])
    assert not [row for row in decision.findings if row.hypothesis.where == "V"]
    deviations = np.sqrt(np.diag(decision.covariance))
    for n, unknown in enumerate(decision.completed.design.unknowns):
        if unknown[0] == "term" and unknown[1][1].factors:  # type: ignore[index]
            true = body.terms[unknown[1][0], str(unknown[1][1])]  # type: ignore[index]
            assert abs(decision.completed.solution.values[n] - true) < 3.0 * deviations[n]


@pytest.mark.slow
def test_a_declared_calibration_is_believed() -> None:
    """With the scale factor declared as one the derivatives by alpha are as certain as the flights make them."""
    body = BODIES[0]
    generator = np.random.default_rng(SEEDS + 5)
    aircraft = aircraft_of(body, 0.08, generator)
    logs = [flown(name, body, SEEDS + 50 + n, air=0.8, seconds=30.0) for n, name in enumerate(("one", "two"))]
    effect = '[[effects]]\nkind = "sensor_scale"\nwhere = "alpha"\nvalue = 1.0\n'
    calibrated = aircraft_from_text(aircraft.text + effect, "calibrated.toml", "0" * 64)
    errors = {}
    for name, each in (("usual", aircraft), ("calibrated", calibrated)):
        result = close_loop(logs[:1], each, logs[1:], settings=QUICK)
        (row,) = [row for row in result.derivatives if (row.coefficient, row.term) == ("C_m", "alpha")]
        assert row.std_error is not None
        errors[name] = row.std_error
        assert any("scale factor of its vane" in note for note in result.notes) is (name == "usual")
    assert errors["calibrated"] < 0.8 * errors["usual"]
