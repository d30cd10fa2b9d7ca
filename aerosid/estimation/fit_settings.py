"""Settings of a maximum-likelihood fit: of a final estimate, of a trial, of one beside a disturbance."""

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
