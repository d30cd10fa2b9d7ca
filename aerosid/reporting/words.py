"""Symbols, shown units and names of effects; shared by the page, the figures and the console."""

from __future__ import annotations

import math
import re
from typing import NamedTuple

from aerosid.effects import KINDS
from aerosid.effects.names import listed_name
from aerosid.errors import AircraftError
from aerosid.flight_model.terms import Factor, parse_term
from aerosid.loop.effect_rows import Effect
from aerosid.nomenclature import CHANNELS
from aerosid.notation import MISSING, SUPERSCRIPTS, listed, number, si_unit

DEGREES = 180.0 / math.pi

_GREEK = {"alpha": "α", "beta": "β", "theta": "θ", "phi": "φ", "psi": "ψ", "rho": "ρ", "delta": "δ", "sigma": "σ"}
_MEASURES = ("n_z", "sigma_w", "sigma_u", "L_w", "L_u", "I_xx", "I_yy", "I_zz", "I_xz")
_ACCENTS = {"hat": "\u0302", "dot": "\u0307", "bar": "\u0304"}
_SUBSCRIPTED = re.compile(r"(C|I|L|a|h|n|delta|sigma)_([A-Za-z]+)")
_DERIVATIVE = re.compile(r"C_([A-Za-z]+)_(\w+)")
_ANGLES = {"rad": "deg", "rad/s": "deg/s", "rad/s^2": "deg/s^2"}


class Symbol(NamedTuple):
    """A name as a symbol: `delta_e` is δ with the subscript e."""

    base: str
    subscript: str = ""


class Unit(NamedTuple):
    """The unit in which a quantity is shown, and the factor from its SI number; `text` is empty without one."""

    text: str
    factor: float


def symbol(name: str) -> Symbol:
    """The symbol of a channel, coefficient or variable; a name that is not in the glossary is kept."""
    matched = _SUBSCRIPTED.fullmatch(name)
    if matched and (name in CHANNELS or name in _MEASURES or name.startswith("C_")):
        return Symbol(_GREEK.get(matched[1], matched[1]), matched[2])
    derivative = _DERIVATIVE.fullmatch(name)
    if derivative:
        inner = symbol(derivative[2])
        return Symbol("C", derivative[1] + inner.base + inner.subscript)
    base, *marks = name.split("_")
    if (base in CHANNELS or base in _GREEK) and all(mark in _ACCENTS for mark in marks):
        return Symbol(_GREEK.get(base, base) + "".join(_ACCENTS[mark] for mark in marks))
    return Symbol(name.replace("_", " ") if name in CHANNELS else name)


def subscripted(name: str) -> str:
    """The symbol with its subscript as `_{x}`, as figures take it."""
    base, subscript = symbol(name)
    return f"{base}_{{{subscript}}}" if subscript else base


def shown_unit(unit: str) -> Unit:
    """The unit shown: degrees in place of radians, m/s² in place of m/s^2."""
    return Unit(si_unit(_ANGLES.get(unit, unit)), DEGREES if unit in _ANGLES else 1.0)


def ratio(better: float | None, worse: float | None) -> str:
    """The ratio of `worse` to `better`."""
    if better is None or worse is None or not better > 0.0 or not math.isfinite(worse / better):
        return MISSING
    return f"{number(worse / better, 2)}×"


def factors_of(term: str) -> tuple[Factor, ...] | None:
    """The factors of a term's text; None where it is not a term (an effect of another kind), empty for the constant."""
    try:
        return parse_term(term).factors
    except AircraftError:
        return None


def term_label(term: str) -> str:
    """A term for a figure: `alpha^2` is α²; a text that is not a term is kept."""
    factors = factors_of(term)
    if not factors:
        return term
    return "·".join(map(_factor_label, factors))


def _factor_label(factor: Factor) -> str:
    body = subscripted(factor.variable)
    if factor.shape == "abs":
        body = f"|{body}|"
    elif factor.shape == "pos":
        sign = "−" if factor.offset >= 0.0 else "+"
        body = f"pos({body} {sign} {abs(factor.offset):g})" if factor.offset else f"pos({body})"
    return body if factor.power == 1 else body + str(factor.power).translate(SUPERSCRIPTS)


_QUANTITIES = {
    "sigma": "standard deviation",
    "sigma_side": "lateral standard deviation",
    "length": "scale length",
}
"""Names of parameters of effects whose own name says too little."""


def quantity(name: str) -> str:
    """The name of an effect's parameter in words: `time_constant` as time constant; a coefficient is kept."""
    if name in _QUANTITIES:
        return _QUANTITIES[name]
    return name if symbol(name) != Symbol(name) else name.replace("_", " ")


def effect_name(effect: Effect) -> str:
    """The effect as an entry of a list: `C_m alpha^2`, `control lag of delta_e`, `vertical turbulence`."""
    if effect.kind == "aero_term":
        return f"{effect.where} {effect.term}"
    return f"{listed_name(effect.kind, effect.where)}{_along(effect)}"


def _along(effect: Effect) -> str:
    """The body axes of a position: ` along x and z`."""
    return f" along {listed(list(effect.along))}" if effect.along else ""


def sentence(text: str) -> str:
    """`text` with a full stop; its first letter is kept, since it may be that of a channel or a file."""
    text = text.strip()
    return text + ("" if text.endswith((".", "!", "?")) or not text else ".")


def effect_sentence(effect: Effect) -> str:
    """The effect in words, with the names of the files: `C_m has a term in alpha^2`.

    An effect that does not improve the prediction of validation data is marked.
    """
    return _said(effect) + (UNCONFIRMED if effect.evidence.unseen_better is False else "")


def short_effect(effect: Effect) -> str:
    """The effect for a narrow table: its name, with its time; `thrust change` is not told to be of the thrust."""
    kind = effect.kind.replace("_", " ")
    name = kind if effect.where and kind.startswith(effect.where) else effect_name(effect)
    return name + effect.moment


UNCONFIRMED = " (does not improve the prediction of validation data)"
"""Mark of an effect that the validation data do not confirm."""


def _said(effect: Effect) -> str:
    if effect.kind == "aero_term":
        return (
            f"{effect.where} has another constant"
            if effect.term == "1"
            else f"{effect.where} has a term in {effect.term}"
        )
    if effect.kind not in KINDS:
        place = f" in {effect.where}" if effect.where else ""
        return f"{effect.kind.replace('_', ' ')}{place}{f' ({effect.term})' if effect.term else ''}"
    text = KINDS[effect.kind].describe(effect.where, effect.value) + _along(effect)
    return text + effect.moment
