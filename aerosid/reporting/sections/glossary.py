"""Glossary of the report: symbols with units and positive senses, and the terms of its tables and figures."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from aerosid.flight_model.axes import LATERAL, LONGITUDINAL, planes_of
from aerosid.loop.result import ClosedLoop
from aerosid.nomenclature import CHANNELS
from aerosid.reporting.figures.chart import Chart
from aerosid.reporting.figures.lateral_sign_sketch import lateral_sign_sketch
from aerosid.reporting.figures.numbered import FigureBook
from aerosid.reporting.figures.sign_sketch import sign_sketch


class Term(NamedTuple):
    """A term of the report and its meaning."""

    name: str
    meaning: str


VARIABLES = (
    Term("p_hat", "normalised roll rate, p b / (2 U0), b the whole span"),
    Term("q_hat", "normalised pitch rate, q c / (2 U0)"),
    Term("r_hat", "normalised yaw rate, r b / (2 U0), b the whole span"),
    Term("V_hat", "relative change of airspeed, V/U0 − 1"),
    Term("alpha_dot_hat", "normalised rate of the angle of attack, its derivative times c / (2 U0)"),
    Term("n_z", "load factor, −a_z/g: 1 in level flight"),
    Term("C_X", "axial force coefficient, positive forward: X / (q_bar S)"),
    Term("C_Y", "side force coefficient, positive right: Y / (q_bar S)"),
    Term("C_Z", "normal force coefficient, positive down: Z / (q_bar S)"),
    Term("C_l", "rolling moment coefficient about the centre of gravity, right wing down: L / (q_bar S b)"),
    Term("C_m", "pitching moment coefficient about the centre of gravity, nose up: M / (q_bar S c)"),
    Term("C_n", "yawing moment coefficient about the centre of gravity, nose right: N / (q_bar S b)"),
    Term("C_L", "lift coefficient, across the flight path"),
    Term("C_D", "drag coefficient, along the flight path"),
)
"""Names in terms that are not channels."""

TERMS = (
    Term("declared", "The aircraft file as given."),
    Term(
        "re-estimated (before)",
        "The declared structure with its derivatives estimated on the identification flights, by the same estimator "
        "and weights as the completed model, so that re-estimation alone does not count as an improvement.",
    ),
    Term("completed (after)", "The declared structure with the identified effects, all estimated together."),
    Term(
        "trimmed",
        "The completed model with the constants of the force and moment coefficients re-estimated on that flight.",
    ),
    Term("identification, validation", "Flights used in the estimate; flights that are only predicted."),
    Term(
        "open loop",
        "Simulated from an initial state estimated on the flight, driven by measured inputs alone, no measurement "
        "fed back.",
    ),
    Term("error", "Root-mean-square of measured minus simulated, open loop."),
    Term("noise", "Standard deviation of a channel's white measurement noise, estimated from the recording."),
    Term("standard error", "Standard deviation of an estimate, corrected for coloured residuals."),
    Term(
        "log-likelihood difference 2Δln L",
        "Twice the difference of the log-likelihoods of two models on the same flights; large: the data favour "
        "the first.",
    ),
    Term(
        "p-value",
        "Probability of so large an estimate if the effect were absent, corrected for the number of hypotheses tested.",
    ),
    Term(
        "model error d(t)",
        "Time history of the coefficient missing from the equations of motion (Parameswaran and Raol 1994).",
    ),
    Term(
        "correlation",
        "Of d(t) with a candidate term, both filtered by the same estimator; in tables, of two estimates.",
    ),
    Term(
        "variance inflation", "Factor by which estimating the other parameters as well increases the variance of one."
    ),
    Term("recursive least squares", "Estimate of the paper's chain from d(t), before the maximum-likelihood estimate."),
    Term(
        "not significant",
        "A derivative on which the flights contain too little information; its value is not measured.",
    ),
    Term(
        "turbulence sigma_w, L_w",
        "Vertical wind of standard deviation sigma_w, exponentially correlated over the scale length L_w.",
    ),
    Term("R²", "Fraction of the variance of the measurement explained by the simulation."),
    Term("Theil's U", "Inequality coefficient: 0 for a perfect simulation, 1 for the worst."),
)
"""Terms of the report in reading order."""


_SKETCHES: dict[str, tuple[Callable[[], Chart], str, str]] = {
    LONGITUDINAL.name: (
        sign_sketch,
        "Positive senses of axes, angles, the pitch rate and the elevator.",
        (
            "Aircraft from the side, nose to the right. Body x forward, z down; positive angle of attack: the nose "
            "above the flight path; positive pitch angle: the nose above the horizon; positive pitch rate and moment: "
            "nose up; positive elevator: trailing edge down."
        ),
    ),
    LATERAL.name: (
        lateral_sign_sketch,
        "Positive senses of sideslip, roll, yaw, aileron and rudder: from above, and from behind.",
        (
            "Aircraft from above, nose to the right, and from behind. Body x forward, y right, z down; positive "
            "sideslip: the wind from the right; positive yaw rate and moment: nose right; positive roll rate, bank "
            "angle and rolling moment: right wing down; positive aileron: right trailing edge down; positive rudder: "
            "trailing edge left."
        ),
    ),
}
"""For each plane of the motion: the sketch, its caption and its text."""


def context(result: ClosedLoop, figures: FigureBook) -> dict[str, Any]:
    """The channels of the logs, the variables of the model's terms, the report's terms, and the sketches of signs."""
    logs = (*result.identification, *result.validation)
    channels = dict.fromkeys(name for log in logs for name in log.channels if name in CHANNELS)
    in_terms = result.completed_aircraft.variables | {row.coefficient for row in result.derivatives}
    sketches = (_SKETCHES[plane.name] for plane in planes_of(result.aircraft.axes))
    return {
        "sketches": [figures.add(draw(), caption, label) for draw, caption, label in sketches],
        "channels": [CHANNELS[name] for name in channels],
        "variables": [variable for variable in VARIABLES if variable.name in in_terms],
        "terms": TERMS,
    }
