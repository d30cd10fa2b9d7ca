"""Cross-validation: backward elimination of parts that make the prediction of validation flights worse."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from aerosid.errors import EstimationError
from aerosid.estimation.fit_settings import RESIDUAL_TESTS, RefinementSettings
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.estimation.maximum_likelihood import Refinement, refine
from aerosid.estimation.open_loop import on_log, prediction_errors
from aerosid.estimation.residual_tests import unexplained_channels
from aerosid.search.findings import Part
from aerosid.search.structure_search import StructureSearch

VALIDATION_FIT = RefinementSettings(steps=20, step_tolerance=0.03, cost_tolerance=0.5, disturbances=False)
"""A few units of -2 ln L do not decide whether a residual is noise."""


def eliminate_by_cross_validation(
    completed: Refinement, search: StructureSearch, validation: Sequence[Manoeuvre]
) -> tuple[Refinement, tuple[Part, ...]]:
    """The estimate without the parts that make the prediction of validation flights worse, and those parts.

    Parameters
    ----------
    completed : Refinement
        The structure found on the fitted flights.
    validation : sequence of Manoeuvre
        Flights that were not fitted; none: nothing is removed.

    Notes
    -----
    The part whose removal gives the best prediction of the validation flights is removed and the others re-estimated on
    the fitted flights, until none remains. The last structure with a significantly better prediction is returned.

    An instrument error that kinematics of all flights show stays: an open-loop prediction also contains whatever else
    is missing, which the motion integrates, and a drift of the bank angle outweighs a channel that fits to its noise.
    """
    if not validation:
        return completed, ()
    limits = search.settings.refutation
    fraction = limits.share_in_gusts if completed.is_disturbed else limits.share
    error = prediction_error(completed, validation)
    accepted = current = completed
    refuted: tuple[Part, ...] = ()
    eliminated: tuple[Part, ...] = ()
    while parts := [part for part in search.parts(current, None) if not search.is_shown_by_kinematics(part)]:
        trials = [(search.re_estimated_without(current, [part]), part) for part in parts]
        errors = [prediction_error(trial, validation) for trial, _ in trials]
        least = int(np.argmin(errors))
        current, eliminated = trials[least][0], (*eliminated, trials[least][1])
        if error > errors[least] + limits.certain + fraction * errors[least]:
            error, accepted, refuted = errors[least], current, eliminated
    return accepted, refuted


def prediction_error(at: Refinement, manoeuvres: Sequence[Manoeuvre]) -> float:
    """Sum of squared errors of the open-loop predictions in units of the noise; infinite where one diverges."""
    total = 0.0
    for manoeuvre in manoeuvres:
        for name, value in prediction_errors(at, manoeuvre).items():
            i = manoeuvre.row(name)
            if manoeuvre.noise[i] == 0.0:
                continue  # a quantised record that holds its last sample: its noise is not known
            if value is None:
                return float("inf")
            count = int(np.isfinite(manoeuvre.flight.measured[:, i]).sum())
            total += count * (value / max(float(manoeuvre.noise[i]), 1e-12)) ** 2
    return total


def re_estimated_on(completed: Refinement, manoeuvre: Manoeuvre) -> Refinement | None:
    """The structure re-estimated on a flight that was not fitted, once; None where no estimate exists."""
    log = manoeuvre.span
    if log not in completed.on_others:
        completed.on_others[log] = _re_estimated_on(completed, manoeuvre)
    return completed.on_others[log]


def _re_estimated_on(completed: Refinement, manoeuvre: Manoeuvre) -> Refinement | None:
    try:
        return refine(
            completed.model,
            [manoeuvre],
            completed.free,
            effects=on_log(completed, manoeuvre),
            variance=completed.variance,
            settings=VALIDATION_FIT,
        )
    except EstimationError:
        return None


def is_inadequate_on(
    completed: Refinement,
    manoeuvre: Manoeuvre,
    *,
    noise_hidden: bool = False,
    memory: float = RESIDUAL_TESTS.recorder_memory,
    least_share: float = 0.0,
) -> bool:
    """Whether a structure leaves a residual above noise on a flight although re-estimated on it.

    The settings are those of `unexplained_channels`.
    """
    own = re_estimated_on(completed, manoeuvre)
    return own is None or bool(
        unexplained_channels(own, [manoeuvre], noise_hidden=noise_hidden, memory=memory, least_share=least_share)
    )
