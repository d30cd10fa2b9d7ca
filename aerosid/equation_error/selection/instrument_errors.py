"""Flight-path reconstruction: sensor faults estimated from the kinematic equations of all recordings jointly."""

from __future__ import annotations

import functools
import itertools
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from aerosid.effects import ActiveEffect, PositionEffect
from aerosid.effects.hypothesis import Hypothesis
from aerosid.effects.sensor_position import farthest_place
from aerosid.equation_error.equations.channels import COEFFICIENT, KINEMATIC, VANE_OF
from aerosid.equation_error.equations.points import Point, Unknown
from aerosid.equation_error.equations.recording import read_recordings
from aerosid.equation_error.regression.design import whiten
from aerosid.equation_error.regression.estimate import (
    Estimate,
    Frame,
    effect_columns,
    estimate,
    linear_values,
    numbers_of,
)
from aerosid.equation_error.regression.standard_errors import corrected_covariance
from aerosid.equation_error.selection.alternatives import replaced
from aerosid.equation_error.selection.candidates import (
    bounded,
    of_sensors,
    position_hypotheses,
    told_apart,
    within_reach,
)
from aerosid.equation_error.selection.instrument_error_choice import CoefficientsBeside, chosen_with_coefficients
from aerosid.equation_error.selection.joint_time_delays import JointTiming, values_of
from aerosid.equation_error.selection.pairwise_selection import with_pair
from aerosid.equation_error.selection.penalties import Rules, rules_for
from aerosid.equation_error.selection.redundancy import at_one_distance
from aerosid.equation_error.selection.stepwise import forward_steps, names_of, recordings_agree
from aerosid.equation_error.selection.structure import Chosen, Selected, left_out
from aerosid.equation_error.selection.time_origin import with_late_channels
from aerosid.equation_error.selection.wald_tests import weakest
from aerosid.equation_error.settings import EquationErrorSettings
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.flight_model.aerodynamics import AerodynamicModel, Entry
from aerosid.flight_model.axes import LONGITUDINAL

Array = NDArray[np.float64]

ANGULAR_ACCELERATIONS = ("p_dot", "q_dot", "r_dot")
"""Channels that no equation compares: the moments are those of the rates' derivatives."""

USUAL = EquationErrorSettings()
"""The settings of a loop unless told otherwise."""

TAUTOLOGICAL = frozenset({"C_X", "C_Z", "C_L", "C_D"})
"""Coefficients in which a term of alphadot says no more than a_z = V (alphadot - q), whatever the aerodynamics."""


@dataclass(frozen=True)
class ProvedFaults:
    """Sensor faults proved by the kinematic equations of a set of recordings.

    Attributes
    ----------
    start : Point
        The declared model, as the coefficients' search begins with it.
    asked : tuple of Hypothesis
        Everything that may be missing, with its limits.
    declared : Estimate
        The kinematic equations with no fault of any instrument but what is declared.
    selected : Selected
        The faults, estimated from the kinematic equations.
    rules : Rules
        By which they entered, prices shared among all that are asked.
    """

    start: Point
    asked: tuple[Hypothesis, ...]
    declared: Estimate
    selected: Selected
    rules: Rules

    @property
    def noise_ratio(self) -> float:
        """The largest kinematic residual over what the noise that successive samples show leaves in the band, if white.

        About one where white noise is all that is left; moving air, coloured noise and recordings that were filtered
        afterwards leave more. Of white noise each frequency holds the same, so that a band of n of N has the square
        root of n/N of its deviation.
        """
        found = self.selected.estimate
        ratios = []
        for s, (place, channel) in enumerate(found.design.segments):
            recording, left = found.frame.recordings[place], found.solution.residuals[found.design.rows(s)]
            noise = float(recording.manoeuvre.noise[recording.manoeuvre.row(channel)])
            in_band = noise * float(np.sqrt(left.size / recording.time.size))
            ratios.append(float(np.std(left)) / max(in_band, 1e-300))
        return max(ratios, default=0.0)


def askable(hypothesis: Hypothesis) -> bool:
    """Whether the equations can judge a hypothesis as it stands; sudden changes are looked for by the engine itself."""
    if hypothesis.time is not None or hypothesis.where in ANGULAR_ACCELERATIONS:
        return False
    return not any(c in TAUTOLOGICAL and "alpha_dot_hat" in term.variables for c, term in hypothesis.entries)


def beyond_the_wind(found: Estimate, hypothesis: Hypothesis) -> bool:
    """Whether the last zero of a vane is further off than the mean that gusts may have over a record.

    By the deviation of the mean of a first-order autoregression with the residual's size and memory.
    """
    vanes = set(VANE_OF.values())
    if hypothesis.kind != "sensor_bias" or hypothesis.where not in vanes:
        return True
    spread = 0.0
    for s, (_, channel) in enumerate(found.design.segments):
        if channel == hypothesis.where:
            left = found.solution.residuals[found.design.rows(s)]
            left = left - left.mean()
            memory = float(left[1:] @ left[:-1]) / max(float(left @ left), 1e-300)
            inflated = (1.0 + memory) / max(1.0 - memory, 1e-6)
            spread = max(spread, float(np.std(left)) * np.sqrt(min(inflated / left.size, 1.0)))
    (value, *_) = found.point.effects[-1].values
    return abs(value) > found.frame.settings.deviations * spread


def prove_faults(
    model: AerodynamicModel,
    free: Sequence[Entry],
    given: Sequence[ActiveEffect],
    hypotheses: Sequence[Hypothesis],
    identification: Sequence[Manoeuvre],
    validation: Sequence[Manoeuvre] = (),
    settings: EquationErrorSettings = USUAL,
    told: Callable[[str], None] = lambda _text: None,
    length: float | None = None,
) -> ProvedFaults | None:
    """Select and estimate sensor faults from the kinematic equations; None where a recording is too short.

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
    identification, validation : sequence of Manoeuvre
        Structure is chosen on all of them; derivatives come from the first alone.
    told : callable
        Hears what enters and leaves, for a journal.
    length : float, optional
        Of the aircraft, m: how far from the centre of gravity a sensor can sit; by default a multiple of its chord.
    """
    recordings = read_recordings(identification, validation, settings)
    if any(recording.time_in_band.size < settings.fewest for recording in recordings):
        return None
    channels = list(dict.fromkeys(c for r in recordings for c in r.channels))
    told_already = {told_apart(hypothesis) for hypothesis in hypotheses}
    every = (*hypotheses, *(h for h in position_hypotheses(channels) if told_apart(h) not in told_already))
    asked = tuple(bounded(h, model.constants.mean_chord) for h in every if askable(h))
    start = Point(model, tuple(free), tuple(given))
    frame = Frame(recordings, KINEMATIC, settings)
    beside = CoefficientsBeside(Frame(recordings, COEFFICIENT, settings, all_fitted=True), start)
    none = begun = Selected(estimate(frame, start), ())
    while True:
        samples, alarm = none.estimate.design.target.size, settings.alarm(model.axes)
        rules = rules_for(asked, samples, alarm, settings.factor_odds)
        found, passed = _searched(begun, asked, rules, beside, lambda found: _outside(found, length), told)
        outside = _outside(found, length)
        if not outside:
            break
        told(f"  not on this aircraft: {[hypothesis.label for hypothesis in outside]}")
        names = set(map(told_apart, outside))
        asked = tuple(h for h in asked if told_apart(h) not in names)
        # What entered before the first of them would enter again.
        (*_, begun) = none, *itertools.takewhile(functools.partial(_has_none, names), passed)
    # Alternatives are held to the aircraft's size from the beginning: a search may pass beyond it.
    asked = tuple(within_reach(h, model.constants.mean_chord, length) for h in asked)
    return ProvedFaults(start, asked, none.estimate, found, rules)


def _searched(
    begun: Selected,
    asked: Sequence[Hypothesis],
    rules: Rules,
    beside: CoefficientsBeside,
    outside: Callable[[Selected], list[Hypothesis]],
    told: Callable[[str], None],
) -> tuple[Selected, list[Selected]]:
    """The faults that pay their price in the kinematic equations, each in its likeliest form, those that stand.

    And the structures that forward selection went through; it is the end where one of its faults is `outside`.
    """
    frame, model = begun.estimate.frame, begun.estimate.point.model
    settings = frame.settings
    sensors = [h for h in asked if of_sensors(h)]

    def admitted(estimated: Estimate, hypothesis: Hypothesis) -> bool:
        agreed = recordings_agree(estimated, hypothesis)
        if model.axes == LONGITUDINAL:
            return agreed
        return agreed and beyond_the_wind(estimated, hypothesis) and beside.admit(estimated, hypothesis)

    steps = functools.partial(
        forward_steps, rules=rules, hypotheses=sensors, kinematic=True, most=settings.most, admitted=admitted, told=told
    )
    passed = list(steps(begun))
    found = passed[-1]
    met = {names_of(found)}
    while (paired := with_pair(found, rules, sensors, admitted, told)) is not None:
        *_, found = steps(paired)
        if names_of(found) in met:  # a pair that pays and does not stand would come again and again
            break
        met.add(names_of(found))
    if outside(found):
        return found, passed
    found = replaced(found, sensors, rules, admitted)
    found = with_late_channels(found, sensors, rules, admitted, told)
    if begun.estimate.point.free:
        alike = at_one_distance if model.axes == LONGITUDINAL else _any_fault
        found = chosen_with_coefficients(found, sensors, rules, beside, alike)
    while (weak := weakest(found.estimate, found.chosen)) is not None:
        found = left_out(found, weak)
    return found, [begun]


def _has_none(names: Collection[tuple[str, ...]], selected: Selected) -> bool:
    """Whether a structure has none of some hypotheses."""
    return not any(told_apart(each.hypothesis) in names for each in selected.chosen)


def _outside(found: Selected, length: float | None) -> list[Hypothesis]:
    """The chosen sensors' places that are not on the aircraft."""
    return [each.hypothesis for each in found.chosen if _is_outside(found, each, length)]


def _is_outside(found: Selected, each: Chosen, length: float | None) -> bool:
    """Whether a chosen sensor's place is further from the centre of gravity than the aircraft reaches."""
    names = {active.name for active in each.hypothesis.effects if isinstance(active.effect, PositionEffect)}
    chord = found.estimate.point.model.constants.mean_chord
    places = [active for active in found.estimate.point.effects if active.name in names]
    return any(float(np.hypot.reduce(at.values)) > farthest_place(at.effect.where, chord, length) for at in places)


def _any_fault(_chosen: Hypothesis, _other: Hypothesis) -> bool:
    return True


def on_fitted(selected: Selected) -> Selected:
    """The faults re-estimated from the fitted recordings alone: zero offsets differ from flight to flight."""
    found = selected.estimate
    fitted = tuple(recording for recording in found.frame.recordings if recording.fitted)
    if len(fitted) == len(found.frame.recordings):
        return selected
    return Selected(estimate(replace(found.frame, recordings=fitted), found.point), selected.chosen)


def with_proved_faults(
    faults: JointTiming, found: Estimate, confirmed: Collection[Unknown] = ()
) -> tuple[Estimate, Array]:
    """The coefficients' estimate with the instruments' numbers among its unknowns, and the covariance of all.

    Biases, scales and places stay where kinematics put them: gusts and unmodelled forces would pull them elsewhere.
    The uncertainty of all is passed on to the derivatives to first order. `confirmed`: unknowns that another recording
    shows as well.
    """
    point = replace(found.point, effects=(*faults.effects, *found.point.effects[len(faults.effects) :]))
    free = numbers_of(faults.effects)
    covariance = corrected_covariance(found.design, found.solution, confirmed)
    if not free:
        return replace(found, point=point), covariance
    columns = effect_columns(found.frame, linear_values(found.design, found.solution), point, free)
    white = whiten(found.design, columns, found.solution.weights)
    answers = -found.solution.covariance @ found.solution.slopes.T @ white
    solution = replace(
        found.solution,
        values=np.append(found.solution.values, values_of(faults.effects)),
        covariance=_joint(found.solution.covariance, answers, faults.covariance),
        slopes=np.column_stack([found.solution.slopes, white]),
    )
    design = found.design.beside(columns, [("effect", i, k) for i, k in free])
    return Estimate(found.frame, point, design, solution), _joint(covariance, answers, faults.covariance)


def _joint(own: Array, answers: Array, given: Array) -> Array:
    """Covariance of some unknowns that answer others, and of those others."""
    return np.block([[own + answers @ given @ answers.T, answers @ given], [given @ answers.T, given]])
