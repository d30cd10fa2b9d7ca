"""A first d(t) of each flight: continuous IEBMEE (21)-(23), forward, on prefiltered channels."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from aerosid.errors import EstimationError
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.flight_model.aerodynamics import AerodynamicModel
from aerosid.model_error.aircraft_error import estimate_aircraft_error
from aerosid.model_error.paper_chain import ChainSettings, choose_error_density, feed
from aerosid.signals import prefilter
from aerosid.signals.prefilter import Butterworth

Array = NDArray[np.float64]

_AXES = ("C_X", "C_Z", "C_m")


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
        The aircraft's three: C_X or C_D, C_Z or C_L, C_m.
    settings : ChainSettings, optional
        Of prefilter and weights.

    Notes
    -----
    Parameswaran & Raol 1994, eqs. (21)-(23). The estimate follows the noise far above the frequencies at which forces
    act; it is low-passed to the band in which alpha moves. It begins the fixed-interval sweeps, which do not depend on
    it where they converge.
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
        axes = history.d[:, : len(_AXES)] / history.rate_per_unit
        time = part.flight.time
        known = np.isfinite(axes).all(axis=1)
        axes = np.column_stack([np.interp(time, time[known], column[known]) for column in axes.T])
        band = part.cut_off.per_channel.get("alpha") if part.cut_off is not None else None
        if band is not None and band < 0.4 / float(np.median(np.diff(time))):
            axes = np.column_stack([prefilter.apply(Butterworth(2, band), time, column) for column in axes.T])
        found.append(_in_coefficients(axes, history.states, coefficients))
    return tuple(found)


def _in_coefficients(axes: Array, states: Array, coefficients: Sequence[str]) -> Array:
    """Body-axis coefficients (N, 3) as the aircraft's: lift and drag where it has those."""
    alpha = np.arctan2(states[:, 1], states[:, 0])
    x, z, m = axes.T
    values = {
        "C_X": x,
        "C_Z": z,
        "C_m": m,
        "C_L": x * np.sin(alpha) - z * np.cos(alpha),
        "C_D": -x * np.cos(alpha) - z * np.sin(alpha),
    }
    return np.column_stack([values[name] for name in coefficients])
