"""Accelerometers in one unit in pitch: that of a_z displaced along x takes the one of a_x with it.

A unit x ahead of its declared place takes x q' from a_z and x q^2 from a_x: one parameter of two channels. Kinematics
show the first, in the path that a_z gives, as its distance from the vane; the second stays in the axial force, where
terms as C_X q_hat^2 would stand for it. Two accelerometers declared at one distance ahead are therefore taken as one
unit, unless both kinds of equations together are clearly likelier with that of a_z alone; and in place of the vane
where they are clearly likelier with the unit. Klein & Morelli, Aircraft System Identification, section 10.2.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from aerosid.effects import ActiveEffect
from aerosid.effects.family import at_null
from aerosid.effects.hypothesis import Hypothesis
from aerosid.effects.kinds import UNIT, axes_of
from aerosid.effects.sensor_position import AHEAD, READ_AS_UNIT, are_beside_each_other, sensor_place
from aerosid.equation_error.equations.channels import MEASURED_BY, VANE_OF
from aerosid.equation_error.equations.points import Point
from aerosid.equation_error.equations.recording import Recording
from aerosid.equation_error.equations.sensors import position
from aerosid.equation_error.regression.estimate import estimate
from aerosid.equation_error.selection.alternatives import Alternative, alike_margin
from aerosid.equation_error.selection.joint_errors import JointErrors
from aerosid.equation_error.selection.penalties import Label, SelectionCriterion, effects_of
from aerosid.equation_error.selection.redundancy import PLACE
from aerosid.equation_error.selection.structure import SelectedEffect, SelectedStructure, estimate_without
from aerosid.flight_model.axes import LONGITUDINAL

ALONE: Label = (PLACE, MEASURED_BY["C_Z"], "")
"""The vertical accelerometer displaced by itself."""

VANE: Label = (PLACE, VANE_OF["C_Z"], "")
"""The vane displaced: kinematics show its distance from the accelerometer, whichever of both is not in its place."""

TOGETHER: Label = (PLACE, UNIT, "")
"""The unit displaced."""


@dataclass(frozen=True)
class DisplacedUnit:
    """The unit in place of a sensor that kinematics found ahead of or behind its place.

    `identified` : the instrument errors with the unit; `label` of the sensor; `least_gain` in penalised ln L of both
    kinds of equations from which the unit is taken.
    """

    identified: SelectedStructure
    label: Label
    least_gain: float


def in_one_unit(identified: SelectedStructure, hypotheses: Sequence[Hypothesis]) -> DisplacedUnit | None:
    """The errors with the unit in place of a_z or the vane; None where neither was found, or they are declared apart.

    Parameters
    ----------
    identified : SelectedStructure
        Instrument errors by the kinematic equations.
    hypotheses : sequence of Hypothesis
        Those from which they were selected.
    """
    found, settings = identified.estimate, identified.estimate.problem.settings
    for label, least_gain in ((ALONE, -settings.choice_gain), (VANE, settings.choice_gain)):
        each = _chosen(identified, label)
        if each is None or axes_of(each.hypothesis.effects[0]) != AHEAD:
            continue
        (single,) = effects_of(found.point, each.hypothesis)
        given = tuple(active for active in found.point.effects if active is not single)
        for unit in units_of(hypotheses, replace(found.point, effects=given), found.problem.recordings):
            (place,) = unit.effects
            together = replace(place, values=tuple(READ_AS_UNIT[label[1]] * value for value in single.values))
            effects = tuple(together if active is single else active for active in found.point.effects)
            moved = estimate(found.problem, replace(found.point, effects=effects), found.solution.weights)
            entered = SelectedEffect(unit, each.kinematic, each.gain)
            chosen = tuple(entered if other is each else other for other in identified.chosen)
            return DisplacedUnit(SelectedStructure(moved, chosen), label, least_gain)
    return None


def units_of(hypotheses: Sequence[Hypothesis], given: Point, recordings: Sequence[Recording]) -> list[Hypothesis]:
    """The position of the unit for that of a_z along x, with its limits; none where they are declared apart.

    Parameters
    ----------
    hypotheses : sequence of Hypothesis
        Candidates, that of a_z among them.
    given : Point
        Its effects displace the accelerometers from their declared places.
    recordings : sequence of Recording
        All records.
    """
    single = next((h for h in hypotheses if h.label == ALONE and axes_of(h.effects[0]) == AHEAD), None)
    if single is None or given.model.axes != LONGITUDINAL:
        return []
    if not all(_are_declared_together(recording, given.effects) for recording in recordings):
        return []
    effect = sensor_place(UNIT, AHEAD)
    limits = single.effects[0].effect.parameters
    parameters = tuple(
        replace(parameter, lowest=of_single.lowest, highest=of_single.highest)
        for parameter, of_single in zip(effect.parameters, limits, strict=True)
    )
    return [Hypothesis(PLACE, UNIT, effects=(at_null(replace(effect, parameters=parameters)),))]


def single_as_alternative(
    unit: SelectedStructure, apart: SelectedStructure, label: Label, errors: JointErrors, deficit: float
) -> Alternative | None:
    """The single displaced sensor as an alternative of the unit; None where it is none.

    Parameters
    ----------
    unit, apart : SelectedStructure
        The instrument errors with the unit, and with the single sensor of that `label`.
    errors : JointErrors
        The latter's values by both kinds of equations.
    deficit : float
        In penalised ln L of both kinds of equations.
    """
    together, single = _chosen(unit, TOGETHER), _chosen(apart, label)
    if together is None or single is None:
        return None
    gain = unit.estimate.gain_over(estimate_without(unit, together))
    margin = alike_margin(unit.estimate.problem.settings.alike_instruments, gain)
    if deficit >= margin:
        return None
    active, error = errors.estimate_of(single.hypothesis)
    value, found, lost = active.values[0], apart.estimate, max(deficit, 0.0)
    return Alternative(single.hypothesis, active, value, error, gain, lost, margin, together.hypothesis, found)


def with_unit_favoured(criterion: SelectionCriterion, factor_odds: float) -> SelectionCriterion:
    """The criterion in pitch: the odds of a position of a_z shared by the unit and a_z alone, as 1 to `factor_odds`.

    Accelerometers of one declared place are in one unit more often than not, and the unit has no more parameters.
    """
    shares = criterion.odds_shares
    of_unit = shares[ALONE] / (1.0 + factor_odds)
    return replace(criterion, odds_shares={**shares, TOGETHER: of_unit, ALONE: shares[ALONE] - of_unit})


def _chosen(selected: SelectedStructure, label: Label) -> SelectedEffect | None:
    return next((each for each in selected.chosen if each.hypothesis.label == label), None)


def _are_declared_together(recording: Recording, given: Sequence[ActiveEffect]) -> bool:
    """Whether a record has both accelerometers, declared at one distance ahead, with the `given` effects."""
    along = "xyz".index(AHEAD)
    return are_beside_each_other({name: float(position(recording, given, name)[along]) for name in recording.channels})
