"""Flow separation with memory: delayed loss and recovery of lift, with drag and pitching moment.

The flow separates at the point X of the chord, 1 attached to 0 separated at the leading edge:

    relaxation X' + X = 1/2 {1 - tanh[sharpness (alpha - delay alpha' - alpha_star)]}
    C_Z or C_L:  C = C_attached + C_alpha alpha {((1 + sqrt X)/2)^2 - 1}        others:  C = C_attached + value (1 - X)
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from aerosid.effects.family import Family, Kind, Planted
from aerosid.effects.kinds import ActiveEffect, EffectParameter, StateEffect
from aerosid.effects.limits import OFFERED
from aerosid.effects.step_change import offset_column
from aerosid.flight_model.motion_laws import Law


def longest_separation(mean_chord: float, airspeeds: Iterable[float]) -> float:
    """Longest plausible delay or relaxation of flow separation, s: what is slower is no flow over the wing.

    `mean_chord`: m; `airspeeds`: m/s, of the flights, the slowest of which counts.
    """
    return min(OFFERED.longest_separation, OFFERED.separation_chords * mean_chord / min(airspeeds))


def flow_separation(
    alpha_highest: float, lift: str, others: tuple[str, ...], longest: float = OFFERED.longest_separation
) -> StateEffect:
    """Goman and Khrabrov's separation point with Kirchhoff's lift, linear in 1 - X for the other coefficients.

    Parameters
    ----------
    alpha_highest : float
        Largest angle of attack of the flight, rad: the flow separates somewhere near it.
    lift : str
        C_Z or C_L: the fraction ((1 + sqrt X)/2)^2 of its alpha derivative's lift remains.
    others : tuple of str
        Coefficients that change with 1 - X.
    longest : float
        Greatest delay and relaxation, s.
    """
    return StateEffect(
        "flow_separation",
        lift,
        (
            EffectParameter(
                "alpha_star",
                "rad",
                trials=(alpha_highest + 0.03, alpha_highest - 0.02),
                lowest=0.02,
                highest=alpha_highest + 0.2,
                step=1e-4,
            ),
            EffectParameter("sharpness", "1/rad", trials=(25.0,), lowest=2.0, highest=150.0, step=0.05),
            EffectParameter("delay", "s", trials=(0.2,), lowest=0.0, highest=longest, step=1e-3),
            EffectParameter("relaxation", "s", trials=(0.2,), lowest=0.0, highest=longest, step=1e-3),
            *(EffectParameter(name, "1", trials=(0.0,), lowest=-2.0, highest=2.0, step=1e-4) for name in others),
        ),
        Law.SEPARATION,
        (0.0,) * (4 + len(others)),
        tuple(range(4 + len(others))),
        lift,
        tuple(offset_column(name) for name in (lift, *others)),
        "Goman & Khrabrov 1994; Jategaonkar, Flight Vehicle System Identification, quasi-steady stall",
    )


def is_breakdown(active: ActiveEffect) -> bool:
    """Whether the flow separates within the flown range of alpha.

    A static curve at its limit of flatness, or about an angle at its limit, is a nonlinearity of lift at all angles and
    no separation; one whose delay or relaxation is at its limit follows a drift.
    """
    (angle, sharpness, *times), (alpha_star, slope, *lags) = active.effect.parameters[:4], active.values[:4]
    is_prompt = all(lag < time.highest for time, lag in zip(times, lags, strict=True))
    return angle.lowest < alpha_star < angle.highest and slope > sharpness.lowest and is_prompt


def _made(where: str, numbers: Mapping[str, float], _interval: float) -> StateEffect:
    others = tuple(name for name in numbers if name.startswith("C_"))
    return flow_separation(numbers["alpha_star"], where, others)


FAMILY = Family(
    (
        Kind(
            "flow_separation",
            "coefficient",
            "{where} shows flow separation",
            _made,
            (
                Planted(
                    "C_Z",
                    {
                        "alpha_star": 0.12,
                        "sharpness": 25.0,
                        "delay": 0.15,
                        "relaxation": 0.2,
                        "C_X": -0.05,
                        "C_m": -0.03,
                    },
                ),
            ),
            negative=False,
        ),
    ),
)
