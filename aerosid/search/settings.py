"""Settings of the structure search: every threshold with quantity, unit, effect and source.

Where the source names data, the number was found by trial on them, and they are no evidence for it; what was chosen by
reasoning or convention says so. `docs/limits.md` lists the data.
"""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass(frozen=True)
class TrialSettings:
    """Which hypotheses are worth a fit, and where the fits begin.

    Attributes
    ----------
    unlike_share : float
        Share of the best score, 1, from which a kind whose effect is far from linear in its number is fitted too. Less
        costs fits, more loses rate limits behind terms that only follow them. Found on the simulated flights of
        `tests/planted`.
    spline_share : float
        Share of the best score, 1, from which a spline is fitted beside simpler terms: it follows any curve closely.
        Chosen.
    gross : float
        Times a channel's noise, 1, from which a residual may have drawn every estimate far off, and the search begins
        from the declared numbers too. Chosen: three standard deviations.
    restart_share : float
        Share, 1, of what the best trial saves, by which that of a term may stay behind it and the term still be asked
        from the declared numbers. Those further behind came nearer there by at most three tenths of that: found on 39
        simulated practice flights in calm and in moving air.
    profile : int
        Values of an effect of a control at which all else is estimated, so that neighbours differ by less than twice.
        Chosen; the cost is linear in it.
    profile_followed : int
        How many of those values are followed: those where the first linearisation promises most. On 40 flights of
        `benchmarks/detection.py --plant gross`, seed 921, the same is named with the same numbers as where all are.
    profile_reach : float
        Times the largest trial value, 1, up to which they go. Found on the simulated hard flights of `tests/planted`,
        with a surface seconds behind its record.
    calm_left : float
        Share, 1, of what averaging a noisy record brings that a better average could still bring: a lag must bring more
        to be one. Found on the simulated flights with noisy elevators of `tests/planted`.
    jump_spacing : float
        Steps of the grid of moments within which two sudden changes are one: the second mends the edge of the first.
        Chosen.
    """

    unlike_share: float = 0.1
    spline_share: float = 0.9
    gross: float = 3.0
    restart_share: float = 0.1
    profile: int = 10
    profile_followed: int = 3
    profile_reach: float = 3.0
    calm_left: float = 0.5
    jump_spacing: float = 3.0


@dataclass(frozen=True)
class DisturbanceSettings:
    """Searches beside gusts and beside forces of any shape.

    Attributes
    ----------
    beside_gusts : int
        How many may enter beside gusts that kinematics show, before flow separation is asked and all else without
        them. Found on the simulated hard flights of `tests/planted`; each more costs a round.
    no_imitation : float
        Rise of -2 ln L for each measured value, 1, that no wrong name makes good: residuals 2.5 times as large (2 ln
        2.5 = 1.8). Forces of any shape follow a stall, a trim change and thrust too and leave none of them standing;
        what brings the residual in open loop down so far is kept. Found on the ATTAS stall, HFB-320 and Citation
        recordings.
    """

    beside_gusts: int = 2
    no_imitation: float = 1.8


@dataclass(frozen=True)
class SeparationSettings:
    """When flow separation is asked, and what may enter beside it.

    Attributes
    ----------
    beside : int
        How many may enter beside flow separation: each is sought among as many rivals as all that entered before.
        Found on simulated stalls with a slow sensor, `tests/planted`.
    after : int
        How many may enter where separation came first, as few as beside gusts. Found on the ATTAS stall recording.
    patches : int
        Names that together may be a likeness of something else: the lift of a stall alone bends as two of them. Found
        on the simulated hard flights of `tests/planted` and the ATTAS stall recording.
    likeness : float
        Share, 1, of what its likeness brings that separation must bring too, for others to be sought beside it. Found
        on the same flights; less searches doubtful ones for minutes.
    """

    beside: int = 1
    after: int = 2
    patches: int = 3
    likeness: float = 0.9


@dataclass(frozen=True)
class RefutationSettings:
    """What flights that were not fitted refute.

    Attributes
    ----------
    certain : float
        Squared errors in units of the noise, 1, by which a prediction must be worse: five deviations of one sample.
        Chosen.
    share : float
        Share, 1, of the whole by which it must be worse too: a model that is wrong elsewhere predicts a little better
        or worse by chance. Found on the simulated flights of `tests/planted`.
    share_in_gusts : float
        The same where a disturbance is among what was found: no open-loop simulation follows it, and chance is more.
        Found on simulated stalls in gusts, `tests/planted`.
    """

    certain: float = 25.0
    share: float = 0.03
    share_in_gusts: float = 0.25


@dataclass(frozen=True)
class InconsistentSensorSettings:
    """When a fault of one sensor, whose channel alone is left wrong, is no fault.

    Attributes
    ----------
    odd : float
        Times its noise, 1, that the channel must be off with the fault for it to be dropped. Found on the simulated
        hard flights of `tests/planted`.
    mostly : float
        Times what is left, 1, that the channel must be off without the fault for it to be named all the same: it says
        most. Found on the same flights.
    """

    odd: float = 2.0
    mostly: float = 3.0


@dataclass(frozen=True)
class ReplacementSettings:
    """Which rivals are fitted in the place of what was found.

    Attributes
    ----------
    nearly_all : float
        Share, 1, of the loss that a rival may leave and still be fitted: second order errs by less where it wins back
        most. Chosen.
    stand_in_share : float
        Share, 1, of the loss, linear in the number of an effect that is not, from which a stand-in is fitted. Found on
        flights with a late vane: those of `tests/`, and the Twin Otter recording.
    rival_share : float
        Share, 1, of the chosen one's score from which another hypothesis is fitted in its place. Chosen; less costs
        fits.
    otherwise_good : float
        Share, 1, of what a hypothesis brings in the place of a part from which, brought beside it, it is about
        something else. Chosen: half.
    surely_apart : float
        Times the difference in price that decides nothing, 1, within which a rival of a small effect is fitted. Chosen.
    listed : float
        Own deviations from the null value, 1, from which a part of a rival structure is listed. Convention: two.
    """

    nearly_all: float = 0.02
    stand_in_share: float = 0.5
    rival_share: float = 0.75
    otherwise_good: float = 0.5
    surely_apart: float = 20.0
    listed: float = 2.0


@dataclass(frozen=True)
class SuggestionSettings:
    """Terms that a flight suggests and does not prove, and their confirmation by other flights.

    Attributes
    ----------
    suggested : float
        Corrected deviations from zero, 1, from which one candidate, asked for alone, would be believed. Convention of
        flight test.
    tried : int
        How many are fitted in each coefficient; the best is told, as powers of one variable say much the same. Chosen.
    less : float
        Share, 1, of a coefficient's variance unexplained without a term that may be left with it: less gain is worth no
        name. Chosen.
    apart : float
        Standard errors of their difference, 1, from which two numbers of one term are told to differ. Convention.
    """

    suggested: float = 3.0
    tried: int = 2
    less: float = 0.95
    apart: float = 3.0


@dataclass(frozen=True)
class IndistinguishableTermSettings:
    """Terms that one coefficient alone cannot tell from a sensor's or a control's fault.

    Attributes
    ----------
    material : float
        Share, 1, of a coefficient's unexplained variance that an effect must take away before rivals there are of
        interest. Chosen.
    as_good : float
        Share, 1, of that which a term in the effect's place must take away too, to look the same. Chosen.
    more : float
        Share, 1, that a term takes away beside the effect from which it is about something else. Chosen.
    corrected : float
        Share, 1, of the unexplained variance by which an effect may change the coefficient as measured: beyond, its
        regressions are of two quantities. Chosen.
    rows_each : int
        Measured samples for each free term that a coefficient must have. Convention of regression.
    """

    material: float = 0.5
    as_good: float = 0.9
    more: float = 0.1
    corrected: float = 0.01
    rows_each: int = 10


@dataclass(frozen=True)
class AttributionSettings:
    """Settings of the structure search, each with the reason for its value.

    Attributes
    ----------
    false_alarm : float
        Share of flights with nothing missing in which something may be named, by design.
    confirmed : float
        Share of flights in which a term that was suggested by chance may be confirmed by chance, by design. More than
        the other share: few flights suggest one.
    shortlist : int
        Hypotheses that are fitted in each round; the score's ranking is exact only for small effects.
    rounds : int
        How many may enter; beyond, a flight misses something that is no sum of them.
    reach : float
        Difference of -2 ln L, for white residuals, within which another hypothesis counts as not told apart (20:1).
    price : float
        What each further number must bring in -2 ln L for one hypothesis to be preferred to a simpler one.
    final_deviations : float
        By how many of its own final standard errors a named number is at least off none; chosen by convention, as three
        standard errors are what flight test calls significant.
    disturbances : bool
        Whether gusts and forces of any shape are considered where something is left.
    instruments_compared : bool
        Whether kinematics judged the instruments before. Where not, after a search among forces of any shape the rivals
        are compared once more in open loop.
    air_judged : bool
        Whether kinematics judged the air before. Where not, a gust is asked first if it alone says more than the first
        thing that could enter: half of the time of a search.
    trials, gusts, separation, refutation, odd_sensor, replacement, suggestion, coefficient_rivals
        Settings of the parts of the search.
    """

    false_alarm: float = 0.001
    confirmed: float = 0.003
    shortlist: int = 6
    rounds: int = 6
    reach: float = 6.0
    price: float = 8.0
    final_deviations: float = 3.0
    disturbances: bool = True
    instruments_compared: bool = True
    air_judged: bool = True
    trials: TrialSettings = field(default_factory=TrialSettings)
    gusts: DisturbanceSettings = field(default_factory=DisturbanceSettings)
    separation: SeparationSettings = field(default_factory=SeparationSettings)
    refutation: RefutationSettings = field(default_factory=RefutationSettings)
    odd_sensor: InconsistentSensorSettings = field(default_factory=InconsistentSensorSettings)
    replacement: ReplacementSettings = field(default_factory=ReplacementSettings)
    suggestion: SuggestionSettings = field(default_factory=SuggestionSettings)
    coefficient_rivals: IndistinguishableTermSettings = field(default_factory=IndistinguishableTermSettings)
