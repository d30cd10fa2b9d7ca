"""The one glossary: symbol, name, unit and positive sense of every channel that aerosid knows.

Docs, CSV headers, tables and exports are generated from it. Body axes are x forward, y right, z down.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Kind = Literal["output", "input", "other"]


@dataclass(frozen=True)
class Channel:
    """One entry of the glossary.

    Attributes
    ----------
    symbol : str
        The name in logs, terms and results.
    name : str
        What it is, in words.
    unit : str
        The unit it is held in, SI and radians, as pint reads it; `1` where there is none.
    positive : str
        The positive sense, or the reference.
    kind : {"output", "input", "other"}
        `output`: an answer of the longitudinal model, compared with the simulation where measured.
        `input`: may drive a simulation. `other`: an answer that is not compared, or an auxiliary quantity.
    """

    symbol: str
    name: str
    unit: str
    positive: str
    kind: Kind


_GLOSSARY = (
    Channel("time", "time", "s", "strictly increasing", "other"),
    Channel("V", "true airspeed", "m/s", "forward", "output"),
    Channel("alpha", "angle of attack", "rad", "nose above the flow", "output"),
    Channel("beta", "sideslip angle", "rad", "wind from the right", "input"),
    Channel("u", "velocity along body x", "m/s", "forward", "other"),
    Channel("v", "velocity along body y", "m/s", "right", "other"),
    Channel("w", "velocity along body z", "m/s", "down", "other"),
    Channel("p", "roll rate", "rad/s", "right wing down", "input"),
    Channel("q", "pitch rate", "rad/s", "nose up", "output"),
    Channel("r", "yaw rate", "rad/s", "nose right", "input"),
    Channel("phi", "bank angle", "rad", "right wing down", "input"),
    Channel("theta", "pitch angle", "rad", "nose up", "output"),
    Channel("psi", "heading", "rad", "nose right", "other"),
    Channel("a_x", "specific force along body x at the centre of gravity", "m/s^2", "forward", "output"),
    Channel("a_y", "specific force along body y at the centre of gravity", "m/s^2", "right", "other"),
    Channel(
        "a_z", "specific force along body z at the centre of gravity", "m/s^2", "down; level flight -9.81", "output"
    ),
    Channel("p_dot", "roll acceleration", "rad/s^2", "right wing down", "other"),
    Channel("q_dot", "pitch acceleration", "rad/s^2", "nose up", "output"),
    Channel("r_dot", "yaw acceleration", "rad/s^2", "nose right", "other"),
    Channel("delta_e", "elevator deflection", "rad", "trailing edge down (C_m_delta_e < 0)", "input"),
    Channel("delta_a", "aileron deflection", "rad", "right trailing edge down", "input"),
    Channel("delta_r", "rudder deflection", "rad", "trailing edge left", "input"),
    Channel("delta_f", "flap deflection", "rad", "trailing edge down", "input"),
    Channel("delta_h", "stabiliser trim", "rad", "trailing edge down", "input"),
    Channel("q_bar", "dynamic pressure", "Pa", "always", "other"),
    Channel("rho", "air density", "kg/m^3", "always", "input"),
    Channel("h", "altitude", "m", "up", "output"),
    Channel("h_agl", "height above the ground", "m", "up", "other"),
    Channel("thrust", "thrust", "N", "forward", "input"),
    Channel("mass", "mass", "kg", "always", "input"),
    Channel("fuel_used", "fuel used", "kg", "always", "other"),
    Channel("fuel_flow", "fuel flow", "kg/s", "always", "other"),
    Channel("mach", "Mach number", "1", "always", "other"),
)

CHANNELS: dict[str, Channel] = {channel.symbol: channel for channel in _GLOSSARY}

_SURFACE = "delta_"  # with which the name of a control surface's deflection begins


def is_surface(channel: str) -> bool:
    """Whether a channel is the deflection of a control surface, by its name: a log may have more than the glossary."""
    return channel.startswith(_SURFACE)
