"""A first d(t) of each flight: continuous IEBMEE (21)-(23), forward, on prefiltered channels."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from aerosid.errors import EstimationError
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.flight_model.aerodynamics import AerodynamicModel
from aerosid.flight_model.axes import Axes, coupled_of
from aerosid.model_error.aircraft_error.forward_estimate import estimate_aircraft_error
from aerosid.model_error.paper_chain.chain import ChainSettings, choose_error_density, feed
from aerosid.signals import prefilter
from aerosid.signals.prefilter import Butterworth

Array = NDArray[np.float64]

_VANES = ("alpha", "beta", "p")
"""The channel whose band d(t) is low-passed to: the first of these that is compared and recorded."""


def forward_forces(
    model: AerodynamicModel,
    manoeuvres: Sequence[Manoeuvre],
    coefficients: Sequence[str],
    settings: ChainSettings | None = None,
) -> tuple[Array, ...]:
    """d(t) of each flight, (N, coefficients), in units of the coefficients; zeros where the recursion breaks down.

    Parameters
    ----------
    model : AerodynamicModel
        The declared one.
    manoeuvres : sequence of Manoeuvre
    coefficients : sequence of str
        The aircraft's: those of its axes, C_D and C_L in place of C_X and C_Z where it has those.
    settings : ChainSettings, optional
        Of prefilter and weights.

    Notes
    -----
    Parameswaran & Raol 1994, eqs. (21)-(23). The estimate follows the noise far above the frequencies at which forces
    act; it is low-passed to the band in which the angle of the flow moves. It begins the fixed-interval sweeps, which
    do not depend on it where they converge.
    """
    settings = settings or ChainSettings()
    still = tuple(np.zeros((manoeuvre.flight.time.size, len(coefficients))) for manoeuvre in manoeuvres)
    try:
        density = choose_error_density(model, manoeuvres, settings, coarse=True)
        fed = [feed(manoeuvre, settings) for manoeuvre in manoeuvres]
        histories = [estimate_aircraft_error(model, part.flight, part.variance, density, respond=False) for part in fed]
    except EstimationError:
        return still
    found = []
    for part, history in zip(fed, histories, strict=True):
        errors = history.d[:, : history.rate_per_unit.shape[1]] / history.rate_per_unit
        time = part.flight.time
        known = np.isfinite(errors).all(axis=1)
        errors = np.column_stack([np.interp(time, time[known], column[known]) for column in errors.T])
        bands = part.cut_off.per_channel if part.cut_off is not None else {}
        band = next((bands[name] for name in _VANES if name in bands), None)
        if band is not None and band < 0.4 / float(np.median(np.diff(time))):
            errors = np.column_stack([prefilter.apply(Butterworth(2, band), time, column) for column in errors.T])
        found.append(_in_coefficients(errors, history.states, model.axes, coefficients))
    return tuple(found)


def _in_coefficients(errors: Array, states: Array, axes: Axes, coefficients: Sequence[str]) -> Array:
    """Body-axis coefficients (N, C) as the aircraft's: lift and drag where it has those."""
    values = dict(zip(axes.coefficients, errors.T, strict=True))
    if axes.wind_axes:
        u, w = (states[:, coupled_of(axes).index(name)] for name in ("u", "w"))
        alpha, x, z = np.arctan2(w, u), values["C_X"], values["C_Z"]
        values["C_L"] = x * np.sin(alpha) - z * np.cos(alpha)
        values["C_D"] = -x * np.cos(alpha) - z * np.sin(alpha)
    return np.column_stack([values[name] for name in coefficients])
