"""Injected effects as JSBSim XML and as time histories of its properties.

Forces and moments act as external ones at the centre of gravity: they fit any aircraft, whatever axes its own
aerodynamics use, and leave those aerodynamics unchanged.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from aerosid.errors import UsageError
from aerosid.flight_model.terms import Term, parse_term
from aerosid.reporting.export.jsbsim_functions import (
    References,
    call,
    function,
    reading,
    term_element,
    total,
    value,
    variable_element,
)
from aerosid.reporting.export.jsbsim_units import FOOT, KNOT, POUNDS_PER_SLUG, SLUG
from aerosid.studies.jsbsim.injected import InjectedEffect
from aerosid.studies.jsbsim.properties import DEVIATIONS, FLAP, GEAR

Array = NDArray[np.float64]

ICED = {
    ("C_Z", "alpha"): -0.10,
    ("C_Z", "q_hat"): -0.0135,
    ("C_Z", "delta_e"): -0.095,
    ("C_m", "alpha"): -0.099,
    ("C_m", "q_hat"): -0.035,
    ("C_m", "delta_e"): -0.10,
}
"""Design: fraction, 1, by which tailplane and wing ice reduce the Twin Otter's derivatives (Bragg et al., AIAA
2000-0360)."""
ICED_DRAG = -0.021
"""Design: increase of C_X due to the ice."""

_WIND_AT_20_FEET = 7.5 * KNOT  # for each step of severity: 15 kt for light turbulence


@dataclass
class Injection:
    """Additions of the effects to a configuration and to a flight.

    Attributes
    ----------
    forces : list of Element
        For `<external_reactions>`.
    properties : list of str
        Properties to be declared, including those of forces.
    places : list of tuple
        Locations to set: pattern of their properties, forward, below and, where needed, right [m].
    drives : dict of str to (F,)
        Histories of properties, absolute.
    thrust_share : (F,)
        Factor on the trim's thrust.
    actuators : dict of str to Element
        Actuators by control.
    inertias : dict of str to float
        I_xx and so on that replace those of the file, kg m^2.
    hysteresis : Element or None
        For `<aerodynamics>`.
    attached : float or None
        An angle of attack at which a stalled flow reattaches, rad.
    point_mass : Element or None
        For `<mass_balance>`.
    after_trim : dict of str to float
        Properties to set at the beginning of the flight.
    """

    forces: list[ET.Element] = field(default_factory=list)
    properties: list[str] = field(default_factory=list)
    places: list[tuple[str, float, float, float]] = field(default_factory=list)
    drives: dict[str, Array] = field(default_factory=dict)
    thrust_share: Array = field(default_factory=lambda: np.ones(0))
    actuators: dict[str, ET.Element] = field(default_factory=dict)
    inertias: dict[str, float] = field(default_factory=dict)
    hysteresis: ET.Element | None = None
    attached: float | None = None
    point_mass: ET.Element | None = None
    after_trim: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Body:
    """The aircraft into which effects are injected.

    Attributes
    ----------
    references : References
        Reference quantities by which terms are made dimensional.
    stock : bool
        Whether it is one of JSBSim, with flaps and gear.
    point_masses : int
        Number of point masses in its mass balance.
    slopes : mapping of (str, str) to float
        Its own derivatives, by coefficient and variable, for effects that change them by a fraction.
    """

    references: References
    stock: bool
    point_masses: int
    slopes: Mapping[tuple[str, str], float]


def inject(effects: Sequence[InjectedEffect], body: Body, frames: Array, interval: float, seed: int) -> Injection:
    """The injection of all effects; sensor effects are not JSBSim's and are applied by the recorder.

    Parameters
    ----------
    effects : sequence of InjectedEffect
    body : Body
    frames : (F,)
        Times of the frames, s.
    interval : float
        s, of the log: a step is a ramp over one of them.
    seed : int
        Seed of the turbulence.

    Raises
    ------
    UsageError
        Where an effect does not fit this aircraft.
    """
    made = Injection(thrust_share=np.ones(frames.size), actuators=_actuators(effects))
    for number, effect in enumerate(effects):
        since = np.ones(frames.size)
        if effect.time is not None:
            since = np.clip((frames - effect.time) / interval, 0.0, 1.0)
        _add(made, effect, body, since, f"aerosid/injected-{number}")
        if effect.kind == "turbulence":
            made.after_trim |= _turbulence(effect.values[0], seed)
    return made


def needs_slopes(effects: Sequence[InjectedEffect]) -> bool:
    """Whether an effect changes the aircraft's own derivatives by a fraction."""
    return any(effect.kind == "icing" for effect in effects)


def _add(made: Injection, effect: InjectedEffect, body: Body, since: Array, switch: str) -> None:
    """One effect of aircraft or air; `since` (F,) is its onset, from 0 to 1."""
    if effect.kind in ("aero_term", "step_change"):
        _switch(made, switch, since)
        terms = [(effect.values[0], parse_term(effect.term or "1"))]
        made.forces.append(_force(switch, effect.where, switch, terms, body))
    elif effect.kind == "icing":
        _switch(made, switch, since)
        for coefficient in ("C_X", "C_Z", "C_m"):
            terms = [
                (effect.values[0] * share * body.slopes[coefficient, name], parse_term(name))
                for (where, name), share in ICED.items()
                if where == coefficient
            ] or [(effect.values[0] * ICED_DRAG, parse_term("1"))]
            made.forces.append(_force(f"{switch}-{coefficient}", coefficient, switch, terms, body))
    elif effect.kind == "inertia":
        if body.stock:
            raise UsageError("the effect inertia needs an aircraft file, whose inertia it takes the place of.")
        made.inertias[effect.where] = effect.values[0]
    elif effect.kind == "thrust_loss":
        made.thrust_share = made.thrust_share * (1.0 - effect.values[0] * since)
    elif effect.kind in ("flap", "gear"):
        if not body.stock:
            raise UsageError(
                f"the effect {effect.kind} needs an aircraft of JSBSim; for an aircraft file give its jumps, as in "
                "step_change:C_m=-0.02@5."
            )
        made.drives[FLAP if effect.kind == "flap" else GEAR] = effect.values[0] * since
    elif effect.kind == "cg_shift":
        mass, forward, below, right = (*effect.values, 0.0, 0.0)[:4]
        index = f"[{body.point_masses}]" if body.point_masses else ""
        made.point_mass = _point_mass()
        made.places.append((f"inertia/pointmass-location-{{X}}-inches{index}", forward, below, right))
        made.drives[f"inertia/pointmass-weight-lbs{index}"] = mass / SLUG * POUNDS_PER_SLUG * since
    elif effect.kind == "ground_effect":
        made.forces.append(_ground_force(switch, effect.values[0]))
    elif effect.kind == "stall_hysteresis":
        low, high, *changes = effect.values
        made.hysteresis = _hysteresis(low, high)
        made.attached = low - 0.05
        for coefficient, change in zip(("C_Z", "C_m", "C_X"), changes, strict=False):
            terms = [(change, parse_term("1"))]
            made.forces.append(_force(f"{switch}-{coefficient}", coefficient, "aero/stall-hyst-norm", terms, body))


def _switch(made: Injection, name: str, since: Array) -> None:
    made.properties.append(name)
    made.drives[name] = since


def _force(name: str, coefficient: str, switch: str, terms: Sequence[tuple[float, Term]], body: Body) -> ET.Element:
    """A force along an axis, or a moment about one, in the current dynamic pressure; `switch` scales it."""
    axis, by = _ACTS[coefficient]
    kind = "moment" if by else "force"
    area = body.references.wing_area / FOOT**2
    scale = area * float(getattr(body.references, by)) / FOOT if by else area
    coefficients = total(
        *(term_element(number, term, lambda name: variable_element(body.references, name)) for number, term in terms)
    )
    magnitude = call("product", reading(switch), reading("aero/qbar-psf"), value(scale), coefficients)
    return _external(kind, name, axis, magnitude)


_ACTS = {
    "C_X": ("x", ""),
    "C_Y": ("y", ""),
    "C_Z": ("z", ""),
    "C_l": ("x", "span"),
    "C_m": ("y", "mean_chord"),
    "C_n": ("z", "span"),
}
"""The axis of a coefficient, and the reference length of a moment."""


def _ground_force(name: str, gain: float) -> ET.Element:
    """The aircraft's own normal force increased by `gain` at the ground, and by exp(-2.48 (2 h/b)^0.768) of it above.

    The influence is Suh and Ostowari's, as quoted by Phillips and Hunsaker, AIAA 2013-2917.
    """
    height = call("max", reading("aero/h_b-mac-ft"), value(0.0))
    power = call("pow", call("product", value(2.0), height), value(0.768))
    fading = call("exp", call("product", value(-2.48), power))
    return _external("force", name, "z", call("product", value(gain), fading, reading("forces/fbz-aero-lbs")))


def _external(kind: str, name: str, axis: str, magnitude: ET.Element) -> ET.Element:
    element = ET.Element(kind, name=name.replace("/", "-"), frame="BODY")
    element.append(function(f"{name}-magnitude", magnitude))
    if kind == "force":
        _point(ET.SubElement(element, "location", unit="IN"), (0.0, 0.0, 0.0))
    _point(ET.SubElement(element, "direction"), tuple(float(axis == own) for own in "xyz"))
    return element


def _point(element: ET.Element, numbers: Sequence[float]) -> None:
    for axis, number in zip("xyz", numbers, strict=True):
        ET.SubElement(element, axis).text = repr(float(number))


def _actuators(effects: Sequence[InjectedEffect]) -> dict[str, ET.Element]:
    """By control, JSBSim's actuator between the commanded deviation from trim and the surface."""
    made: dict[str, ET.Element] = {}
    controls = dict.fromkeys(effect.where for effect in effects if effect.kind.startswith("control_"))
    for control in controls:
        own = (effect for effect in effects if effect.kind.startswith("control_") and effect.where == control)
        numbers = {effect.kind: effect.values[0] for effect in own}
        actuator = made[control] = ET.Element("actuator", name=f"fcs/aerosid/{control}-deviation")
        ET.SubElement(actuator, "input").text = DEVIATIONS[control]
        for kind, tag in (
            ("control_lag", "lag"),
            ("control_rate_limit", "rate_limit"),
            ("control_deadband", "deadband_width"),
            ("control_delay", "delay"),
        ):
            number = numbers.get(kind, 0.0)
            if number:
                # JSBSim: the lag is given as corner frequency [rad/s], the dead band from edge to edge.
                value_there = {"lag": 1.0 / number, "deadband_width": 2.0 * number}.get(tag, number)
                ET.SubElement(actuator, tag).text = repr(value_there)
    return made


def _point_mass() -> ET.Element:
    mass = ET.Element("pointmass", name="shifted")
    ET.SubElement(mass, "weight", unit="LBS").text = "0.0"
    _point(ET.SubElement(mass, "location", unit="IN"), (0.0, 0.0, 0.0))
    return mass


def _hysteresis(reattachment: float, stall: float) -> ET.Element:
    limits = ET.Element("hysteresis_limits", unit="RAD")
    for tag, alpha in (("min", reattachment), ("max", stall)):
        ET.SubElement(limits, tag).text = repr(alpha or 1e-9)  # JSBSim interprets zero as no limits at all
    return limits


def _turbulence(severity: float, seed: int) -> dict[str, float]:
    """JSBSim's Dryden turbulence of MIL-F-8785C; its generator is seeded before it is switched on."""
    return {
        "simulation/randomseed": float(seed % 2**31),
        "atmosphere/randomseed": float(seed % 2**31),
        "atmosphere/turbulence/milspec/windspeed_at_20ft_AGL-fps": _WIND_AT_20_FEET * severity / FOOT,
        "atmosphere/turbulence/milspec/severity": severity,
        "atmosphere/turb-type": 3.0,
    }
