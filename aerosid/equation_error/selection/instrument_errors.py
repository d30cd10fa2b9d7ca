"""Flight-path reconstruction: instrument errors identified from the kinematic equations of all records jointly."""

from __future__ import annotations

import functools
import itertools
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from aerosid.effects import ActiveEffect, PositionEffect
from aerosid.effects.hypothesis import Hypothesis
from aerosid.effects.sensor_position import farthest_place
from aerosid.equation_error.equations.channels import AIRSPEED, HEIGHT, KINEMATIC, VANE_OF
from aerosid.equation_error.equations.points import Point, Unknown
from aerosid.equation_error.equations.recording import has_inertial_path
from aerosid.equation_error.equations.regular_recordings import read_recordings
from aerosid.equation_error.equations.sensors import position
from aerosid.equation_error.regression.design import compared_columns
from aerosid.equation_error.regression.estimate import Estimate, effect_sensitivities, estimate, linear_values
from aerosid.equation_error.regression.parameter_limits import free_parameters
from aerosid.equation_error.regression.problem import RegressionProblem
from aerosid.equation_error.regression.related_problems import coefficients_of_all
from aerosid.equation_error.regression.standard_errors import corrected_covariance
from aerosid.equation_error.selection.alternatives import with_replacements
from aerosid.equation_error.selection.bias_or_scale import with_either_begun
from aerosid.equation_error.selection.calibration import exceeds_calibration
from aerosid.equation_error.selection.candidates import (
    distinct_name,
    is_instrument_error,
    position_hypotheses,
    with_aircraft_limits,
    with_plausible_limits,
)
from aerosid.equation_error.selection.dead_time import is_causal
from aerosid.equation_error.selection.instrument_error_choice import CoefficientCheck, choose_by_coefficients
from aerosid.equation_error.selection.joint_errors import DELAY, JointErrors, free_values
from aerosid.equation_error.selection.pairwise_selection import add_pair
from aerosid.equation_error.selection.penalties import SelectionCriterion, criterion_for
from aerosid.equation_error.selection.redundancy import share_a_distance
from aerosid.equation_error.selection.stepwise import forward_selection, recordings_agree, structure_key
from aerosid.equation_error.selection.structure import SelectedEffect, SelectedStructure, structure_without
from aerosid.equation_error.selection.time_origin import with_other_time_origin
from aerosid.equation_error.selection.wald_tests import least_significant
from aerosid.equation_error.settings import EquationErrorSettings
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.flight_model.aerodynamics import AerodynamicModel, Entry
from aerosid.flight_model.axes import LONGITUDINAL
from aerosid.signals.autoregression import variance_of_mean

Array = NDArray[np.float64]

ANGULAR_ACCELERATIONS = ("p_dot", "q_dot", "r_dot")
"""Channels that no equation compares: moments are obtained from the derivatives of the angular rates."""

USUAL = EquationErrorSettings()
"""Default settings of a loop."""

TAUTOLOGICAL = frozenset({"C_X", "C_Z", "C_L", "C_D"})
"""Coefficients in which a term of alphadot only restates a_z = V (alphadot - q), whatever the aerodynamics."""


@dataclass(frozen=True)
class InstrumentErrors:
    """Instrument errors identified by the kinematic equations of a set of records.

    Attributes
    ----------
    start : Point
        The declared model, the starting point of the search in the coefficients.
    hypotheses : tuple of Hypothesis
        All hypotheses, with their limits.
    declared : Estimate
        The kinematic equations with the declared instrument errors only.
    selected : SelectedStructure
        The instrument errors, estimated from the kinematic equations.
    criterion : SelectionCriterion
        By which they were selected, the prior odds shared among all hypotheses.
    """

    start: Point
    hypotheses: tuple[Hypothesis, ...]
    declared: Estimate
    selected: SelectedStructure
    criterion: SelectionCriterion

    @property
    def noise_ratio(self) -> float:
        """The largest kinematic residual over the in-band noise predicted from successive differences, if white.

        About one where white noise is all that is left; moving air, coloured noise and records filtered after the
        flight leave more.
        """
        return max(self._noise_ratios, default=0.0)

    @property
    def least_noise_ratio(self) -> float:
        """The least of the same: about one in white noise even where one instrument is faulty, more behind a recorder.

        A recorder filters or colours all channels, and a fault leaves more in those alone that it reaches.
        """
        return min(self._noise_ratios, default=0.0)

    @cached_property
    def _noise_ratios(self) -> list[float]:
        """Those of each channel and record.

        White noise has the same power at each frequency, so that a band of n of N samples has the square root of n/N of
        its standard deviation. N counts interpolated samples as well, which makes the ratio of a coarse record larger
        by the square root of its refinement: there the differences of neighbours contain gusts, and hide them. With its
        own samples alone the likelihood decided in gusts (benchmarks/field_detection.py, seed 213: 96 in place of 98 %
        of the derivatives within two standard errors). A height integrated from air data, for lack of accelerometers,
        is left out: it contains the integral of their noise.
        """
        found = self.selected.estimate
        ratios = []
        for s, (index, channel) in enumerate(found.design.segments):
            if channel == HEIGHT and not has_inertial_path(found.problem.recordings[index]):
                continue
            recording, residual = found.problem.recordings[index], found.solution.residuals[found.design.rows(s)]
            noise = float(recording.manoeuvre.noise[recording.manoeuvre.row(channel)])
            in_band = noise * float(np.sqrt(residual.size / recording.time.size))
            ratios.append(float(np.std(residual)) / max(in_band, 1e-300))
        return ratios


def is_testable(hypothesis: Hypothesis) -> bool:
    """Whether the equations can test a hypothesis; step changes are searched for separately."""
    if hypothesis.time is not None or hypothesis.where in ANGULAR_ACCELERATIONS:
        return False
    return not any(c in TAUTOLOGICAL and "alpha_dot_hat" in term.variables for c, term in hypothesis.entries)


def exceeds_mean_gust(found: Estimate, hypothesis: Hypothesis) -> bool:
    """Whether the last bias of a vane exceeds the mean that gusts may have over a record.

    In terms of the standard error of the mean of a first-order autoregression with the residual's size and memory.
    """
    vanes = set(VANE_OF.values())
    if hypothesis.kind != "sensor_bias" or hypothesis.where not in vanes:
        return True
    of_means = [
        variance_of_mean(found.solution.residuals[found.design.rows(s)])
        for s, (_, channel) in enumerate(found.design.segments)
        if channel == hypothesis.where
    ]
    (value, *_) = found.point.effects[-1].values
    return abs(value) > found.problem.settings.deviations * float(np.sqrt(max(of_means, default=0.0)))


def identify_instrument_errors(
    model: AerodynamicModel,
    free: Sequence[Entry],
    given: Sequence[ActiveEffect],
    hypotheses: Sequence[Hypothesis],
    identification: Sequence[Manoeuvre],
    validation: Sequence[Manoeuvre] = (),
    settings: EquationErrorSettings = USUAL,
    length: float | None = None,
) -> InstrumentErrors | None:
    """Identify and estimate instrument errors by the kinematic equations; None where a record is too short.

    Parameters
    ----------
    model : AerodynamicModel
        The declared one, with columns for every candidate's channel.
    free : sequence of Entry
        Its terms that are estimated.
    given : sequence of ActiveEffect
        Declared effects with fixed parameters.
    hypotheses : sequence of Hypothesis
        Candidates.
    identification, validation : sequence of Manoeuvre
        The structure is determined from all of them, derivatives from the first alone.
    length : float, optional
        Of the aircraft, m: largest distance of a sensor from the centre of gravity; by default a multiple of its chord.
    """
    recordings = read_recordings(identification, validation, settings)
    if any(recording.time_in_band.size < settings.fewest for recording in recordings):
        return None
    channels = list(dict.fromkeys(c for r in recordings for c in r.channels))
    given_names = {distinct_name(hypothesis) for hypothesis in hypotheses}
    all_hypotheses = (*hypotheses, *(h for h in position_hypotheses(channels) if distinct_name(h) not in given_names))
    chord, airspeed = model.constants.mean_chord, min(float(np.mean(r.as_measured(AIRSPEED))) for r in recordings)
    testable = tuple(with_plausible_limits(h, chord, airspeed) for h in all_hypotheses if is_testable(h))
    start = Point(model, tuple(free), tuple(given))
    problem = RegressionProblem(recordings, KINEMATIC, settings)
    coefficients = CoefficientCheck(coefficients_of_all(recordings, settings, model), start)
    error_free = initial = SelectedStructure(estimate(problem, start), ())
    while True:
        samples, alarm = error_free.estimate.design.target.size, settings.alarm(model.axes)
        criterion = criterion_for(testable, samples, alarm, settings.factor_odds)
        found, path = _searched(initial, testable, criterion, coefficients, lambda found: _off_aircraft(found, length))
        off_aircraft = _off_aircraft(found, length)
        if not off_aircraft:
            break
        names = set(map(distinct_name, off_aircraft))
        testable = tuple(h for h in testable if distinct_name(h) not in names)
        # Steps before the first of them would be repeated identically.
        (*_, initial) = error_free, *itertools.takewhile(functools.partial(_has_none, names), path)
    # Alternatives are limited to the aircraft's size from the start; a search may pass beyond it.
    declared = {name: each.position(name) for each in recordings for name in each.channels}
    testable = tuple(with_aircraft_limits(h, declared, chord, length) for h in testable)
    return InstrumentErrors(start, testable, error_free.estimate, found, criterion)


def _searched(
    initial: SelectedStructure,
    hypotheses: Sequence[Hypothesis],
    criterion: SelectionCriterion,
    coefficients: CoefficientCheck,
    off_aircraft: Callable[[SelectedStructure], list[Hypothesis]],
) -> tuple[SelectedStructure, list[SelectedStructure]]:
    """Stepwise selection of instrument errors by the kinematic equations: selection, pairs, replacement, elimination.

    Also returned are the intermediate structures of forward selection; the search ends early where the position of a
    sensor is `off_aircraft`.
    """
    problem, model = initial.estimate.problem, initial.estimate.point.model
    settings = problem.settings
    sensors = [h for h in hypotheses if is_instrument_error(h)]

    def admitted(estimated: Estimate, hypothesis: Hypothesis) -> bool:
        agreed = recordings_agree(estimated, hypothesis) and exceeds_calibration(estimated, hypothesis)
        agreed = agreed and is_causal(estimated.point)
        if model.axes == LONGITUDINAL:
            return agreed
        return agreed and exceeds_mean_gust(estimated, hypothesis) and coefficients.admits(estimated, hypothesis)

    steps = functools.partial(
        forward_selection,
        criterion=criterion,
        hypotheses=sensors,
        kinematic=True,
        most=settings.most,
        admitted=admitted,
    )
    path = list(steps(initial))
    found = path[-1]
    visited = {structure_key(found)}
    while (paired := add_pair(found, criterion, sensors, admitted)) is not None:
        *_, found = steps(paired)
        if structure_key(found) in visited:  # a pair that enters and is eliminated again would repeat endlessly
            break
        visited.add(structure_key(found))
    if off_aircraft(found):
        return found, path
    found = with_replacements(found, sensors, criterion, admitted)

    def continued(begun: SelectedStructure) -> SelectedStructure:
        *_, last = steps(begun)
        return last if off_aircraft(last) else with_replacements(last, sensors, criterion, admitted)

    found = with_either_begun(found, path, sensors, criterion, continued)

    def on_aircraft(estimated: Estimate, hypothesis: Hypothesis) -> bool:
        entered = SelectedEffect(hypothesis, kinematic=True, gain=0.0)
        return admitted(estimated, hypothesis) and not off_aircraft(SelectedStructure(estimated, (entered,)))

    by_kinematics, has_coefficients = found, bool(initial.estimate.point.free)
    if model.axes != LONGITUDINAL and has_coefficients:
        delays = [h for h in sensors if h.kind == DELAY]
        *_, by_kinematics = steps(found, hypotheses=delays, admitted=recordings_agree)
    judging = coefficients if has_coefficients else None
    found = with_other_time_origin(found, by_kinematics, sensors, criterion, on_aircraft, judging)
    if has_coefficients:
        may_replace = share_a_distance if model.axes == LONGITUDINAL else _any_error
        found = choose_by_coefficients(found, sensors, criterion, coefficients, may_replace)
    while (insignificant := least_significant(found.estimate, found.chosen)) is not None:
        found = structure_without(found, insignificant)
    return found, [initial]


def _has_none(names: Collection[tuple[str, ...]], selected: SelectedStructure) -> bool:
    """Whether a structure contains none of some hypotheses."""
    return not any(distinct_name(each.hypothesis) in names for each in selected.chosen)


def _off_aircraft(found: SelectedStructure, length: float | None) -> list[Hypothesis]:
    """The selected sensor positions that are not on the aircraft."""
    return [each.hypothesis for each in found.chosen if is_off_aircraft(found, each, length)]


def is_off_aircraft(found: SelectedStructure, each: SelectedEffect, length: float | None) -> bool:
    """Whether a selected sensor position is further from the centre of gravity than the aircraft extends.

    A position declared out there may be corrected, inwards.
    """
    names = {active.name for active in each.hypothesis.effects}
    effects, chord = found.estimate.point.effects, found.estimate.point.model.constants.mean_chord
    placed = [a.effect for a in effects if isinstance(a.effect, PositionEffect) and a.name in names]
    for recording in found.estimate.problem.recordings:
        for channel in recording.channels:
            if any(effect.moves(channel) for effect in placed):
                declared = float(np.linalg.norm(recording.position(channel)))
                distance = float(np.linalg.norm(position(recording, effects, channel)))
                if distance > max(farthest_place(channel, chord, length), declared):
                    return True
    return False


def _any_error(_chosen: Hypothesis, _other: Hypothesis) -> bool:
    return True


def on_identification_records(selected: SelectedStructure) -> SelectedStructure:
    """The errors re-estimated from the identification records alone: biases differ from flight to flight."""
    found = selected.estimate
    fitted = tuple(recording for recording in found.problem.recordings if recording.fitted)
    if len(fitted) == len(found.problem.recordings):
        return selected
    return SelectedStructure(estimate(replace(found.problem, recordings=fitted), found.point), selected.chosen)


def with_instrument_errors(
    errors: JointErrors, found: Estimate, confirmed: Collection[Unknown] = ()
) -> tuple[Estimate, Array]:
    """The coefficients' estimate with the instrument errors among its unknowns, and the covariance of all.

    Biases, scale factors and positions keep their kinematic estimates: gusts and unmodelled forces would bias them. The
    uncertainty of all is propagated to the derivatives to first order. `confirmed`: unknowns replicated by a validation
    record.
    """
    point = replace(found.point, effects=(*errors.effects, *found.point.effects[len(errors.effects) :]))
    free = free_parameters(errors.effects)
    covariance = corrected_covariance(found.design, found.solution, confirmed)
    if not free:
        return replace(found, point=point), covariance
    columns = effect_sensitivities(found.problem, linear_values(found.design, found.solution), point, free)
    white = compared_columns(found.design, columns, found.solution.weights)
    sensitivities = -found.solution.covariance @ found.solution.slopes.T @ white
    solution = replace(
        found.solution,
        values=np.append(found.solution.values, free_values(errors.effects)),
        covariance=_joint(found.solution.covariance, sensitivities, errors.covariance),
        compared=found.solution.compared.beside(white),
    )
    design = found.design.extended(columns, [("effect", i, k) for i, k in free])
    return Estimate(found.problem, point, design, solution), _joint(covariance, sensitivities, errors.covariance)


def _joint(own: Array, sensitivities: Array, given: Array) -> Array:
    """Covariance of unknowns with some sensitivities to given parameters, and of those parameters."""
    return np.block(
        [[own + sensitivities @ given @ sensitivities.T, sensitivities @ given], [given @ sensitivities.T, given]]
    )
