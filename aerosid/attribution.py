"""Find what the declared model lacks, keep what survives the noise, and say what else fits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from aerosid.aerodynamics import AerodynamicModel, Entry
from aerosid.bounds import FilterError, filter_error, widened
from aerosid.confirmation import Confirmed, confirmed_terms, with_confirmed
from aerosid.disturbance_search import Searched, beside_disturbances, in_forces, in_moving_air, is_gust, through_air
from aerosid.effects import OutputEffect, StateEffect
from aerosid.evidence import Deviations, Score, deviations, unexplained_channels
from aerosid.exchange import alternatives, exchange
from aerosid.findings import Finding, labels, named
from aerosid.forward_search import forward, settled
from aerosid.hypotheses import Hypothesis
from aerosid.longitudinal import OUTPUTS
from aerosid.manoeuvre import Manoeuvre
from aerosid.part_findings import findings_of
from aerosid.pruning import certain, pruned
from aerosid.refinement import Refinement, refine_on
from aerosid.refutation import cannot_follow, without_refuted
from aerosid.search_settings import AttributionSettings
from aerosid.separation_search import PATCHES, is_patchwork, separation_at_first, with_separation
from aerosid.structure_search import StructureSearch
from aerosid.unproven import Unproven, unproven_terms

USUAL = AttributionSettings()
"""The settings of a loop unless told otherwise."""


@dataclass(frozen=True)
class Attribution:
    """What is missing from the declared model.

    Attributes
    ----------
    before : Refinement
        The declared structure, re-estimated.
    completed : Refinement
        With every finding.
    completed_deviations : Deviations
        Its standard deviations.
    findings : tuple of Finding
        Most certain first.
    alternatives : tuple of Finding
        What could stand in place of a finding.
    rounds : tuple of tuple of Score
        The score of every hypothesis in each round, before one of that round entered.
    refuted : tuple of (kind, where, term)
        What the flights that were fitted showed and others refuted.
    filter_error : FilterError or None
        The completed structure's terms among forces of any shape, where those say better what is left; then
        `completed_deviations` are no smaller than theirs.
    unproven : tuple of Unproven
        Terms that stand out where something is left, and not far enough.
    confirmed : tuple of Confirmed
        Those of them that flights which were not fitted show by themselves: they are among the findings.
    """

    before: Refinement
    completed: Refinement
    completed_deviations: Deviations
    findings: tuple[Finding, ...]
    alternatives: tuple[Finding, ...]
    rounds: tuple[tuple[Score, ...], ...]
    refuted: tuple[tuple[str, str, str], ...] = ()
    filter_error: FilterError | None = None
    unproven: tuple[Unproven, ...] = ()
    confirmed: tuple[Confirmed, ...] = ()

    @property
    def terms(self) -> tuple[Entry, ...]:
        """The found terms."""
        return tuple(finding.entry for finding in self.findings if finding.entry is not None)


def attribute(
    before: Refinement,
    manoeuvres: Sequence[Manoeuvre],
    hypotheses: Sequence[Hypothesis],
    coefficients: Sequence[str] = (),
    settings: AttributionSettings = USUAL,
    given: AerodynamicModel | None = None,
    validation: Sequence[Manoeuvre] = (),
    *,
    moving_air: bool = False,
) -> Attribution:
    """What the declared model lacks, among `hypotheses`, flow separation and disturbances.

    Parameters
    ----------
    before : Refinement
        The declared structure, re-estimated on the manoeuvres.
    manoeuvres : sequence of Manoeuvre
        The identification flights, one joint estimate.
    hypotheses : sequence of Hypothesis
        What may enter.
    coefficients : sequence of str
        Coefficients that may change without a term; none: no sudden change and no flow separation is tried.
    given : AerodynamicModel, optional
        The declared structure with its declared values: where a search begins again if what is missing is gross.
    validation : sequence of Manoeuvre
        Flights that are not fitted; what predicts them worse is not named.
    moving_air : bool
        Whether the instruments show gusts by kinematics alone: what is missing is then looked for beside them at first.
    """
    search = StructureSearch(tuple(manoeuvres), tuple(hypotheses), tuple(coefficients), before, settings, given)
    gusty = None
    if moving_air and coefficients and settings.disturbances and search.is_doubtful(before):
        gusty = _beside_gusts(search, before, validation)
    if gusty is not None and _is_explained_by_gusts(search, gusty.estimate):
        plain = reached = gusty
    else:
        plain = _plainly(search, before, validation, gusty)
        reached = _against_disturbances(search, before, plain, gusty) if settings.disturbances else plain
    current, others = reached.estimate, reached.others
    completed, spread = certain(search, refine_on(_unforced(current, before), manoeuvres))
    if _is_forced(current) and (kept := _no_imitation(search, before, completed, plain, gusty, validation)) is not None:
        current, others = kept.estimate, kept.others
        completed, spread = certain(search, refine_on(current, manoeuvres))
    held, refuted = without_refuted(completed, search, validation)
    if refuted:
        completed, spread = certain(search, refine_on(held, manoeuvres))
        gain = search.price(before) - search.price(completed)
        if settings.disturbances and search.is_doubtful(completed) and gain < NO_IMITATION * search.samples:
            # What is left of a sum that was refuted was not found as such.
            standing = pruned(search, in_forces(search, completed))
            completed, spread = certain(search, refine_on(_unforced(standing, before), manoeuvres))
    if (reduced := _without_odd_sensors(search, completed)) is not completed:
        # A gust that was found beside such a fault may have been its work.
        completed, spread = certain(search, refine_on(_calmed(search, reduced), manoeuvres))
    told = tuple(part.label for part in refuted)
    unproven = unproven_terms(search, completed, told)
    confirmed = confirmed_terms(search, completed, unproven, validation)
    if confirmed:
        completed = with_confirmed(search, completed, [each.entry for each in confirmed])
        spread = deviations(completed, manoeuvres)
        unproven = tuple(each for each in unproven if each not in [stands.suggested for stands in confirmed])
    forces = next((active for active in current.effects if active.effect.kind == "unmodelled_forces"), None)
    beside_forces = filter_error(completed, forces, current.variance, manoeuvres) if forces is not None else None
    spread = widened(spread, beside_forces)
    p_values = {each.entry: each.p_value for each in confirmed}
    findings = tuple(
        replace(row, p_value=p_values[row.entry]) if row.entry in p_values else row
        for row in findings_of(search, completed, spread)
    )
    if forces is not None:
        # Those forces follow what a rival leaves in open loop, and may so tell apart what the motion alone cannot.
        others = _once((*others, *alternatives(search, completed)))
    others = tuple(other for other in others if other.instead_of in {named(label) for label in labels(findings)})
    return Attribution(
        before, completed, spread, findings, others, plain.rounds, told, beside_forces, unproven, confirmed
    )


BESIDE_GUSTS = 2
"""How many may enter beside gusts that kinematics show, before flow separation is asked and all else without them."""


def _beside_gusts(search: StructureSearch, before: Refinement, validation: Sequence[Manoeuvre]) -> Searched:
    """The search beside a gust, with flow separation where something is left."""
    gusty = through_air(search, in_moving_air(search, before), BESIDE_GUSTS)
    if search.is_doubtful(gusty.estimate) or _fails_elsewhere(search, gusty.estimate, validation):
        separated = settled(search, with_separation(search, gusty.estimate))
        if search.price(separated) < search.price(gusty.estimate):
            gusty = replace(gusty, estimate=separated, others=())
    return gusty


def _fails_elsewhere(search: StructureSearch, current: Refinement, validation: Sequence[Manoeuvre]) -> bool:
    """Whether what was found cannot follow another flight: what separates there may look like a term here."""
    return bool(search.parts(current, None)) and any(cannot_follow(current, other) for other in validation)


def _is_explained_by_gusts(search: StructureSearch, gusty: Refinement) -> bool:
    """Whether a gust, with what was found beside it, leaves nothing wrong, and is more than forces of any shape."""
    return not search.is_doubtful(gusty) and is_gust(search, gusty)


def _plainly(
    search: StructureSearch, before: Refinement, validation: Sequence[Manoeuvre], gusty: Searched | None
) -> Searched:
    """The search without disturbances, and flow separation where something is left that gusts do not say better."""
    current, rounds = forward(search, before)
    current, others = exchange(search, current)
    plain = Searched(current, others, tuple(rounds))
    if gusty is not None and search.price(gusty.estimate) < search.price(current):
        return plain
    return _separated(search, plain, validation)


def _separated(search: StructureSearch, plain: Searched, validation: Sequence[Manoeuvre]) -> Searched:
    """The search with flow separation where something is left and that says it better."""
    current = plain.estimate
    if not search.stepping:
        return plain
    if is_patchwork(search, current) or search.is_doubtful(current) or _fails_elsewhere(search, current, validation):
        separated = with_separation(search, current)
        if search.price(separated) < search.price(current):
            return replace(plain, estimate=separated, others=())
    return plain


def _against_disturbances(
    search: StructureSearch, before: Refinement, plain: Searched, gusty: Searched | None
) -> Searched:
    """The search against gusts or forces of any shape where something is left and they say it better."""
    found = plain.estimate
    if not search.is_doubtful(found):
        return plain
    best = plain
    # What was found so far may be the disturbance's work, or be real beside it.
    held_still = found is before or any(isinstance(active.effect, StateEffect) for active in found.effects)
    held_still |= gusty is not None and search.price(gusty.estimate) < search.price(found)
    for base in (before,) if held_still else (before, found):
        disturbed = beside_disturbances(search, base, gusty if base is before else None)
        if search.price(disturbed.estimate) < search.price(best.estimate):
            best = disturbed
    return best


ODD = 2.0
"""Times its noise that the one channel with anything left must be for the fault named of its sensor to be no such."""

MOSTLY = 3.0
"""Times what is left that the channel must be off without the fault for it to be named all the same: it says most."""


def _without_odd_sensors(search: StructureSearch, completed: Refinement) -> Refinement:
    """The estimate without faults of the one sensor whose channel alone is left wrong: it errs as they do not."""
    wrong = unexplained_channels(completed, search.manoeuvres)
    if len(wrong) != 1:
        return completed
    place = OUTPUTS.index(wrong[0])
    noise = max(float(manoeuvre.noise[place]) for manoeuvre in search.manoeuvres)
    left = float(np.sqrt(completed.variance[place]))
    odd = [
        part
        for part in search.parts(completed, None)
        if part.active is not None and isinstance(part.active.effect, OutputEffect) and part.label[1] == wrong[0]
    ]
    if left < ODD * noise or not odd:
        return completed
    reduced = search.without(completed, odd)
    return reduced if np.sqrt(reduced.variance[place]) < MOSTLY * left else completed


def _calmed(search: StructureSearch, completed: Refinement) -> Refinement:
    """The estimate without the gust that it may hold, where that does not say enough to stay."""
    gusts = [part for part in search.parts(completed, None) if part.label[0] == "gust"]
    calm = search.without(completed, gusts) if gusts else completed
    return calm if search.price(calm) < search.price(completed) + search.critical**2 else completed


NO_IMITATION = 1.8
"""Rise of -2 ln L a sample, residuals 2.5 times as large, that no wrong name makes good.

Forces of any shape can follow a stall, a trim change and thrust too, and leave none of them standing. What brings the
whole residual in open loop down so far is kept, although something is left.
"""


def _no_imitation(
    search: StructureSearch,
    before: Refinement,
    completed: Refinement,
    plain: Searched,
    gusty: Searched | None,
    validation: Sequence[Manoeuvre],
) -> Searched | None:
    """What was found without forces of any shape, if in still air it says so much more than `completed` does.

    What those forces left standing has no gust beside it, and is weighed against the others without theirs.
    """
    level = search.price(completed) - NO_IMITATION * search.samples
    found = {search.price(plain.estimate): plain}
    if gusty is not None:
        gusts = [part for part in search.parts(gusty.estimate, None) if part.is_disturbance]
        found[search.price(search.without(gusty.estimate, gusts))] = gusty
    if min(found) >= level:
        return None
    if gusty is not None:
        # Where gusts said it better, flow separation was asked beside them alone.
        separated = _separated(search, plain, validation)
        found[search.price(separated.estimate)] = separated
    if search.stepping and len(search.parts(plain.estimate, None)) >= PATCHES:
        estimate, others = separation_at_first(search, before)
        found[search.price(estimate)] = replace(plain, estimate=estimate, others=others)
    return found[min(found)]


def _is_forced(current: Refinement) -> bool:
    return any(active.effect.kind == "unmodelled_forces" for active in current.effects)


def _unforced(current: Refinement, before: Refinement) -> Refinement:
    """Without forces of any shape, which judged what is real: the numbers come from the estimator of those before."""
    effects = tuple(active for active in current.effects if active.effect.kind != "unmodelled_forces")
    return replace(current, effects=effects, variance=np.maximum(current.variance, before.variance))


def _once(findings: Sequence[Finding]) -> tuple[Finding, ...]:
    """Each alternative once, the first time that it is named."""
    return tuple({(f.kind, f.where, f.term, f.instead_of): f for f in reversed(findings)}.values())[::-1]
