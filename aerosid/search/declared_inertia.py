"""Product of inertia by which the estimated derivatives of roll and yaw agree with the declared ones.

Roll and yaw accelerations are a = J^-1 q_bar S b (C_l, C_n), J = [[I_xx, -I_xz], [-I_xz, I_zz]]. Where the derivatives
of both moments are free, another I_xz has the same accelerations with other derivatives,

    C_l' = C_l - dI_xz a_n,  C_n' = C_n - dI_xz a_l,  (a_l, a_n) = J^-1 (C_l, C_n) for each variable,

so that only the products I_xz p q and I_xz q r of fast rolls show it. Its mark is that several declared derivatives are
missed at once, in the ratio of those accelerations; the declared values decide, by generalised least squares.
Source: Etkin & Reid, Dynamics of Flight, 3rd ed., section 4.3.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import ndtr

from aerosid.aircraft import Aircraft
from aerosid.effects.limits import OFFERED
from aerosid.flight_model.aerodynamics import Entry
from aerosid.notation import listed, number, with_deviation
from aerosid.search.attribution import Attribution
from aerosid.search.findings import Finding, labels
from aerosid.search.settings import DeclaredInertiaSettings

LABEL = ("inertia", "I_xz", "")
"""Kind, place and term of the effect."""

Estimates = Mapping[Entry, tuple[float, float]]
"""Values of entries with their standard errors."""


@dataclass(frozen=True)
class InertiaChange:
    """A change of I_xz that brings estimated derivatives to their declared values.

    Attributes
    ----------
    change, std_error : float
        kg m^2, beyond the declared I_xz.
    declared : float
        I_xz as declared, kg m^2.
    explained : tuple of Entry
        Derivatives far from the declared values as estimated, and near them with this change.
    gain : float
        Fall of the sum of squared distances from the declared values, in their standard deviations.
    """

    change: float
    std_error: float
    declared: float
    explained: tuple[Entry, ...]
    gain: float


def inertia_change(estimates: Estimates, aircraft: Aircraft, settings: DeclaredInertiaSettings) -> InertiaChange | None:
    """The change of I_xz that explains how estimates differ from declared values; None where none does.

    Parameters
    ----------
    estimates : mapping of Entry to (float, float)
        Estimated derivatives, with the declared inertias.
    aircraft : Aircraft
        The declared one.
    """
    i_xx, i_zz = aircraft.I_xx, aircraft.I_zz
    if i_xx is None or i_zz is None:
        return None
    i_xz = aircraft.I_xz or 0.0
    tensor = np.array([[i_xx, -i_xz], [-i_xz, i_zz]])
    entries, distances, variances, shifts = [], [], [], []
    for derivative in aircraft.derivatives:
        entry = derivative.coefficient, derivative.term
        if derivative.coefficient not in ("C_l", "C_n") or not derivative.term.factors or entry not in estimates:
            continue
        value, error = estimates[entry]
        both = [estimates.get((name, derivative.term), (0.0, 0.0))[0] for name in ("C_l", "C_n")]
        roll, yaw = np.linalg.solve(tensor, both)
        sigma = settings.usual * abs(derivative.value) if derivative.sigma is None else derivative.sigma
        entries.append(entry)
        distances.append(derivative.value - value)
        variances.append(max(sigma**2 + error**2, np.finfo(float).tiny))
        shifts.append(-yaw if derivative.coefficient == "C_l" else -roll)
    away, variance, shift = np.array(distances), np.array(variances), np.array(shifts)
    curvature = float(np.sum(shift**2 / variance)) if entries else 0.0
    if curvature == 0.0:
        return None
    change = float(np.sum(shift * away / variance)) / curvature
    before, after = away**2 / variance, (away - change * shift) ** 2 / variance
    critical = settings.deviations**2
    explained = tuple(e for e, far, near in zip(entries, before, after, strict=True) if near < critical < far)
    spoilt = np.any((before < critical) & (after > critical))
    variables = {term for _, term in explained}
    std_error = curvature**-0.5
    if (
        len(variables) < settings.fewest
        or spoilt
        or float(after.sum()) > settings.left * float(before.sum())
        or abs(change) < settings.deviations * std_error
        or abs(change) > OFFERED.largest_inertia * min(i_xx, i_zz)
    ):
        return None
    return InertiaChange(change, std_error, i_xz, explained, float(before.sum() - after.sum()))


def with_declared_inertia(found: Attribution, aircraft: Aircraft, settings: DeclaredInertiaSettings) -> Attribution:
    """The attribution with I_xz as an alternative to the derivatives as estimated, where it explains them."""
    if LABEL in labels((*found.findings, *found.alternatives)):
        return found
    completed, errors = found.completed, found.completed_deviations.corrected
    estimates = {e: (completed.model.value(e), float(error)) for e, error in zip(completed.free, errors, strict=True)}
    change = inertia_change(estimates, aircraft, settings)
    if change is None:
        return found
    kind, where, term = LABEL
    alternative = Finding(
        kind=kind,
        where=where,
        term=term,
        entry=None,
        value=change.change,
        std_error=change.std_error,
        unit="kg m^2",
        time=None,
        p_value=float(2.0 * ndtr(-abs(change.change) / change.std_error)),
        gain=0.0,  # of the flights alone, which have the same likelihood with it
    )
    return replace(found, alternatives=(*found.alternatives, alternative))


def sentence_on_inertia(change: InertiaChange) -> str:
    """What differs, by how much I_xz would have to, and why the flights do not decide."""
    names = listed([f"{coefficient} {term}" for coefficient, term in change.explained])
    return (
        f"{names} differ from their declared values as they would with an I_xz of "
        f"{number(change.declared + change.change)} in place of {number(change.declared)} kg m^2 (a change of "
        f"{with_deviation(change.change, change.std_error)}), and agree with them then: check I_xz before assuming an "
        "aerodynamic cause. The flights cannot distinguish the two, since with another I_xz other derivatives of C_l "
        "and C_n have the same response."
    )
