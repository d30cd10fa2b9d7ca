"""Settings of the stepwise selection by partial correlation with d(t)."""

from __future__ import annotations

from dataclasses import dataclass, field

from aerosid.model_error.swept_model import SweepSettings


@dataclass(frozen=True)
class ModelErrorSearchSettings:
    """Settings of the search.

    Attributes
    ----------
    false_alarm : float
        Share of flights with nothing missing in which something may be named, by design (as the likelihood's search).
    shortlist : int
        Candidates of each round that are fitted: first-order ranks are exact only for small effects.
    rounds : int
        How many may enter.
    price : float
        What each further number must bring in -2 ln L for one candidate to be preferred to a simpler one (as the
        likelihood's search).
    evidence : float
        ln L beyond half of ln N for each number that a name must bring: the field's Bayesian criterion, and odds of
        3000 to 1 beside it, for the colour of the noise is itself estimated. Eight is what an independent regression
        needed on twelve practice flights in turbulence.
    reach : float
        Difference of -2 ln L within which another candidate counts as not told apart: odds of 20 to 1.
    trial_sweeps : int
        Sweeps of a trial fit.
    kept_statistics : bool
        Whether trials hold the statistics of d(t) of the structure before them and a part's gain is its Wald statistic:
        only what then is likeliest is estimated with statistics of its own. Terms, zeros and scales, being linear, are
        tried to first order, and what is not begins from its best scored start alone. Ranks are the same where an
        effect is plain.
    far_ahead : float
        A candidate that must be flown is left out where another one's fit brings so many times its first-order gain;
        0: none is. Four changed no name on 38 own flights (seed 31), where it was chosen.
    nearly_best : float
        Where trials are held: share of the best plain term's first-order worth from which another plain term is tried
        too, since the ranks of what is linear are those of their fits.
    least_share : float
        Share of the significant gain from which a candidate's first-order gain is worth a fit.
    unlike_share : float
        Share of the best first-order gain from which a kind that is far from linear in its number is worth a fit.
    outliers : int
        Moments of the greatest innovations of each flight at which a sudden change is asked for.
    outlying : float
        Squared innovations of a sample beyond their mean, in deviations of chi-square, from which it is one: 8 is met
        by chance in one flight of a thousand samples out of a million.
    jump_stride : int
        A sudden change is asked for at every n-th moment of the grid; at those of the greatest innovations in any case.
    jump_spacing : float
        Steps of the grid of moments within which two sudden changes are one: the second would only mend the edge of the
        first (as the likelihood's search).
    noticed : float
        Times the least spread of d(t), 1, from which it is there at all: 3e-5 of a coefficient. Chosen.
    least_reduction : float
        Share of its spread, memory held, to which d(t) of some coefficient must fall for a term, control or jump to
        have explained it: what leaves d as it was follows it by chance. Found by trial on own flights in gusts and
        stalls.
    most_increase : float
        Times by which a name may raise the spread of d(t), memory held, in any coefficient: it is to explain model
        error and not to need more of it. Half as much again is within the scatter of the spread on records of 500
        samples.
    least_rise : float
        Share of the greatest fall of a spread below which another coefficient's may be whatever it is: a fiftieth of a
        C_Z explained had been refused for 5e-5 in C_X (own flight 36 of seed 2026).
    apparent_mass : float
        Largest force that grows with alphadot, as a share of the aircraft's mass, that is believed: that of air set in
        motion is a few hundredths (Etkin, Dynamics of Atmospheric Flight); near one the equations have no solution.
    asked_at_once : int
        Samples times candidates' columns that are screened in one piece: 1e6 are 64 MB with eight channels. It changes
        no result beyond rounding.
    gusts : bool
        Whether the air may move.
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
