"""Turbulence detection: vane residual over the inertial path, and the response of lift or side force to it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from aerosid.equation_error.equations.gust_response import derivative_by_flow_angle
from aerosid.equation_error.equations.points import Unknown
from aerosid.equation_error.regression.estimate import Estimate
from aerosid.equation_error.regression.standard_errors import corrected_covariance
from aerosid.signals.autoregression import correlation_time, independent_squares

Array = NDArray[np.float64]


class GustSensors(NamedTuple):
    """A vane and the force that responds to its gusts; `kind`: of the effect, as in result.json."""

    kind: str
    vane: str
    force: str


GUST_SENSORS = (
    GustSensors("gust", "alpha", "C_Z"),
    GustSensors("side_gust", "beta", "C_Y"),
)


@dataclass(frozen=True)
class Turbulence:
    """Gusts along one axis: standard deviation m/s and its standard error, scale m, force response over the expected.

    `kind`: of the effect, as in result.json.
    """

    kind: str
    sigma: float
    sigma_error: float
    length: float
    response: float
    response_error: float

    def has_known_size(self, deviations: float) -> bool:
        """Whether sigma is so many standard errors from zero; a record with few independent gusts does not tell it."""
        return self.sigma >= deviations * self.sigma_error


def turbulence_of(kinematic: Estimate, found: Estimate) -> tuple[Turbulence, ...]:
    """The turbulence along each axis on which a vane's kinematic equation and its force agree.

    `kinematic`: the estimate of the kinematic equations, `found` that of the coefficients. The residual of the flow
    angle over the inertial path contains gusts and vane noise; the force responds to the gusts by its derivative.
    """
    gusts = (_along_axis(sensors, kinematic, found) for sensors in GUST_SENSORS)
    return tuple(each for each in gusts if each is not None)


def may_be_turbulent(found: Estimate) -> bool:
    """Whether a force responds to what its vane shows over the inertial path, so that the air is not shown to be calm.

    Less than `turbulence_of` asks for: on a recorder of coarse resolution the vane's noise hides gusts of .3 m/s, and
    the response of the force to what it shows is a tenth to a third of the derivative.

    Parameters
    ----------
    found : Estimate
        Of the coefficient equations.
    """
    responses = (force_response(sensors.force, found) for sensors in GUST_SENSORS)
    settings = found.problem.settings
    return any(
        each is not None and each[0] > max(settings.gust_possible * each[1], settings.gust_hidden) for each in responses
    )


def gust_fraction(kinematic: Estimate, vane: str) -> float:
    """RMS of a vane's residual over the inertial path of the identification records, over its total RMS, 1.

    In the band; infinite where no path of the vane was compared.
    """
    left, whole = 0.0, 0.0
    for s, (n, channel) in enumerate(kinematic.design.segments):
        recording = kinematic.problem.recordings[n]
        if channel == vane and recording.fitted:
            gusts = recording.band(recording.channels[vane])
            left += float(np.mean(kinematic.solution.residuals[kinematic.design.rows(s)] ** 2))
            whole += float(np.var(gusts))
    return float(np.sqrt(left / whole)) if whole > 0.0 else float("inf")


def _along_axis(sensors: GustSensors, kinematic: Estimate, found: Estimate) -> Turbulence | None:
    """The turbulence along one axis; None where vane and force do not agree."""
    design, settings = found.design, found.problem.settings
    responding = force_response(sensors.force, found)
    if responding is None or not is_gust(responding, settings.gust_certain, settings.gust_answer):
        return None
    response, error = responding
    winds: list[Array] = []
    memories: list[float] = []
    independent = 0.0
    for n, recording in enumerate(found.problem.recordings):
        if (n, sensors.vane) not in kinematic.design.segments or (n, sensors.force) not in design.segments:
            continue
        segment = kinematic.design.segments.index((n, sensors.vane))
        gusts = kinematic.solution.residuals[kinematic.design.rows(segment)]
        speed = float(np.mean(recording.as_measured("V")))
        step = recording.interval * recording.band.step
        winds.append(gusts * speed)
        memories.append(correlation_time(gusts, step) * speed)
        independent += independent_squares(gusts, step)
    sigma = float(np.std(np.concatenate(winds)) * np.sqrt(min(response, 1.0)))
    error_of_sigma = sigma / float(np.sqrt(2.0 * max(independent, 2.0)))
    return Turbulence(sensors.kind, sigma, error_of_sigma, float(np.median(memories)), response, error)


def is_gust(response: tuple[float, float], least: float, margin: float) -> bool:
    """Whether a response over its derivative, with its standard error, is one to gusts and not to noise.

    Vane noise reduces the estimated response unless it is small compared with the gusts.

    Parameters
    ----------
    least, margin : float
        Least t-ratio, and standard deviations from a half to one within which the response must lie, 1.
    """
    value, error = response
    return value >= least * error and 0.5 - margin * error < value < 1.0 + margin * error


def force_response(force: str, found: Estimate) -> tuple[float, float] | None:
    """Response of a force to its vane's gusts over its derivative, 1, and its standard error; None without a vane."""
    return response_of(("gust", force), derivative_by_flow_angle(force, found.point.model), found)


def response_of(unknown: Unknown, derivative: float, found: Estimate) -> tuple[float, float] | None:
    """An unknown's estimate over a derivative, 1, and its standard error; None without either."""
    design = found.design
    if derivative == 0.0 or unknown not in design.unknowns:
        return None
    index = design.unknowns.index(unknown)
    error = float(np.sqrt(corrected_covariance(design, found.solution)[index, index])) / abs(derivative)
    return float(found.solution.values[index]) / derivative, error
