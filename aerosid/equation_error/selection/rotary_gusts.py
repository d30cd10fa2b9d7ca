"""Rotary gusts among the regressors of the moments, where a moment responds to them.

In calm air the rate of the vane's difference from the path is that of noise and of the path's errors. The rotary gusts
of a vane's plane are therefore regressors only where the force of the plane responds to its gusts, and its moment to
their rate: as by its derivative with respect to the angular rate, in sign and size, and by more than chance.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from aerosid.equation_error.equations.gust_response import BY_RATE, FORCE_OF
from aerosid.equation_error.equations.rotary_gust import ROTARY
from aerosid.equation_error.regression.estimate import Estimate, estimate
from aerosid.equation_error.selection.turbulence import force_response, is_gust, response_of

SHOWN_BY = ("C_m", "C_n")
"""Physical: the moment that shows the rotary gusts of each vane; rolling responds to those in yaw by a coupling."""


@dataclass(frozen=True)
class RotaryGustSettings:
    """Settings of the test for rotary gusts.

    Attributes
    ----------
    least : float
        Least t-ratio of a moment's response, 1. Chosen: of nineteen flights with and without rotary gusts the ten with
        them had 4.3 or more with the declared structure, the nine without 1.4 or less (an independent simulator,
        three aircraft in light turbulence).
    """

    least: float = 3.0


ROTARY_GUSTS = RotaryGustSettings()
"""Of every regression."""


def with_rotary_gusts(found: Estimate, vanes: tuple[str, ...] | None = None) -> Estimate:
    """The estimate with the rotary gusts of some vanes among its regressors; colours re-estimated.

    Parameters
    ----------
    found : Estimate
        Of the coefficient equations.
    vanes : tuple of str, optional
        By default those whose moments respond to them.
    """
    shown = rotary_gusts_shown(found) if vanes is None else vanes
    if shown == found.problem.rotary_gusts:
        return found
    problem = replace(found.problem, rotary_gusts=shown)
    return estimate(problem, found.point, found.solution.weights)


def rotary_gusts_shown(found: Estimate) -> tuple[str, ...]:
    """The vanes whose moments respond to their rotary gusts, whether those are among the regressors or not.

    Parameters
    ----------
    found : Estimate
        Of the coefficient equations.
    """
    certain = found.problem.settings.gust_certain
    vanes = tuple(ROTARY[name] for name in SHOWN_BY if _shows_gusts(FORCE_OF[name], found, certain))
    if not vanes:
        return ()
    tried = with_rotary_gusts(found, vanes)
    return tuple(ROTARY[name] for name in SHOWN_BY if ROTARY[name] in vanes and _shows_rotary_gusts(name, tried))


def _shows_gusts(force: str, found: Estimate, least: float) -> bool:
    """Whether a force responds to the gusts that its vane shows."""
    response = force_response(force, found)
    return response is not None and is_gust(response, least, found.problem.settings.gust_answer)


def _shows_rotary_gusts(moment: str, found: Estimate) -> bool:
    """Whether a moment responds to the rotary gusts that its vane shows."""
    entry, model = BY_RATE[moment], found.point.model
    derivative = model.value(entry) if entry in model.places else 0.0
    response = response_of(("rotary_gust", moment), derivative, found)
    return response is not None and is_gust(response, ROTARY_GUSTS.least, found.problem.settings.gust_answer)
