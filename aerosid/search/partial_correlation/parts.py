"""Parts of a structure found by d(t): standard errors, joint Wald statistics, plausibility limits."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy import special

from aerosid.effects.hypothesis import Hypothesis
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.flight_model.aerodynamics import AerodynamicModel, Entry
from aerosid.model_error.flight_sweeps.swept_model import Sweep, SweptModel
from aerosid.search.findings import Part

Array = NDArray[np.float64]


def parts_of(current: Sweep, declared: SweptModel, distance: float) -> list[Part]:
    """The parts of a structure beyond the declared one, with corrected standard deviations.

    Parameters
    ----------
    current : Sweep
        The structure's estimate.
    declared : SweptModel
        The declared structure.
    distance : float
        Distance flown through the air, m: a gust's size is estimated from as many scale lengths.
    """
    deviation = np.sqrt(np.diag(current.fit.covariance))
    swept = current.swept
    found = []
    if swept.statistics.gust is not None:
        *sizes, length = swept.statistics.gust.values
        # The number of scale lengths flown through is the number of independent samples of its size.
        errors = tuple(float(size / np.sqrt(2.0 * max(distance / length, 1.0))) for size in sizes)
        found.append(Part(None, swept.statistics.gust, sizes[0], 0.0, errors[0], (*errors, np.nan)))
    found += [
        Part(entry, None, swept.model.value(entry), 0.0, float(deviation[n]))
        for n, entry in enumerate(swept.free)
        if entry not in declared.free
    ]
    place = len(swept.free)
    for active in swept.effects:
        if active.slopes and active not in declared.effects:
            errors = tuple(float(value) for value in deviation[place : place + active.slopes])
            null = active.effect.parameters[0].null
            found.append(Part(None, active, active.values[0], null, errors[0], errors))
        place += active.slopes
    return found


def wald_p_value(sweep: Sweep, parts: Sequence[Part], tested: int, samples: int) -> float:
    """p-value of some parts by their joint Wald statistic in coloured noise, times the number of tests (Bonferroni).

    `tested`: number of candidates; `samples`: number of instants at which a step change may occur.
    """
    if any(part.is_disturbance for part in parts):
        return 0.0  # a disturbance's size is tested by the likelihood ratio of its trial alone
    places = [_place(sweep, part) for part in parts]
    offsets = np.array([part.value - part.null for part in parts])
    covariance = sweep.fit.covariance[np.ix_(places, places)]
    if not np.isfinite(covariance).all():
        return 1.0
    # The instant of a step change was chosen among all samples.
    tested_count = tested if all(part.time is None for part in parts) else max(tested, samples)
    statistic = float(offsets @ np.linalg.pinv(covariance, hermitian=True) @ offsets)
    if len(parts) == 1:
        return float(min(1.0, 2.0 * special.stdtr(sweep.fit.freedom, -np.sqrt(statistic)) * tested_count))
    return float(min(1.0, special.fdtrc(len(parts), sweep.fit.freedom, statistic / len(parts)) * tested_count))


def _place(sweep: Sweep, part: Part) -> int:
    swept = sweep.swept
    if part.entry is not None:
        return swept.free.index(part.entry)
    place = len(swept.free)
    for active in swept.effects:
        if active is part.active:
            break
        place += active.slopes
    return place


def apparent_mass(model: AerodynamicModel, first: Manoeuvre) -> float:
    """Force proportional to alphadot, as a fraction of the aircraft's mass: at one the motion has no solution.

    `first`: a flight, for the density of the air and the mass.
    """
    return sum(
        _apparent_mass(entry, value, model, first) for entry, value in zip(model.entries, model.values, strict=True)
    )


def has_plausible_apparent_mass(
    hypothesis: Hypothesis, step: Sequence[float], current: Sweep, first: Manoeuvre, most: float
) -> bool:
    """Whether a candidate's terms, with their first-order estimates, leave the apparent mass below `most`."""
    model = current.swept.model
    further = sum(
        _apparent_mass(entry, value, model, first) for entry, value in zip(hypothesis.entries, step, strict=False)
    )
    return further == 0.0 or apparent_mass(model, first) + further < most


def _apparent_mass(entry: Entry, value: float, model: AerodynamicModel, first: Manoeuvre) -> float:
    coefficient, term = entry
    if coefficient not in ("C_Z", "C_L") or term.variables != {"alpha_dot_hat"}:
        return 0.0
    inputs = dict(zip(first.columns, first.flight.inputs.T, strict=True))
    density, mass = float(np.median(inputs["rho"])), float(np.median(inputs["mass"]))
    constants = model.constants
    return float(abs(value) * 0.25 * density * constants.wing_area * constants.mean_chord / mass)


def is_at_a_limit(parts: Sequence[Part]) -> bool:
    """Whether a parameter of an effect is at its limit, where the effect is no longer meaningful."""
    return any(
        value in (parameter.lowest, parameter.highest)
        for part in parts
        if part.active is not None
        for value, parameter in zip(part.active.values, part.active.effect.parameters, strict=True)
    )


def plain_t_ratios(target: Array, columns: Array) -> Array:
    """t-ratios of plain correlations about the means."""
    y, x = target - target.mean(), columns - columns.mean(axis=0)
    size = np.linalg.norm(y) * np.linalg.norm(x, axis=0)
    rho = np.divide(x.T @ y, size, out=np.zeros_like(size), where=size > 0.0)
    return np.asarray(rho * np.sqrt((y.size - 2) / np.maximum(1.0 - rho**2, 1e-12)))
