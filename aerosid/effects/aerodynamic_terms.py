"""The library of aerodynamic terms: powers, products, splines, Mach number, rates.

Powers of alpha and their products with the slower variables are the polynomial library of stepwise regression (Klein &
Morelli, Aircraft System Identification, section 5.4). Splines pos(alpha - c)^n are that book's section 5.4.3: their
knots c divide the flown range of alpha. Mach number and alphadot are nearly collinear with V_hat, and with q_hat and
alpha, and are named where a flight distinguishes them.

Side force, rolling and yawing moment change sign with the mirror image of the motion: their library contains the odd
terms of sideslip, rates, aileron and rudder, their products with variables of the symmetric motion, and even terms,
which no symmetric aircraft has and many show (propellers, bent surfaces). Where a case integrates both motions the
symmetric coefficients have the even terms of the lateral motion too, and the linear ones of an asymmetric aircraft.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from aerosid.effects.limits import OFFERED
from aerosid.flight_model.axes import LATERAL, Axes
from aerosid.flight_model.terms import Term, parse_term
from aerosid.logs.flight_log import FlightLog, range_of
from aerosid.nomenclature import is_surface

POLYNOMIALS = (
    "1",
    "alpha",
    "q_hat",
    "delta_e",
    "V_hat",
    "alpha^2",
    "alpha^3",
    "alpha^4",
    "delta_e^2",
    "delta_e^3",
    "V_hat^2",
    "q_hat^2",
    "alpha*q_hat",
    "alpha*delta_e",
    "alpha*V_hat",
    "q_hat*delta_e",
    "q_hat*V_hat",
    "delta_e*V_hat",
    "alpha^2*q_hat",
    "alpha^2*delta_e",
)
"""Powers of alpha to the fourth, lower ones of the slower variables, and their cross terms."""

ANTISYMMETRIC = (
    "1",
    "beta",
    "p_hat",
    "r_hat",
    "delta_a",
    "delta_r",
    "alpha",
    "q_hat",
    "delta_e",
    "V_hat",
    "beta^3",
    "beta*abs(beta)",
    "beta^2",
    "abs(beta)",
    "p_hat*abs(p_hat)",
    "r_hat*abs(r_hat)",
    "delta_a^3",
    "delta_a*abs(delta_a)",
    "delta_a^2",
    "abs(delta_a)",
    "delta_r^3",
    "delta_r*abs(delta_r)",
    "delta_r^2",
    "abs(delta_r)",
    "alpha*beta",
    "alpha*p_hat",
    "alpha*r_hat",
    "alpha*delta_a",
    "alpha*delta_r",
    "alpha^2*beta",
    "V_hat*beta",
    "q_hat*beta",
    "beta*p_hat",
    "beta*r_hat",
    "beta^2*p_hat",
    "beta^2*r_hat",
    "beta^2*delta_a",
    "beta^2*delta_r",
)
"""Terms of side force, rolling and yawing moment: linear, nonlinear, and products with symmetric variables."""

COUPLED = (
    "beta^2",
    "abs(beta)",
    "beta",
    "p_hat",
    "r_hat",
    "delta_a",
    "delta_r",
    "delta_a^2",
    "delta_r^2",
    "beta*p_hat",
    "beta*r_hat",
    "alpha*beta^2",
)
"""Terms of the lateral motion in the symmetric coefficients, where both motions are integrated."""

POWERED = ("C_T*beta", "C_T*delta_r", "C_T*r_hat")
"""Slipstream over fin and rudder, where recorded thrust varies."""

ATTITUDE = ("theta", "phi")
"""Of the pitching moment: fuel that moves, and slow responses of a trimmed controller or a vane."""

UNSTEADY = ("alpha_dot_hat",)
"""Delayed downwash at the tail, and apparent mass."""

COMPRESSIBLE = ("mach", "alpha*mach")
"""Where Mach number is recorded."""

COMPRESSIBLE_SIDE = ("beta*mach",)
"""The same of side force, rolling and yawing moment."""


def is_symmetric(coefficient: str) -> bool:
    """Whether a coefficient is unchanged in the mirror image of the motion."""
    return coefficient not in LATERAL.coefficients


def polynomials(logs: Sequence[FlightLog], coefficient: str, axes: Axes) -> Iterator[Term]:
    """The terms of the polynomial library whose channels are logged."""
    texts: tuple[str, ...] = POLYNOMIALS if is_symmetric(coefficient) else ANTISYMMETRIC
    if is_symmetric(coefficient) and set(LATERAL.coefficients) <= set(axes.coefficients):
        texts += COUPLED
    for term in map(parse_term, texts):
        if all(name in log for log in logs for name in term.variables if is_surface(name)):
            yield term


def unsteady(_logs: Sequence[FlightLog], coefficient: str, _axes: Axes) -> Iterator[Term]:
    """Terms in alphadot; none in drag and in lateral coefficients."""
    if is_symmetric(coefficient) and coefficient not in ("C_X", "C_D"):
        yield from map(parse_term, UNSTEADY)


def compressible(logs: Sequence[FlightLog], coefficient: str, _axes: Axes) -> Iterator[Term]:
    """Terms in Mach number where it varies."""
    if all("mach" in log for log in logs) and any(range_of(log["mach"]) > OFFERED.least_mach for log in logs):
        yield from map(parse_term, COMPRESSIBLE if is_symmetric(coefficient) else COMPRESSIBLE_SIDE)


def attitude(logs: Sequence[FlightLog], coefficient: str, _axes: Axes) -> Iterator[Term]:
    """Terms of the pitching moment in pitch and bank, where these are recorded and vary."""
    if coefficient != "C_m":
        return
    for term in map(parse_term, ATTITUDE):
        recorded = [log[name] for name in term.variables for log in logs if name in log]
        if len(recorded) == len(logs) and any(range_of(values) > OFFERED.least_attitude for values in recorded):
            yield term


def splines(logs: Sequence[FlightLog], coefficient: str, _axes: Axes) -> Iterator[Term]:
    """Splines of alpha with knots inside the flown range, of first and second order, in symmetric coefficients."""
    if not is_symmetric(coefficient):
        return
    alpha = np.concatenate([np.zeros(0), *(log["alpha"][np.isfinite(log["alpha"])] for log in logs if "alpha" in log)])
    if alpha.size == 0:
        return
    low, high = (float(value) for value in np.percentile(alpha, [1.0, 99.0]))
    if high - low < OFFERED.least_range:
        return
    for knot in dict.fromkeys(round((low + fraction * (high - low)) / OFFERED.knot_grid) for fraction in OFFERED.knots):
        sign = "-" if knot >= 0 else "+"
        start = f" {sign} {abs(knot) * OFFERED.knot_grid:.2f}" if knot else ""
        for power in ("", "^2"):
            yield parse_term(f"pos(alpha{start}){power}")


def searched_parameters(term: Term) -> int:
    """Number of parameters inside a term that were chosen from the flight: its knots."""
    return sum(factor.shape == "pos" and factor.offset != 0.0 for factor in term.factors)


def rarity(term: Term) -> float:
    """Additional gain in -2 ln L that a term needs compared with a commoner or simpler one of the same fit."""
    degree = sum(factor.power for factor in term.factors)
    return 0.1 * degree + (2.0 if "mach" in term.variables else 0.0)
