"""Kinematic evidence of instrument errors that are significant only by kinematic and coefficient equations jointly.

In moving air the time delay of a vane, the bias of a pitot tube or the position of a lateral accelerometer is a small
part of the residual of its kinematic equation, and a large part of the residuals of the coefficients. Coefficients
alone cannot identify an instrument error: a term may have the same signature. Where kinematics support the error too,
with the same parameters, the likelihoods of both are multiplied (independent measurements; Klein & Morelli, Aircraft
System Identification, eq. 5.31). Five errors are candidates without kinematic support, and must agree with the
kinematics. The bias of airspeed acts on every coefficient by one parameter, where terms would need one each. So does a
late vane in gusts, in pitch alone: all forces and moments answer the gusts that it reads late, and where they lag it
looks early, not late. A late lateral or longitudinal accelerometer is a small part of the path integrated from it, and
all of its force is late, by gusts and controls too: a term of the yaw or pitch rate stands for the motion's part alone.
A position of the lateral accelerometer acts on the side force by angular accelerations, of which no term is a function:
several terms of the moments' would be needed, and gusts on the vane hide it in the kinematics of a large aircraft. So
does one of the longitudinal accelerometer above or below its place on the axial force, in pitch alone too: a displaced
centre of gravity, which kinematics do not show either, would be named in its place. Where no vane measures sideslip the
lateral one is estimated from the coefficients alone: there the path is the accelerometer's own. So is a time delay of
the airspeed where no accelerometer gives it a path to be compared with: the axial force is then formed from its rate.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

import numpy as np

from aerosid.compiled.cores import mapped
from aerosid.effects.hypothesis import Hypothesis
from aerosid.effects.kinds import PositionEffect
from aerosid.equation_error.equations.channels import AIRSPEED, MEASURED_BY, VANE_OF
from aerosid.equation_error.equations.recording import has_inertial_path
from aerosid.equation_error.regression.estimate import estimate
from aerosid.equation_error.regression.standard_errors import corrected_covariance
from aerosid.equation_error.selection.candidate_scores import score_candidates
from aerosid.equation_error.selection.candidates import (
    distinct_name,
    effect_candidates,
    linearised,
    with_hypothesis,
    within_limits,
)
from aerosid.equation_error.selection.joint_errors import DELAY_KINDS, SIDE_FORCE
from aerosid.equation_error.selection.penalties import KinematicEvidence, Name
from aerosid.equation_error.selection.redundancy import non_redundant
from aerosid.equation_error.selection.structure import SelectedStructure
from aerosid.flight_model.axes import ACCELEROMETERS, LONGITUDINAL, Axes

LEAST_DELAY = 0.15
"""Design: least delay of the airspeed, s, that the axial force shows by itself. A late airspeed adds nearly a part of
C_X alpha, and the noise of the air data takes as much as a delay of .02 s adds, of one aircraft .1 s (flights of
benchmarks/turbulent_flights.py without accelerometers in calm air, seeds 940000 to 960000)."""

LEAST_SHOWN_DELAY = 0.02
"""Design: least delay of a flow angle or an accelerometer, s, that coefficients show without kinematics; the filters of
a recorder's channels may differ by as much. Lift or a moment that lags the flow angle makes the vane look early; a side
force that lags the sideslip, by the sidewash at the fin, makes its accelerometer look late, by less than that."""

AXIAL_FORCE = "C_X"
"""The coefficient affected by the height of its accelerometer."""

PROMISING = 0.5
"""Numerical: fraction of the required gain in ln L that a candidate must have to first order to be fitted."""


def kinematic_evidence(identified: SelectedStructure, sensors: Sequence[Hypothesis]) -> dict[Name, KinematicEvidence]:
    """Kinematic estimates of instrument errors in addition to the identified ones, by distinct name."""
    base, support = identified.estimate, identified.estimate.problem.settings.support
    gain_required = 0.5 * support**2
    axes = base.point.model.axes
    timed = {each.hypothesis.where for each in identified.chosen if each.hypothesis.kind in DELAY_KINDS}
    others = [h for h in sensors if h.kind not in DELAY_KINDS or h.where not in timed]
    eligible = non_redundant([h for h in others if _is_eligible(h, axes)], identified.chosen)
    candidates = effect_candidates(base.problem, base, eligible)
    has_path = all(map(has_inertial_path, base.problem.recordings))
    best: dict[Name, int] = {}
    gains = score_candidates(base, candidates).gains
    for n in np.argsort(-gains):
        if gains[n] >= PROMISING * gain_required or needs_no_support(candidates[n].hypothesis, axes, has_path):
            best.setdefault(distinct_name(candidates[n].hypothesis), int(n))

    def fitted(n: int) -> KinematicEvidence | None:
        if not candidates[n].columns.any():
            return _none_of(candidates[n].hypothesis)
        trial, hypothesis = linearised(base, candidates[n])
        is_of_force = _is_timing_of_force(hypothesis)
        if affects_all_coefficients(hypothesis) or is_of_force:
            hypothesis = _without_limits(hypothesis)
        found = estimate(base.problem, with_hypothesis(base.point, hypothesis), trial.weights, steps=5)
        active, gain = found.point.effects[-1], found.gain_over(base)
        covariance = corrected_covariance(found.design, found.solution)
        covariance = covariance[-len(active.values) :, -len(active.values) :]
        distance = active.values[0] - active.effect.parameters[0].null
        # Time delays are positive; a position error may lie along any axis, and its gain is that of all axes.
        distance = distance if hypothesis.kind in DELAY_KINDS else abs(distance)
        is_significant = _is_lateral_position(hypothesis) or distance > support * float(np.sqrt(covariance[0, 0]))
        is_significant = is_significant and gain > gain_required
        by_coefficients = _is_timing_of_a_vane(hypothesis) or is_of_force
        least = LEAST_SHOWN_DELAY if by_coefficients and not is_significant else -np.inf
        if not (within_limits(found, hypothesis) and (is_significant or needs_no_support(hypothesis, axes, has_path))):
            return None
        # A term may look like a delayed vane: a time delay must reach its penalty in the coefficients by itself.
        credit = 0.0 if hypothesis.kind in DELAY_KINDS else gain
        if is_of_force:
            least_variance = _least_variance(distance, found.log_likelihood - base.log_likelihood)
            covariance = np.maximum(covariance, least_variance)
        return KinematicEvidence(active.values, covariance, gain, credit, least)

    fits = mapped(fitted, list(best.values()))
    evidence = {name: fit for name, fit in zip(best, fits, strict=True) if fit is not None}
    return _fewest_axes(evidence, gain_required) | _unobserved(identified, eligible)


def _least_variance(delay: float, gain: float) -> float:
    """Variance, s^2, of a delay that noise may stand for, from its gain in ln L, each structure with its own colours.

    That gain is half the square of the delay over its standard error where noise does not. The slow drift of the height
    that a late lateral accelerometer causes looks like noise of another colour: a jet's was .167 +- .019 s late, nine
    standard errors, for a gain of 2, and .1 s in truth.
    """
    return delay**2 / (2.0 * max(gain, 0.0) + 1.0)


def _without_limits(hypothesis: Hypothesis) -> Hypothesis:
    """The hypothesis without limits of usable instruments.

    Kinematics may put its value beyond them, and yet not contradict a value within.
    """
    (active,) = hypothesis.effects
    parameters = tuple(replace(each, lowest=-np.inf, highest=np.inf) for each in active.effect.parameters)
    return replace(hypothesis, effects=(replace(active, effect=replace(active.effect, parameters=parameters)),))


def _unobserved(identified: SelectedStructure, eligible: Sequence[Hypothesis]) -> dict[Name, KinematicEvidence]:
    """Errors on which kinematics contain no information."""
    compared = {channel for _, channel in identified.estimate.design.segments}
    found = {}
    for hypothesis in eligible:
        if _is_unobserved(hypothesis, compared):
            found[distinct_name(hypothesis)] = _none_of(hypothesis)
    return found


def _none_of(hypothesis: Hypothesis) -> KinematicEvidence:
    """What kinematics tell of an error that is in none of their equations: nothing."""
    values = hypothesis.effects[0].values
    least = LEAST_DELAY if hypothesis.kind in DELAY_KINDS else -np.inf
    return KinematicEvidence(values, np.diag(np.full(len(values), np.inf)), 0.0, 0.0, least)


def _is_unobserved(hypothesis: Hypothesis, compared: Collection[str]) -> bool:
    """Positions of the lateral accelerometer without a sideslip vane, and delays of the airspeed without its path."""
    if hypothesis.kind in DELAY_KINDS:
        return hypothesis.where == AIRSPEED and AIRSPEED not in compared
    return hypothesis.where == MEASURED_BY[SIDE_FORCE] and VANE_OF[SIDE_FORCE] not in compared


def needs_no_support(hypothesis: Hypothesis, axes: Axes, has_path: bool) -> bool:
    """Whether coefficients alone may show an error that kinematics do not contradict: no few terms stand for it.

    In pitch alone a position of the normal accelerometer is told from a late vane by little else than kinematics.
    `has_path`: whether all records have accelerometers; without, the forces are those of the flow angle's own rate, and
    answer no gusts.
    """
    is_few = hypothesis.parameters == 1 or hypothesis.where == MEASURED_BY[SIDE_FORCE]
    is_place = is_few and _is_position_of_accelerometer(hypothesis)
    is_told_apart = axes != LONGITUDINAL or hypothesis.where == MEASURED_BY[AXIAL_FORCE]
    told_by_gusts = _is_timing_of_a_vane(hypothesis) and has_path and axes == LONGITUDINAL
    told_by_force = _is_timing_of_force(hypothesis)
    return affects_all_coefficients(hypothesis) or (is_place and is_told_apart) or told_by_gusts or told_by_force


def affects_all_coefficients(hypothesis: Hypothesis) -> bool:
    """Whether an error scales every coefficient by one parameter, as an error of dynamic pressure does and no term."""
    return (hypothesis.kind, hypothesis.where) == ("sensor_bias", "V")


def _is_eligible(hypothesis: Hypothesis, axes: Axes) -> bool:
    """Whether an error is a candidate of the coefficient equations.

    Where sideslip is compared, only time delays and the positions of accelerometers and of its vane: wind affects the
    rest.
    """
    placed = _is_position_of_accelerometer(hypothesis) or _is_lateral_position(hypothesis)
    return axes == LONGITUDINAL or hypothesis.kind in DELAY_KINDS or placed


def _fewest_axes(evidence: Mapping[Name, KinematicEvidence], margin: float) -> dict[Name, KinematicEvidence]:
    """Of each sensor the position error along the fewest axes that is supported within a `margin` in ln L.

    Where none is supported, that along each axis: the coefficients choose.
    """
    retained: dict[Name, KinematicEvidence] = {}
    for name, row in sorted(evidence.items(), key=lambda item: (len(item[1].values), -item[1].gain)):
        of_sensor = [other for known, other in retained.items() if known[:3] == name[:3]]
        if all(row.gain > other.gain + margin or max(row.gain, other.gain) <= margin for other in of_sensor):
            retained[name] = row
    return retained


def _is_timing_of_a_vane(hypothesis: Hypothesis) -> bool:
    """Whether a hypothesis is a delay or lag of a flow angle."""
    return hypothesis.kind in DELAY_KINDS and hypothesis.where in VANE_OF.values()


def _is_timing_of_force(hypothesis: Hypothesis) -> bool:
    """Whether a hypothesis is a delay or lag of the lateral or longitudinal accelerometer."""
    return hypothesis.kind in DELAY_KINDS and hypothesis.where in (MEASURED_BY[SIDE_FORCE], MEASURED_BY[AXIAL_FORCE])


def _is_lateral_position(hypothesis: Hypothesis) -> bool:
    """Whether a hypothesis is a position error of the lateral accelerometer or of the sideslip vane."""
    where = (MEASURED_BY[SIDE_FORCE], VANE_OF[SIDE_FORCE])
    return hypothesis.where in where and isinstance(hypothesis.effects[0].effect, PositionEffect)


def _is_position_of_accelerometer(hypothesis: Hypothesis) -> bool:
    """Whether a hypothesis is a position error of an accelerometer, or of all in one unit."""
    (active, *_) = hypothesis.effects
    return isinstance(active.effect, PositionEffect) and any(map(active.effect.moves, ACCELEROMETERS))
