"""Backward elimination by corrected t-ratios."""

from __future__ import annotations

from scipy.special import chdtri

from aerosid.effects.step_input import is_step_change
from aerosid.estimation.deviations import Deviations, deviations
from aerosid.estimation.maximum_likelihood import Refinement, refine_on
from aerosid.search.findings import Part
from aerosid.search.structure_search import NONLINEAR_KINDS, StructureSearch

BORDERLINE = 0.7
"""Numerical: share of the critical t-ratio from which a search's quick deviations do not decide: they are the published
ones raised by their usual shortfall, and made 4.2 of a ratio of 5.2 (C_X alpha*delta_e of JSBSim's c310)."""


def eliminate_insignificant(
    search: StructureSearch, current: Refinement, origin: Refinement | None = None
) -> Refinement:
    """The estimate without the added parts that are insignificant by their corrected standard deviations.

    `origin` is the estimate to which parts were added: it is returned, not fitted again, where all of them are removed.
    """
    while (
        reduced := without_least_significant(search, current, _sufficient_deviations(search, current), origin)
    ) is not None:
        current = reduced
        if current is origin:
            break
    return current


def _sufficient_deviations(search: StructureSearch, current: Refinement) -> Deviations:
    """The search's quick deviations, or the full ones where only a borderline t-ratio is insignificant by those."""
    quick = search.quick_deviations(current)
    least = min(
        (part.ratio for part in search.parts(current, quick) if not part.is_disturbance), default=search.critical
    )
    if BORDERLINE * search.critical <= least < search.critical:
        return deviations(current, search.manoeuvres, whitened=search.stored_whitened(current))
    return quick


def eliminate_on_final_estimate(search: StructureSearch, completed: Refinement) -> tuple[Refinement, Deviations]:
    """The final estimate without the parts that are insignificant by its full standard deviations, and the latter."""
    while True:
        uncertainty = deviations(completed, search.manoeuvres)
        reduced = without_least_significant(search, completed, uncertainty)
        if reduced is None:
            return completed, uncertainty
        completed = refine_on(reduced, search.manoeuvres)


def without_least_significant(
    search: StructureSearch, current: Refinement, uncertainty: Deviations, origin: Refinement | None = None
) -> Refinement | None:
    """The estimate without the least significant part, `origin` where it is that; None where all are significant."""
    parts = [part for part in search.parts(current, uncertainty) if not part.is_disturbance]
    for part in sorted(parts, key=lambda part: part.ratio):
        if part.ratio >= search.critical:
            break
        reduced = search.re_estimated_without(current, [part], origin)
        if not is_jointly_significant(
            search, part, reduced.cost - current.cost, variance_inflation(search, current, uncertainty, {part.label})
        ):
            return reduced
    return None


def is_jointly_significant(search: StructureSearch, part: Part, loss: float, inflation: float) -> bool:
    """Likelihood ratio test of an effect with several or nonlinear parameters, which a single t-ratio cannot test.

    The standard deviation of a gain allows for its unknown reach, though without a gain there is no reach: where the
    two are correlated, neither is significant and the effect is. And where an effect is far from linear, the
    log-likelihood between the null value and the estimate is no parabola. Wilks' likelihood ratio, divided by the
    variance inflation of coloured residuals, tests both.
    """
    if part.active is None or part.ratio == 0.0 or is_step_change(part.active):
        return False
    count = len(part.active.values)
    if count < 2 and part.active.effect.kind not in NONLINEAR_KINDS:
        return False
    return loss / inflation > float(chdtri(count, search.settings.false_alarm / max(len(search.hypotheses), 1)))


def variance_inflation(
    search: StructureSearch, current: Refinement, uncertainty: Deviations, labels: set[tuple[str, str, str]]
) -> float:
    """Largest inflation of some parts' variances by coloured residuals, at least 1."""
    white = search.parts(current, uncertainty.as_white)
    corrected = search.parts(current, uncertainty)
    ratios = [
        (part.std_error / plain.std_error) ** 2
        for part, plain in zip(corrected, white, strict=True)
        if part.label in labels and plain.std_error > 0.0
    ]
    return max(1.0, *ratios, 1.0)
