"""Settings of the stepwise selection by partial correlation with d(t)."""

from __future__ import annotations

from dataclasses import dataclass, field

from aerosid.model_error.flight_sweeps.swept_model import SweepSettings


@dataclass(frozen=True)
class ModelErrorSearchSettings:
    """Settings of the search.

    Attributes
    ----------
    false_alarm : float
        False alarm rate: fraction of flights without a missing effect in which one may be named, by design (as the
        likelihood's search).
    shortlist : int
        Candidates of each round that are fitted: first-order ranks are exact only for small effects.
    rounds : int
        Largest number of candidates that enter.
    price : float
        Penalty in -2 ln L for each further parameter (as the likelihood's search).
    evidence : float
        ln L beyond half of ln N for each parameter that a candidate must gain: the Bayesian information criterion, and
        odds of 3000 to 1 in addition, as the colour of the noise is itself estimated. An independent regression needed
        eight on twelve practice flights in turbulence.
    reach : float
        Difference of -2 ln L within which another candidate is indistinguishable: odds of 20 to 1.
    trial_sweeps : int
        Sweeps of a trial fit.
    kept_statistics : bool
        Whether trials hold the statistics of d(t) of the structure before them and a part's gain is its Wald statistic:
        only the likeliest trial is then estimated with statistics of its own. Terms, biases and scale factors, being
        linear, are tried to first order, and nonlinear ones start from their best scored start alone. The ranking is
        the same for a distinct effect.
    far_ahead : float
        A candidate that must be simulated is left out where another one's fit gains so many times its first-order gain;
        0: none is. Four changed no finding on 38 own flights (seed 31), where it was chosen.
    nearly_best : float
        Where trials are held: fraction of the best plain term's first-order net gain from which another plain term is
        tried too, since linear candidates rank as their fits do.
    least_share : float
        Fraction of the significant gain from which a candidate of that first-order gain is fitted.
    unlike_share : float
        Fraction of the best first-order gain from which a kind far from linear in its parameter is fitted.
    outliers : int
        Instants of the largest innovations of each flight at which a step change is tested.
    outlying : float
        Squared innovations of a sample beyond their mean, in standard deviations of chi-square, from which it is an
        outlier: 8 occurs by chance in one flight of a thousand samples out of a million.
    jump_stride : int
        A step change is tested at every n-th instant of the grid; at those of the largest innovations in any case.
    jump_spacing : float
        Steps of the grid of instants within which two step changes are one: the second would only correct the first's
        instant (as the likelihood's search).
    noticed : float
        Ratio to the least standard deviation of d(t), 1, from which d(t) is present: 3e-5 of a coefficient. Chosen.
    least_reduction : float
        Fraction of its standard deviation, memory held, to which d(t) of some coefficient must fall for a term, control
        or step change to have explained it: a candidate that does not reduce d(t) correlates by chance. Found by trial
        on own flights in gusts and stalls.
    most_increase : float
        Largest factor by which a candidate may raise the standard deviation of d(t), memory held, in any coefficient:
        it is to explain model error, not to increase it. Half as much again is within the scatter of that standard
        deviation on records of 500 samples.
    least_rise : float
        Fraction of the largest fall of a standard deviation below which a rise in another coefficient is allowed: a
        fiftieth of a C_Z explained had been rejected for 5e-5 in C_X (own flight 36 of seed 2026).
    apparent_mass : float
        Largest plausible force proportional to alphadot, as a fraction of the aircraft's mass: the apparent mass of the
        air is a few hundredths (Etkin, Dynamics of Atmospheric Flight); near one the equations have no solution.
    asked_at_once : int
        Samples times candidates' columns that are screened in one batch: 1e6 are 64 MB with eight channels. It changes
        no result beyond rounding.
    gusts : bool
        Whether turbulence is tried.
    partial : bool
        Whether candidates are ranked by partial correlation; else by the plain one of the paper's table 3 (for the
        study of stages).
    sweeps : SweepSettings
    """

    false_alarm: float = 0.001
    shortlist: int = 6
    rounds: int = 6
    price: float = 8.0
    evidence: float = 8.0
    reach: float = 6.0
    trial_sweeps: int = 3
    kept_statistics: bool = False
    far_ahead: float = 0.0
    nearly_best: float = 0.9
    least_share: float = 0.5
    unlike_share: float = 0.1
    outliers: int = 3
    outlying: float = 8.0
    jump_stride: int = 1
    jump_spacing: float = 3.0
    noticed: float = 30.0
    least_reduction: float = 0.8
    most_increase: float = 1.5
    least_rise: float = 0.1
    apparent_mass: float = 0.3
    asked_at_once: int = 1_000_000
    gusts: bool = True
    partial: bool = True
    sweeps: SweepSettings = field(default_factory=SweepSettings)
