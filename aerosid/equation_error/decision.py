"""Structure selection by equation error: proved sensor faults first, then the aerodynamic coefficients."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from aerosid.effects import frozen
from aerosid.effects.aerodynamic_terms import is_symmetric
from aerosid.effects.hypothesis import Hypothesis
from aerosid.effects.sudden import is_sudden
from aerosid.equation_error.alternatives import Alternative, alternatives_of, replaced, worth_of
from aerosid.equation_error.candidates import joined, of_sensors
from aerosid.equation_error.channels import COEFFICIENT
from aerosid.equation_error.deviations import corrected_covariance
from aerosid.equation_error.estimate import Estimate, Frame, estimate, weights_on
from aerosid.equation_error.evidence import EvidenceFinding, findings_of, left_out, weakest, weakest_of
from aerosid.equation_error.gusts import Turbulence, share_of_gusts, turbulence_of
from aerosid.equation_error.proved_faults import ProvedFaults, on_fitted, with_proved_faults
from aerosid.equation_error.selection import (
    Chosen,
    Rules,
    Selected,
    forward,
    rules_for,
    total_price,
    with_separation,
    without,
)
from aerosid.equation_error.shared_damping import SharedDamping, shared_damping
from aerosid.equation_error.starts import may_separate, of_controls, sudden_hypotheses
from aerosid.equation_error.votes import Share, beside_gusts, refused, shares_of, unconfirmed

Array = NDArray[np.float64]


@dataclass(frozen=True)
class EquationErrorDecision:
    """What the equations show to be missing, with the estimates of the declared and the completed structure.

    Attributes
    ----------
    findings : tuple of EvidenceFinding
        Those of kinematics by certainty, then the others by gain.
    alternatives : tuple of Alternative
        What could stand in place of a finding.
    before, completed : Estimate
        Declared and completed structure, coefficients regressed on the identification recordings alone.
    covariance : ndarray, shape (P, P)
        Of the completed estimate's unknowns, corrected for coloured residuals.
    before_covariance : ndarray
        The same of the declared structure.
    turbulence : tuple of Turbulence
        What vanes and forces show of the air.
    shares : tuple of (Share, Share)
        R^2 before and after, of each coefficient and recording.
    gust_share : float
        What the sideslip's vane shows beyond the inertial path over all that it shows, 1; infinite where none is there.
    measured : Estimate
        The instruments' faults as the kinematics of the identification recordings alone measure them.
    asked : int
        Hypotheses.
    refuted : tuple of (kind, where, term)
        What the validation recordings refused.
    damping : SharedDamping or None
        What the completed C_m q_hat holds of an undeclared C_m alpha_dot_hat.
    """

    findings: tuple[EvidenceFinding, ...]
    alternatives: tuple[Alternative, ...]
    before: Estimate
    completed: Estimate
    covariance: Array
    before_covariance: Array
    turbulence: tuple[Turbulence, ...]
    shares: tuple[tuple[Share, Share], ...]
    gust_share: float
    measured: Estimate
    asked: int
    refuted: tuple[tuple[str, str, str], ...]
    damping: SharedDamping | None = None


def decide(
    faults: ProvedFaults, coefficients: Sequence[str], told: Callable[[str], None] = lambda _text: None
) -> EquationErrorDecision:
    """Select the undeclared effects from the coefficient equations, given the proved sensor faults.

    Parameters
    ----------
    coefficients : sequence of str
        Drag or axial force, lift or normal force, moment, as the aircraft file names them.
    told : callable
        Hears what enters and leaves, for a journal.
    """
    start, asked, proved = faults.start, faults.asked, faults.selected
    frame = proved.estimate.frame
    settings = frame.settings
    sensors = [h for h in asked if of_sensors(h)]
    others = [h for h in asked if not of_sensors(h)]
    fitted = Frame(frame.recordings, COEFFICIENT, settings)
    whole = replace(fitted, all_fitted=True)
    point = replace(start, effects=tuple(frozen(active) for active in proved.estimate.point.effects))
    begun = Selected(estimate(whole, point), ())
    rules = rules_for(asked, begun.estimate.design.target.size, settings.alarm(start.model.axes), settings.factor_odds)
    kept, refuted = _voted(begun, fitted, others, coefficients, rules, told)
    while True:
        point = kept.estimate.point
        lone = estimate(fitted, point, weights_on(kept.estimate, fitted, point))
        completed, covariance = with_proved_faults(proved.estimate, lone)
        findings = findings_of(completed, covariance, (*proved.chosen, *kept.chosen))
        # What the faults' own uncertainty could have made does not stand either.
        weak = weakest_of(findings, kept.chosen, settings.deviations)
        if weak is None:
            break
        told(f"  does not stand beside the instruments: {weak.hypothesis.label}")
        kept = left_out(kept, weak)
    worth = {**worth_of(proved), **worth_of(kept)}
    findings = findings_of(completed, covariance, (*proved.chosen, *kept.chosen), worth)
    # What another flight refutes stands in nobody's place.
    open_ = [hypothesis for hypothesis in others if hypothesis.label not in refuted]
    before = estimate(fitted, start)
    return EquationErrorDecision(
        findings=findings,
        alternatives=(*alternatives_of(proved, sensors), *alternatives_of(kept, open_)),
        before=before,
        completed=completed,
        covariance=covariance,
        before_covariance=corrected_covariance(before.design, before.solution),
        turbulence=turbulence_of(proved.estimate, lone),
        shares=tuple(zip(shares_of(whole, before), shares_of(whole, completed), strict=True)),
        gust_share=share_of_gusts(proved.estimate, "beta"),
        measured=on_fitted(proved).estimate,
        asked=len(asked),
        refuted=refuted,
        damping=shared_damping(lone),
    )


def _voted(
    begun: Selected,
    fitted: Frame,
    others: Sequence[Hypothesis],
    coefficients: Sequence[str],
    rules: Rules,
    told: Callable[[str], None],
) -> tuple[Selected, tuple[tuple[str, str, str], ...]]:
    """What the coefficients lack and every recording can bear; what was refused may have stood in another's place."""
    refuted: tuple[tuple[str, str, str], ...] = ()
    whole = begun.estimate.frame
    found = _attributed(begun, others, coefficients, rules, told)
    for _ in range(whole.settings.rounds):
        kept, refused_now = _standing(found, fitted, coefficients, rules, told)
        refuted = (*refuted, *refused_now)
        open_ = [hypothesis for hypothesis in others if hypothesis.label not in refuted]
        found = replaced(kept, open_, rules)
        if refused_now:
            most = whole.settings.most
            found = forward(
                found, whole, rules, open_, kinematic=False, coefficients=coefficients, most=most, told=told
            )
        if {each.hypothesis.label for each in found.chosen} == {each.hypothesis.label for each in kept.chosen}:
            return kept, refuted
    kept, refused_now = _standing(found, fitted, coefficients, rules, told)
    return kept, (*refuted, *refused_now)


def _attributed(
    begun: Selected,
    others: Sequence[Hypothesis],
    coefficients: Sequence[str],
    rules: Rules,
    told: Callable[[str], None],
) -> Selected:
    """What the coefficients lack; where that is worth more, with the controls first and flow separation second.

    A stall and the stabiliser and thrust that a pilot moves in it bend the coefficients together: powers of alpha that
    enter one by one would stand in the place of all three. Both ways are compared at the same number of effects.
    """
    frame = begun.estimate.frame

    def searched(selected: Selected, most: int) -> Selected:
        return forward(selected, frame, rules, others, kinematic=False, coefficients=coefficients, most=most, told=told)

    most = frame.settings.most
    found = begun
    if may_separate(frame):
        controls = [hypothesis for hypothesis in others if of_controls(hypothesis)]
        driven = forward(begun, frame, rules, controls, kinematic=False, most=most, told=told)
        separated = with_separation(driven, frame, rules, coefficients, told)
        if separated is not None:
            separated = searched(separated, most)
            found = searched(begun, len(separated.chosen))
            if paid(separated, rules) > paid(found, rules):
                return replaced(separated, others, rules)
    return replaced(searched(found, most), others, rules)


def paid(selected: Selected, rules: Rules) -> float:
    """Ln L less the price of all that entered."""
    return selected.estimate.log_likelihood - total_price(rules, selected.chosen)


def _standing(
    selected: Selected, fitted: Frame, coefficients: Sequence[str], rules: Rules, told: Callable[[str], None]
) -> tuple[Selected, tuple[tuple[str, str, str], ...]]:
    """What keeps its distance from none on the fitted recordings, and lowers no coefficient of an unseen one."""
    refuted: list[tuple[str, str, str]] = []
    while True:
        point = selected.estimate.point
        completed = estimate(fitted, point, weights_on(selected.estimate, fitted, point), steps=4)
        gone = weakest(completed, selected.chosen)
        if gone is None:
            gone = _refused_one(selected, completed, coefficients, rules)
            if gone is None:
                return selected, tuple(refuted)
            refuted.append(gone.hypothesis.label)
        told(f"  does not stand: {gone.hypothesis.label}")
        selected = left_out(selected, gone)


def _refused_one(selected: Selected, completed: Estimate, coefficients: Sequence[str], rules: Rules) -> Chosen | None:
    """The chosen one of least gain with which an unseen coefficient is predicted worse than without it."""
    if not selected.chosen:
        return None
    settings, whole = completed.frame.settings, selected.estimate.frame
    after = beside_gusts(whole, completed)
    for each in sorted(selected.chosen, key=lambda each: each.gain):
        bare = estimate(completed.frame, without(completed.point, each), completed.solution.weights, steps=4)
        before = beside_gusts(whole, bare)
        if refused(whole, before, after, settings.doubt, settings.least_rise):
            if _comes_again(selected, each.hypothesis, coefficients, rules):
                continue
            return each
        sideways = [coefficient for coefficient, _ in each.hypothesis.entries if not is_symmetric(coefficient)]
        if any(unconfirmed(whole, before, after, coefficient) for coefficient in sideways):
            return each
    return None


def _comes_again(selected: Selected, hypothesis: Hypothesis, coefficients: Sequence[str], rules: Rules) -> bool:
    """Whether a sudden change happens on an unseen recording too, at a price: that cannot refute it by being there."""
    if not any(is_sudden(active) for active in hypothesis.effects):
        return False
    base = selected.estimate
    for again in sudden_hypotheses(base.frame, base, coefficients, fitted=False):
        if (again.kind, again.where) == (hypothesis.kind, hypothesis.where):
            found = estimate(base.frame, joined(base.point, again), base.solution.weights, steps=4)
            if found.gain_over(base) > rules.price(again):
                return True
    return False
