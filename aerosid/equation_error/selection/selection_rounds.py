"""Structure selection in the coefficient equations, in rounds of growth and of what every recording can bear."""

from __future__ import annotations

from dataclasses import replace

from aerosid.equation_error.selection.backward_elimination import Labels, on_fitted, predicted_better, standing
from aerosid.equation_error.selection.coefficient_search import CoefficientSearch, beside_level_shifts
from aerosid.equation_error.selection.penalties import Label
from aerosid.equation_error.selection.prior_odds import falls_of, with_contradictions
from aerosid.equation_error.selection.structure import Selected, left_out


def searched(search: CoefficientSearch, begun: Selected) -> tuple[Selected, Labels]:
    """What the coefficients lack and every recording can bear; what left may have stood in another's place.

    What left comes in again neither beside the others nor for one of them. Of the structures that stand after one round
    and another the likeliest counts, prices paid.
    """
    refuted: Labels = ()
    gone_before: Labels = ()
    most = begun.estimate.frame.settings.most
    found = beside_level_shifts(search, begun)
    best: Selected | None = None
    met: set[frozenset[Label]] = set()
    last = begun.estimate.frame.settings.rounds
    for round_ in range(last + 1):
        met.add(frozenset(found.labels))
        kept, refused_now = standing(search, found)
        gone = found.labels_beyond(kept)
        refuted, gone_before = (*refuted, *refused_now), (*gone_before, *gone)
        # What was refused since stands no more in what stood before.
        held = best is not None and not set(best.labels) & set(refused_now)
        best = max(best, kept, key=search.paid) if best is not None and held else kept
        if round_ == last:
            break
        open_ = search.open_but(refuted)
        found = search.replaced(kept, open_, struck_out=gone_before)
        if gone:
            found = search.forward(found, open_, most, struck_out=gone_before)
        names = frozenset(found.labels)
        if names == frozenset(kept.labels) or names in met:  # what stood of it then would stand of it again
            break
    assert best is not None
    return best, refuted


def asked_where_contradicted(
    search: CoefficientSearch, found: Selected, refuted: Labels, faults: slice
) -> tuple[CoefficientSearch, Selected, Labels]:
    """The structure with the terms that pay at the odds of a coefficient that the proven faults contradict, and these.

    Asked once a structure is found: what it explains contradicts no more. At such odds a term has to predict better,
    too, what it is not fitted to. `faults`: those of its effects.
    """
    falls = falls_of(found.estimate, faults)
    if not falls:
        return search, found, refuted
    search.told("  contradicted " + ", ".join(f"{name} {fall:.1f}" for name, fall in falls.items()))
    settings = found.estimate.frame.settings
    search = replace(search, rules=with_contradictions(search.rules, search.asked, falls, settings.contradicted))
    open_ = [hypothesis for hypothesis in search.open_but(refuted) if hypothesis.label in search.rules.likelier]
    more = search.forward(found, open_, settings.most, sudden=False)
    if more is found:
        return search, found, refuted
    kept, refuted_now = standing(search, more)
    new = kept.labels_beyond(found)
    better = predicted_better(kept, on_fitted(search, kept))
    for each in kept.chosen:
        label = each.hypothesis.label
        if label in new and not better.get(label, False):
            search.told(f"  predicts nothing better: {label}")
            kept = left_out(kept, each)
    if not kept.labels_beyond(found):
        return search, found, refuted
    return search, kept, (*refuted, *refuted_now)
