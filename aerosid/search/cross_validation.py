"""Refutation by validation flights: findings that predict them worse are struck out."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from aerosid.errors import EstimationError
from aerosid.estimation.fit_settings import RefinementSettings
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.estimation.maximum_likelihood import Refinement, refine
from aerosid.estimation.open_loop import on_log, respond
from aerosid.estimation.residual_tests import unexplained_channels
from aerosid.search.findings import Part
from aerosid.search.structure_search import StructureSearch

VALIDATION_FIT = RefinementSettings(steps=20, step_tolerance=0.03, cost_tolerance=0.5, disturbances=False)
"""A few units of -2 ln L do not decide whether a residual is noise."""


def eliminate_by_cross_validation(
    completed: Refinement, search: StructureSearch, validation: Sequence[Manoeuvre]
) -> tuple[Refinement, tuple[Part, ...]]:
    """The estimate without the parts that make the prediction of other flights worse, and those parts.

    Parameters
    ----------
    completed : Refinement
        What was found on the flights that were fitted.
    validation : sequence of Manoeuvre
        Flights that were not; none: nothing is struck out.

    Notes
    -----
    Of all parts the one whose loss predicts the other flights best is struck out, the rest re-estimated on the flights
    that were fitted, and so on until none is left. The way is gone as far as the prediction becomes better for certain.
    """
    if not validation:
        return completed, ()
    limits = search.settings.refutation
    share = limits.share_in_gusts if completed.is_disturbed else limits.share
    error = prediction_error(completed, validation)
    accepted = current = completed
    refuted: tuple[Part, ...] = ()
    eliminated: tuple[Part, ...] = ()
    while parts := search.parts(current, None):
        trials = [(search.re_estimated_without(current, [part]), part) for part in parts]
        errors = [prediction_error(trial, validation) for trial, _ in trials]
        least = int(np.argmin(errors))
        current, eliminated = trials[least][0], (*eliminated, trials[least][1])
        if error > errors[least] + limits.certain + share * errors[least]:
            error, accepted, refuted = errors[least], current, eliminated
    return accepted, refuted


def prediction_error(at: Refinement, manoeuvres: Sequence[Manoeuvre]) -> float:
    """Squared errors of the open-loop predictions in units of the noise; infinite where one runs away."""
    total = 0.0
    for manoeuvre in manoeuvres:
        rms = respond(at.model, manoeuvre, at.variance, effects=on_log(at, manoeuvre)).rms
        for name, value in rms.items():
            i = manoeuvre.row(name)
            if manoeuvre.noise[i] == 0.0:
                continue  # a reading that hangs between steps: its noise is not known
            if value is None:
                return float("inf")
            count = int(np.isfinite(manoeuvre.flight.measured[:, i]).sum())
            total += count * (value / max(float(manoeuvre.noise[i]), 1e-12)) ** 2
    return total


def is_inadequate_on(completed: Refinement, manoeuvre: Manoeuvre) -> bool:
    """Whether a structure cannot follow another flight even with numbers of that flight's own."""
    try:
        own = refine(
            completed.model,
            [manoeuvre],
            completed.free,
            effects=on_log(completed, manoeuvre),
            variance=completed.variance,
            settings=VALIDATION_FIT,
        )
    except EstimationError:
        return True
    return bool(unexplained_channels(own, [manoeuvre]))
