"""How good a fit is: Theil, whiteness at its nominal rate, correlations, scatter, what a record cannot show."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from problems import BOTH_SQUARES, LIGHT, NOISE, SILENT, Problem, declaring, entry, with_channels
from scipy.signal import lfilter
from scipy.stats import binom, chi2

from aerosid.estimation.deviations import deviations
from aerosid.estimation.maximum_likelihood import refine
from aerosid.loop.closed_loop import close_loop
from aerosid.loop.model_validation.goodness import correlation_matrix, scatter, variance_inflation
from aerosid.loop.settings import LoopSettings
from aerosid.loop.verdict import Verdict
from aerosid.signals.fit_statistics import explained_variance, noise_memories, theil, whiteness

TERMS = LoopSettings(catalogue="terms")


@given(seed=st.integers(0, 1000), shift=st.floats(-3.0, 3.0), scale=st.floats(0.2, 3.0))
def test_theils_shares_add_up(seed: int, shift: float, scale: float) -> None:
    rng = np.random.default_rng(seed)
    measured = rng.normal(size=50)
    found = theil(measured, shift + scale * measured + 0.1 * rng.normal(size=50))
    assert found is not None
    assert found.bias + found.variance + found.covariance == pytest.approx(1.0, abs=1e-9)
    assert 0.0 < found.coefficient <= 1.0


def test_theils_shares_name_their_cause() -> None:
    measured = np.sin(np.linspace(0.0, 20.0, 400))
    noise = 0.01 * np.random.default_rng(1).normal(size=400)
    shifted, scaled = theil(measured, measured + 0.5 + noise), theil(measured, 1.5 * measured + noise)
    noisy = theil(measured, measured + 30.0 * noise)
    assert shifted is not None
    assert scaled is not None
    assert noisy is not None
    assert min(shifted.bias, scaled.variance, noisy.covariance) > 0.9
    assert theil(measured, measured) is None
    # The worst there is: the opposite.
    opposite = theil(measured, -measured)
    assert opposite is not None
    assert opposite.coefficient == pytest.approx(1.0)
    assert explained_variance(measured, -measured) == pytest.approx(-3.0, abs=0.1)


def test_white_noise_is_called_white_at_the_nominal_rate() -> None:
    rng = np.random.default_rng(3)
    values = [whiteness(rng.normal(size=470)) for _ in range(400)]
    below = sum(value is not None and value.p_value < 0.05 for value in values)
    # False alarm of this test: one in a thousand.
    assert binom.ppf(5e-4, 400, 0.05) <= below <= binom.ppf(1.0 - 5e-4, 400, 0.065)


def test_a_slow_swing_is_not_white() -> None:
    rng = np.random.default_rng(3)
    found = whiteness(rng.normal(size=470) + 0.5 * np.sin(np.arange(470) / 6.0))
    assert found is not None
    assert found.p_value < 1e-6
    assert found.autocorrelation[0] == 1.0
    assert whiteness(np.full(10, np.nan)) is None


def remembering(rng: np.random.Generator, memory: float, channels: int) -> np.ndarray:
    """First-order noise of unit variance, (600, channels)."""
    shocks = np.sqrt(1.0 - memory**2) * rng.normal(size=(700, channels))
    return np.asarray(lfilter([1.0], [1.0, -memory], shocks, axis=0)[100:])


def test_the_memory_of_a_sensors_own_noise_is_found_and_a_wrong_model_is_no_noise() -> None:
    """Coloured by itself: noise. Common to two channels, or a slow swing under white noise: none."""
    time = 0.03 * np.arange(600)
    rng = np.random.default_rng(5)
    own = remembering(rng, 0.7, 4)
    # The deviation of a correlation from 600 samples is 0.03 at 0.7; four of them.
    assert noise_memories(time, own) == pytest.approx(0.7, abs=0.12)
    swing = 0.7 * np.sin(2.0 * np.pi * 0.4 * time)
    shared = remembering(rng, 0.7, 1)
    mixed = np.column_stack(
        [own[:, 0], own[:, 1] + shared[:, 0], own[:, 2] - shared[:, 0], rng.normal(size=600) + swing]
    )
    assert np.isfinite(noise_memories(time, mixed)).tolist() == [True, False, False, False]
    # Slow as the motion is: not told from it.
    assert np.isnan(noise_memories(time, remembering(rng, 0.97, 1))).all()


def test_coloured_noise_alone_is_nothing_missing_and_stands_in_the_notes() -> None:
    problem = Problem(LIGHT)
    log = problem.fly(4)
    clean = replace(problem, noise=SILENT).fly(4)
    rng = np.random.default_rng(8)
    outputs = [name for name in NOISE if name != "delta_e"]
    coloured = dict(zip(outputs, remembering(rng, 0.6, len(outputs)).T, strict=True))
    channels = {name: clean[name] + NOISE[name] * coloured[name][: log.samples] for name in outputs}
    result = close_loop([with_channels(log, **channels)], LIGHT)
    assert result.verdict is Verdict.NOTHING_MISSING
    assert any("noise of V" in note and "coloured" in note for note in result.notes)


def test_correlations_and_inflation_are_those_of_the_inverse_information() -> None:
    problem = Problem(declaring(LIGHT, BOTH_SQUARES))
    model, manoeuvre = problem.prepared(problem.fly(2))
    found = refine(model, [manoeuvre], model.entries)
    inverse = np.linalg.inv(found.information[:-1, :-1] if found.information[-1, -1] == 0.0 else found.information)
    free = len(found.free)
    wanted = (np.diag(found.information)[:free]) * np.diag(inverse)[:free]
    assert variance_inflation(found) == pytest.approx(wanted, rel=1e-4)
    assert (variance_inflation(found) >= 1.0).all()
    matrix = np.array(correlation_matrix(found, deviations(found, [manoeuvre])).rows)
    assert np.abs(matrix - matrix.T).max() < 1e-12
    assert np.diag(matrix) == pytest.approx(1.0)
    assert np.linalg.eigvalsh(matrix).min() > 0.0


def test_scatter_between_flights_is_their_deviation() -> None:
    """Six flights alike: each derivative's scatter over its mean deviation is a chi with five degrees of freedom."""
    problem = Problem(declaring(LIGHT, BOTH_SQUARES))
    model, _ = problem.prepared(problem.fly(0))
    manoeuvres = [problem.prepared(problem.fly(seed, name=f"flight {seed}"))[1] for seed in range(6)]
    joint = refine(model, manoeuvres, model.entries)
    alone = [refine(model, [manoeuvre], model.entries) for manoeuvre in manoeuvres]
    mean = np.sqrt(np.mean([np.diag(each.covariance)[:12] for each in alone], axis=0))
    found = scatter(joint, manoeuvres)
    # Twelve derivatives, one in ten thousand each side.
    lowest, highest = np.sqrt(chi2.ppf([1e-4, 1.0 - 1e-4], 5) / 5.0)
    ratios = {free: found[free] / mean[n] for n, free in enumerate(joint.free) if free in found}
    assert len(ratios) >= 10
    assert all(lowest < ratio < highest for ratio in ratios.values())
    assert entry("C_m", "alpha") in found
    assert scatter(joint, manoeuvres[:1]) == {}


def test_what_a_record_cannot_show_is_said() -> None:
    """A doublet of a tenth: C_Z q_hat drowns in the noise."""
    result = close_loop([Problem(amplitude=0.004, duration=8.0).fly(4)], LIGHT, settings=TERMS)
    hidden = [row for row in result.derivatives if not row.shown]
    assert any((row.coefficient, row.term) == ("C_Z", "q_hat") for row in hidden)
    sentences = [note for note in result.notes if "Not significant" in note]
    assert len(sentences) == len(hidden)
    assert any("C_Z q_hat" in sentence for sentence in sentences)


def test_a_loop_carries_fit_and_innovations_of_every_channel() -> None:
    first, second = Problem(undeclared=BOTH_SQUARES).fly(1), Problem(undeclared=BOTH_SQUARES, elevator="3211").fly(2)
    result = close_loop([first], LIGHT, [replace(second, name="second")], TERMS)
    assert {(row.log, row.channel, row.variant) for row in result.fit} == {
        (name, channel, variant)
        for name in (first.name, "second")
        for channel in ("V", "alpha", "q", "theta", "a_x", "a_z", "h")
        for variant in ("before", "after")
    }
    after = {(row.log, row.channel): row for row in result.fit if row.variant == "after"}
    before = {(row.log, row.channel): row for row in result.fit if row.variant == "before"}
    q = after[first.name, "q"], before[first.name, "q"]
    assert q[0].theil is not None
    assert q[1].theil is not None
    assert q[0].theil < 0.5 * q[1].theil
    assert all(abs(row.ratio - 1.0) < 0.02 for row in result.innovations)
    # Seven channels at one in a thousand.
    assert all(row.whiteness is not None and row.whiteness > 1e-3 / 7.0 for row in result.innovations)
