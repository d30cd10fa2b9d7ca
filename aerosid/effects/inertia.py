"""Moments and product of inertia that differ from the declared ones.

L = I_xx p' - I_xz (r' + p q) + (I_zz - I_yy) q r, M = I_yy q' + (I_xx - I_zz) p r + I_xz (p^2 - r^2) and
N = I_zz r' - I_xz (p' - q r) + (I_yy - I_xx) p q. Where the derivatives of a moment are free, an error of a moment of
inertia is a factor of them all, and an error of the product of inertia couples roll and yaw: only undeclared terms
(such as C_n delta_a, the commoner name) and fast rolls show it.
Source: Etkin & Reid, Dynamics of Flight, 3rd ed., section 4.3; Klein & Morelli, Aircraft System Identification, 3.1.
"""

from __future__ import annotations

from collections.abc import Iterator

from aerosid.effects.family import Family, FlightData, Kind, Offer, Planted, at_null
from aerosid.effects.kinds import BodyEffect, EffectParameter
from aerosid.effects.limits import OFFERED
from aerosid.flight_model.axes import LATERAL

INERTIA = ("I_xx", "I_yy", "I_zz", "I_xz")
"""Moments and product of inertia, as an aircraft file names them."""


def inertia(name: str, size: float) -> BodyEffect:
    """A moment or product of inertia, I_xx, I_yy, I_zz or I_xz, is greater than declared.

    `size` [kg m^2] is its reference: the moment itself, for I_xz the smaller one of roll and yaw.
    """
    limit = OFFERED.largest_inertia * size
    change = EffectParameter(
        "change", "kg m^2", trials=(0.0,), lowest=-limit, highest=limit, step=OFFERED.inertia_step * size
    )
    return BodyEffect("inertia", name, (change,), (name,), "Etkin & Reid, Dynamics of Flight, section 4.3")


def _offered(
    flights: tuple[FlightData, ...], _controls: tuple[str, ...], _coefficients: tuple[str, ...]
) -> Iterator[Offer]:
    """Those in the equations of the case, where it integrates rolling and yawing motion."""
    axes, constants = flights[0].axes, flights[0].constants
    if not {"p", "r"} <= set(axes.integrated):
        return
    sizes = {"I_xz": min(constants.I_xx, constants.I_zz), "I_xx": constants.I_xx, "I_zz": constants.I_zz}
    if "q" in axes.integrated:
        sizes["I_yy"] = constants.I_yy
    for name, size in sizes.items():
        yield Offer("inertia", name, (at_null(inertia(name, size)),))


FAMILY = Family(
    (
        Kind(
            "inertia",
            "inertia",
            "{where} differs from the declared one",
            lambda where, numbers, _interval: inertia(where, abs(numbers["change"]) or 1.0),
            (Planted("I_xz", {"change": 1500.0}, axes=LATERAL),),
            noun="an error of a moment or product of inertia",
            rarity=6.0,
        ),
    ),
    _offered,
)
