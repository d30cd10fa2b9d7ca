"""Settings of the structure search: every threshold with quantity, unit, effect and source.

Where the source names data, the value was tuned on them, so that they are no evidence for it; values chosen by
reasoning or convention are marked so. `docs/limits.md` lists the data.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from aerosid.effects import ActiveEffect
from aerosid.effects.kinds import axes_of


@dataclass(frozen=True)
class TrialSettings:
    """Selection of the hypotheses for trial fits, and the starts of the fits.

    Attributes
    ----------
    unlike_share : float
        Fraction of the best score, 1, from which a kind far from linear in its parameter is fitted too. Less costs
        fits, more loses rate limits behind terms that only imitate them. Found on the simulated flights of
        `tests/planted`.
    spline_share : float
        Fraction of the best score, 1, from which a spline is fitted together with simpler terms: it approximates any
        curve closely. Chosen.
    gross : float
        Ratio of a residual to the channel's noise, 1, above which every estimate may be far off, and the search is
        restarted from the declared values. Chosen: three standard deviations.
    restart_share : float
        Fraction, 1, of the best trial's gain by which a term's trial may stay behind it and the term still be restarted
        from the declared values. Terms further behind improved there by at most three tenths of that: found on 39
        simulated practice flights in calm and in moving air.
    profile : int
        Values of a control effect at which everything else is estimated (profile likelihood), so that neighbours differ
        by less than a factor of two. Chosen; the cost is linear in it.
    profile_followed : int
        Number of those values whose fits are completed: those of the best likelihood predicted by the first
        linearisation. On 40 flights of `benchmarks/detection.py --plant gross`, seed 921, the findings and their values
        are the same as where all fits are completed.
    profile_reach : float
        Largest of those values over the largest trial value, 1. Found on the simulated hard flights of `tests/planted`,
        with a surface seconds behind its record.
    calm_left : float
        Fraction, 1, of the gain from averaging a noisy record that a better average could still add: a lag must gain
        more. Found on the simulated flights with noisy elevators of `tests/planted`.
    jump_spacing : float
        Steps of the grid of instants within which two step changes are one: the second corrects the first's instant.
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
    """Searches in the presence of gusts and of unmodelled forces.

    Attributes
    ----------
    beside_gusts : int
        Largest number of hypotheses that enter in the presence of gusts shown by kinematics, before flow separation is
        tried and all others without gusts. Found on the simulated hard flights of `tests/planted`; each more costs a
        round.
    no_imitation : float
        Rise of -2 ln L for each measured value, 1, that no false effect recovers: residuals 2.5 times as large (2 ln
        2.5 = 1.8). Unmodelled forces follow a stall, a trim change and thrust too, which are then eliminated; parts
        that reduce the open-loop residual by so much are retained. Found on the ATTAS stall, HFB-320 and Citation
        recordings.
    """

    beside_gusts: int = 2
    no_imitation: float = 1.8


@dataclass(frozen=True)
class SeparationSettings:
    """Conditions under which flow separation is tried, and the number of hypotheses that enter with it.

    Attributes
    ----------
    beside : int
        Largest number of hypotheses that enter after flow separation: each is selected among as many candidates as all
        that entered before. Found on simulated stalls with a slow sensor, `tests/planted`.
    after : int
        The same where separation enters first, as few as with gusts. Found on the ATTAS stall recording.
    patches : int
        Number of terms that together may imitate flow separation: the lift of a stall alone resembles two of them.
        Found on the simulated hard flights of `tests/planted` and the ATTAS stall recording.
    likeness : float
        Fraction, 1, of the imitating parts' gain that separation must reach, for others to be tried with it. Found on
        the same flights; less spends minutes on doubtful ones.
    """

    beside: int = 1
    after: int = 2
    patches: int = 3
    likeness: float = 0.9


@dataclass(frozen=True)
class RefutationSettings:
    """Elimination by cross-validation on flights that were not fitted.

    Attributes
    ----------
    certain : float
        Squared errors in units of the noise, 1, by which a prediction must be worse: five standard deviations of one
        sample. Chosen.
    share : float
        Fraction, 1, of the total by which it must be worse too: a model with other errors predicts a little better or
        worse by chance. Found on the simulated flights of `tests/planted`.
    share_in_gusts : float
        The same where the structure holds a disturbance, which no open-loop simulation follows: random differences are
        larger. Found on simulated stalls in gusts, `tests/planted`.
    """

    certain: float = 25.0
    share: float = 0.03
    share_in_gusts: float = 0.25


@dataclass(frozen=True)
class InconsistentSensorSettings:
    """Elimination of an error of a single inconsistent sensor, whose channel alone keeps a residual.

    Attributes
    ----------
    odd : float
        Ratio, 1, of the channel's residual with the sensor error to its noise from which the error is eliminated. Found
        on the simulated hard flights of `tests/planted`.
    mostly : float
        Ratio, 1, of the channel's residual without the sensor error to that with it from which the error is retained
        all the same, as it explains most. Found on the same flights.
    """

    odd: float = 2.0
    mostly: float = 3.0


@dataclass(frozen=True)
class ReplacementSettings:
    """Selection of the competing hypotheses that are fitted in place of a found part.

    Attributes
    ----------
    nearly_all : float
        Fraction, 1, of the loss that a competitor may leave and still be fitted: the error of the second-order
        expansion is less where it recovers most. Chosen.
    stand_in_share : float
        Fraction, 1, of the loss, linearised for an effect that is nonlinear, from which a collinear hypothesis is
        fitted. Found on flights with a late vane: those of `tests/`, and the Twin Otter recording.
    rival_share : float
        Fraction, 1, of the found part's score from which another hypothesis is fitted in its place. Chosen; less costs
        fits.
    otherwise_good : float
        Fraction, 1, of a hypothesis' gain in place of a part from which its gain in addition to the part shows that it
        explains something else. Chosen: half.
    surely_apart : float
        Times the insignificant difference in penalised cost, 1, within which a competitor of a small effect is fitted.
        Chosen.
    listed : float
        t-ratio, 1, from which a part of a competing structure is listed. Convention: two.
    """

    nearly_all: float = 0.02
    stand_in_share: float = 0.5
    rival_share: float = 0.75
    otherwise_good: float = 0.5
    surely_apart: float = 20.0
    listed: float = 2.0


@dataclass(frozen=True)
class SuggestionSettings:
    """Near-significant terms, and their confirmation by validation flights.

    Attributes
    ----------
    suggested : float
        Corrected t-ratio, 1, from which a single candidate, tested alone, is significant. Convention of flight test.
    tried : int
        Number of terms fitted in each coefficient; the best is reported, as powers of one variable are nearly
        collinear. Chosen.
    less : float
        Largest unexplained variance of a coefficient with the term over that without it, 1: a smaller reduction does
        not confirm the term. Chosen.
    apart : float
        Standard errors of their difference, 1, from which two estimates of one term are reported to differ. Convention.
    """

    suggested: float = 3.0
    tried: int = 2
    less: float = 0.95
    apart: float = 3.0


@dataclass(frozen=True)
class IndistinguishableTermSettings:
    """Terms that one coefficient alone cannot distinguish from an error of a sensor or control.

    Attributes
    ----------
    material : float
        Fraction, 1, of a coefficient's unexplained variance that an effect must explain before such terms there are of
        interest. Chosen.
    as_good : float
        Fraction, 1, of that variance that a term in the effect's place must explain. Chosen.
    more : float
        Fraction, 1, explained by a term in addition to the effect from which it explains something else. Chosen.
    corrected : float
        Fraction, 1, of the unexplained variance by which an effect may change the coefficient as measured: beyond, the
        two regressions have different dependent variables. Chosen.
    rows_each : int
        Measured samples for each free term that a coefficient must have. Convention of regression.
    """

    material: float = 0.5
    as_good: float = 0.9
    more: float = 0.1
    corrected: float = 0.01
    rows_each: int = 10


@dataclass(frozen=True)
class UnreachedPositionSettings:
    """When a surface never reaches its recorded position, and what its effectiveness is known by then.

    Attributes
    ----------
    tried : float
        Reduction of the limit, as a fraction of it, 1, by which the excursion has to shrink as well. Chosen.
    proportional : float
        Deviation from proportional shrinking, 1, over that of the excursion itself, up to which the surface never
        arrives; one that arrives in any of its movements deviates by tenths. Chosen.
    effectiveness : float
        Standard deviation, 1, of a declared control derivative over its size, where the aircraft file states none:
        estimates from geometry differ from flight by a quarter (Roskam, Airplane Flight Dynamics, appendix B). Chosen.
    """

    tried: float = 0.1
    proportional: float = 0.1
    effectiveness: float = 0.25


@dataclass(frozen=True)
class DeclaredInertiaSettings:
    """When derivatives that differ from their declared values are a wrong product of inertia.

    Attributes
    ----------
    usual : float
        Standard deviation, 1, of a declared derivative over its size, where the aircraft file states none. As
        `UnreachedPositionSettings.effectiveness`.
    deviations : float
        Standard deviations, 1, beyond which a derivative differs from its declared value, and which the change of the
        product of inertia must reach. Convention.
    fewest : int
        Least number of variables whose derivatives differ, and agree with the change: one number always explains one
        derivative. By reasoning.
    left : float
        Largest fraction, 1, of the sum of squared distances from the declared values that may remain. Chosen.
    """

    usual: float = 0.25
    deviations: float = 3.0
    fewest: int = 2
    left: float = 0.25


@dataclass(frozen=True)
class ShownError:
    """An instrument error that kinematics show, without any aerodynamic model.

    `kind`, `where`: as of an effect; `axis`: of a position, the first of its body axes; `value`, `std_error`: of its
    leading parameter.
    """

    kind: str
    where: str
    axis: str
    value: float
    std_error: float

    def is_that_of(self, active: ActiveEffect, deviations: float) -> bool:
        """Whether an effect is this error, its leading parameter within so many standard errors."""
        apart = abs(active.values[0] - self.value)
        return (*active.name, axes_of(active)[:1]) == (
            self.kind,
            self.where,
            self.axis,
        ) and apart <= deviations * self.std_error


@dataclass(frozen=True)
class AttributionSettings:
    """Settings of the structure search, each with the reason for its value.

    Attributes
    ----------
    false_alarm : float
        False alarm rate: fraction of flights without a missing effect in which one may be named, by design.
    confirmed : float
        Fraction of flights in which a falsely suggested term may be falsely confirmed, by design. Larger than the false
        alarm rate, as few flights suggest a term.
    shortlist : int
        Hypotheses that are fitted in each round; the score's ranking is exact only for small effects.
    rounds : int
        Largest number of hypotheses that enter; beyond, the missing effect is no sum of hypotheses.
    doubted : int
        Hypotheses entered by a search without disturbances that leave the model inadequate, beyond which the equations
        are begun beside it. Of 94 simulated flights those with an adequate model had it after one or two.
    reach : float
        Difference of -2 ln L, for white residuals, within which another hypothesis is indistinguishable (20:1).
    price : float
        Penalty in -2 ln L for each further parameter.
    final_deviations : float
        Critical t-ratio of a finding's final estimate; chosen by convention, as three standard errors are significant
        in flight test.
    disturbances : bool
        Whether gusts and unmodelled forces are tried where the model is inadequate.
    instruments_compared : bool
        Whether kinematics tested the instruments before. Where not, after a search with unmodelled forces the competing
        structures are compared once more in open loop.
    air_judged : bool
        Whether kinematics tested the air before. Where not, a gust is tried first if it alone gains more than the first
        hypothesis that could enter: half of the time of a search.
    shown_by_kinematics : tuple of ShownError
        Instrument errors that kinematics of all flights show, with those that they cannot tell from them.
    reported : bool
        Whether a report gives the gain of each found term by a fit without it, and near-significant terms. In a study
        the gain is Wald's statistic, and terms are suggested only to be confirmed by validation flights.
    trials, gusts, separation, refutation, odd_sensor, replacement, suggestion, coefficient_rivals, unreached, inertia
        Settings of the parts of the search.
    """

    false_alarm: float = 0.001
    confirmed: float = 0.003
    shortlist: int = 6
    rounds: int = 6
    doubted: int = 2
    reach: float = 6.0
    price: float = 8.0
    final_deviations: float = 3.0
    disturbances: bool = True
    instruments_compared: bool = True
    air_judged: bool = True
    shown_by_kinematics: tuple[ShownError, ...] = ()
    reported: bool = True
    trials: TrialSettings = field(default_factory=TrialSettings)
    gusts: DisturbanceSettings = field(default_factory=DisturbanceSettings)
    separation: SeparationSettings = field(default_factory=SeparationSettings)
    refutation: RefutationSettings = field(default_factory=RefutationSettings)
    odd_sensor: InconsistentSensorSettings = field(default_factory=InconsistentSensorSettings)
    replacement: ReplacementSettings = field(default_factory=ReplacementSettings)
    suggestion: SuggestionSettings = field(default_factory=SuggestionSettings)
    coefficient_rivals: IndistinguishableTermSettings = field(default_factory=IndistinguishableTermSettings)
    unreached: UnreachedPositionSettings = field(default_factory=UnreachedPositionSettings)
    inertia: DeclaredInertiaSettings = field(default_factory=DeclaredInertiaSettings)
