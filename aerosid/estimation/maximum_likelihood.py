"""Maximum-likelihood estimates of derivatives, effects, initial states and noise, over all manoeuvres.

With noise-free inputs this is the output-error method; the noise of a measured surface is process noise with known
input matrix, and is accounted for. The likelihood itself is in `aerosid.estimation.likelihood`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from aerosid.effects import ActiveEffect, NoiseEffect
from aerosid.errors import EstimationError
from aerosid.estimation.damped_search import best_point
from aerosid.estimation.fit_settings import COMPETING_FITS, USUAL, RefinementSettings
from aerosid.estimation.likelihood import Likelihood, Whitened
from aerosid.estimation.likelihood_point import Point
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.estimation.noise_statistics import estimate_noise_statistics
from aerosid.flight_model.aerodynamics import AerodynamicModel, Entry


@dataclass(frozen=True)
class Refinement:
    """The maximum-likelihood estimate.

    Attributes
    ----------
    model : AerodynamicModel
        The model with the estimated values.
    free : tuple of Entry
        The entries that were estimated, in the order of the first parameters.
    states : tuple of ndarray, shape (n,)
        The initial state of each manoeuvre.
    effects : tuple of ActiveEffect
        Effects other than terms, with their estimated parameters.
    variance : ndarray, shape (m,)
        Noise variance of each output, SI squared; of unmeasured outputs 1.
    cost : float
        -2 ln L but for a constant.
    information : ndarray, shape (M, M)
        Fisher information: free entries, the initial states of each manoeuvre, the effects' parameters.
    converged : bool
        Whether the last step was within the tolerance.
    held_to_data : float
        Factor on the inputs' noise where the model diverges in open loop and was fitted in the filter form; else 0.
    is_maximum : bool
        Whether it is where a search of the likelihood's maximum ended, without a-priori estimates, whose part of the
        cost others lack. An estimate by any other method is none.
    seen_on_others : mapping of str to tuple of ActiveEffect
        Step changes that the coefficients show on logs beside the effects, by name of each log where they were looked
        for.
    placed : dict
        Effects as they act on logs that were not fitted, stored at first use: by name, start and samples.
    on_others : dict
        The structure re-estimated on such logs, None where no estimate exists, likewise.
    residuals : dict
        Whitened residuals (N, m) of the stretches of some manoeuvres, each with the index of its manoeuvre, likewise.
    errors_on : dict
        Errors of the open-loop prediction of logs, root-mean-square of each channel, likewise.
    reduced : dict
        Re-estimates without some parts, stored at first use: by the terms and effects that are left.
    """

    model: AerodynamicModel
    free: tuple[Entry, ...]
    states: tuple[NDArray[np.float64], ...]
    effects: tuple[ActiveEffect, ...]
    variance: NDArray[np.float64]
    cost: float
    information: NDArray[np.float64]
    converged: bool
    held_to_data: float = 0.0
    is_maximum: bool = False
    seen_on_others: Mapping[str, tuple[ActiveEffect, ...]] = field(default_factory=dict, repr=False, compare=False)
    placed: dict[tuple[str, float, int], tuple[ActiveEffect, ...]] = field(
        init=False, default_factory=dict, repr=False, compare=False
    )
    on_others: dict[tuple[str, float, int], Refinement | None] = field(
        init=False, default_factory=dict, repr=False, compare=False
    )
    residuals: dict[tuple[tuple[str, float, int], ...], tuple[tuple[int, NDArray[np.float64]], ...]] = field(
        init=False, default_factory=dict, repr=False, compare=False
    )
    errors_on: dict[tuple[str, float, int], dict[str, float | None]] = field(
        init=False, default_factory=dict, repr=False, compare=False
    )
    reduced: dict[tuple[tuple[Entry, ...], tuple[ActiveEffect, ...]], Refinement] = field(
        init=False, default_factory=dict, repr=False, compare=False
    )

    @property
    def covariance(self) -> NDArray[np.float64]:
        """Cramer-Rao bound for white residuals, of all parameters (M, M)."""
        return scaled_inverse(self.information)

    def with_terms(self, entries: Sequence[Entry]) -> Refinement:
        """The structure with further terms, not estimated yet; the other parameters unchanged."""
        return replace(self, model=self.model.extended(entries), free=(*self.free, *entries))

    @property
    def is_disturbed(self) -> bool:
        """Whether gusts or unmodelled forces act."""
        return any(isinstance(active.effect, NoiseEffect) for active in self.effects)


def refine(
    model: AerodynamicModel,
    manoeuvres: Sequence[Manoeuvre],
    free: Sequence[Entry],
    *,
    effects: Sequence[ActiveEffect] = (),
    states: Sequence[NDArray[np.float64]] | None = None,
    variance: NDArray[np.float64] | None = None,
    priors: Sequence[tuple[Entry, float, float]] = (),
    point: Point | None = None,
    settings: RefinementSettings = USUAL,
) -> Refinement:
    """The maximum-likelihood estimate of the free entries, the effects and every manoeuvre's initial state.

    Parameters
    ----------
    model : AerodynamicModel
        Start values; entries that are not free keep theirs.
    manoeuvres : sequence of Manoeuvre
        All of them are one joint estimate.
    free : sequence of Entry
        The estimated entries; may be empty (initial states alone).
    effects : sequence of ActiveEffect
        Effects other than terms, with start values.
    states : sequence of ndarray, shape (n,), optional
        Start values of the initial states; by default from the first samples.
    variance : ndarray, shape (m,), optional
        Noise variances to start from; by default those of the logs.
    priors : sequence of (entry, value, standard deviation)
        A-priori estimates of entries.
    point : Point, optional
        The likelihood at the start, as in `Start`.

    Raises
    ------
    EstimationError
        Where the simulation leaves the model's range with all start values.

    Notes
    -----
    Levenberg-Marquardt on the likelihood with concentrated noise variances: each step is weighted by the residuals at
    its start. Maine & Iliff, NASA RP-1168, 1986; Jategaonkar, Flight Vehicle System Identification, chapters 4 and 5.
    """
    likelihood = Likelihood(model, tuple(manoeuvres), tuple(free), settings.filtering, tuple(priors))
    start = Start(model, tuple(free), tuple(effects), None if states is None else tuple(states), variance, point)
    point = first_point(likelihood, start, settings)
    point, converged = best_point(likelihood, point, settings, settings.hold_variance)
    if settings.disturbances and point.is_disturbed:
        for _ in range(settings.rounds):
            moved = estimate_noise_statistics(likelihood, point, hold_variance=settings.hold_variance)
            if moved is point:
                break
            point, converged = best_point(likelihood, moved, settings, settings.hold_variance)
    return refinement_at(likelihood, model, tuple(free), point, converged)


def refine_on(
    at: Refinement,
    manoeuvres: Sequence[Manoeuvre],
    settings: RefinementSettings = USUAL,
    effects: Sequence[ActiveEffect] | None = None,
    point: Point | None = None,
) -> Refinement:
    """Continue the estimation of a structure from an existing estimate.

    `effects`: in place of its own; `point`: its likelihood, where that is known.
    """
    return refine(
        at.model,
        manoeuvres,
        at.free,
        effects=at.effects if effects is None else effects,
        states=at.states,
        variance=at.variance,
        point=point,
        settings=settings,
    )


@dataclass(frozen=True)
class Start:
    """Start of an estimate: the free entries, and the start values of everything.

    As the parameters of `refine`. `point`: the likelihood at the start, where another estimate's linearisation gives
    it. `known`: an estimate of the same structure, without effects, to which the fit need not return.
    """

    model: AerodynamicModel
    free: tuple[Entry, ...]
    effects: tuple[ActiveEffect, ...] = ()
    states: tuple[NDArray[np.float64], ...] | None = None
    variance: NDArray[np.float64] | None = None
    point: Point | None = None
    known: Refinement | None = None


def first_point(likelihood: Likelihood, start: Start, settings: RefinementSettings) -> Point:
    """The start with its likelihood, by continuation from the data where it diverges in open loop.

    Raises
    ------
    EstimationError
        Where no continuation can be simulated either.
    """
    point = simulated_point(likelihood, start)
    if point is None:
        at = (start.model.values, _states(likelihood, start), start.effects, _variance(likelihood, start))
        point = _continuation_start(likelihood, *at, settings)
    return point


def simulated_point(likelihood: Likelihood, start: Start) -> Point | None:
    """The start with its likelihood; None where it diverges in open loop."""
    if start.point is not None:
        return start.point
    return likelihood.evaluate(
        start.model.values, _states(likelihood, start), start.effects, _variance(likelihood, start)
    )


def _states(likelihood: Likelihood, start: Start) -> tuple[NDArray[np.float64], ...]:
    """The initial states of a start; by default those measured."""
    if start.states is not None:
        return start.states
    return tuple(manoeuvre.first_state for manoeuvre in likelihood.manoeuvres)


def _variance(likelihood: Likelihood, start: Start) -> NDArray[np.float64]:
    """The noise variances of a start; by default those of the measurements."""
    return likelihood.starting_variance() if start.variance is None else np.array(start.variance)


def refinement_at(
    likelihood: Likelihood, model: AerodynamicModel, free: tuple[Entry, ...], point: Point, converged: bool
) -> Refinement:
    """The result at a point."""
    return Refinement(
        model=model.with_values(point.values),
        free=free,
        states=point.states,
        effects=point.effects,
        variance=point.variance,
        cost=point.cost,
        information=point.information,
        converged=converged,
        held_to_data=likelihood.held_to_data,
        is_maximum=not likelihood.priors,
    )


def whiten(
    refinement: Refinement,
    manoeuvres: Sequence[Manoeuvre],
    *,
    columns: Sequence[Entry] | None = None,
) -> Iterator[Whitened]:
    """The whitened residuals of an estimate and their sensitivities, stretch by stretch.

    Parameters
    ----------
    refinement : Refinement
        The estimate at which they are computed.
    manoeuvres : sequence of Manoeuvre
        Those of the estimate.
    columns : sequence of Entry, optional
        The entries whose sensitivities come first; by default the free ones. Initial states and effects follow.
    """
    free = refinement.free if columns is None else tuple(columns)
    likelihood = Likelihood(refinement.model, tuple(manoeuvres), free)
    likelihood.held_to_data = refinement.held_to_data
    return likelihood.stretches(refinement.model.values, refinement.states, refinement.effects, refinement.variance)


def _continuation_start(
    likelihood: Likelihood,
    values: NDArray[np.float64],
    states: Sequence[NDArray[np.float64]],
    effects: tuple[ActiveEffect, ...],
    variance: NDArray[np.float64],
    settings: RefinementSettings,
) -> Point:
    """Start for a diverging open-loop simulation by continuation: filter gain reduced step by step to zero.

    In the filter form an artificially large input noise gives a gain that holds the recursion to the measurements even
    for an unstable aircraft; the factor is then reduced and the parameters re-estimated, and open loop is tried again
    at the end.
    """
    point = None
    settings = replace(settings, steps=min(settings.steps, COMPETING_FITS.leading_steps))
    for factor in (1e8, 1e6, 1e4, 1e3, 1e2, 1e1, 1.0):
        likelihood.held_to_data = factor
        point = likelihood.evaluate(values, states, effects, variance)
        if point is not None:
            point, _ = best_point(likelihood, point, settings, hold_variance=True)
            values, states = point.values, point.states
    likelihood.held_to_data = 0.0
    opened = likelihood.evaluate(values, states, effects, variance)
    if opened is not None:
        return opened
    likelihood.held_to_data = 1.0
    if point is None:
        axes = likelihood.manoeuvres[0].axes
        raise EstimationError(
            f"the simulation leaves |{axes.flow_angle}| < 1.5 rad with every start value that was tried; check the "
            f"signs of {axes.doubtful_signs}, and the trim constants in the aircraft file."
        )
    return point


def scaled_inverse(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """Inverse of a symmetric semi-definite matrix after scaling to unit diagonal; rows without information give inf.

    The pseudo-inverse's cut-off at 1e-13 removes directions without information.
    """
    scale = np.sqrt(np.diag(matrix))
    shown = scale > 0.0
    inverse = np.zeros_like(matrix)
    scaled = matrix[np.ix_(shown, shown)] / np.outer(scale[shown], scale[shown])
    part = np.linalg.pinv(scaled, rcond=1e-13, hermitian=True) / np.outer(scale[shown], scale[shown])
    inverse[np.ix_(shown, shown)] = part
    inverse[~shown, ~shown] = np.inf
    return inverse
