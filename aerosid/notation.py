"""Numbers as text: significant digits, standard errors, powers of ten and units, one way on page, paper and console."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from typing import Any

MISSING = "–"
"""Stands where there is no number."""

SUPERSCRIPTS = str.maketrans("0123456789-", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻")

_LOWEST_POWER, _HIGHEST_POWER = -4, 5
"""Display: powers of ten between which a number is written without one: 0.000123 and 98700 are still read at
a glance."""


def number(value: float | None, digits: int = 3) -> str:
    """`value` to so many significant digits with a true minus sign, never as 1.03e+04; a dash where there is none.

    Parameters
    ----------
    value : float or None
        Any unit.
    digits : int
        Significant digits, at least 1. Whole numbers beyond them end in zeros.
    """
    if value is None or not math.isfinite(value):
        return MISSING
    if value == 0.0:
        return "0"
    mantissa, power = f"{value:.{digits - 1}e}".split("e")
    exponent = int(power)
    if _LOWEST_POWER <= exponent < max(digits, _HIGHEST_POWER):
        places = digits - 1 - exponent
        rounded = float(f"{mantissa}e{power}")
        return f"{rounded:.{max(places, 0)}f}".replace("-", "−")
    return f"{mantissa}·10{str(exponent).translate(SUPERSCRIPTS)}".replace("-", "−")


def with_deviation(value: float | None, std_error: float | None) -> str:
    """`value ± standard error`, both cut at its second digit; the value alone where the standard error is unknown."""
    if value is None or not math.isfinite(value):
        return MISSING
    if std_error is None or not math.isfinite(std_error) or std_error <= 0.0:
        return number(value, 4)
    places = 1 - math.floor(math.log10(float(f"{std_error:.1e}")))
    if not 0 <= places <= 7:
        digits = max(1, math.floor(math.log10(abs(value))) + places + 1) if value else 1
        return f"{number(value, min(digits, 8))} ± {number(std_error, 2)}"
    return f"{value:.{places}f} ± {std_error:.{places}f}".replace("-", "−")


def decimals(value: float, places: int) -> str:
    """`value` with so many decimals; what rounds to zero has no sign."""
    # Adding zero turns a rounded -0.0 into 0.0.
    return f"{round(value, places) + 0.0:.{places}f}".replace("-", "−")


def plain(value: float | None, digits: int = 6) -> str:
    """`value` without trailing zeros, for numbers that someone has set; a dash for none."""
    text = number(value, digits)
    body, times, power = text.partition("·")
    if "." in body:
        body = body.rstrip("0").rstrip(".")
    return body + times + power


def p_value(value: float | None) -> str:
    """A probability as engineers read it: below 10⁻¹² only its smallness is known; a dash for none."""
    if value is None or not math.isfinite(value):
        return MISSING
    return "< 10⁻¹²" if value < 1e-12 else number(value, 2)


def share(value: float | None) -> str:
    """A share of one to three places: what is less is nothing to anybody."""
    if value is None or not math.isfinite(value):
        return MISSING
    return "< 0.001" if 0.0 < value < 0.0005 else f"{value + 0.0:.3f}".replace("-", "−")


def finite(value: float, digits: int | None = None) -> float | None:
    """The number as JSON and TOML can hold it: None where it is infinite or NaN, which neither has a word for.

    Parameters
    ----------
    value : float
        Any unit.
    digits : int, optional
        Significant digits that are kept; all by default.
    """
    if not math.isfinite(value):
        return None
    return value if digits is None else float(f"{value:.{digits}g}")


def finite_throughout(value: Any, digits: int | None = None) -> Any:
    """A document for JSON: `finite` of its floats at every level of mappings and sequences."""
    if isinstance(value, Mapping):
        return {str(key): finite_throughout(item, digits) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [finite_throughout(item, digits) for item in value]
    return finite(value, digits) if isinstance(value, float) else value


def si_unit(unit: str) -> str:
    """The unit that a number of result.json has, as it is set: m/s² in place of m/s^2; empty where it is 1."""
    text = re.sub(r"\*\*|\^", "^", unit)
    return "" if unit == "1" else re.sub(r"\^(-?\d)", lambda power: power[1].translate(SUPERSCRIPTS), text)


def listed(items: Sequence[str], last: str = "and") -> str:
    """`a`, `a and b`, `a, b and c`, or with another word before the last; empty where there is none."""
    if len(items) < 2:
        return "".join(items)
    return f"{', '.join(items[:-1])} {last} {items[-1]}"
