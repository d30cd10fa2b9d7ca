"""Notes of the equation-error method for the report: time delays, near-significant effects, combined derivatives."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from aerosid.effects import KINDS, ActiveEffect
from aerosid.equation_error.equations.bridged_holes import channel_holes, has_path
from aerosid.equation_error.equations.channels import AIRSPEED
from aerosid.equation_error.regression.estimate import Estimate
from aerosid.equation_error.selection.airspeed_calibration import mean_airspeed
from aerosid.equation_error.selection.calibration import SCALE
from aerosid.equation_error.selection.control_dependence import DEPENDENCE, ControlDependence, dependent
from aerosid.equation_error.selection.damping_collinearity import USUAL, DampingCollinearity
from aerosid.equation_error.selection.joint_errors import DELAY_KINDS
from aerosid.equation_error.selection.near_significant import NearSignificant
from aerosid.equation_error.selection.penalties import KinematicEvidence
from aerosid.equation_error.selection.regressor_errors import RegressorErrors
from aerosid.equation_error.selection.time_delays import DelayDiscrepancy
from aerosid.equation_error.selection.turbulence import Turbulence
from aerosid.equation_error.selection.vane_position import IdentifiedVane
from aerosid.equation_error.selection.wald_tests import EffectEstimate
from aerosid.estimation.fit_settings import RESIDUAL_TESTS
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.notation import listed, number, si_unit, with_deviation
from aerosid.search.attribution import Attribution
from aerosid.search.findings import named


def note_on_delay(seen: DelayDiscrepancy) -> str:
    """Note on an instrument's time delay or lag: from kinematics alone, and together with forces and moments."""

    def words(active: ActiveEffect, error: float) -> str:
        kind = active.effect.kind.removeprefix("sensor_")
        return f"a {kind} of {with_deviation(active.values[0], error)} s"

    alone, joint = words(seen.kinematic, seen.kinematic_std_error), words(seen.joint, seen.joint_std_error)
    return (
        f"{seen.channel} is recorded late: kinematics alone give {alone}, together with forces and moments {joint}, "
        "which the completed model uses. If the declared structure lacks an effect that resembles a delay, such as "
        "unsteady lift that lags alpha, the estimate from kinematics alone is the better one."
    )


def note_on_vane(seen: IdentifiedVane, row: EffectEstimate) -> str:
    """Note on a vane's position or dead time identified beside its time delay, with what the delay is without it."""
    kind, channel = seen.timing.effect.kind.removeprefix("sensor_"), seen.timing.effect.where
    alone = with_deviation(seen.timing.values[0], seen.std_error)
    instead = (
        f", although {listed([named(label) for label in seen.instead])} is then identified" if seen.instead else ""
    )
    without = f"{alone} s and 2 ln L is {number(2.0 * row.gain, 2)} lower{instead}."
    is_dead_time = row.hypothesis.kind in DELAY_KINDS
    further = (
        f" The vane of {listed(seen.unplaced)} is late too; its {'dead time' if is_dead_time else 'position'} was not "
        "looked for beside this one."
        if seen.unplaced
        else ""
    )
    if is_dead_time:
        return (
            f"{channel} lags and is recorded late: a lag, and a dead time of "
            f"{with_deviation(row.value, row.std_error)} s. Kinematics show little more than their sum; forces and "
            f"moments distinguish them. With a {kind} alone it is {without}{further}"
        )
    return (
        f"The position of the vane of {channel} is not declared; it is identified as "
        f"{with_deviation(row.value, row.std_error)} m ahead of the centre of gravity. Kinematics show only the sum of "
        f"its {kind} and that distance over the airspeed; forces and moments distinguish them. Without the position "
        f"the {kind} is {without} Forces or moments that lag {channel} resemble such a position, and gusts that a boom "
        f"meets early enlarge it. If it is known, declare it in the channel map.{further}"
    )


def note_on_supported_error(row: EffectEstimate, seen: KinematicEvidence) -> str:
    """Note on an instrument error that is significant only in kinematic and coefficient equations together."""
    own = row.active.effect.parameters[0].unit if row.active is not None else "1"
    unit = "" if own == "1" else f" {own}"
    alone = with_deviation(seen.values[0], float(np.sqrt(seen.covariance[0, 0])))
    return (
        f"{named(row.hypothesis.label)} of {with_deviation(row.value, row.std_error)}{unit} is identified from "
        f"kinematics and coefficients together: kinematics alone give {alone}{unit}, 2 ln L {number(2.0 * seen.gain)}, "
        "which is not significant, and forces and moments agree."
    )


NOTED_RISE = 0.005
"""Display: rise of R^2 from which it is noted; its third digit is the last that is printed."""


def note_on_near_significant(row: NearSignificant) -> str:
    """Note on an effect that would be significant as the only hypothesis: gain, penalty and R^2."""
    own = si_unit(row.active.effect.parameters[0].unit) if row.active is not None else ""
    value = f"{with_deviation(row.value, row.std_error)} {own}".strip()
    sentence = (
        f"Near-significant: {named(row.hypothesis.label)} of {value} gains {number(row.gain, 2)} in ln L; the penalty "
        f"for the number of hypotheses is {number(row.penalty, 2)}"
    )
    if row.is_retained:
        sentence += ". It is not named, since a calibrated instrument retains as much"
    if row.indistinguishable:
        others = listed([named(rival.label) for rival in row.indistinguishable[:2]], "or")
        sentence += f"; replacing it by {others} fits nearly as well"
    better = [(a, b) for a, b in row.validation_fits if b.r2 >= a.r2 + NOTED_RISE]
    if better:
        shares = [f"{b.coefficient} of {b.recording} from {a.r2:.3f} to {b.r2:.3f}" for a, b in better]
        sentence += f". It would raise R^2 of {listed(shares)}"
    return f"{sentence}."


BRIDGED = 0.3
"""Numerical: s of a hole from which it is noted: half a period at the band of usual short periods."""

NOTED_SCALE = 0.005
"""Display: relative part of a standard error from which the error of a vane or of the airspeed is noted."""


def notes_on_bridged_holes(manoeuvres: Sequence[Manoeuvre]) -> tuple[str, ...]:
    """One sentence for each hole of a measured channel that is longer than the equations' band resolves.

    The equations need every sample of a record. Where kinematics do not predict the channel they bridge a hole by a
    line: what the aircraft did meanwhile is lost, and its motion before and after contradicts the line.
    """
    found = []
    for manoeuvre in manoeuvres:
        for name, edges in channel_holes(manoeuvre).items():
            how = (
                "which the equations bridge by a line; what is found may be due to that. Choose a span without it, "
                "with --from and --to."
            )
            if has_path(manoeuvre, name):
                how = "which the equations bridge by the motion that gyros and accelerometers measured meanwhile."
            found += [
                f"{manoeuvre.name}: {name} has a hole from {begun:.2f} to {ended:.2f} s, {how}"
                for begun, ended in edges
                if ended - begun > BRIDGED
            ]
    return tuple(found)


def notes_on_calibration(scales: Sequence[ActiveEffect], completed: Estimate) -> tuple[str, ...]:
    """Notes on the parts of the standard errors that errors of vanes and airspeed are; none where negligible.

    `scales`: scale factors of vanes, and scale factor and bias of the airspeed, frozen at their sizes.
    """
    sizes: dict[str, float] = {}
    for active in scales:
        is_scale = active.effect.kind == SCALE
        size = active.held[0] - 1.0 if is_scale else active.held[0] / mean_airspeed(completed)
        sizes[active.effect.where] = math.hypot(sizes.get(active.effect.where, 0.0), size)
    return tuple(_note_on_calibration(where, size) for where, size in sizes.items() if size >= NOTED_SCALE)


def _note_on_calibration(where: str, size: float) -> str:
    contained, by = f"the derivatives by {where} contain the scale factor of its vane", "kinematics"
    if where == AIRSPEED:
        contained, by = f"all derivatives contain twice the error of {where}", "kinematics, coefficients"
    return (
        f"The standard errors of {contained}, known to {number(100.0 * size, 2)} % by {by} and the usual "
        "accuracy of a calibration together. If it is calibrated better than that, declare so in the aircraft file: "
        f'kind = "sensor_scale", where = "{where}", value = 1.0 in [[effects]].'
    )


def note_on_unsized_turbulence(seen: Turbulence) -> str:
    """Note on turbulence of too few independent gusts to be named with a size."""
    size = with_deviation(seen.sigma, seen.sigma_error)
    return (
        f"Vane and accelerometer agree on {KINDS[seen.kind].short_name} of {size} m/s (standard deviation) over "
        f"{number(seen.length, 2)} m: the flights hold too few independent gusts to tell its size, and it is not named."
    )


def notes_on_rotary_gusts(vanes: Sequence[str]) -> tuple[str, ...]:
    """Notes on the moments that respond to rotary gusts, by the vanes that show these."""
    notes = {
        "alpha": "C_m responds to rotary gusts: the rate of the gust that the vane of alpha shows is one of its "
        "regressors, since the aircraft's response to it would make every derivative of C_m too small.",
        "beta": "C_l and C_n respond to rotary gusts. No vane shows those in roll: both are estimated by the response "
        "to the controls (instrumental variables), and their R^2 is of that response. It is valid unless the controls "
        "respond to gusts, as an autopilot's do.",
    }
    return tuple(notes[vane] for vane in vanes)


def note_on_regressor_errors(biased: RegressorErrors) -> str | None:
    """Note on a coefficient whose derivatives by instrumental variables are others than by least squares.

    None where none differs by more than its standard error.
    """
    apart = sorted(biased.derivatives, key=lambda each: -abs(each.instrumental - each.value) / each.std_error)
    beyond = [each for each in apart if abs(each.instrumental - each.value) > each.std_error]
    if not beyond:
        return None
    values = [
        f"{each.entry[1]} of {with_deviation(each.instrumental, each.std_error)} and {number(each.value)}"
        for each in beyond
    ]
    cause = (
        f"{biased.coefficient}: the response to the controls alone (instrumental variables) and least squares give "
        f"{listed(values)}; chance explains the differences with p = {number(biased.p_value, 2)}. Errors of the "
        "measured angles and rates draw least squares towards zero, or the controls respond to gusts, as those of an "
        "autopilot do, and instrumental variables are biased."
    )
    if biased.adopted:
        return f"{cause} Instrumental variables predict the coefficient as well or better, and are reported."
    return f"{cause} Least squares is reported, and its standard errors contain the differences."


def note_on_damping(damping: DampingCollinearity) -> str:
    """Note on the parts of the derivatives that these manoeuvres cannot separate from C_m alpha_dot_hat."""
    least, most = damping.parts
    own = f"{number(100.0 * damping.independent)} %" if damping.independent > 1e-3 else "less than 0.1 %"
    text = (
        f"C_m q_hat is a combined derivative: it includes {number(damping.aliased)} times the C_m alpha_dot_hat that "
        f"the model may lack; {own} of that regressor is independent of the declared terms in these manoeuvres. With a "
        f"C_m alpha_dot_hat of the usual size ({USUAL[0]} to {USUAL[1]} of C_m q_hat), C_m q_hat alone is "
        f"{100.0 * least / damping.value:.0f} to {100.0 * most / damping.value:.0f} % of the estimate"
    )
    others = []
    for other in damping.beyond_errors:
        small, large = (number(change, 2) for change in damping.changes(other))
        others.append(f"{small} to {large} of C_m {other.term} (standard error {number(other.std_error, 2)})")
    if not others:
        return f"{text}; the standard error does not include this."
    return f"{text}, and alphadot accounts for {listed(others)}; the standard errors do not include this."


def note_on_residuals(found: Attribution) -> str:
    """Note on what counts as a residual where a recorder hides the noise, or gusts are suspected and not identified."""
    hidden = (
        "The recorder filters or colours every channel:"
        if found.noise_hidden
        else "Vane and lift together suggest gusts, too small to be identified:"
    )
    if found.dependence is not None:
        alarms = number(100.0 * DEPENDENCE.false_alarm, 1)
        logs = listed(list(dict.fromkeys(row.recording for row in found.dependence)))
        why = "neither open-loop errors nor innovations tell a missing effect from the air and the recorder"
        slow = "What happens without the controls, as a drift of the trim, this does not show."
        if found.still_air:
            why = "open-loop errors do not tell a missing effect from the noise of sensors and recorder"
            slow = (
                "So does an open-loop error of more than "
                f"{number(100.0 * RESIDUAL_TESTS.recorded_share)} % of a channel's variance in the record whose means "
                f"over {number(RESIDUAL_TESTS.sensor_memory)} s are not white."
            )
        return (
            f"{hidden} in {'still' if found.still_air else 'moving'} air {why}. A residual counts as significant where "
            "it depends on the controls (F test of each coefficient's whitened residual on "
            f"{logs}, {alarms} % false alarms in all): {_dependences(found.dependence)}. {slow}"
        )
    told = (
        f"{hidden} the last digits of the logs do not show their noise. A channel "
        f"counts as explained with an open-loop error of up to {number(RESIDUAL_TESTS.recorded_ratio)} times what they "
        f"show, or of up to {number(100.0 * RESIDUAL_TESTS.recorded_share)} % of its variance in the record, or one "
        f"whose means over {number(RESIDUAL_TESTS.recorder_memory)} s are white."
    )
    if found.in_turbulence is None:
        return told
    return (
        f"{hidden} in turbulence its noise is part of the innovations that are tested, and a significant residual is "
        "no evidence of a missing effect by itself."
    )


def _dependences(rows: Sequence[ControlDependence]) -> str:
    """The coefficients that depend on the controls, the most certain first; of none the nearest to it."""
    shown = sorted(dependent(rows), key=lambda row: row.p_value)
    if not shown:
        nearest = min(rows, key=lambda row: row.p_value)
        least = number(100.0 * DEPENDENCE.least_share, 1)
        of_nearest = f"{number(nearest.p_value, 2)}, {nearest.coefficient} of {nearest.recording}"
        return f"none does significantly and by {least} % of its variance (least p-value {of_nearest})"
    return listed(
        [
            f"{row.coefficient} of {row.recording} (p-value {number(row.p_value, 2)}, "
            f"{number(100.0 * row.share, 2)} % of its variance)"
            for row in shown
        ]
    )
