"""Bias of the airspeed: identified by the coefficients, and estimated from kinematics and coefficients together.

A bias acts on every coefficient by one parameter, and on the kinematics by the rate of the flight path: each shows it
with some per cent of the airspeed, and by the coefficients of the identification records alone it is hardly ever three
standard errors from zero where both of all records leave no doubt. It belongs to the installation. So it is judged and
reported by the product of both likelihoods over all records (Klein & Morelli, Aircraft System Identification, eq.
5.31), and its uncertainty is a part of the derivatives' as that of the other instrument errors.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from aerosid.effects import ActiveEffect, frozen
from aerosid.effects.hypothesis import Hypothesis
from aerosid.equation_error.equations.channels import AIRSPEED
from aerosid.equation_error.equations.points import Point
from aerosid.equation_error.regression.design import compared_columns
from aerosid.equation_error.regression.estimate import Estimate, effect_sensitivities, estimate, linear_values
from aerosid.equation_error.regression.parameter_limits import free_parameters
from aerosid.equation_error.regression.standard_errors import corrected_covariance
from aerosid.equation_error.selection.alternatives import Alternative, last_parameter
from aerosid.equation_error.selection.calibration import BIAS, SCALE
from aerosid.equation_error.selection.candidates import distinct_name, with_hypothesis, within_limits
from aerosid.equation_error.selection.coefficient_information import information_on_effects
from aerosid.equation_error.selection.joint_errors import JointErrors, free_values
from aerosid.equation_error.selection.kinematic_evidence import affects_all_coefficients
from aerosid.equation_error.selection.penalties import KinematicEvidence, SelectionCriterion
from aerosid.equation_error.selection.structure import SelectedEffect, SelectedStructure
from aerosid.equation_error.selection.wald_tests import null_value, unknown_indices

Array = NDArray[np.float64]

SETTLED = 0.1
"""Numerical: standard errors, 1, of a step of the bias that counts as converged."""


@dataclass(frozen=True)
class AirspeedBias:
    """A bias of the airspeed that both kinds of equations show together.

    Attributes
    ----------
    hypothesis : Hypothesis
    evidence : KinematicEvidence
        Its estimate by kinematics alone.
    value, std_error : float
        m/s, from both kinds of equations of all records.
    gain : float
        In ln L of both.
    """

    hypothesis: Hypothesis
    evidence: KinematicEvidence
    value: float
    std_error: float
    gain: float = 0.0

    @property
    def effect(self) -> SelectedEffect:
        """As an effect that was selected."""
        return SelectedEffect(self.hypothesis, kinematic=False, gain=self.gain)

    def is_significant(self, deviations: float) -> bool:
        """Whether it is some standard errors from zero, and within the limits of a usable instrument."""
        parameter = self.hypothesis.effects[0].effect.parameters[0]
        return parameter.lowest < self.value < parameter.highest and abs(self.value) >= deviations * self.std_error

    def is_settled(self, other: AirspeedBias) -> bool:
        """Whether another estimate differs by a small part of the standard error."""
        return abs(other.value - self.value) <= SETTLED * self.std_error


def selected_bias(structure: SelectedStructure, criterion: SelectionCriterion) -> AirspeedBias | None:
    """The bias of the airspeed that a structure of the coefficients of all records contains, estimated from both.

    None where it contains none.
    """
    each = next((each for each in structure.chosen if affects_all_coefficients(each.hypothesis)), None)
    if each is None:
        return None
    found, known = structure.estimate, criterion.evidence[distinct_name(each.hypothesis)]
    (index,) = unknown_indices(found, each.hypothesis)
    _, effect, _ = found.design.unknowns[index]
    (own, *_) = found.point.effects[int(str(effect))].values
    variance = float(corrected_covariance(found.design, found.solution)[index, index])
    of_coefficients = 1.0 / variance if variance > 0.0 else 0.0  # none of one that is held at a limit
    of_kinematics, seen = _kinematic_information(known)
    information = max(of_coefficients + of_kinematics, 1e-300)
    value = (of_coefficients * own + of_kinematics * seen) / information
    return AirspeedBias(each.hypothesis, known, value, 1.0 / math.sqrt(information))


def _kinematic_information(known: KinematicEvidence) -> tuple[float, float]:
    """Information of kinematics on the bias, and their estimate."""
    variance = float(known.covariance[0, 0])
    return (1.0 / variance if 0.0 < variance < math.inf else 0.0), known.values[0]


def is_shown_by_both(structure: SelectedStructure, criterion: SelectionCriterion) -> bool:
    """Whether a structure's bias of the airspeed is significant by both kinds of equations of all records."""
    bias = selected_bias(structure, criterion)
    return bias is not None and bias.is_significant(structure.estimate.problem.settings.deviations)


def without_errors_of_airspeed(
    hypotheses: Sequence[Hypothesis], kinds: Sequence[str] = (BIAS, SCALE)
) -> tuple[Hypothesis, ...]:
    """The hypotheses without some kinds of errors of the airspeed: a scale factor beside a bias is no other error."""
    return tuple(h for h in hypotheses if not (h.where == AIRSPEED and h.kind in kinds))


def with_bias_held(identified: SelectedStructure, bias: AirspeedBias) -> SelectedStructure:
    """The instrument errors re-estimated from kinematics with the bias held at its value."""
    base = identified.estimate
    held = replace(bias.hypothesis, effects=(_held(bias),))
    return SelectedStructure(
        estimate(base.problem, with_hypothesis(base.point, held), base.solution.weights), identified.chosen
    )


def _held(bias: AirspeedBias) -> ActiveEffect:
    return frozen(_free(bias))


def reestimated(bias: AirspeedBias, coefficients: Estimate) -> AirspeedBias:
    """The bias after a Newton step on the joint likelihood.

    `coefficients`: of all records, the bias held at its value.
    """
    place, point = _freed(coefficients, bias)
    own, score = information_on_effects(coefficients, point, [(place, 0)], np.eye(1))
    of_kinematics, seen = _kinematic_information(bias.evidence)
    information = float(own[0, 0]) + of_kinematics
    value = bias.value + (float(score[0]) + of_kinematics * (seen - bias.value)) / information
    return replace(bias, value=value, std_error=1.0 / math.sqrt(information))


def with_joint_gain(bias: AirspeedBias, coefficients: Estimate) -> AirspeedBias:
    """The bias with its gain in ln L of both; `coefficients` as of `reestimated`."""
    unbiased = _without_bias(coefficients.point.effects, bias)
    reduced = estimate(
        coefficients.problem, replace(coefficients.point, effects=unbiased), coefficients.solution.weights
    )
    gain = coefficients.log_likelihood - reduced.log_likelihood + bias.evidence.gain_at((bias.value,))
    return replace(bias, gain=gain)


def _freed(found: Estimate, bias: AirspeedBias) -> tuple[int, Point]:
    """The place of the bias that an estimate holds, and its point with the bias free."""
    effects = found.point.effects
    place = next(n for n, active in enumerate(effects) if _is_held_bias(active, bias))
    return place, replace(found.point, effects=(*effects[:place], _free(bias), *effects[place + 1 :]))


def _whitened_column(found: Estimate, bias: AirspeedBias) -> Array:
    """Change of every equation with the bias that an estimate holds, whitened, (R, 1)."""
    place, point = _freed(found, bias)
    columns = effect_sensitivities(found.problem, linear_values(found.design, found.solution), point, [(place, 0)])
    return compared_columns(found.design, columns, found.solution.weights)


def _free(bias: AirspeedBias) -> ActiveEffect:
    return replace(bias.hypothesis.effects[0], values=(bias.value,))


def _is_held_bias(active: ActiveEffect, bias: AirspeedBias) -> bool:
    return active.name == bias.hypothesis.effects[0].name and bool(active.held)


def with_bias_free(errors: JointErrors, identified: Estimate, bias: AirspeedBias) -> JointErrors:
    """The errors with the bias, which is held among them, as a parameter, and the covariance of all.

    `identified`: by kinematics with the bias held; by them the other errors change with it.
    """
    place = next(n for n, each in enumerate(errors.effects) if _is_held_bias(each, bias))
    change = -identified.solution.covariance @ (identified.solution.slopes.T @ _whitened_column(identified, bias)[:, 0])
    numbers = {
        (identified.point.effects[i].name, k): float(change[identified.design.unknowns.index(("effect", i, k))])
        for i, k in free_parameters(identified.point.effects)
    }
    effects = (*errors.effects[:place], _free(bias), *errors.effects[place + 1 :])
    along = [1.0 if i == place else numbers.get((effects[i].name, k), 0.0) for i, k in free_parameters(effects)]
    n = len(free_values(effects[:place]))
    covariance = np.insert(np.insert(errors.covariance, n, 0.0, axis=0), n, 0.0, axis=1)
    return JointErrors(effects, covariance + bias.std_error**2 * np.outer(along, along), errors.penalty)


def scale_as_alternative(
    bias: AirspeedBias, identified: SelectedStructure, coefficients: Estimate, hypotheses: Sequence[Hypothesis]
) -> Alternative | None:
    """The scale factor of the airspeed in place of its bias, where kinematics support it and little likelihood is lost.

    Parameters
    ----------
    identified : SelectedStructure
        Of kinematics, the bias held.
    coefficients : Estimate
        Of all records, the bias held.
    hypotheses : sequence of Hypothesis
        All hypotheses.
    """
    scale = next((h for h in hypotheses if h.where == AIRSPEED and h.kind == SCALE), None)
    if scale is None:
        return None
    base, settings = identified.estimate, coefficients.problem.settings
    without = replace(base.point, effects=_without_bias(base.point.effects, bias))
    found = estimate(base.problem, with_hypothesis(without, scale), base.solution.weights)
    active, value, error = last_parameter(found, scale)
    assert active is not None
    if not within_limits(found, scale) or abs(value - null_value(active)) < settings.support * error:
        return None
    effects = tuple(frozen(active) if _is_held_bias(each, bias) else each for each in coefficients.point.effects)
    other = estimate(coefficients.problem, replace(coefficients.point, effects=effects), coefficients.solution.weights)
    deficit = max(base.gain_over(found) + coefficients.log_likelihood - other.log_likelihood, 0.0)
    margin = settings.alike_instruments
    if deficit > margin:
        return None
    return Alternative(scale, active, value, error, bias.gain - deficit, deficit, margin, bias.hypothesis, other)


def _without_bias(effects: Sequence[ActiveEffect], bias: AirspeedBias) -> tuple[ActiveEffect, ...]:
    return tuple(active for active in effects if not _is_held_bias(active, bias))
