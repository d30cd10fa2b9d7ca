"""Wald tests of a selected structure: the numbers of each effect, and their distance from the null value."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from aerosid.effects import ActiveEffect
from aerosid.effects.hypothesis import Hypothesis
from aerosid.equation_error.equations.points import Unknown
from aerosid.equation_error.regression.estimate import Estimate
from aerosid.equation_error.regression.standard_errors import corrected_covariance
from aerosid.equation_error.selection.structure import Chosen

Array = NDArray[np.float64]


@dataclass(frozen=True)
class EvidenceFinding:
    """One effect with its numbers on the fitted recordings.

    Attributes
    ----------
    hypothesis : Hypothesis
    active : ActiveEffect or None
        The effect with its numbers; None for a term.
    value, std_error : float
        Of its leading number; the deviation corrected for coloured residuals.
    std_errors : tuple of float
        Of all its numbers.
    gain : float
        In ln L: the fall when it is struck out of the final structure, or the rise when it entered.
    witness : "kinematics" or "coefficients"
        Which equations proved it.
    unseen_better : bool or None
        Whether the coefficients of unseen recordings, or blocks, are predicted better with it; None where not asked.
    """

    hypothesis: Hypothesis
    active: ActiveEffect | None
    value: float
    std_error: float
    std_errors: tuple[float, ...]
    gain: float
    witness: str
    unseen_better: bool | None = None

    @property
    def null(self) -> float:
        """The null value: that at which the effect does nothing."""
        return null_of(self.active)

    @property
    def ratio(self) -> float:
        """Distance from the null value in its own deviations; of several numbers the most certain one counts."""
        if self.active is not None and abs(self.value - self.null) < self.active.effect.parameters[0].least:
            return 0.0
        if self.active is None or len(self.active.values) == 1:
            return abs(self.value - self.null) / self.std_error if self.std_error > 0.0 else np.inf
        ratios = [
            abs(value - parameter.null) / error
            for value, parameter, error in zip(
                self.active.values, self.active.effect.parameters, self.std_errors, strict=True
            )
            if error > 0.0
        ]
        return max(ratios, default=np.inf)


def null_of(active: ActiveEffect | None) -> float:
    """The null value of an effect's leading number; of a term, None here, it is 0."""
    return active.effect.parameters[0].null if active is not None else 0.0


def findings_of(
    found: Estimate,
    covariance: Array,
    chosen: Sequence[Chosen],
    worth: Mapping[tuple[str, str, str], float] = MappingProxyType({}),
    better: Mapping[tuple[str, str, str], bool] = MappingProxyType({}),
) -> tuple[EvidenceFinding, ...]:
    """The chosen with their numbers and corrected deviations: those of kinematics by certainty, then others by gain.

    `worth`: their gain in the whole structure, by label; what is not in it keeps that of its entry. `better`: whether
    the unseen is predicted better with it.
    """
    deviations = np.sqrt(np.diag(covariance))
    place = {unknown: n for n, unknown in enumerate(found.design.unknowns)}
    rows = []
    for each in chosen:
        witness = "kinematics" if each.kinematic else "coefficients"
        hypothesis = each.hypothesis
        gain, unseen = worth.get(hypothesis.label, each.gain), better.get(hypothesis.label)
        if hypothesis.entries:
            (entry,) = hypothesis.entries
            n = place.get(("term", entry))
            value = found.point.model.value(entry)
            error = float(deviations[n]) if n is not None else np.inf
            rows.append(EvidenceFinding(hypothesis, None, value, error, (error,), gain, witness, unseen))
            continue
        for i, active in enumerate(found.point.effects):
            if active.values and active.name == hypothesis.effects[0].name and active.log == hypothesis.effects[0].log:
                errors = tuple(float(deviations[place["effect", i, k]]) for k in range(len(active.values)))
                first = active.values[0]
                rows.append(EvidenceFinding(hypothesis, active, first, errors[0], errors, gain, witness, unseen))
                break
    return tuple(sorted(rows, key=_rank))


def _rank(row: EvidenceFinding) -> tuple[bool, float]:
    """Of instruments' faults the most certain first: which of them entered first depends on what else was missing."""
    return (False, -row.ratio) if row.witness == "kinematics" else (True, -row.gain)


def weakest(
    found: Estimate, chosen: Sequence[Chosen], confirmed: Callable[[Chosen], bool] = lambda _each: False
) -> Chosen | None:
    """The chosen one nearest to none, where that is nearer than the deviations that a final value must keep.

    `confirmed`: asked of those that are too near, whether another recording shows them as well.
    """
    covariance = corrected_covariance(found.design, found.solution)
    shown = confirmed_unknowns(found, covariance, chosen, confirmed)
    if shown:
        covariance = corrected_covariance(found.design, found.solution, shown)
    return weakest_of(findings_of(found, covariance, chosen), chosen, found.frame.settings.deviations)


def confirmed_unknowns(
    found: Estimate, covariance: Array, chosen: Sequence[Chosen], confirmed: Callable[[Chosen], bool]
) -> list[Unknown]:
    """The numbers of those chosen that are too near to none by some covariance, and confirmed."""
    near = nearer_than(findings_of(found, covariance, chosen), chosen, found.frame.settings.deviations)
    return [found.design.unknowns[n] for each in near if confirmed(each) for n in places_of(found, each.hypothesis)]


def nearer_than(rows: Sequence[EvidenceFinding], chosen: Sequence[Chosen], deviations: float) -> list[Chosen]:
    """The chosen ones whose finding is nearer to none than so many of its deviations."""
    near = {row.hypothesis.label for row in rows if row.ratio < deviations}
    return [each for each in chosen if each.hypothesis.label in near]


def weakest_of(rows: Sequence[EvidenceFinding], chosen: Sequence[Chosen], deviations: float) -> Chosen | None:
    """The chosen one whose finding is nearest to none, where that is nearer than so many of its deviations."""
    labels = {each.hypothesis.label for each in nearer_than(rows, chosen, deviations)}
    weak = [row for row in rows if row.hypothesis.label in labels]
    if not weak:
        return None
    label = min(weak, key=lambda row: row.ratio).hypothesis.label
    return next(each for each in chosen if each.hypothesis.label == label)


def places_of(found: Estimate, hypothesis: Hypothesis) -> list[int]:
    """Where the numbers of a hypothesis stand among the unknowns."""
    names = {(active.name, active.log) for active in hypothesis.effects}
    effects = {i for i, active in enumerate(found.point.effects) if (active.name, active.log) in names}
    return [
        n
        for n, unknown in enumerate(found.design.unknowns)
        if (unknown[0] == "term" and unknown[1] in hypothesis.entries)
        or (unknown[0] == "effect" and unknown[1] in effects)
    ]


def distances(found: Estimate, hypothesis: Hypothesis) -> list[tuple[int, float]]:
    """Place among the unknowns of each of a hypothesis' numbers, and its distance from the null value."""
    rows = []
    for n in places_of(found, hypothesis):
        unknown, away = found.design.unknowns[n], float(found.solution.values[n])
        if unknown[0] == "effect":
            active, number = found.point.effects[int(str(unknown[1]))], int(str(unknown[2]))
            away = active.values[number] - active.effect.parameters[number].null
        rows.append((n, away))
    return rows
