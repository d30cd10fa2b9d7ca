"""Flow separation with memory: lift breaks down late and comes back late, drag and pitching moment follow."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from aerosid.effects.family import Family, Kind, Planted
from aerosid.effects.kinds import EffectParameter, Signal, StateEffect
from aerosid.effects.operators import lagged
from aerosid.effects.step_change import offset_column


def separation_point(
    time: Signal, alpha: Signal, sharpness: float, alpha_star: float, delay: float, relaxation: float
) -> Signal:
    """The flow separation point X along the chord, 1 attached to 0 separated at the leading edge, (N,).

    relaxation X' + X = 1/2 {1 - tanh[sharpness (alpha - delay alpha' - alpha_star)]}

    Parameters
    ----------
    time, alpha : (N,) s, rad.
    sharpness, alpha_star : 1/rad, rad.
    delay, relaxation : s.
    """
    rate = np.gradient(alpha, time)
    static = 0.5 * (1.0 - np.tanh(sharpness * (alpha - delay * rate - alpha_star)))
    return np.clip(lagged(time, static[:, None], relaxation)[:, 0], 0.0, 1.0)


def flow_separation(alpha_highest: float, lift: str, others: tuple[str, ...]) -> StateEffect:
    """Goman and Khrabrov's separation point with Kirchhoff's lift, linear in 1 - X for the other coefficients.

    Parameters
    ----------
    alpha_highest : float
        Largest angle of attack of the flight, rad: the flow separates somewhere near it.
    lift : str
        C_Z or C_L: the share ((1 + sqrt X)/2)^2 of its alpha derivative's lift is left.
    others : tuple of str
        Coefficients that change with 1 - X.
    """

    def offsets(time: Signal, alpha: Signal, slope: float, p: tuple[float, ...]) -> dict[str, Signal]:
        point = separation_point(time, alpha, p[0], p[1], p[2], p[3])
        lost = (0.5 * (1.0 + np.sqrt(point))) ** 2 - 1.0
        changes = {offset_column(lift): slope * alpha * lost}
        for name, value in zip(others, p[4:], strict=True):
            changes[offset_column(name)] = value * (1.0 - point)
        return changes

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
            EffectParameter("delay", "s", trials=(0.2,), lowest=0.0, highest=3.0, step=1e-3),
            EffectParameter("relaxation", "s", trials=(0.2,), lowest=0.0, highest=3.0, step=1e-3),
            *(EffectParameter(name, "1", trials=(0.0,), lowest=-2.0, highest=2.0, step=1e-4) for name in others),
        ),
        lambda motion, p: offsets(motion.time, motion.alpha, motion.slope, (p[1], p[0], *p[2:])),
        lift,
        tuple(offset_column(name) for name in (lift, *others)),
        "Goman & Khrabrov 1994; Jategaonkar, Flight Vehicle System Identification, quasi-steady stall",
    )


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
