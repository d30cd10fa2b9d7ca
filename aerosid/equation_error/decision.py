"""Structure selection by equation error: proved sensor faults first, then the aerodynamic coefficients."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from aerosid.compiled.cores import both
from aerosid.effects.hypothesis import Hypothesis
from aerosid.equation_error.equations.channels import COEFFICIENT
from aerosid.equation_error.regression.estimate import Estimate, Frame, estimate, weights_on
from aerosid.equation_error.regression.input_interpolation import likelier_inputs
from aerosid.equation_error.regression.standard_errors import corrected_covariance
from aerosid.equation_error.regression.vane_smoothing import likelier_smoothing
from aerosid.equation_error.selection.alternatives import Alternative, alternatives_of, worth_of
from aerosid.equation_error.selection.backward_elimination import Labels, predicted_better, standing
from aerosid.equation_error.selection.candidates import of_sensors, told_apart
from aerosid.equation_error.selection.coefficient_search import CoefficientSearch
from aerosid.equation_error.selection.cross_validation import Share, shares_of
from aerosid.equation_error.selection.damping_collinearity import SharedDamping, shared_damping, usual_downwash
from aerosid.equation_error.selection.instrument_errors import ProvedFaults, on_fitted, with_proved_faults
from aerosid.equation_error.selection.joint_time_delays import (
    JointTiming,
    TwoWitnesses,
    held_at,
    is_within,
    joint_gain,
    joint_timing,
    kinematic_timing,
    likeliest_kinds,
    where_witnesses_differ,
)
from aerosid.equation_error.selection.kinematic_evidence import supported_faults
from aerosid.equation_error.selection.model_averaging import averaged
from aerosid.equation_error.selection.near_significant import NearlyProven, nearly_proven, with_unseen
from aerosid.equation_error.selection.penalties import Label, Support, own_effects, rules_for
from aerosid.equation_error.selection.replication import is_replicated
from aerosid.equation_error.selection.selection_rounds import asked_where_contradicted, searched
from aerosid.equation_error.selection.stepwise import recordings_agree
from aerosid.equation_error.selection.structure import Selected, left_out
from aerosid.equation_error.selection.turbulence import Turbulence, share_of_gusts, turbulence_of
from aerosid.equation_error.selection.wald_tests import EvidenceFinding, confirmed_unknowns, findings_of, weakest_of

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
        Of the completed estimate's unknowns, corrected for coloured residuals; that of declared derivatives with what
        the choice among the alternatives adds.
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
    timings : tuple of TwoWitnesses
        Instruments that kinematics alone and all equations find late in different ways.
    supported : mapping of label to Support
        What kinematics show of the instruments' faults that they and the coefficients name together.
    nearly : tuple of NearlyProven
        What would be named were it the only question: of kinematics, then of coefficients.
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
    timings: tuple[TwoWitnesses, ...] = ()
    supported: Mapping[Label, Support] = field(default_factory=dict)
    nearly: tuple[NearlyProven, ...] = ()


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
    start, asked = faults.start, faults.asked
    settings = faults.selected.estimate.frame.settings
    sensors = [h for h in asked if of_sensors(h)]
    proved, late, search, outcome = _structure(faults, faults.selected, tuple(coefficients), told)
    fitted, support = search.fitted, search.rules.support
    (kept, alone, completed, covariance), refuted = _beside_instruments(proved, search, outcome)
    lone, chosen = alone.estimate, (*proved.chosen, *kept.chosen)
    together = [each.hypothesis for each in kept.chosen if told_apart(each.hypothesis) in support]
    of_proved, of_kept = alternatives_of(proved, sensors), alternatives_of(kept, search.open_but(refuted))
    worth = {**worth_of(proved), **worth_of(kept)}
    for hypothesis in together:
        (active,) = own_effects(kept.estimate.point, hypothesis)
        worth[hypothesis.label] += support[told_apart(hypothesis)].gain_at(active.values)
    findings = findings_of(completed, covariance, chosen, worth, predicted_better(kept, alone))
    late = tuple(replace(row, gain=worth[row.instead_of.label] - row.behind) for row in late)
    # What another flight refutes stands in nobody's place, and so does what both kinds of equations name together.
    taken = {*refuted, *(hypothesis.label for hypothesis in together)}
    before = estimate(lone.frame, start)
    as_measured = replace(settings, blend=settings.blend_compared, blend_aside=settings.blend_compared)
    compared = replace(lone.frame, settings=as_measured, all_fitted=True)
    of_proved = tuple(row for row in of_proved if row.hypothesis.label not in taken)
    alternatives = (*late, *_unlike(late, of_proved), *of_kept)
    derivatives = [unknown for unknown in before.design.unknowns if unknown[0] == "term"]
    after = shares_of(compared, completed)
    nearly = _nearly_proven(faults, proved, kept, search, alternatives, refuted)
    return EquationErrorDecision(
        findings=findings,
        alternatives=alternatives,
        before=before,
        completed=completed,
        covariance=averaged(completed, covariance, lone, alternatives, derivatives, nearly),
        before_covariance=corrected_covariance(before.design, before.solution),
        turbulence=turbulence_of(proved.estimate, lone),
        shares=tuple(zip(shares_of(compared, before), after, strict=True)),
        gust_share=share_of_gusts(proved.estimate, "beta"),
        measured=on_fitted(proved).estimate,
        asked=len(asked),
        refuted=refuted,
        damping=shared_damping(lone),
        timings=where_witnesses_differ(faults.selected.estimate, outcome.timing, settings.deviations),
        supported={hypothesis.label: support[told_apart(hypothesis)] for hypothesis in together},
        nearly=tuple(with_unseen(row, after, fitted, compared) for row in nearly),
    )


class _Standing(NamedTuple):
    """A structure, the same on the fitted recordings alone, and its estimate and covariance beside the instruments."""

    kept: Selected
    alone: Selected
    completed: Estimate
    covariance: Array


def _beside_instruments(proved: Selected, search: CoefficientSearch, outcome: _Outcome) -> tuple[_Standing, Labels]:
    """The structure without what the instruments' own uncertainty could have made, and all that was refuted.

    What leaves for that may have stood in another's place, as a power of alpha whose bias is known badly: the others
    are asked again, as they are of what does not stand in the search itself.
    """
    settings = search.fitted.settings
    kept, refuted = outcome.kept, outcome.refuted
    gone: Labels = ()
    for _ in range(settings.rounds):
        certain = _certain(proved, search, outcome.timing, kept)
        fell = kept.labels_beyond(certain.kept)
        if not fell:
            return certain, refuted
        gone = (*gone, *fell)
        more = search.forward(certain.kept, search.open_but(refuted), settings.most, struck_out=gone)
        if more is certain.kept:
            return certain, refuted
        kept, refused = standing(search, more)
        refuted = (*refuted, *refused)
    return _certain(proved, search, outcome.timing, kept), refuted


def _certain(proved: Selected, search: CoefficientSearch, timing: JointTiming, kept: Selected) -> _Standing:
    """A structure less what is nearer to none than the deviations that a final value must keep."""
    while True:
        point = kept.estimate.point
        alone = likelier_inputs(estimate(search.fitted, point, weights_on(kept.estimate, search.fitted, point)))
        fitted = Selected(alone, kept.chosen)
        completed, covariance = _with_deviations(timing, fitted, kept)
        findings = findings_of(completed, covariance, (*proved.chosen, *kept.chosen))
        weak = weakest_of(findings, kept.chosen, search.fitted.settings.deviations)
        if weak is None:
            return _Standing(kept, fitted, completed, covariance)
        search.told(f"  does not stand beside the instruments: {weak.hypothesis.label}")
        kept = left_out(kept, weak)


def _nearly_proven(
    faults: ProvedFaults,
    proved: Selected,
    kept: Selected,
    search: CoefficientSearch,
    alternatives: Sequence[Alternative],
    refuted: Sequence[Label],
) -> tuple[NearlyProven, ...]:
    """What kinematics and coefficients each would name were it all that was asked, and nothing lists yet."""
    listed = {*refuted, *(row.hypothesis.label for row in alternatives)}
    listed |= {*proved.labels, *kept.labels}
    sensors = [h for h in faults.asked if h.label not in listed and of_sensors(h)]
    terms = [h for h in search.asked if h.label not in listed and not of_sensors(h)]
    rows = both(
        functools.partial(nearly_proven, proved, faults.rules, sensors, recordings_agree),
        functools.partial(nearly_proven, kept, search.rules, terms, search.admitted),
        [proved.estimate.frame, kept.estimate.frame],
    )
    return tuple(row for row in rows if row is not None)


class _Structure(NamedTuple):
    """The faults, the other ways in which a channel may be late, the search in the coefficients, and its outcome."""

    proved: Selected
    late: tuple[Alternative, ...]
    search: CoefficientSearch
    outcome: _Outcome


def _structure(
    faults: ProvedFaults, proved: Selected, coefficients: tuple[str, ...], told: Callable[[str], None]
) -> _Structure:
    """The structure that both kinds of equations show, no lateness in it for which they do not pay together."""
    start, settings = faults.start, proved.estimate.frame.settings
    sensors = [h for h in faults.asked if of_sensors(h)]
    whole = Frame(proved.estimate.frame.recordings, COEFFICIENT, settings, all_fitted=True)
    declared = estimate(whole, held_at(start, proved.estimate.point.effects))
    likelier, late = likeliest_kinds(proved, declared, sensors, told)
    if likelier is not proved:
        proved, declared = likelier, estimate(whole, held_at(start, likelier.estimate.point.effects))
    declared = likelier_smoothing(likelier_inputs(declared))
    search = _search_of(faults, proved, declared, coefficients, told)
    outcome = _timed(proved.estimate, declared, search)
    for each in proved.chosen:
        gain = joint_gain(proved, each, outcome.timing, outcome.kept.estimate)
        if gain is not None and gain < search.rules.price(each.hypothesis):
            told(f"  both kinds of equations together gain {gain:.1f} by {each.hypothesis.label}")
            return _structure(faults, left_out(proved, each), coefficients, told)
    undeclared = slice(len(start.effects), len(outcome.timing.effects))
    search, kept, refuted = asked_where_contradicted(search, outcome.kept, outcome.refuted, undeclared)
    return _Structure(proved, late, search, replace(outcome, kept=kept, refuted=refuted))


def _with_deviations(timing: JointTiming, alone: Selected, kept: Selected) -> tuple[Estimate, Array]:
    """The estimate with the instruments' numbers, and the covariance of all.

    An effect that one event of the fitted recordings shows keeps the deviation of the deleted blocks, unless it would
    be lost by that alone and the unseen recordings show it too.
    """
    completed, covariance = with_proved_faults(timing, alone.estimate)
    replicated = functools.partial(is_replicated, kept, alone)
    shown = confirmed_unknowns(completed, covariance, kept.chosen, replicated)
    return with_proved_faults(timing, alone.estimate, shown) if shown else (completed, covariance)


def _search_of(
    faults: ProvedFaults,
    proved: Selected,
    declared: Estimate,
    coefficients: tuple[str, ...],
    told: Callable[[str], None],
) -> CoefficientSearch:
    """What is asked of the coefficients: what is no sensor's fault, and the faults that kinematics support."""
    asked, settings = faults.asked, declared.frame.settings
    support = supported_faults(proved, [h for h in asked if of_sensors(h)])
    open_ = tuple(h for h in asked if not of_sensors(h) or told_apart(h) in support)
    alarm = settings.alarm(declared.point.model.axes)
    rules = rules_for(asked, declared.design.target.size, alarm, settings.factor_odds)
    rules = replace(rules, support=support, usual=usual_downwash(faults.start.model))

    def admitted(found: Estimate, hypothesis: Hypothesis) -> bool:
        known = support.get(told_apart(hypothesis))
        return known is None or known.agrees(found.point.effects[-1].values, settings.agreement)

    fitted = replace(declared.frame, all_fitted=False)
    return CoefficientSearch(open_, coefficients, fitted, rules, admitted, told)


def _unlike(known: Sequence[Alternative], rows: Sequence[Alternative]) -> list[Alternative]:
    """The rows whose hypotheses are not among the known ones."""
    labels = {row.hypothesis.label for row in known}
    return [row for row in rows if row.hypothesis.label not in labels]


def _timed(proved: Estimate, declared: Estimate, search: CoefficientSearch) -> _Outcome:
    """The structure with the timings of instruments that kinematics and coefficients show together.

    A structure found with a wrong timing has something in its place, and a timing found with a wrong structure is
    off: the search begins with the timings of kinematics alone and with those that the declared structure prefers, and
    the likelier outcome counts.
    """

    def outcome(search: CoefficientSearch, begun: JointTiming) -> _Outcome:
        start = estimate(declared.frame, held_at(declared.point, begun.effects), declared.solution.weights)
        kept, refuted = searched(search, Selected(start, ()))
        timing = joint_timing(proved, begun, kept.estimate, search.told)
        if timing is begun:
            return _Outcome(begun, kept, refuted)
        moved = estimate(declared.frame, held_at(kept.estimate.point, timing.effects), kept.estimate.solution.weights)
        if search.refuses(kept.estimate, moved):
            search.told("  an unseen recording keeps the timings as they were")
            return _Outcome(begun, kept, refuted)
        return _Outcome(timing, Selected(moved, kept.chosen), refuted)

    kinematic = kinematic_timing(proved)
    joint = joint_timing(proved, kinematic, declared, search.told)
    if is_within(kinematic, joint, declared.frame.settings.deviations):
        return outcome(search, joint)
    found, other = search.side_by_side(
        functools.partial(outcome, begun=joint), functools.partial(outcome, begun=kinematic), [declared.frame]
    )
    paid, others = (search.paid(each.kept) - each.timing.penalty for each in (found, other))
    return other if others > paid else found


@dataclass(frozen=True)
class _Outcome:
    """The timings of instruments, the structure found with them, and what the unseen recordings refused."""

    timing: JointTiming
    kept: Selected
    refuted: tuple[tuple[str, str, str], ...]
