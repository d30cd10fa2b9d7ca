"""Open questions: models that fit about as well, and derivatives that are not significant."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from aerosid.estimation.maximum_likelihood import Refinement
from aerosid.loop.next_flight.expected_information import shared_information
from aerosid.search.attribution import Attribution
from aerosid.search.findings import Finding, named
from aerosid.search.settings import AttributionSettings


@dataclass(frozen=True)
class CompetingModel:
    """A model that fits the records about as well as the chosen one.

    `estimate`: its estimate; `known` (K, K): information matrix of its parameters from the records; `present`: the
    difference of -2 ln L against it, corrected for coloured residuals as all expected ones are; `label`: its name;
    `instead_of`: the chosen effect that it would replace; `kinds` and `places` of both.
    """

    estimate: Refinement
    known: NDArray[np.float64]
    present: float
    label: str
    instead_of: str
    kinds: frozenset[str]
    places: frozenset[str]


@dataclass(frozen=True)
class Unknown:
    """An insignificant derivative: its `place` among the free entries, deviations `present` and `needed`, and by
    how much coloured residuals widen it.
    """

    label: str
    place: int
    present: float
    needed: float
    colour: float


REACH = AttributionSettings().reach
"""Difference of -2 ln L below which the loop lists a model as an alternative."""


def largest_colour(found: Attribution) -> float:
    """Largest factor by which coloured residuals widen a variance: expected differences shrink by as much."""
    completed, uncertainty = found.completed, found.completed_deviations
    ratios = [1.0]
    for n, entry in enumerate(completed.free):
        if entry not in found.before.free and np.isfinite(uncertainty.corrected[n]):
            ratios.append(float(uncertainty.corrected[n] / uncertainty.white[n]) ** 2)
    finite = np.isfinite(uncertainty.effects) & (uncertainty.effects_white > 0.0)
    ratios += ((uncertainty.effects[finite] / uncertainty.effects_white[finite]) ** 2).tolist()
    return max(ratios)


def competing_models(found: Attribution, most: int) -> tuple[CompetingModel, ...]:
    """The alternatives as models, the closest first; several effects of one fit are one model."""
    fits: dict[int, tuple[Refinement, list[Finding]]] = {}
    for other in sorted(found.alternatives, key=lambda one: -one.gain):
        if other.fit is not None and other.fit.held_to_data == 0.0:
            fits.setdefault(id(other.fit), (other.fit, []))[1].append(other)
    colour = largest_colour(found)
    chosen = {named((one.kind, one.where, one.term)): one for one in found.findings}
    rivals = []
    for fit, parts in list(fits.values())[:most]:
        instead_of = parts[0].instead_of
        both = [*parts, *([chosen[instead_of]] if instead_of in chosen else [])]
        rivals.append(
            CompetingModel(
                estimate=fit,
                known=shared_information(fit),
                present=-parts[0].gain / colour,
                label=" and ".join(dict.fromkeys(named((part.kind, part.where, part.term)) for part in parts)),
                instead_of=instead_of,
                kinds=frozenset(part.kind for part in both),
                places=frozenset(part.where for part in both),
            )
        )
    return tuple(rivals)
