"""Coefficients of an aircraft file's polynomial at a point, without a flight."""

from __future__ import annotations

import math
from collections.abc import Mapping

from aerosid.aircraft import Aircraft
from aerosid.flight_model.terms import LIFT, Factor, Term


def coefficients_at(aircraft: Aircraft, point: Mapping[str, float]) -> dict[str, float]:
    """C_X, C_Z and C_m where the variables of terms have the values of `point`; those not named are zero."""
    total = dict.fromkeys(("C_X", "C_Z", "C_m", "C_L", "C_D"), 0.0)
    for entry in sorted(aircraft.derivatives, key=lambda entry: entry.coefficient not in LIFT):
        known = {**point, **{name: total[name] for name in LIFT}}
        total[entry.coefficient] += entry.value * term_at(entry.term, known)
    alpha = point.get("alpha", 0.0)
    lift, drag = total["C_L"], total["C_D"]
    return {
        "C_X": total["C_X"] + lift * math.sin(alpha) - drag * math.cos(alpha),
        "C_Z": total["C_Z"] - lift * math.cos(alpha) - drag * math.sin(alpha),
        "C_m": total["C_m"],
    }


def term_at(term: Term, point: Mapping[str, float]) -> float:
    """The value of a term."""
    return math.prod(_factor(factor, point.get(factor.variable, 0.0)) for factor in term.factors)


def _factor(factor: Factor, x: float) -> float:
    shaped = {"plain": x, "abs": abs(x), "pos": max(x - factor.offset, 0.0)}[factor.shape]
    return float(shaped**factor.power)
