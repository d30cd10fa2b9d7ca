"""Settings of maximum-likelihood fits and of the tests of their residuals."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class RefinementSettings:
    """Settings of the search, each with the reason for its value.

    Attributes
    ----------
    steps : int
        Levenberg-Marquardt steps; five to ten are usual, more means a wrong model.
    rounds : int
        Rounds in which the statistics of disturbances and everything else are estimated in turn.
    step_tolerance : float
        A step below this share of the standard deviation of every parameter changes no printed digit.
    variance_tolerance : float
        Relative change of a noise variance that counts as none.
    cost_tolerance : float
        Fall of -2 ln L in one step that decides nothing any more.
    disturbances : bool
        Whether the statistics of disturbances are estimated too, or kept.
    hold_states : bool
        Whether the initial states keep their start values.
    hold_variance : bool
        Whether the outputs' noise variances keep their start values.
    filtering : bool
        Whether the noise of measured inputs is accounted for; otherwise plain output error.
    """

    steps: int = 60
    rounds: int = 12
    step_tolerance: float = 1e-3
    variance_tolerance: float = 1e-3
    cost_tolerance: float = 1e-3
    disturbances: bool = True
    hold_states: bool = False
    hold_variance: bool = False
    filtering: bool = True


USUAL = RefinementSettings()
"""A final estimate."""

TRIAL = RefinementSettings(
    steps=16, step_tolerance=0.03, variance_tolerance=0.02, cost_tolerance=1.0, disturbances=False
)
"""A trial decides between hypotheses that differ by many units of -2 ln L: a few steps are enough."""


BACKGROUND = RefinementSettings(steps=30, rounds=5, step_tolerance=0.03, variance_tolerance=0.01, cost_tolerance=0.1)
"""As a trial, with the size of the disturbance estimated too."""

WRONG_STRUCTURE = RefinementSettings(cost_tolerance=0.05)
"""A wrong structure creeps along a flat valley for long; a twentieth of -2 ln L moves none of its errors."""

NEARBY = RefinementSettings(cost_tolerance=1.0, variance_tolerance=0.1)
"""From a start that another flight gave: what a wrong structure still creeps is nothing beside what it lacks."""


@dataclass(frozen=True)
class DampedStepSettings:
    """Settings of the damped Gauss-Newton steps; none of them moves the estimate that a fit ends in.

    Attributes
    ----------
    least_change : float
        Relative change, 1, of a noise variance that is no longer tried where it makes the flight less likely. Chosen.
    trusted : float
        Damping, 1, up to which the last step is nearly the whole one: where it is small, it is taken without a look.
        Chosen.
    weightings : int
        Rounds in which a step and the noise variances that it promises are found in turn.
    settled : float
        Change, 1, of a variance's logarithm in such a round that moves the step by less than its own curvature does.
    decides_nothing : float
        Of -2 ln L: a tenth is far below what tells two structures apart.
    """

    least_change: float = 0.02
    trusted: float = 1e-2
    weightings: int = 20
    settled: float = 0.01
    decides_nothing: float = 0.1


DAMPED_STEPS = DampedStepSettings()
"""Of every fit."""


@dataclass(frozen=True)
class NoiseSearchSettings:
    """Settings of the search of noise variances and of the statistics of disturbances.

    Attributes
    ----------
    widest : float
        Times, 1, by which a variance may move from where it stands: from the sensor's noise to the whole signal.
    turns : int
        Quasi-Newton steps of one search; the motion then moves too, and the search goes on from there.
    least_fall : float
        Fall of -2 ln L that is worth another look at the motion. Chosen.
    """

    widest: float = 1e5
    turns: int = 20
    least_fall: float = 1e-2


NOISE_SEARCH = NoiseSearchSettings()
"""Of every fit."""


@dataclass(frozen=True)
class CompetingFitSettings:
    """Which of several fits are followed to their end.

    Attributes
    ----------
    most_of_promise : float
        Times, 1, the fall that a linearisation promises: where the problem bends, a step finds more than was promised.
        Less gives up fits that would win. Chosen.
    leading_steps : int
        Steps at each factor by which noise is lowered on the way to an estimate: the next one begins anew anyway.
    dealt_out : float
        Seconds of work from which on one step of all is dealt out to the cores: a copy of the process takes some .02 s.
        Changes no number. Chosen.
    """

    most_of_promise: float = 3.0
    leading_steps: int = 20
    dealt_out: float = 0.1


COMPETING_FITS = CompetingFitSettings()
"""Of every contest."""


@dataclass(frozen=True)
class ResidualTestSettings:
    """When a residual is more than the sensors' noise, and when a candidate is one of its own.

    Attributes
    ----------
    noise_ratio : float
        Times the log's own white noise, 1: that noise is known to 5-15 %.
    as_remembered : float
        Times what its memory makes of the log's white noise, 1. That noise is known from its rough part alone, within
        25 %; what comes and goes, as samples that hang, has more left.
    fewest : int
        Samples of a channel below which its residual is not judged.
    quick_shortfall : float
        Times by which the published correction falls short on records of some hundred samples, 1: 2.5-7 % of cover at
        95 %.
    least_independence : float
        Share of a candidate's squares, 1, that what is there already cannot imitate, below which it is another name for
        terms already there: 0.3 % of its effect is its own. Chosen.
    """

    noise_ratio: float = 1.3
    as_remembered: float = 1.5
    fewest: int = 20
    quick_shortfall: float = 1.15
    least_independence: float = 1e-5


RESIDUAL_TESTS = ResidualTestSettings()
"""Of every estimate."""
