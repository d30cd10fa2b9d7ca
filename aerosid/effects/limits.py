"""Limits of the catalogue: conditions for the candidacy of effects, and bounds of their parameters."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field


def _biases() -> Mapping[str, float]:
    return {"m/s": 8.0, "rad": 0.1, "rad/s": 0.05, "m/s^2": 2.0}


def _scales() -> Mapping[str, float]:
    return {"rad": 0.4, "m/s": 0.3, "m": 0.4}


def _over_usual() -> Mapping[str | tuple[str, str], float]:
    usual: dict[str | tuple[str, str], float] = {"sensor_bias": 3.0, "sensor_scale": 3.0, "cg_shift": 3.0}
    calibrated = ("V", "p", "q", "r", "a_x", "a_y", "a_z")
    usual |= {("sensor_scale", channel): 10.0 for channel in calibrated}
    usual |= {("sensor_scale", vane): 4.0 for vane in ("alpha", "beta")}
    return usual | {("cg_shift", "x"): 10.0}


@dataclass(frozen=True)
class OfferLimits:
    """Conditions for the candidacy of the families; chosen from an effect's influence on a motion, as stated.

    Attributes
    ----------
    grid : int
        Instants at which a step change is tried on each log; the best is then refined between its neighbours. The
        number of columns is linear in it.
    least_mach : float
        Least variation of Mach number, 1, in a flight for a term in it.
    knots : tuple of float
        Knots of the splines, as fractions, 1, of the flown range of alpha.
    knot_grid : float
        rad; knots are rounded to this, for readable knots and reproducible terms.
    least_attitude : float
        rad; least range of pitch or bank in which a moment due to it is distinguishable from a constant.
    least_range : float
        rad; least flown range of alpha in which knots are distinguishable.
    slowest : float
        s; a surface that takes longer for its largest excursion follows no manoeuvre.
    least_band : float
        Least width of a dead band over the record's noise, 1: a narrower one removes noise from the trimmed flight
        before a manoeuvre, which improves any fit.
    at_rest : float
        Distance of a control from its first sample over the record's noise, 1, up to which it has not moved: the mean
        until then is the neutral position of its dead band. Chosen: four standard deviations of that sample.
    least_influence : float
        Least variation of the ground's influence, 1, in a flight: below, a gain as large as one would change the lift
        by 2 %.
    reaches : tuple of float
        Reaches of the ground effect that are tried, over wing area by mean chord, 1.
    largest_inertia : float
        Largest product of inertia or error of a moment, as a fraction, 1, of the declared moments.
    inertia_step : float
        Finite-difference step as the same fraction.
    least_noise_ratio : float
        Least standard deviation of a recorded channel over its noise, 1.
    least_present : float
        Least fraction of samples present, 1, for a recorded channel to be a candidate term.
    fewest : int
        Least number of samples of a recorded channel.
    below_ground : float
        Largest depth below ground over wing area by mean chord, 1; beyond, the altitude is no height.
    least_thrust : float
        Least variation of recorded thrust over its mean, 1, for C_T or a scale factor to be distinguishable from a
        constant.
    like_the_states, like_an_acceleration : float
        R^2, 1, of an unknown channel with the case's other responses together, and with each acceleration alone, from
        which it is a response too. All accelerations together would explain every input that acts.
    most_channels : int
        Largest number of recorded channels among the candidates, as every simulation contains each of them.
    earliest_control : float
        s; least time delay of a control where rolling and yawing are integrated: negative where the record is late, as
        with a surface sensor's filter. A tenth of a second is a filter of 2 Hz.
    least_timing : float
        Least significant time delay of a control over the sampling interval, 1, where rolling and yawing are
        integrated: the motion between samples is not known better. Found on benchmarks/sideways_flights.py, seed 1.
    least_slowing : float
        Sampling intervals, 1, by which a rate limit must prolong the fastest recorded movement: the instant of a step
        between two samples is not known. By reasoning, after two false limits in benchmarks/turbulent_false_alarms.py,
        seed 1.
    furthest : float
        m; largest position error of a sensor where the aircraft's size is not given.
    length_in_chords : float
        Aircraft length in mean chords, 1, where its file does not state it: Citation II 7, VFW-614 6.5, DHC-6 8
        (Jane's), model aircraft less.
    largest_bias : mapping of str to float
        Largest bias by unit, SI; beyond, the channel is wrong and not biased. Airspeed: three times the 5 kt of 14 CFR
        25.1323; the others chosen.
    largest_airspeed_bias : float
        The same of the airspeed over the airspeed, 1, of aircraft slower than fifty metres a second: half its largest
        scale factor error. By reasoning, after an unmanned aircraft at 17 m/s whose late airspeed was biased by 8.
    largest_scale : mapping of str to float
        Largest scale factor error, 1, by the channel's unit: vanes measure the local flow at the aircraft; airspeed ten
        times the 3 % of 14 CFR 25.1323. Usual errors are in `limit_over_usual`.
    largest_inertial_scale : float
        The same of every other channel, accelerometers and gyros: beyond, a channel has another unit.
    furthest_centre : float
        Largest centre-of-gravity error in mean chords, 1: no pilot could hold an aircraft beyond.
    limit_over_usual : mapping of str to float
        Limit of a kind over the standard deviation of its usual error, 1, by kind, or by kind and place; others have no
        usual size. Biases, attitudes and the height of the centre of gravity: a third of their limit. Scale factors of
        airspeed, accelerometers and gyros, calibrated on the ground: a tenth, 3 and 5 %; of vanes, by upwash: a
        quarter, 10 %. Along the fuselage, weighed before every flight: a tenth, a twentieth of the chord. By reasoning;
        that a limit in place of a prior hides clear evidence of a record, on benchmarks/field_detection.py, seeds 4 and
        5, that a vane is rarely a fifth off, on seed 166.
    scales : (float, float)
        Least and greatest measured over true, 1, of any sensor's channel.
    sensor_delays : (float, float)
        s; least and greatest time delay of a sensor's channel; below zero the others are late.
    slowest_sensor : float
        s; greatest time constant of a sensor's lag: it would follow no manoeuvre.
    longest_separation : float
        s; longest delay and relaxation of flow separation.
    separation_chords : float
        The same in mean chords flown, 1: four times the 24 published for the VFW-614 ATTAS (Jategaonkar). Chosen by
        reasoning; on a short period of the Citation without attitude a relaxation of 150 followed a drift.
    reach : float
        Largest distance of a vane from the centre of gravity over the aircraft's length, 1: half of it, and a nose
        boom. The VFW-614 ATTAS has its vane 0.64 of its length ahead.
    reach_inside : float
        The same of accelerometers, which no boom carries.
    """

    grid: int = 48
    least_mach: float = 0.02
    knots: tuple[float, ...] = (0.25, 0.5, 0.75)
    knot_grid: float = 0.01
    least_attitude: float = 0.1
    least_range: float = 0.06
    slowest: float = 5.0
    least_band: float = 3.0
    at_rest: float = 4.0
    least_influence: float = 0.02
    reaches: tuple[float, ...] = (0.5, 1.0, 2.0)
    largest_inertia: float = 0.4
    inertia_step: float = 1e-3
    least_noise_ratio: float = 5.0
    least_present: float = 0.9
    fewest: int = 5
    below_ground: float = 0.2
    least_thrust: float = 0.05
    like_the_states: float = 0.9
    like_an_acceleration: float = 0.95
    most_channels: int = 8
    earliest_control: float = -0.1
    least_timing: float = 0.2
    least_slowing: float = 0.5
    furthest: float = 30.0
    length_in_chords: float = 8.0
    reach: float = 0.65
    reach_inside: float = 0.5
    largest_bias: Mapping[str, float] = field(default_factory=_biases)
    largest_airspeed_bias: float = 0.15
    largest_scale: Mapping[str, float] = field(default_factory=_scales)
    largest_inertial_scale: float = 0.5
    furthest_centre: float = 0.5
    limit_over_usual: Mapping[str | tuple[str, str], float] = field(default_factory=_over_usual)
    scales: tuple[float, float] = (0.2, 5.0)
    sensor_delays: tuple[float, float] = (-0.5, 2.0)
    slowest_sensor: float = 5.0
    longest_separation: float = 3.0
    separation_chords: float = 100.0


OFFERED = OfferLimits()
"""The limits of every loop."""
