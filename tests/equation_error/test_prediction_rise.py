"""The standard error of a rise of the mean square prediction residual, against simulated pairs of predictions."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from aerosid.equation_error.selection.cross_validation import FallSettings, PredictionResidual, predictions_against

SEED = 52_000
"""Of these tests; published tables and trials begin elsewhere."""

TRIALS = 600
SAMPLES = 240
WRONG = 0.1
"""Root mean square of each model's own error, of unit noise: the smaller residual is taken for noise alone."""

Array = NDArray[np.float64]


def predicted(
    pole: float, parameter_error: float, *, told: bool = True
) -> Iterator[tuple[PredictionResidual, PredictionResidual]]:
    """Pairs of predictions of a record by two models that predict it equally well in the mean.

    Both have the same errors of two derivatives beside noise of the record, and each its own wrong column. `told`:
    whether the covariance of the derivatives is known.
    """
    generator = np.random.default_rng(SEED)
    time = np.linspace(0.0, 1.0, SAMPLES)
    slopes = np.column_stack([np.sin(9.0 * time), np.sin(23.0 * time + 0.4)])
    wrong = np.column_stack([np.sin(9.0 * time) ** 2, np.cos(23.0 * time + 0.4) ** 2])
    wrong -= wrong.mean(axis=0)
    wrong *= WRONG / np.sqrt(np.mean(wrong**2, axis=0))
    covariance = parameter_error**2 * np.array([[1.0, 0.5], [0.5, 1.0]])
    for _ in range(TRIALS):
        white = generator.standard_normal(SAMPLES + 100)
        noise = np.sqrt(1.0 - pole**2) * lfilter([1.0], [1.0, -pole], white)[100:]
        shared = noise + slopes @ generator.multivariate_normal([0.0, 0.0], covariance)
        before, after = (PredictionResidual(shared, shared + own, slopes, told * covariance) for own in wrong.T)
        yield before, after


def z_scores(pole: float, parameter_error: float, *, told: bool = True) -> Array:
    """Rises over their standard errors."""
    rises = (after.rise_over(before) for before, after in predicted(pole, parameter_error, told=told))
    return np.array([rise / std_error for rise, std_error in rises])


def test_its_standard_error_is_that_of_the_simulated_rises() -> None:
    for pole, parameter_error in ((0.0, 0.0), (0.6, 0.0), (0.0, 0.4), (0.6, 0.4)):
        scores = z_scores(pole, parameter_error)
        assert abs(scores.mean()) < 0.25
        assert 0.85 < scores.std() < 1.2
        assert np.mean(scores > 2.0) < 0.05  # designed .023, of 600 trials with a standard error of .006


def test_the_errors_of_the_derivatives_are_part_of_it() -> None:
    """They decide where a quiet flight hardly shows the derivatives of a coefficient."""
    scores = z_scores(0.0, 3.0)
    assert 0.85 < scores.std() < 1.2
    assert z_scores(0.0, 3.0, told=False).std() > 2.5


def test_predictions_are_against_a_structure_by_what_a_normal_deviate_loses_in_likelihood() -> None:
    """Equal predictions are against either of two structures as rarely as two standard errors are exceeded."""
    heard, scores = FallSettings(fall=0.0), z_scores(0.6, 0.4)
    found = []
    for (before, after), score in zip(predicted(0.6, 0.4), scores, strict=True):
        one, other = {(0, "C_m"): before}, {(0, "C_m"): after}
        found.append(predictions_against(one, other, heard))
        assert np.isclose(found[-1], 0.5 * score**2 if score > heard.deviations else 0.0)
        # What one coefficient loses another may gain.
        assert predictions_against(one | {(0, "C_X"): after}, other | {(0, "C_X"): before}, heard) == 0.0
        assert predictions_against(one, other, FallSettings(fall=1.0)) == 0.0
    assert np.mean(np.array(found) > 0.0) < 0.05  # designed .023
