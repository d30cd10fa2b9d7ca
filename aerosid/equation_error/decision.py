"""What the declared model lacks, by kinematics first and coefficients second, with all recordings in one likelihood."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from aerosid.effects import ActiveEffect, frozen
from aerosid.effects.hypothesis import Hypothesis
from aerosid.equation_error.alternatives import Alternative, alternatives_of, replaced
from aerosid.equation_error.candidates import bounded, of_sensors, position_hypotheses
from aerosid.equation_error.channels import COEFFICIENT, KINEMATIC
from aerosid.equation_error.design import design_of, whiten
from aerosid.equation_error.deviations import corrected_covariance
from aerosid.equation_error.estimate import Estimate, Frame, effect_columns, estimate, weights_on
from aerosid.equation_error.gusts import Turbulence, turbulence_of
from aerosid.equation_error.points import Point
from aerosid.equation_error.recording import read_recordings
from aerosid.equation_error.selection import (
    Chosen,
    Rules,
    Selected,
    forward,
    recordings_agree,
    rules_for,
    total_price,
    with_separation,
    without,
)
from aerosid.equation_error.settings import EquationErrorSettings
from aerosid.equation_error.votes import Share, refused, shares_of
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.flight_model.aerodynamics import AerodynamicModel, Entry

Array = NDArray[np.float64]

USUAL = EquationErrorSettings()
"""The settings of a loop unless told otherwise."""

TAUTOLOGICAL = frozenset({"C_X", "C_Z", "C_L", "C_D"})
"""Coefficients in which a term of alphadot says no more than a_z = V (alphadot - q), whatever the aerodynamics."""


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
        In ln L when it entered.
    witness : "kinematics" or "coefficients"
        Which equations proved it.
    """

    hypothesis: Hypothesis
    active: ActiveEffect | None
    value: float
    std_error: float
    std_errors: tuple[float, ...]
    gain: float
    witness: str

    @property
    def null(self) -> float:
        """The value at which it is none."""
        return self.active.effect.parameters[0].null if self.active is not None else 0.0

    @property
    def ratio(self) -> float:
        """Distance from none in its own deviations; of several numbers the most certain one counts."""
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


@dataclass(frozen=True)
class EquationErrorDecision:
    """What the equations show to be missing, with the estimates of the declared and the completed structure.

    Attributes
    ----------
    findings : tuple of EvidenceFinding
        Those of kinematics first, then by gain.
    alternatives : tuple of Alternative
        What could stand in place of a finding.
    before, completed : Estimate
        Declared and completed structure, coefficients regressed on the identification recordings alone.
    covariance : ndarray, shape (P, P)
        Of the completed estimate's unknowns, corrected for coloured residuals.
    before_covariance : ndarray
        The same of the declared structure.
    turbulence : Turbulence or None
        What vane and lift show of the air.
    shares : tuple of (Share, Share)
        R^2 before and after, of each coefficient and recording.
    asked : int
        Hypotheses.
    refuted : tuple of (kind, where, term)
        What the validation recordings refused.
    """

    findings: tuple[EvidenceFinding, ...]
    alternatives: tuple[Alternative, ...]
    before: Estimate
    completed: Estimate
    covariance: Array
    before_covariance: Array
    turbulence: Turbulence | None
    shares: tuple[tuple[Share, Share], ...]
    asked: int
    refuted: tuple[tuple[str, str, str], ...]


def askable(hypothesis: Hypothesis) -> bool:
    """Whether the equations can judge a hypothesis as it stands; sudden changes are looked for by the engine itself."""
    if hypothesis.time is not None:
        return False
    return not any(c in TAUTOLOGICAL and "alpha_dot_hat" in term.variables for c, term in hypothesis.entries)


def decide(
    model: AerodynamicModel,
    free: Sequence[Entry],
    given: Sequence[ActiveEffect],
    hypotheses: Sequence[Hypothesis],
    coefficients: Sequence[str],
    identification: Sequence[Manoeuvre],
    validation: Sequence[Manoeuvre] = (),
    settings: EquationErrorSettings = USUAL,
    told: Callable[[str], None] = lambda _text: None,
) -> EquationErrorDecision:
    """What the declared model lacks.

    Parameters
    ----------
    model : AerodynamicModel
        The declared one, with columns for every candidate's channel.
    free : sequence of Entry
        Its terms that are estimated.
    given : sequence of ActiveEffect
        Declared effects, their numbers held.
    hypotheses : sequence of Hypothesis
        What may be missing.
    coefficients : sequence of str
        Drag or axial force, lift or normal force, moment, as the aircraft file names them.
    identification, validation : sequence of Manoeuvre
        Structure is chosen on all of them; derivatives come from the first alone.
    told : callable
        Hears what enters and leaves, for a journal.
    """
    recordings = read_recordings(identification, validation, settings)
    channels = list(dict.fromkeys(c for r in recordings for c in r.channels))
    every = (*hypotheses, *position_hypotheses(channels))
    asked = [bounded(h, model.constants.mean_chord) for h in every if askable(h)]
    sensors = [h for h in asked if of_sensors(h) and h.where != "q_dot"]
    others = [h for h in asked if not of_sensors(h)]
    start = Point(model, tuple(free), tuple(given))
    kinematic = Frame(recordings, KINEMATIC, settings)
    rules = rules_for(asked, whole_rows(estimate(kinematic, start)), settings.false_alarm, settings.factor_odds)
    proved = _proved(start, kinematic, sensors, rules, told)
    fitted = Frame(recordings, COEFFICIENT, settings)
    whole = replace(fitted, all_fitted=True)
    point = replace(start, effects=tuple(frozen(active) for active in proved.estimate.point.effects))
    begun = Selected(estimate(whole, point), ())
    rules = rules_for(asked, whole_rows(begun.estimate), settings.false_alarm, settings.factor_odds)
    kept, refuted = _standing(_attributed(begun, others, coefficients, rules, told), fitted, told)
    changed = replaced(kept, others, rules)
    if changed is not kept:
        kept, more = _standing(changed, fitted, told)
        refuted = (*refuted, *more)
    point = kept.estimate.point
    lone = estimate(fitted, point, weights_on(kept.estimate, fitted, point))
    completed, covariance = with_proved_faults(proved.estimate, lone)
    before = estimate(fitted, start)
    return EquationErrorDecision(
        findings=findings_of(completed, covariance, (*proved.chosen, *kept.chosen)),
        alternatives=(*alternatives_of(proved, sensors), *alternatives_of(kept, others)),
        before=before,
        completed=completed,
        covariance=covariance,
        before_covariance=corrected_covariance(before.design, before.solution),
        turbulence=turbulence_of(proved.estimate, lone),
        shares=tuple(zip(shares_of(whole, before), shares_of(whole, completed), strict=True)),
        asked=len(asked),
        refuted=refuted,
    )


def whole_rows(found: Estimate) -> int:
    """Samples that an estimate is made of."""
    return int(found.design.target.size)


def _proved(
    start: Point, frame: Frame, sensors: Sequence[Hypothesis], rules: Rules, told: Callable[[str], None]
) -> Selected:
    """The instruments' faults that kinematics prove; coefficients do not undo them."""
    none = Selected(estimate(frame, start), ())
    found = forward(none, frame, rules, sensors, kinematic=True, admitted=recordings_agree, told=told)
    found = replaced(found, sensors, rules, recordings_agree)
    while (weak := _weakest(found.estimate, found.chosen)) is not None:
        found = _left_out(found, weak)
    return found


def _weakest(found: Estimate, chosen: Sequence[Chosen]) -> Chosen | None:
    """The chosen one nearest to none, where that is nearer than the deviations that a final value must keep."""
    rows = findings_of(found, corrected_covariance(found.design, found.solution), chosen)
    weak = [row for row in rows if row.ratio < found.frame.settings.deviations]
    if not weak:
        return None
    label = min(weak, key=lambda row: row.ratio).hypothesis.label
    return next(each for each in chosen if each.hypothesis.label == label)


def _left_out(selected: Selected, gone: Chosen) -> Selected:
    """The structure without one, estimated anew."""
    found = selected.estimate
    lone = estimate(found.frame, without(found.point, gone), found.solution.weights, steps=4)
    return Selected(lone, tuple(each for each in selected.chosen if each is not gone))


def _attributed(
    begun: Selected,
    others: Sequence[Hypothesis],
    coefficients: Sequence[str],
    rules: Rules,
    told: Callable[[str], None],
) -> Selected:
    """What the coefficients lack; with flow separation first where that is worth more."""
    frame = begun.estimate.frame

    def searched(selected: Selected) -> Selected:
        found = forward(selected, frame, rules, others, kinematic=False, coefficients=coefficients, told=told)
        return replaced(found, others, rules)

    found = searched(begun)
    separated = with_separation(begun, frame, rules, coefficients, told)
    if separated is not None:
        separated = searched(separated)
        if worth(separated, rules) > worth(found, rules):
            found = separated
    return found


def worth(selected: Selected, rules: Rules) -> float:
    """Ln L less the price of all that entered."""
    return selected.estimate.log_likelihood - total_price(rules, selected.chosen)


def _standing(
    selected: Selected, fitted: Frame, told: Callable[[str], None]
) -> tuple[Selected, tuple[tuple[str, str, str], ...]]:
    """What keeps its distance from none on the fitted recordings, and lowers no coefficient of an unseen one."""
    refuted: list[tuple[str, str, str]] = []
    while True:
        point = selected.estimate.point
        completed = estimate(fitted, point, weights_on(selected.estimate, fitted, point), steps=4)
        gone = _weakest(completed, selected.chosen)
        if gone is None:
            gone = _refused_one(selected, completed)
            if gone is None:
                return selected, tuple(refuted)
            refuted.append(gone.hypothesis.label)
        told(f"  does not stand: {gone.hypothesis.label}")
        selected = _left_out(selected, gone)


def _refused_one(selected: Selected, completed: Estimate) -> Chosen | None:
    """The chosen one of least gain with which an unseen coefficient is predicted worse than without it."""
    settings = completed.frame.settings
    for each in sorted(selected.chosen, key=lambda each: each.gain):
        bare = estimate(completed.frame, without(completed.point, each), completed.solution.weights, steps=4)
        if refused(selected.estimate.frame, bare, completed, settings.doubt, settings.least_rise):
            return each
    return None


def with_proved_faults(proved: Estimate, found: Estimate) -> tuple[Estimate, Array]:
    """The coefficients' estimate with the instruments' numbers among its unknowns, and the covariance of all.

    The numbers stay where kinematics put them: gusts and unmodelled forces would pull them elsewhere. Their uncertainty
    is passed on to the derivatives to first order.
    """
    point = replace(found.point, effects=(*proved.point.effects, *found.point.effects[len(proved.point.effects) :]))
    free = [(i, k) for i, active in enumerate(proved.point.effects) for k in range(len(active.values))]
    covariance = corrected_covariance(found.design, found.solution)
    if not free:
        return replace(found, point=point), covariance
    linear = [p for p, unknown in enumerate(found.design.unknowns) if unknown[0] != "effect"]
    bare = design_of(found.frame.segments(found.point), found.frame.settings)
    columns = effect_columns(found.frame, bare, found.solution.values[linear], point, free)
    white = whiten(found.design, columns, found.solution.weights)
    answers = -found.solution.covariance @ found.solution.slopes.T @ white
    places = [proved.design.unknowns.index(("effect", i, k)) for i, k in free]
    kinematic = corrected_covariance(proved.design, proved.solution)[np.ix_(places, places)]
    solution = replace(
        found.solution,
        values=np.append(found.solution.values, proved.solution.values[places]),
        covariance=_joint(found.solution.covariance, answers, proved.solution.covariance[np.ix_(places, places)]),
        slopes=np.column_stack([found.solution.slopes, white]),
    )
    design = found.design.beside(columns, [("effect", i, k) for i, k in free])
    return Estimate(found.frame, point, design, solution), _joint(covariance, answers, kinematic)


def _joint(own: Array, answers: Array, given: Array) -> Array:
    """Covariance of some unknowns that answer others, and of those others."""
    return np.block([[own + answers @ given @ answers.T, answers @ given], [given @ answers.T, given]])


def findings_of(found: Estimate, covariance: Array, chosen: Sequence[Chosen]) -> tuple[EvidenceFinding, ...]:
    """The chosen with their numbers and corrected deviations, those of kinematics first, then by gain."""
    deviations = np.sqrt(np.diag(covariance))
    place = {unknown: n for n, unknown in enumerate(found.design.unknowns)}
    rows = []
    for each in chosen:
        witness = "kinematics" if each.kinematic else "coefficients"
        hypothesis = each.hypothesis
        if hypothesis.entries:
            (entry,) = hypothesis.entries
            n = place.get(("term", entry))
            value = found.point.model.value(entry)
            error = float(deviations[n]) if n is not None else np.inf
            rows.append(EvidenceFinding(hypothesis, None, value, error, (error,), each.gain, witness))
            continue
        for i, active in enumerate(found.point.effects):
            if active.values and active.name == hypothesis.effects[0].name and active.log == hypothesis.effects[0].log:
                errors = tuple(float(deviations[place["effect", i, k]]) for k in range(len(active.values)))
                rows.append(
                    EvidenceFinding(hypothesis, active, active.values[0], errors[0], errors, each.gain, witness)
                )
                break
    return tuple(sorted(rows, key=lambda row: (row.witness != "kinematics", -row.gain)))
