"""A-priori response of a coefficient to the difference of its vane from the path.

A gust changes the flow angle, and the coefficients respond by their derivatives with respect to it; to the noise of the
vane nothing responds. The regression of a coefficient on the vane's difference from the path is therefore between zero,
in calm air, and the derivative, in gusts that are large compared with the vane's noise. In calm air the difference
contains the errors of the path, which damping resembles: where the record alone determined the response, C_m responded
to the Twin Otter's vane with the opposite sign of its derivative, twice as large, and C_m q_hat was -30.6; without a
response it is -34.2 (published: -36). So the response has an a-priori value, half the derivative, and a standard
deviation of as much. In gusts a record is far more accurate than that and determines it. To the rotary gust that the
vane's rate shows the moments respond by their derivatives with respect to the angular rate, with the same widths.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from aerosid.flight_model.aerodynamics import AerodynamicModel, Entry
from aerosid.flight_model.terms import parse_term

BY_FLOW_ANGLE: Mapping[str, Mapping[Entry, float]] = {
    "C_Z": {("C_Z", parse_term("alpha")): 1.0, ("C_L", parse_term("alpha")): -1.0},
    "C_m": {("C_m", parse_term("alpha")): 1.0},
    "C_Y": {("C_Y", parse_term("beta")): 1.0},
    "C_l": {("C_l", parse_term("beta")): 1.0},
    "C_n": {("C_n", parse_term("beta")): 1.0},
}
"""Physical: signs of the derivatives by which the coefficients respond to a gust. C_X is not among them: it responds by
the lift, which turns with the flow, more than by the drag, and is left to the record."""

BY_RATE: Mapping[str, Entry] = {
    "C_m": ("C_m", parse_term("q_hat")),
    "C_l": ("C_l", parse_term("r_hat")),
    "C_n": ("C_n", parse_term("r_hat")),
}
"""Physical: the derivatives by which the moments respond to a rotary gust."""

FORCE_OF = {"C_m": "C_Z", "C_l": "C_Y", "C_n": "C_Y"}
"""The force of whose lever each moment is the product."""


@dataclass(frozen=True)
class GustResponseSettings:
    """Width of what is expected; chosen, no other values were tried on recordings.

    Attributes
    ----------
    share : float
        Mean and standard deviation of the response as a fraction, 1, of the derivative: nothing and all of it are one
        standard deviation away.
    lever : float
        Further standard deviation of a moment's response as a fraction, 1, of its force's derivative: a gust meets the
        wing before the tail, and a tenth of a chord, or of the span, is the lever.
    least : mapping of str to float
        Least size of a force's derivative, 1/rad, for those widths: an aircraft file may declare a placeholder. Half to
        two thirds of what aircraft have.
    """

    share: float = 0.5
    lever: float = 0.1
    least: Mapping[str, float] = field(default_factory=lambda: {"C_Z": 3.0, "C_Y": 0.3})


GUST_RESPONSE = GustResponseSettings()
"""Of every regression."""


@dataclass(frozen=True)
class GustResponse:
    """A-priori response of one coefficient to the vane's difference from the path.

    Attributes
    ----------
    derivatives : mapping of Entry to (float, float)
        Terms to which its mean is proportional: factor of each, and the declared value, which counts where the term is
        not estimated.
    deviation : float
        Standard deviation, by the declared values.
    """

    derivatives: Mapping[Entry, tuple[float, float]]
    deviation: float


def derivative_by_flow_angle(coefficient: str, model: AerodynamicModel) -> float:
    """Response of a coefficient to a gust by the model's linear derivatives, 1/rad; zero without one."""
    return sum(factor * value for factor, value in _derivatives(coefficient, model).values())


def expected_gust_responses(model: AerodynamicModel) -> dict[str, GustResponse]:
    """The a-priori response of each coefficient of a declared model that has a derivative by the flow angle."""
    found = {}
    for coefficient in BY_FLOW_ANGLE:
        derivatives = _derivatives(coefficient, model)
        if derivative_by_flow_angle(coefficient, model) == 0.0:
            continue
        by_lever = GUST_RESPONSE.lever * _size(FORCE_OF[coefficient], model) if coefficient in FORCE_OF else 0.0
        found[coefficient] = GustResponse(
            {entry: (GUST_RESPONSE.share * factor, value) for entry, (factor, value) in derivatives.items()},
            float(np.hypot(GUST_RESPONSE.share * _size(coefficient, model), by_lever)),
        )
    return found


def expected_rotary_responses(model: AerodynamicModel) -> dict[str, GustResponse]:
    """The a-priori response of each moment of a declared model to the rotary gust that its vane shows."""
    share = GUST_RESPONSE.share
    values = {name: (entry, model.value(entry)) for name, entry in BY_RATE.items() if entry in model.places}
    return {
        name: GustResponse({entry: (share, value)}, share * abs(value))
        for name, (entry, value) in values.items()
        if value != 0.0
    }


def _size(coefficient: str, model: AerodynamicModel) -> float:
    """Size of a derivative by the flow angle, of a force no less than a placeholder may be."""
    return max(abs(derivative_by_flow_angle(coefficient, model)), GUST_RESPONSE.least.get(coefficient, 0.0))


def _derivatives(coefficient: str, model: AerodynamicModel) -> dict[Entry, tuple[float, float]]:
    """Sign and value of the model's terms among those by which a coefficient responds."""
    signs = BY_FLOW_ANGLE.get(coefficient, {}).items()
    return {entry: (sign, model.value(entry)) for entry, sign in signs if entry in model.places}
