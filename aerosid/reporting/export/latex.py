r"""The derivatives as a LaTeX `tabular`, without any package."""

from __future__ import annotations

import math
import re
from pathlib import Path

from aerosid import __version__
from aerosid.aircraft import Aircraft
from aerosid.flight_model.terms import Factor, Term
from aerosid.reporting.export.options import NOT_SHOWN, Exported, ExportOptions, named, origin

_SYMBOLS = {
    "alpha": r"\alpha",
    "p_hat": r"\hat{p}",
    "q_hat": r"\hat{q}",
    "r_hat": r"\hat{r}",
    "V_hat": r"\hat{V}",
    "alpha_dot_hat": r"\hat{\dot{\alpha}}",
    "C_T": "C_{T}",
    "C_L": "C_{L}",
    "C_Z": "C_{Z}",
    "mach": "M",
    "beta": r"\beta",
    "phi": r"\phi",
    "theta": r"\theta",
    "rho": r"\rho",
    "thrust": "T",
    "mass": "m",
    "p": "p",
    "r": "r",
}
_ESCAPES = {
    "\\": r"\textbackslash{}",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    **{character: f"\\{character}" for character in "&%$#_{}"},
}
_SPECIAL = re.compile(r"[\\~^&%$#_{}]")


def latex_text(aircraft: Aircraft, options: ExportOptions) -> Exported:
    """Term, value and standard deviation by coefficient, followed by the effects."""
    options.only("latex")
    rows = []
    for coefficient in aircraft.coefficients:
        for entry in (entry for entry in aircraft.derivatives if entry.coefficient == coefficient):
            value, sigma = _value_and_deviation(entry.value, entry.sigma)
            mark = "" if entry.shown else "$^{a}$"
            rows.append(
                f"${_coefficient(coefficient)}$ & ${term_formula(entry.term)}$ & ${value}${mark} & {sigma} \\\\"
            )
        rows.append(r"\hline")
    for effect in aircraft.effects:
        value, sigma = _value_and_deviation(effect.value, effect.std_error)
        rows.append(f"\\multicolumn{{2}}{{l}}{{{escaped(named(effect))}}} & ${value}$ & {sigma} \\\\")
        rows += [
            f"\\multicolumn{{2}}{{l}}{{\\quad {escaped(name)}}} & ${_number(number, 6)}$ & \\\\"
            for name, number in (("time", effect.time), *effect.parameters.items())
            if number is not None
        ]
    if aircraft.effects:
        rows.append(r"\hline")
    if not all(entry.shown for entry in aircraft.derivatives):
        rows.append(f"\\multicolumn{{4}}{{l}}{{$^{{a}}$ {NOT_SHOWN}}} \\\\")
    file = f"{aircraft.name}; {Path(aircraft.path).name}, SHA-256 {aircraft.sha256}; aerosid {__version__}"
    head = [
        f"% {' '.join(file.split())}",
        *([f"% {' '.join(origin(aircraft).split())}"] if aircraft.completion else []),
        r"\begin{tabular}{llrr}",
        r"\hline",
        r"coefficient & term & value & standard deviation \\",
        r"\hline",
    ]
    return Exported("\n".join([*head, *rows, r"\end{tabular}"]) + "\n")


def term_formula(term: Term) -> str:
    r"""A term as a formula: `alpha^2*delta_e` is \alpha^{2}\,\delta_{e}."""
    return r"\,".join(_factor(factor) for factor in term.factors) or "1"


def escaped(text: str) -> str:
    """Text escaped for LaTeX, on one line."""
    return _SPECIAL.sub(lambda found: _ESCAPES[found[0]], " ".join(text.split()))


def _coefficient(name: str) -> str:
    return f"{name[0]}_{{{name[2:]}}}"


def _symbol(name: str) -> str:
    if name in _SYMBOLS:
        return _SYMBOLS[name]
    if re.fullmatch(r"delta_[A-Za-z]+", name):
        return rf"\delta_{{{name[6:]}}}"
    return rf"\mathrm{{{escaped(name)}}}"


def _factor(factor: Factor) -> str:
    body = _symbol(factor.variable)
    if factor.shape == "abs":
        body = f"|{body}|"
    elif factor.shape == "pos":
        inner = body if factor.offset == 0.0 else f"{body} {'-' if factor.offset > 0.0 else '+'} {abs(factor.offset):g}"
        body = rf"\max({inner}, 0)"
    return body if factor.power == 1 else f"{body}^{{{factor.power}}}"


def _value_and_deviation(value: float | None, sigma: float | None) -> tuple[str, str]:
    """Both rounded to the second digit of the deviation; the value to six digits where that is unknown."""
    if value is None:
        return "", ""
    if sigma is None or not sigma > 0.0:
        return _number(value, 6), ""
    last = math.floor(math.log10(float(f"{sigma:.1e}"))) - 1
    digits = 1 if value == 0.0 else max(math.floor(math.log10(abs(value))) - last + 1, 1)
    return _number(value, min(digits, 12), last), f"${_number(sigma, 2, last)}$"


def _number(value: float, digits: int, last: int | None = None) -> str:
    """A number with so many digits, or rounded to the decimal place `last` where that is readable."""
    if last is not None and -6 <= last <= 0:
        return f"{value:.{-last}f}"
    mantissa, _, exponent = f"{value:.{digits}g}".partition("e")
    return rf"{mantissa} \cdot 10^{{{int(exponent)}}}" if exponent else mantissa
