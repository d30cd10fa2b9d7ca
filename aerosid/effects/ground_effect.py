"""Ground effect on lift, drag and pitching moment by height over span.

    C_Z, C_L, C_D:  C = C_free (1 + gain sigma(h/b))        C_X, C_m:  C = C_free + gain sigma(h/b)
    sigma(h/b) = exp(-2.48 (2 h/b)^0.768)

h is the height above the ground, b the wing's span: `reach`, which is estimated too, since an aircraft file contains
neither the wing's height above the centre of gravity nor the span itself; it starts at wing area over mean chord. The
height is the simulated altitude less the ground's, which is `h` less the log's channel `h_agl`, the height above the
ground, or zero where there is none.

Source: sigma is the reduction of induced drag by the ground, as fitted by Suh and Ostowari and quoted by Phillips and
Hunsaker, AIAA 2013-2917. JSBSim's tables of lift and drag over aero/h_b-mac-ft (c172p) are 1 + 0.25 sigma and 1 - sigma
to 0.02 from h/b = 0.1 on.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from aerosid.effects.family import Family, FlightData, Kind, Offer, Planted, at_null
from aerosid.effects.kinds import EffectParameter, Signal, StateEffect
from aerosid.effects.limits import OFFERED
from aerosid.effects.step_change import offset_column
from aerosid.flight_model.motion_laws import Law, influence

PROPORTIONAL = ("C_Z", "C_L", "C_D")


def ground_effect(coefficient: str, reach: float) -> StateEffect:
    """A coefficient changes near the ground; `reach` [m] is where the estimate of the span starts."""
    return StateEffect(
        "ground_effect",
        coefficient,
        (
            EffectParameter("gain", "1", trials=(0.0,), lowest=-3.0, highest=3.0, step=1e-3),
            EffectParameter("reach", "m", trials=(reach,), lowest=0.1 * reach, highest=10.0 * reach, step=2e-3 * reach),
        ),
        Law.GROUND,
        (0.0, reach),
        (0, 1),
        coefficient,
        (offset_column(coefficient),),
        "Phillips & Hunsaker, AIAA 2013-2917",
        proportional=coefficient in PROPORTIONAL,
    )


def with_fixed_reach(whole: StateEffect, reach: float) -> StateEffect:
    """The effect with its reach fixed, for the test of a hypothesis."""
    return replace(
        whole, parameters=whole.parameters[:1], given=(0.0, reach), places=(0,), whole=ground_effect(whole.where, reach)
    )


def _offered(
    flights: tuple[FlightData, ...], _controls: tuple[str, ...], coefficients: tuple[str, ...]
) -> Iterator[Offer]:
    """Every coefficient where a flight comes near the ground."""
    near_ground = [flight for flight in flights if flight.height is not None and _varies(flight.height, flight.span)]
    if near_ground:
        for name in coefficients:
            for fraction in OFFERED.reaches:
                reach = fraction * near_ground[0].span
                yield Offer("ground_effect", name, (at_null(with_fixed_reach(ground_effect(name, reach), reach)),))


def _varies(height: Signal, span: float) -> bool:
    """Whether a flight comes near the ground, and not below it, where its altitude is no height above ground."""
    known = height[np.isfinite(height)]
    return bool(
        known.size
        and known.min() > -OFFERED.below_ground * span
        and np.ptp(influence(known, span)) > OFFERED.least_influence
    )


FAMILY = Family(
    (
        Kind(
            "ground_effect",
            "coefficient",
            "{where} shows ground effect",
            lambda where, numbers, _interval: ground_effect(where, numbers["reach"]),
            (Planted("C_Z", {"gain": 0.25, "reach": 14.6}, altitude=5.0),),
        ),
    ),
    _offered,
)
