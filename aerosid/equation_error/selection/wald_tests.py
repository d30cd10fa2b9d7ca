"""Wald tests of a selected structure: parameters of each effect and their t-ratios from the null value."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from aerosid.effects import ActiveEffect
from aerosid.effects.hypothesis import Hypothesis
from aerosid.effects.step_input import is_step_change
from aerosid.equation_error.equations.points import Unknown
from aerosid.equation_error.regression.estimate import Estimate
from aerosid.equation_error.regression.standard_errors import corrected_covariance
from aerosid.equation_error.selection.penalties import effects_of
from aerosid.equation_error.selection.structure import SelectedEffect

Array = NDArray[np.float64]

Confirmed = Callable[[Sequence[SelectedEffect]], Sequence[SelectedEffect]]
"""Those of some effects that something else than the estimate shows."""


@dataclass(frozen=True)
class EffectEstimate:
    """One effect with its parameters estimated from the identification records.

    Attributes
    ----------
    hypothesis : Hypothesis
    active : ActiveEffect or None
        The effect with its parameter values; None for a term.
    value, std_error : float
        Of its leading parameter; the standard error corrected for coloured residuals.
    std_errors : tuple of float
        Of all its parameters.
    gain : float
        In ln L: the loss when it is deleted from the final structure, or the gain when it entered.
    source : "kinematics" or "coefficients"
        Equations that identified it.
    improves_prediction : bool or None
        Whether it improves the prediction of validation coefficients or blocks; None where not tested.
    """

    hypothesis: Hypothesis
    active: ActiveEffect | None
    value: float
    std_error: float
    std_errors: tuple[float, ...]
    gain: float
    source: str
    improves_prediction: bool | None = None

    @property
    def null(self) -> float:
        """The null value, at which the effect vanishes."""
        return null_value(self.active)

    @property
    def ratio(self) -> float:
        """Distance from the null value in standard errors; of several parameters the most significant one counts.

        Of a step change its size alone: the instant has no null value. Of flow separation the angle at which it begins:
        where that is not known, a curve that lags stands for something else. Zero for a parameter that the fitted
        records do not determine, whose variance is left at zero.
        """
        if self.active is not None and abs(self.value - self.null) < self.active.effect.parameters[0].least:
            return 0.0
        if self.active is None or len(self.active.values) == 1 or has_one_leading_parameter(self.active):
            return abs(self.value - self.null) / self.std_error if self.std_error > 0.0 else 0.0
        ratios = [
            abs(value - parameter.null) / error
            for value, parameter, error in zip(
                self.active.values, self.active.effect.parameters, self.std_errors, strict=True
            )
            if error > 0.0
        ]
        return max(ratios, default=0.0)


def has_one_leading_parameter(active: ActiveEffect) -> bool:
    """Whether the first of an effect's parameters alone says whether it exists."""
    return is_step_change(active) or active.effect.kind == "flow_separation"


def null_value(active: ActiveEffect | None) -> float:
    """The null value of an effect's leading parameter; of a term, None here, it is 0."""
    return active.effect.parameters[0].null if active is not None else 0.0


def effect_estimates(
    found: Estimate,
    covariance: Array,
    chosen: Sequence[SelectedEffect],
    gains: Mapping[tuple[str, str, str], float] = MappingProxyType({}),
    improvements: Mapping[tuple[str, str, str], bool] = MappingProxyType({}),
) -> tuple[EffectEstimate, ...]:
    """The selected effects with parameters and corrected standard errors: kinematic ones by t-ratio, others by gain.

    `gains`: gain of each in the whole structure, by label; by default that of its entry. `improvements`: whether it
    improves the prediction of validation coefficients, by label.
    """
    deviations = np.sqrt(np.diag(covariance))
    index = {unknown: n for n, unknown in enumerate(found.design.unknowns)}
    rows = []
    for each in chosen:
        source = "kinematics" if each.kinematic else "coefficients"
        hypothesis = each.hypothesis
        gain, improves = gains.get(hypothesis.label, each.gain), improvements.get(hypothesis.label)
        if hypothesis.entries:
            (entry,) = hypothesis.entries
            n = index.get(("term", entry))
            value = found.point.model.value(entry)
            error = float(deviations[n]) if n is not None else np.inf
            rows.append(EffectEstimate(hypothesis, None, value, error, (error,), gain, source, improves))
            continue
        for active in effects_of(found.point, hypothesis)[:1]:
            i = next(i for i, other in enumerate(found.point.effects) if other is active)
            errors = tuple(float(deviations[index["effect", i, k]]) for k in range(len(active.values)))
            rows.append(EffectEstimate(hypothesis, active, active.values[0], errors[0], errors, gain, source, improves))
    return tuple(sorted(rows, key=_rank))


def _rank(row: EffectEstimate) -> tuple[bool, float]:
    """Instrument errors in order of t-ratio: their order of entry depends on what else was missing."""
    return (False, -row.ratio) if row.source == "kinematics" else (True, -row.gain)


def least_significant(
    found: Estimate, chosen: Sequence[SelectedEffect], confirmed: Confirmed = lambda _effects: ()
) -> SelectedEffect | None:
    """The effect of smallest t-ratio, where that is below the required one; else None.

    `confirmed`: those of insignificant effects that a validation record replicates.
    """
    covariance = corrected_covariance(found.design, found.solution)
    shown = confirmed_unknowns(found, covariance, chosen, confirmed)
    if shown:
        covariance = corrected_covariance(found.design, found.solution, shown)
    return least_significant_of(effect_estimates(found, covariance, chosen), chosen, found.problem.settings.deviations)


def confirmed_unknowns(
    found: Estimate, covariance: Array, chosen: Sequence[SelectedEffect], confirmed: Confirmed
) -> list[Unknown]:
    """The parameters of those effects that are insignificant by some covariance, and confirmed."""
    insignificant = insignificant_effects(
        effect_estimates(found, covariance, chosen), chosen, found.problem.settings.deviations
    )
    return [
        found.design.unknowns[n] for each in confirmed(insignificant) for n in unknown_indices(found, each.hypothesis)
    ]


def insignificant_effects(
    rows: Sequence[EffectEstimate], chosen: Sequence[SelectedEffect], deviations: float
) -> list[SelectedEffect]:
    """The selected effects whose t-ratio is below a limit."""
    insignificant = {row.hypothesis.label for row in rows if row.ratio < deviations}
    return [each for each in chosen if each.hypothesis.label in insignificant]


def least_significant_of(
    rows: Sequence[EffectEstimate], chosen: Sequence[SelectedEffect], deviations: float
) -> SelectedEffect | None:
    """The effect of smallest t-ratio, where that is below a limit; else None."""
    labels = {each.hypothesis.label for each in insignificant_effects(rows, chosen, deviations)}
    insignificant = [row for row in rows if row.hypothesis.label in labels]
    if not insignificant:
        return None
    label = min(insignificant, key=lambda row: row.ratio).hypothesis.label
    return next(each for each in chosen if each.hypothesis.label == label)


def unknown_indices(found: Estimate, hypothesis: Hypothesis) -> list[int]:
    """Indices of a hypothesis' parameters among the unknowns."""
    own = effects_of(found.point, hypothesis)
    effects = {i for i, active in enumerate(found.point.effects) if any(active is one for one in own)}
    return [
        n
        for n, unknown in enumerate(found.design.unknowns)
        if (unknown[0] == "term" and unknown[1] in hypothesis.entries)
        or (unknown[0] == "effect" and unknown[1] in effects)
    ]


def distances_from_null(found: Estimate, hypothesis: Hypothesis) -> list[tuple[int, float]]:
    """Index among the unknowns of each of a hypothesis' estimated parameters, and its distance from the null value.

    Those held at a limit are left out.
    """
    rows = []
    for n in unknown_indices(found, hypothesis):
        if found.solution.covariance[n, n] <= 0.0:
            continue
        unknown, distance = found.design.unknowns[n], float(found.solution.values[n])
        if unknown[0] == "effect":
            active, number = found.point.effects[int(str(unknown[1]))], int(str(unknown[2]))
            distance = active.values[number] - active.effect.parameters[number].null
        rows.append((n, distance))
    return rows
