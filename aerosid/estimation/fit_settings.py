"""Settings of maximum-likelihood fits and of the tests of their residuals."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class RefinementSettings:
    """Settings of the maximisation, each with the reason for its value.

    Attributes
    ----------
    steps : int
        Levenberg-Marquardt steps; five to ten are usual, more means a wrong model.
    rounds : int
        Rounds in which the statistics of disturbances and everything else are estimated in turn.
    step_tolerance : float
        A step below this fraction of the standard deviation of every parameter changes no printed digit.
    variance_tolerance : float
        Negligible relative change of a noise variance.
    cost_tolerance : float
        Negligible decrease of -2 ln L in one step.
    disturbances : bool
        Whether the statistics of disturbances are estimated too, or held.
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

INNOVATIONS = RefinementSettings(steps=6, rounds=2, step_tolerance=0.03, variance_tolerance=0.03, cost_tolerance=2.0)
"""Of residuals that are tested: two of -2 ln L of thousands of samples change none of them. A stall
in turbulence took 2,251 evaluations for the last hundredth of it."""

WRONG_STRUCTURE = RefinementSettings(cost_tolerance=0.05)
"""A wrong structure converges slowly along a flat valley; a twentieth of -2 ln L changes none of its errors."""

NEARBY = RefinementSettings(cost_tolerance=1.0, variance_tolerance=0.1)
"""From another flight's estimate: the remaining decrease of a wrong structure is negligible against its error."""


@dataclass(frozen=True)
class DampedStepSettings:
    """Settings of the damped Gauss-Newton steps; none of them changes the converged estimate.

    Attributes
    ----------
    least_change : float
        Least relative change, 1, of a noise variance that is tried where it reduces the likelihood. Chosen.
    part_of_change : float
        Fraction, 1, to which the change of the noise variances is reduced where it reduces the likelihood. With a half
        a stall in turbulence took sixteen evaluations a step.
    trusted : float
        Damping, 1, up to which a step is nearly the full Gauss-Newton step: a small last one is taken without
        evaluation. Chosen.
    weightings : int
        Rounds in which a step and the noise variances at its end are computed in turn.
    settled : float
        Change, 1, of a variance's logarithm in such a round that changes the step by less than its own curvature does.
    decides_nothing : float
        Of -2 ln L: a tenth is far below any significant difference of two structures.
    """

    least_change: float = 0.02
    part_of_change: float = 0.125
    trusted: float = 1e-2
    weightings: int = 20
    settled: float = 0.01
    decides_nothing: float = 0.1


DAMPED_STEPS = DampedStepSettings()
"""Of every fit."""


@dataclass(frozen=True)
class NoiseSearchSettings:
    """Settings of the estimation of noise variances and of the statistics of disturbances.

    Attributes
    ----------
    widest : float
        Factor, 1, by which a variance may change from its start: from the sensor's noise to the whole signal.
    turns : int
        Quasi-Newton steps between two updates of the motion.
    least_fall : float
        Decrease of -2 ln L from which the motion is updated again. Chosen.
    difference : float
        Relative step, 1, of a disturbance's parameter from which the slope of its noise is taken. Chosen.
    """

    widest: float = 1e5
    turns: int = 20
    least_fall: float = 1e-2
    difference: float = 1e-6


NOISE_SEARCH = NoiseSearchSettings()
"""Of every fit."""


@dataclass(frozen=True)
class CompetingFitSettings:
    """Early termination of competing fits, and of the fits of a continuation from filter form to open loop.

    Attributes
    ----------
    most_of_promise : float
        Factor, 1, on the decrease predicted by a linearisation, which nonlinearity can exceed. Less terminates fits
        that would become the best. Chosen.
    leading_steps : int
        Most steps at each noise factor of the continuation, whose next factor continues the fit anyway.
    as_predicted : float
        Fraction of the predicted decrease, 1, from which the linearisation is taken to hold over a first step: what is
        predicted after it is then within `most_of_promise`, as after a second one. Chosen.
    returning : float
        Squared distance from a known estimate, in standard deviations, over that before a step, 1, up to which in two
        successive steps a fit from elsewhere returns to that estimate. Of 144 restarts on flights as those of
        `benchmarks/detection.py`, seed 700, 136 returned, 92 of them so; of the other eight none.
    """

    most_of_promise: float = 3.0
    leading_steps: int = 20
    as_predicted: float = 0.9
    returning: float = 0.1


COMPETING_FITS = CompetingFitSettings()
"""Of all competing fits."""


@dataclass(frozen=True)
class ResidualTestSettings:
    """Limits of the residual tests, and of a candidate's collinearity.

    Attributes
    ----------
    noise_ratio : float
        Ratio of a residual to the log's own white noise, 1: that noise is known to 5-15 %.
    as_remembered : float
        Ratio of a residual to coloured noise of its memory, 1, estimated from the log's white noise. That is known from
        its high-frequency part alone, within 25 %; intermittent noise, as of held samples, leaves more.
    recorded_ratio, recorded_share : float
        What a residual has to exceed where a recorder hides the noise: its ratio to the log's own white noise, 1 (of
        noise that the recorder colours, up to 1.7 is seen, and up to 6 of a rate sampled at 10 Hz), and the mean square
        of its means over the time below over the variance of the channel in the record, 1. Chosen on eight clean pairs
        in calm air (benchmarks/turbulent_false_alarms.py, seed 336); the share was lowered from .005 for a simulated
        gyro that swings by itself (tests/loop/test_identification.py), after seed 338.
    recorder_memory : float
        Time, s, over whose means such a residual has to be coloured: longer than a recorder's filter remembers, shorter
        than the motion. Found on lateral and six-axis flights with nothing missing, in calm air behind filters of 5 and
        6 Hz (benchmarks/sideways_detection.py, seed 81), and on a pitching moment that lacks a term in alpha^2 for
        twelve seconds (tests/estimation/test_residual_tests.py).
    sensor_memory : float
        The same, s, in still air, where the coefficients' residuals are tested against the controls too: longer than a
        sensor's coloured noise remembers, since what is left for that test to miss is slow, as a drift of the trim.
        Chosen on clean flights of an independent simulator whose noise has a memory of 0.3 s: their residuals repeat
        themselves over .2 s and no longer.
    least_share : float
        Mean square over the variance of the channel in the record, 1, that a residual must exceed to count in the
        verdict, whatever its noise: interpolation and integration leave as much. Chosen on a clean flight of an
        independent simulator with a twentieth of the usual noise, .000002 to .000007; flights that lack an effect leave
        .0004 and more.
    coloured_ratio : float
        Least kinematic residual of any channel over its white noise, 1, from which on a recorder hides the noise: with
        one instrument at fault in white noise .9 to 1.1 (blind practice flights with planted faults of q, theta and
        alpha), behind a recorder 1.5 to 2.5 (seed 341 of the same benchmark). The geometric mean.
    fewest : int
        Samples of a channel below which its residual is not tested.
    quick_shortfall : float
        Factor by which the published correction is too small on records of some hundred samples, 1: 2.5-7 % of coverage
        at 95 %.
    least_independence : float
        Sum of squares of the orthogonalised sensitivity over that of the sensitivity, 1, below which a candidate is
        collinear with the present parameters: 0.3 % of its effect is its own. Chosen.
    """

    noise_ratio: float = 1.3
    as_remembered: float = 1.5
    recorded_ratio: float = 2.0
    recorded_share: float = 0.003
    recorder_memory: float = 0.2
    sensor_memory: float = 1.0
    least_share: float = 3e-5
    coloured_ratio: float = 1.25
    fewest: int = 20
    quick_shortfall: float = 1.15
    least_independence: float = 1e-5


RESIDUAL_TESTS = ResidualTestSettings()
"""Of every estimate."""
