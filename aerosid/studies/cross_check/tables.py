"""Polynomial approximation of JSBSim's aerodynamic tables: where it agrees with them, and where it cannot."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from aerosid.aircraft import Aircraft
from aerosid.studies.cross_check.polynomial import coefficients_at
from aerosid.studies.jsbsim.flight import coefficients_in
from aerosid.studies.jsbsim.plan import FlightPlan

_DEGREES = np.arange(-8.0, 20.1, 2.0)


@dataclass(frozen=True)
class TablePoint:
    """Coefficients at one angle of attack: JSBSim's, the declared and the completed polynomial's.

    Attributes
    ----------
    alpha : float
        rad.
    inside : bool
        Whether the identification flight covered it.
    table, declared, completed : mapping of str to float
        By coefficient; alphadot self-consistent, elevator and airspeed of the trim, zero pitch rate.
    """

    alpha: float
    inside: bool
    table: Mapping[str, float]
    declared: Mapping[str, float]
    completed: Mapping[str, float]


def follow_tables(
    plan: FlightPlan, truth: Mapping[str, Any], declared: Aircraft, completed: Aircraft
) -> tuple[TablePoint, ...]:
    """Coefficients of a plan's aircraft and of its polynomials over alpha.

    Parameters
    ----------
    plan : FlightPlan
        Of the identification flight.
    truth : mapping
        Of that flight.
    declared, completed : Aircraft
    """
    low, high = truth["flown"]["alpha"]
    trim = truth["trim"]
    alphas = np.unique(np.concatenate([np.deg2rad(_DEGREES), [low, trim["alpha"], high]]))
    table, rates = coefficients_in(plan, trim, alphas)
    rate_scale = declared.mean_chord / (2.0 * trim["airspeed"])
    points = []
    for alpha, found, rate in zip(alphas, table, rates, strict=True):
        at = {"alpha": float(alpha), "delta_e": trim["delta_e"], "alpha_dot_hat": float(rate) * rate_scale}
        points.append(
            TablePoint(
                float(alpha),
                bool(low - 1e-12 <= alpha <= high + 1e-12),
                dict(zip(("C_X", "C_Z", "C_m"), map(float, found), strict=True)),
                coefficients_at(declared, at),
                coefficients_at(completed, at),
            )
        )
    return tuple(points)
