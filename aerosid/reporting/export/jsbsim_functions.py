"""Terms and their variables as JSBSim functions; JSBSim's properties are converted from ft, lb and s to SI."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from xml.etree.ElementTree import Element

from aerosid.errors import AircraftError
from aerosid.flight_model.terms import Factor, Term
from aerosid.reporting.export.jsbsim_units import FOOT, POUND_FORCE, SLUG

CHANNEL_PROPERTIES: Mapping[str, tuple[str, float]] = MappingProxyType(
    {
        "delta_e": ("fcs/elevator-pos-rad", 1.0),
        "delta_a": ("fcs/right-aileron-pos-rad", 1.0),
        "delta_r": ("fcs/rudder-pos-rad", 1.0),
        "delta_f": ("fcs/flap-pos-rad", 1.0),
        "beta": ("aero/beta-rad", 1.0),
        "mach": ("velocities/mach", 1.0),
        "p": ("velocities/p-aero-rad_sec", 1.0),
        "r": ("velocities/r-aero-rad_sec", 1.0),
        "phi": ("attitude/phi-rad", 1.0),
        "theta": ("attitude/theta-rad", 1.0),
        "rho": ("atmosphere/rho-slugs_ft3", SLUG / FOOT**3),
        "thrust": ("forces/fbx-prop-lbs", POUND_FORCE),
        "mass": ("inertia/mass-slugs", SLUG),
    }
)
"""Channel -> JSBSim's property and the factor from its unit to SI."""

_RATES: Mapping[str, tuple[str, str]] = MappingProxyType(
    {
        "p_hat": ("velocities/p-aero-rad_sec", "span"),
        "q_hat": ("velocities/q-aero-rad_sec", "mean_chord"),
        "r_hat": ("velocities/r-aero-rad_sec", "span"),
        "alpha_dot_hat": ("aero/alphadot-rad_sec", "mean_chord"),
    }
)
"""Nondimensional rate -> JSBSim's property [rad/s] and the reference length."""


@dataclass(frozen=True)
class References:
    """Constants by which rates and speeds become the variables of terms.

    Attributes
    ----------
    wing_area, mean_chord : float
        m^2, m.
    airspeed_of_rates : float or None
        U0 of p_hat, q_hat, r_hat and alpha_dot_hat, m/s; None: the current airspeed.
    airspeed_of_V_hat : float or None
        U0 of V_hat, m/s.
    properties : mapping of str to (str, float)
        Channels with another JSBSim property than in `CHANNEL_PROPERTIES`, with factors to SI.
    where : str
        Name of the aircraft, for messages.
    span : float or None
        Full span, m, of p_hat and r_hat.
    """

    wing_area: float
    mean_chord: float
    airspeed_of_rates: float | None
    airspeed_of_V_hat: float | None
    properties: Mapping[str, tuple[str, float]] = field(default_factory=dict)
    where: str = ""
    span: float | None = None


def channel_property(references: References, channel: str) -> tuple[str, float]:
    """The JSBSim property of a channel, and the factor from its unit to SI.

    Raises
    ------
    AircraftError
        Where JSBSim does not have the channel.
    """
    found = references.properties.get(channel) or CHANNEL_PROPERTIES.get(channel)
    if found is None:
        raise AircraftError(
            f"{references.where}: a term names the channel {channel}, which JSBSim does not know; name the property "
            "that stands for it, or delete the term."
        )
    return found


def variable_element(references: References, name: str) -> Element:
    """The JSBSim expression of a variable of terms, in SI.

    Raises
    ------
    AircraftError
        Where JSBSim does not have the channel, or the airspeed of V_hat is missing.
    """
    if name == "alpha":
        return reading("aero/alpha-rad")
    if name in _RATES:
        rate, length = reading(_RATES[name][0]), float(getattr(references, _RATES[name][1]) or 0.0)
        if references.airspeed_of_rates is not None:
            return call("product", rate, value(length / (2.0 * references.airspeed_of_rates)))
        # At rest the rates are meaningless, but the quotient must stay finite.
        speed = call("max", reading("velocities/vt-fps"), value(1.0))
        return call("quotient", call("product", rate, value(length / FOOT / 2.0)), speed)
    if name == "V_hat":
        if references.airspeed_of_V_hat is None:
            raise AircraftError(
                f"{references.where}: a term holds V_hat, but no airspeed U0 is given; add reference.airspeed [m/s]."
            )
        ratio = call("product", reading("velocities/vt-fps"), value(FOOT / references.airspeed_of_V_hat))
        return call("difference", ratio, value(1.0))
    if name == "C_T":
        thrust, to_newton = channel_property(references, "thrust")
        scale = to_newton / POUND_FORCE / (references.wing_area / FOOT**2)
        pressure = call("max", reading("aero/qbar-psf"), value(1e-3))
        return call("quotient", call("product", reading(thrust), value(scale)), pressure)
    source, factor = channel_property(references, name)
    return reading(source) if factor == 1.0 else call("product", reading(source), value(factor))


def term_element(number: float, term: Term, variable: Callable[[str], Element]) -> Element:
    """A multiple of a term, with the expression of each variable from `variable`."""
    if not term.factors:
        return value(number)
    return call("product", value(number), *(_factor(factor, variable) for factor in term.factors))


def _factor(factor: Factor, variable: Callable[[str], Element]) -> Element:
    base = variable(factor.variable)
    if factor.shape == "abs":
        base = call("abs", base)
    elif factor.shape == "pos":
        shifted = call("difference", base, value(factor.offset)) if factor.offset else base
        base = call("max", shifted, value(0.0))
    return base if factor.power == 1 else call("pow", base, value(float(factor.power)))


def total(*addends: Element) -> Element:
    """The sum of the operands; JSBSim's own needs two or more."""
    if not addends:
        return value(0.0)
    return addends[0] if len(addends) == 1 else call("sum", *addends)


def call(name: str, *operands: Element) -> Element:
    """An operation of JSBSim on its operands."""
    element = Element(name)
    element.extend(operands)
    return element


def value(number: float) -> Element:
    """A number, in the shortest text that is read back unchanged."""
    element = Element("value")
    element.text = repr(float(number) + 0.0)
    return element


def reading(name: str) -> Element:
    """A property."""
    element = Element("property")
    element.text = name
    return element


def function(name: str, expression: Element) -> Element:
    """A named function of JSBSim; its value is a property of that name."""
    element = Element("function", name=name)
    element.append(expression)
    return element
