"""Limits of the catalogue: which effects a flight is asked for, and how far they may go."""

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
    return usual | {("cg_shift", "x"): 10.0} | {("sensor_scale", channel): 10.0 for channel in calibrated}


@dataclass(frozen=True)
class OfferLimits:
    """When the families of effects are offered; chosen from what an effect can do to a motion, as each says.

    Attributes
    ----------
    grid : int
        Moments at which a sudden change is tried on each log; the best is then refined between its neighbours. More
        costs columns, linearly.
    least_mach : float
        Variation of Mach number, 1, in a flight that can show a term in it.
    knots : tuple of float
        Where the splines begin, as shares, 1, of the flown range of alpha.
    knot_grid : float
        rad; knots are rounded to this, so that a knot reads well and the same flight gives the same terms.
    least_attitude : float
        rad; a range of pitch or bank in which a moment of it can be told from a constant.
    least_range : float
        rad; a flown range of alpha in which knots can be told apart.
    slowest : float
        s; a surface that takes longer for its largest excursion follows no manoeuvre.
    least_band : float
        Times the record's noise, 1, that a dead band has at least: a narrower one takes noise out of the rest before a
        manoeuvre, and that helps any fit.
    least_influence : float
        By how much the influence of the ground, 1, must vary in a flight: below, a gain as large as one would move the
        lift by 2 %.
    reaches : tuple of float
        Reaches of the ground effect that are tried, over wing area by mean chord, 1.
    largest_inertia : float
        Share, 1, of the declared moments: a product of inertia or an error of a moment beyond it is no aircraft's.
    inertia_step : float
        The same share by which they are varied for differences.
    least_noise_ratio : float
        Standard deviation of a recorded channel over its noise, 1, below which it shows nothing.
    least_present : float
        Share of its samples, 1, that a recorded channel must hold to be offered as a term.
    fewest : int
        Samples of a recorded channel below which it shows nothing.
    below_ground : float
        Of wing area over mean chord, 1, by which a height may lie below ground; more, and the altitude is no height.
    least_thrust : float
        Share, 1, of its mean by which recorded thrust must vary to tell C_T or a factor from a constant.
    like_the_states, like_an_acceleration : float
        Shares, 1, of an unknown channel's variance that the case's other answers together, and each acceleration alone,
        explain linearly, from which it is an answer as they are. All accelerations together show every input that acts.
    most_channels : int
        Recorded channels that are asked for: every simulation carries each of them.
    earliest_control : float
        s; the least delay of a control where rolling and yawing are integrated: below zero the record is late, as of a
        surface whose sensor is filtered. A tenth of a second is a filter of 2 Hz.
    least_timing : float
        Share of the sampling interval, 1, below which a delay of a control is none where rolling and yawing are
        integrated: between samples nothing is known better. Found on benchmarks/sideways_flights.py, seed 1.
    least_slowing : float
        Sampling intervals, 1, by which a rate limit must make the fastest recorded movement longer: where between two
        samples a step lies is not known. By reasoning, after two false limits in benchmarks/turbulent_false_alarms.py,
        seed 1.
    furthest : float
        m; how far from its declared place a sensor may sit where the aircraft's size is not asked.
    length_in_chords : float
        Mean chords, 1, that an aircraft is long where its file does not say: Citation II 7, VFW-614 6.5, DHC-6 8
        (Jane's), model aircraft less.
    largest_bias : mapping of str to float
        By unit, SI: what is further off is a channel that is wrong and not one that is biased. Airspeed: three times
        the 5 kt of 14 CFR 25.1323; the others chosen.
    largest_scale : mapping of str to float
        Share, 1, by which a scale may be off, by the channel's unit: vanes see the aircraft's own flow; airspeed ten
        times the 3 % of 14 CFR 25.1323. What is usual is in `limit_over_usual`.
    largest_inertial_scale : float
        The same of every other channel, accelerometers and gyros: beyond, a channel has another unit.
    furthest_centre : float
        Mean chords, 1, by which the centre of gravity may lie off its declared place: no pilot could hold an aircraft
        beyond.
    limit_over_usual : mapping of str to float
        Standard deviations, 1, of what is usual at which the limit of a kind lies, by kind, or by kind and place;
        others have no usual size. Biases, vanes and the height of the centre of gravity: a third of their limit. Scales
        of airspeed, accelerometers and gyros, calibrated on the ground: a tenth, 3 and 5 %. Along the fuselage, weighed
        before every flight: a tenth, a twentieth of the chord. By reasoning; that a limit in place of a prior hides
        what a record shows beyond doubt, on benchmarks/field_detection.py, seeds 4 and 5.
    scales : (float, float)
        Least and greatest measured over true, 1, of any sensor's channel.
    sensor_delays : (float, float)
        s; least and greatest delay of a sensor's channel; below zero the others are late.
    slowest_sensor : float
        s; greatest time constant of a sensor's lag: it would follow no manoeuvre.
    reach : float
        Of the length, 1, that a vane sits from the centre of gravity at most: half of it, and a nose boom. The VFW-614
        ATTAS has its vane 0.64 of its length ahead.
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
    largest_scale: Mapping[str, float] = field(default_factory=_scales)
    largest_inertial_scale: float = 0.5
    furthest_centre: float = 0.5
    limit_over_usual: Mapping[str | tuple[str, str], float] = field(default_factory=_over_usual)
    scales: tuple[float, float] = (0.2, 5.0)
    sensor_delays: tuple[float, float] = (-0.5, 2.0)
    slowest_sensor: float = 5.0


OFFERED = OfferLimits()
"""The limits of every loop."""
