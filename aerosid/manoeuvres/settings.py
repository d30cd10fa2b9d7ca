"""Thresholds of the search for manoeuvres, each with its quantity, unit, effect and source.

Times are given in units of V/g. Flights of dynamically similar aircraft have V^2 in proportion to length, so that every
mode's period is in proportion to V/g: the phugoid's is sqrt(2) pi V/g = 4.44 V/g (Lanchester), short period and Dutch
roll lie between 0.1 and 0.8 V/g. Pitch rates are given as load factor, q V/g.
"""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["FinderSettings"]


@dataclass(frozen=True)
class FinderSettings:
    """What counts as steady, lively, held or free.

    Attributes
    ----------
    one_record : float
        s; and `one_record_units` V/g: what lasts longer than both is a flight and no manoeuvre. A phugoid of five
        periods lasts 22 V/g.
    one_record_units : float
        V/g, as above.
    standing_share : float
        Of a log in which the aircraft stands: what holds more is no manoeuvre.
    hole : float
        Median sampling intervals without a sample, past which the record is cut and nothing is found across.
    finest_raster : float
        V/g; faster recordings are averaged to it. A tenth of the shortest rise time of a surface.
    standing : float
        m/s; below it an aircraft stands, and its altitude is the ground's.
    flying_share : float
        Of the flight's 95 % quantile of airspeed: below it nothing flies. Cruise to stall is at most about 3.
    clear_of_ground : float
        m above that ground from which on the aircraft flies.
    climb_out : float
        V/g after lift-off and before touch-down that hold configuration changes and no test.
    rest_share : float
        Of the largest travel of a surface in 0.3 V/g of the flight: below it the surface is at rest.
    rest_answer : float
        Of what is lively: a surface is at rest only while it travels no more than makes so much of an answer, taking
        the ratio of the flight's largest answer to its largest travel.
    rest_noise : float
        Standard deviations of the surface's noise within which it is at rest too.
    still_window : float
        V/g; over which travel is judged: one short period.
    lively_pitch : float
        q V/g, from which on the pitch motion is lively. Light turbulence stays below (0.1 g, MIL-F-8785C 3.7).
    lively_roll : float
        p V/g, rad, the same in roll: a wing-rock of light turbulence stays below.
    lively_yaw : float
        r V/g, rad, beyond that of the turn that the bank makes.
    clear_answer : float
        Peak q V/g, in g, of a deliberate pitch input of recognised shape: twice what is lively.
    clear_step : float
        Change of measured load factor of a deliberate single step: less is flown to change speed or path.
    clear_roll : float
        Peak p V/g, rad, of an aileron input; an autopilot enters turns with about half of it.
    clear_yaw : float
        Peak r V/g, rad, of a rudder input.
    lead_in : float
        V/g of quiet flight that a test begins with, and that a cut takes along: its trim.
    lead_share : float
        Of the input's amplitude: what the surface may move in the lead-in.
    lobe_level : float
        Of an input's amplitude: a lobe begins where the deflection exceeds it.
    narrow : float
        Of the median width: a lobe that is narrower is an overshoot.
    lobe_join : float
        V/g; lobes of one sign that are this near are one.
    longest_hold : float
        V/g; an input that has not come back after it is a change of trim.
    longest_unit : float
        V/g; widest shortest lobe of an input that is to excite the short period or Dutch roll: about its period.
    comes_back : float
        Share of the amplitude by which the level after the input may differ from the level before.
    width_factor : float
        By which the width of a lobe may be off its pattern's; 1.5 is as far from 2:1 as from 1:1 and a little more.
    busy : float
        Of the range of a sweep or multisine: largest range of its surface in the V/g before and after.
    clear_train : float
        Times `clear_roll` or `clear_yaw`: answer to a train of steps of aileron or rudder, which hands fly in turns.
    square : float
        Share of the time between first and last edge that a stepwise input spends beyond 0.6 of its amplitude; a sine
        spends 0.59 there, a triangle 0.4.
    pause : float
        Of the shortest lobe: longest pause between the lobes of a doublet or 3-2-1-1; with longer ones it is steps.
    sweep_cycles : float
        Fewest cycles of a frequency sweep, and of a multisine.
    sweep_order : float
        Rank correlation of half periods with time, from which on their order is a sweep.
    trim_least : float
        s; shortest trim point.
    trim_length : float
        V/g; longest: one phugoid period, over which what is left of that mode averages out.
    trim_middle : float
        Share of a steady stretch that one trim point may take.
    trim_speed : float
        Range of the airspeed over its mean.
    trim_acceleration : float
        g; mean change of airspeed.
    trim_pitch : float
        Root-mean-square q V/g, g.
    trim_bank : float
        rad; largest bank.
    trim_climb : float
        Range of the slope of the flight path, averaged over 0.5 V/g, rad.
    trim_travel : float
        Of the largest travel of the elevator in 0.3 V/g of flight: what it may travel in a trim point.
    turn_bank : float
        rad; bank from which on a turn is one.
    turn_least : float
        V/g; shortest turn.
    steady_bank : float
        rad; by which bank may vary in a steady turn.
    steady_least : float
        V/g; shortest steady turn.
    phugoid_cycles : float
        Fewest cycles.
    phugoid_speed : float
        Fewest amplitude of airspeed over its mean.
    phugoid_period : (float, float)
        V/g; Lanchester's 4.44 with drag, compressibility and static stability about it.
    phugoid_damping : float
        Largest damping ratio; a slower change of speed is no oscillation.
    phugoid_exchange : float
        Largest correlation of speed with height about their straight lines: one is paid for with the other.
    phugoid_fit : float
        Share of the variance of V that one damped oscillation explains.
    spiral_least : float
        V/g; shortest spiral.
    spiral_bank : float
        rad; least mean bank.
    spiral_change : float
        rad; by how much bank must go its own way, so that nobody holds it.
    dutch_roll_period : (float, float)
        V/g.
    dutch_roll_lobes : int
        Half cycles of yaw rate that exceed a sixth of the largest: two cycles.
    roll_change : float
        rad; least bank change of a roll at held aileron.
    stall_slowing : (float, float)
        g; mean deceleration of an approach to the stall; 1 kt/s is 0.052 (CS 25.201).
    stall_least : float
        V/g; shortest deceleration: to lose 0.12 of the airspeed at 1 kt/s takes 2.3 (CS 25.103(b), 25.201(c)).
    stall_loss : float
        Of the airspeed at its beginning: what it loses at least. Stalls are approached from 1.13 times the stalling
        speed or more (CS 25.103(b)), which is a loss of 0.12; half of it is asked, as many end at the warning.
    stall_drop : float
        rad; by how much the nose drops, or is lowered, at its end.
    steady_speed : float
        g; largest change of airspeed over V/g before steps that are no standard input: a test begins trimmed.
    path_change : float
        rad; largest change of the flight path's slope by a train of steps, and 1.5 times that by a single one: a
        level-off makes more.
    answer_longest : float
        V/g; longest that an answer is followed after its input: two short periods.
    lead_answer : float
        Of the largest answer: what the aircraft may answer in the lead-in.
    lead_answer_shaped : float
        The same before an input of a standard shape, which may follow another one.
    level_bank : float
        rad; bank beyond which an elevator input is not flown with wings level.
    decayed : float
        Of its peak: where an answer has died away.
    onset : float
        V/g; longest rise of a step to 0.8 of its level: past it, it is flown by hand.
    plain : float
        Least `square` of a single step: a rounded movement of the hand has less.
    stepwise : float
        Least share of the time of a train of steps within a fifth of each one's median.
    like_level : float
        Smallest over largest level of a train of steps.
    held : float
        Least share of a single step in which the surface is held.
    step_held : float
        V/g; a first step that is held longer has shown its short period, whose period is shorter, and what follows is
        the recovery: no train of steps. Asked for by the Citation's short period, which is no evidence for it.
    held_travel : float
        Of the amplitude: by what a held surface may travel in 0.1 V/g.
    flat_pulse : float
        Least share held of a step that is to be taken although its answer is weak.
    clear_pulse : float
        g; q V/g of a single short pulse that is more than a correction.
    deliberate : float
        Of the largest travel of a surface: what ends another surface's free answer.
    half_cycle : float
        Of the largest: what a half cycle of an oscillation must reach.
    dutch_roll_longest : float
        V/g; longest that a Dutch roll is followed.
    roll_held : float
        V/g; least time for which the aileron of a roll is held: several roll-mode time constants.
    flat_aileron : float
        Of its level: by which a held aileron may be off.
    stall_load : float
        By which the load factor may be off 1 in an approach to the stall.
    stall_break : float
        V/g after the deceleration in which the nose must drop.
    stall_demand : float
        Of the flight's highest angle of attack near 1 g: what an approach to the stall must reach.
    stall_recovery : float
        V/g; longest recovery that is followed.
    push_over_least : float
        V/g; shortest time below 0.1 more than that.
    push_over : float
        Load factor below which a push-over goes.
    pull_left : float
        Share of the pull-up's load factor that still stands where a push-over begins; a step that is held until its
        answer has gone is no push-over.
    push_over_movements : int
        Movements of pull-up, push-over and pull-out; more of one size are a designed train.
    recovered : int
        Pulses of a step, the push and the pull after it; more are a train.
    started : float
        Share of the amplitude, 1, at which a movement has begun: a tenth, as for rise times.
    """

    one_record: float = 300.0
    one_record_units: float = 40.0
    standing_share: float = 0.02
    hole: float = 5.0
    finest_raster: float = 0.005
    standing: float = 10.0
    flying_share: float = 0.3
    clear_of_ground: float = 10.0
    climb_out: float = 10.0
    rest_share: float = 0.05
    rest_answer: float = 0.5
    rest_noise: float = 6.0
    still_window: float = 0.3
    lively_pitch: float = 0.1
    lively_roll: float = 0.35
    lively_yaw: float = 0.35
    clear_answer: float = 0.2
    clear_step: float = 0.3
    clear_roll: float = 0.8
    clear_yaw: float = 0.6
    lead_in: float = 0.3
    lead_share: float = 0.2
    lobe_level: float = 0.35
    narrow: float = 0.25
    lobe_join: float = 0.05
    longest_hold: float = 2.5
    longest_unit: float = 0.3
    comes_back: float = 0.4
    width_factor: float = 1.5
    busy: float = 0.35
    clear_train: float = 1.5
    square: float = 0.5
    pause: float = 0.6
    sweep_cycles: float = 4.0
    sweep_order: float = 0.85
    trim_least: float = 15.0
    trim_length: float = 4.44
    trim_middle: float = 0.75
    trim_speed: float = 0.025
    trim_acceleration: float = 0.006
    trim_pitch: float = 0.035
    trim_bank: float = 0.07
    trim_climb: float = 0.03
    trim_travel: float = 0.2
    turn_bank: float = 0.105
    turn_least: float = 1.0
    steady_bank: float = 0.03
    steady_least: float = 2.0
    phugoid_cycles: float = 1.25
    phugoid_speed: float = 0.012
    phugoid_period: tuple[float, float] = (3.3, 6.7)
    phugoid_damping: float = 0.2
    phugoid_exchange: float = -0.7
    phugoid_fit: float = 0.8
    spiral_least: float = 3.5
    spiral_bank: float = 0.07
    spiral_change: float = 0.06
    dutch_roll_period: tuple[float, float] = (0.1, 0.8)
    dutch_roll_lobes: int = 4
    roll_change: float = 0.6
    stall_slowing: tuple[float, float] = (0.004, 0.2)
    stall_least: float = 2.0
    stall_loss: float = 0.06
    stall_drop: float = 0.05
    push_over_least: float = 0.25
    push_over: float = 0.5
    pull_left: float = 0.5
    push_over_movements: int = 3
    recovered: int = 3
    started: float = 0.1
    steady_speed: float = 0.025
    answer_longest: float = 0.6
    path_change: float = 0.1
    lead_answer: float = 0.35
    lead_answer_shaped: float = 0.5
    level_bank: float = 0.26
    decayed: float = 0.1
    onset: float = 0.25
    plain: float = 0.6
    stepwise: float = 0.75
    like_level: float = 0.4
    held: float = 0.45
    step_held: float = 0.8
    held_travel: float = 0.15
    flat_pulse: float = 0.8
    clear_pulse: float = 0.5
    deliberate: float = 0.2
    half_cycle: float = 0.15
    dutch_roll_longest: float = 4.0
    roll_held: float = 0.25
    flat_aileron: float = 0.25
    stall_load: float = 0.15
    stall_break: float = 1.0
    stall_demand: float = 0.9
    stall_recovery: float = 3.0
