"""What the declared model lacks, by kinematics first and coefficients second, with all recordings in one likelihood."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from aerosid.effects import ActiveEffect
from aerosid.effects.hypothesis import Hypothesis
from aerosid.equation_error.alternatives import Alternative, alternatives_of, replaced
from aerosid.equation_error.candidates import bounded, of_sensors, position_hypotheses
from aerosid.equation_error.channels import EQUATIONS, KINEMATIC
from aerosid.equation_error.deviations import corrected_covariance
from aerosid.equation_error.estimate import Estimate, Frame, estimate, weights_on
from aerosid.equation_error.gusts import gust_share, gusts_from_lift
from aerosid.equation_error.points import Point
from aerosid.equation_error.recording import Recording, read_recordings
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
    shares: tuple[tuple[Share, Share], ...]
    asked: int
    refuted: tuple[tuple[str, str, str], ...]


FOLLOWED = frozenset({("sensor_scale", "alpha"), ("sensor_scale", "a_z"), ("sensor_scale", "V")})
"""Faults that a flight in strong gusts cannot show: the aircraft follows each gust in proportion to it."""


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
    asked = [bounded(h) for h in (*hypotheses, *position_hypotheses(channels)) if askable(h)]
    start = Point(model, tuple(free), tuple(given))
    chosen = _chosen(start, recordings, asked, coefficients, settings, told)
    gusts = gusts_from_lift(chosen.estimate)
    fitted = Frame(recordings, EQUATIONS, settings, gusts=gusts)
    whole = Frame(recordings, EQUATIONS, settings, all_fitted=True, gusts=gusts)
    before = estimate(fitted, start)
    kept, refuted = _standing(chosen, fitted, whole, settings, told)
    rules = rules_for(asked, whole_rows(kept.estimate), settings.false_alarm, settings.factor_odds)
    changed = replaced(kept, asked, rules)
    if changed is not kept:
        kept, more = _standing(changed, fitted, whole, settings, told)
        refuted = (*refuted, *more)
    point = kept.estimate.point
    completed = estimate(fitted, point, weights_on(kept.estimate, fitted, point))
    findings = findings_of(completed, kept.chosen)
    return EquationErrorDecision(
        findings=findings,
        alternatives=alternatives_of(kept, asked),
        before=before,
        completed=completed,
        covariance=corrected_covariance(completed.design, completed.solution),
        before_covariance=corrected_covariance(before.design, before.solution),
        shares=tuple(zip(shares_of(whole, before), shares_of(whole, completed), strict=True)),
        asked=len(asked),
        refuted=refuted,
    )


def whole_rows(found: Estimate) -> int:
    """Samples that an estimate is made of."""
    return int(found.design.target.size)


def _chosen(
    start: Point,
    recordings: tuple[Recording, ...],
    asked: Sequence[Hypothesis],
    coefficients: Sequence[str],
    settings: EquationErrorSettings,
    told: Callable[[str], None],
) -> Selected:
    """Kinematics first, then coefficients on all recordings; with flow separation first where that is worth more."""
    others = [h for h in asked if not of_sensors(h)]
    declared = estimate(Frame(recordings, EQUATIONS, settings, all_fitted=True), start)
    sensors = [h for h in asked if of_sensors(h) and h.where != "q_dot"]
    if gust_share(declared) > settings.gust_share:
        sensors = [h for h in sensors if (h.kind, h.where) not in FOLLOWED]
    frame = Frame(recordings, KINEMATIC, settings, gusts=gusts_from_lift(declared))
    base = estimate(frame, start)
    rules = rules_for(asked, whole_rows(base), settings.false_alarm, settings.factor_odds)
    first = forward(Selected(base, ()), frame, rules, sensors, kinematic=True, admitted=recordings_agree, told=told)
    first = replaced(first, sensors, rules)
    whole = Frame(recordings, EQUATIONS, settings, all_fitted=True, gusts=frame.gusts)
    full = estimate(whole, first.estimate.point)
    whole = replace(whole, gusts=gusts_from_lift(full))
    full = estimate(whole, full.point)
    rules = rules_for(asked, whole_rows(full), settings.false_alarm, settings.factor_odds)
    begun = Selected(full, first.chosen)

    def searched(selected: Selected) -> Selected:
        found = forward(selected, whole, rules, others, kinematic=False, coefficients=coefficients, told=told)
        return replaced(found, (*sensors, *others), rules)

    found = searched(begun)
    separated = with_separation(begun, whole, rules, coefficients, told)
    if separated is not None:
        separated = searched(separated)
        if worth(separated, rules) > worth(found, rules):
            found = separated
    return found


def worth(selected: Selected, rules: Rules) -> float:
    """Ln L less the price of all that entered."""
    return selected.estimate.log_likelihood - total_price(rules, selected.chosen)


def _standing(
    selected: Selected,
    fitted: Frame,
    whole: Frame,
    settings: EquationErrorSettings,
    told: Callable[[str], None],
) -> tuple[Selected, tuple[tuple[str, str, str], ...]]:
    """What keeps its distance from none on the fitted recordings, and lowers no coefficient of an unseen one."""
    refuted: list[tuple[str, str, str]] = []
    while True:
        point = selected.estimate.point
        completed = estimate(fitted, point, weights_on(selected.estimate, fitted, point), steps=4)
        weights = completed.solution.weights
        rows = [row for row in findings_of(completed, selected.chosen) if row.witness == "coefficients"]
        weak = [row for row in rows if row.ratio < settings.deviations]
        label = min(weak, key=lambda row: row.ratio).hypothesis.label if weak else None
        if label is None:
            for row in sorted(rows, key=lambda row: row.gain):
                each = next(c for c in selected.chosen if c.hypothesis is row.hypothesis)
                bare = estimate(fitted, without(completed.point, each), weights, steps=4)
                if refused(whole, bare, completed, settings.doubt, settings.least_rise):
                    label = row.hypothesis.label
                    refuted.append(label)
                    break
        if label is None:
            return selected, tuple(refuted)
        told(f"  does not stand: {label} {[(r.hypothesis.label, round(r.ratio, 1)) for r in rows]} refuted {refuted}")
        gone = next(each for each in selected.chosen if each.hypothesis.label == label)
        lone = estimate(whole, without(selected.estimate.point, gone), selected.estimate.solution.weights, steps=4)
        selected = Selected(lone, tuple(each for each in selected.chosen if each is not gone))


def findings_of(found: Estimate, chosen: Sequence[Chosen]) -> tuple[EvidenceFinding, ...]:
    """The chosen with their numbers and corrected deviations, those of kinematics first, then by gain."""
    deviations = np.sqrt(np.diag(corrected_covariance(found.design, found.solution)))
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
