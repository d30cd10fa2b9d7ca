"""Numbers, symbols, units and effects as a person reads them; shared by the page, the figures and the console."""

from __future__ import annotations

import math
import re
from typing import NamedTuple

from aerosid.effects import KINDS
from aerosid.errors import AircraftError
from aerosid.flight_model.terms import Factor, parse_term
from aerosid.loop.result import Effect
from aerosid.nomenclature import CHANNELS

DEGREES = 180.0 / math.pi
MISSING = "–"

_GREEK = {"alpha": "α", "beta": "β", "theta": "θ", "phi": "φ", "psi": "ψ", "rho": "ρ", "delta": "δ"}
_ACCENTS = {"hat": "\u0302", "dot": "\u0307", "bar": "\u0304"}
_SUBSCRIPTED = re.compile(r"(C|a|n|delta)_([A-Za-z]+)")
_SUPERSCRIPTS = str.maketrans("0123456789-", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻")
_ANGLES = {"rad": "deg", "rad/s": "deg/s", "rad/s^2": "deg/s^2"}


class Symbol(NamedTuple):
    """A name as it is set: `delta_e` is δ with the subscript e."""

    base: str
    subscript: str = ""


class Unit(NamedTuple):
    """The unit that a quantity is shown in, and what its SI number is multiplied with; `text` is empty without one."""

    text: str
    factor: float


def symbol(name: str) -> Symbol:
    """The symbol of a channel, coefficient or variable; a name that the glossary does not know stays as it is."""
    matched = _SUBSCRIPTED.fullmatch(name)
    if matched and (name in CHANNELS or name.startswith("C_") or name == "n_z"):
        return Symbol(_GREEK.get(matched[1], matched[1]), matched[2])
    base, *marks = name.split("_")
    if (base in CHANNELS or base in _GREEK) and all(mark in _ACCENTS for mark in marks):
        return Symbol(_GREEK.get(base, base) + "".join(_ACCENTS[mark] for mark in marks))
    return Symbol(name)


def subscripted(name: str) -> str:
    """The symbol with its subscript as `_{x}`, as figures take it."""
    base, subscript = symbol(name)
    return f"{base}_{{{subscript}}}" if subscript else base


def shown_unit(unit: str) -> Unit:
    """The unit for a person: degrees in place of radians, m/s² in place of m/s^2."""
    return Unit(si_unit(_ANGLES.get(unit, unit)), DEGREES if unit in _ANGLES else 1.0)


def si_unit(unit: str) -> str:
    """The unit that a number of result.json has, as it is set; empty without one."""
    text = re.sub(r"\*\*|\^", "^", unit)
    return "" if unit == "1" else re.sub(r"\^(-?\d)", lambda power: power[1].translate(_SUPERSCRIPTS), text)


def number(value: float | None, digits: int = 3) -> str:
    """`value` to so many significant digits, with a true minus sign; a dash where there is none."""
    if value is None or not math.isfinite(value):
        return MISSING
    if value == 0.0:
        return "0"
    exponent = math.floor(math.log10(abs(float(f"{value:.{digits - 1}e}"))))
    if -4 <= exponent < max(digits, 5):
        return f"{value:.{max(digits - 1 - exponent, 0)}f}".replace("-", "−")
    mantissa, power = f"{value:.{digits - 1}e}".split("e")
    return f"{mantissa}·10{str(int(power)).translate(_SUPERSCRIPTS)}".replace("-", "−")


def with_deviation(value: float | None, std_error: float | None) -> str:
    """`value ± std_error`, both cut at the second digit of the deviation; the value alone where that is unknown."""
    if value is None or not math.isfinite(value):
        return MISSING
    if std_error is None or not math.isfinite(std_error) or std_error <= 0.0:
        return number(value, 4)
    places = 1 - math.floor(math.log10(float(f"{std_error:.1e}")))
    if not 0 <= places <= 7:
        digits = max(1, math.floor(math.log10(abs(value))) + places + 1) if value else 1
        return f"{number(value, min(digits, 8))} ± {number(std_error, 2)}"
    return f"{value:.{places}f} ± {std_error:.{places}f}".replace("-", "−")


def p_value(value: float) -> str:
    """A probability as engineers read it: below 10^-12 only its smallness is known."""
    if not math.isfinite(value):
        return MISSING
    return "< 10⁻¹²" if value < 1e-12 else number(value, 2)


def ratio(better: float | None, worse: float | None) -> str:
    """How many times `worse` is larger than `better`."""
    if better is None or worse is None or not better > 0.0 or not math.isfinite(worse / better):
        return MISSING
    return f"{number(worse / better, 2)}×"


def factors_of(term: str) -> tuple[Factor, ...] | None:
    """The factors of a term's text; None where it is none (an effect of some other kind), empty for the constant."""
    try:
        return parse_term(term).factors
    except AircraftError:
        return None


def term_label(term: str) -> str:
    """A term for a figure: `alpha^2` is α²; a text that is no term stays a text."""
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
    return body if factor.power == 1 else body + str(factor.power).translate(_SUPERSCRIPTS)


def effect_name(effect: Effect) -> str:
    """The effect in the names of the files, as an entry of a list: `C_m alpha^2`, `control lag of delta_e`."""
    if effect.kind == "aero_term":
        return f"{effect.where} {effect.term}"
    kind = effect.kind.replace("_", " ")
    return f"{kind} of {effect.where}" if effect.where else kind


def plain(value: float | None) -> str:
    """`value` to six significant digits without trailing zeros, for numbers that someone has set; a dash for none."""
    return MISSING if value is None else f"{value:.6g}".replace("-", "−")


def sentence(text: str) -> str:
    """`text` with a full stop; its first letter stays, for it may be a channel's or a file's."""
    text = text.strip()
    return text + ("" if text.endswith((".", "!", "?")) or not text else ".")


def effect_sentence(effect: Effect) -> str:
    """What the effect says, in words and with the names of the files: `C_m has a term in alpha^2`."""
    if effect.kind == "aero_term":
        return (
            f"{effect.where} has another constant"
            if effect.term == "1"
            else f"{effect.where} has a term in {effect.term}"
        )
    if effect.kind not in KINDS:
        place = f" in {effect.where}" if effect.where else ""
        return f"{effect.kind.replace('_', ' ')}{place}{f' ({effect.term})' if effect.term else ''}"
    said = KINDS[effect.kind].sentence.format(where=effect.where)
    return said if effect.time is None else f"{said} at {effect.time:g} s"
