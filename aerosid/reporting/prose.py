"""Running text: names as symbols, names of effects in words, powers and minus signs as printed."""

from __future__ import annotations

import re
from collections.abc import Callable

from markupsafe import Markup, escape

from aerosid.effects import KINDS
from aerosid.flight_model.axes import COEFFICIENTS
from aerosid.nomenclature import CHANNELS
from aerosid.notation import SUPERSCRIPTS
from aerosid.reporting.words import Symbol, symbol

_VARIABLES = ("p_hat", "q_hat", "r_hat", "V_hat", "alpha_dot_hat")
_MEASURES = ("n_z", "sigma_w", "sigma_u", "sigma", "L_w", "L_u", "I_xx", "I_yy", "I_zz", "I_xz")
"""Names in terms and in sentences that are not channels."""
_DERIVATIVES = [f"{c}_{name}" for c in COEFFICIENTS for name in (*CHANNELS, *_VARIABLES)]

_NAMES = sorted({*CHANNELS, *COEFFICIENTS, *_VARIABLES, *_MEASURES, *_DERIVATIVES}, key=lambda name: -len(name))
_NAME = "|".join(map(re.escape, _NAMES))
_FACTOR = rf"(?:{_NAME})(?:\^-?\d+)?"
_TERM = re.compile(rf"(?<![\w./\\-])(?:{_FACTOR})(?:\*{_FACTOR})*(?![\w\\]|/(?!\()|\.\w|-\w)")
_PART = re.compile(rf"({_NAME})(?:\^(-?\d+))?")
_PRODUCT = re.compile(r"(?<=>)\*(?=(?:abs|pos)\()|(?<=\))\*(?=<)")
"""The sign between a factor set as a symbol and one in brackets."""
_POWER = re.compile(r"(?<=[A-Za-z)\]])\^(-?\d+)")
_QUOTED = re.compile(r'("[^"\n]*")')
_MINUS = re.compile(r"(?<![\w.)\]-])-(?=\d|\.\d)")
_KINDS = re.compile(
    rf"(?<![\w./-])({'|'.join(sorted((k for k in KINDS if '_' in k), key=len, reverse=True))})(?![\w./-])"
)


def prose(text: str) -> Markup:
    """The text for the page, escaped: `C_m alpha^2` as Cₘ α², `control_lag` in words, m/s^2 as m/s², a true minus.

    Names of files and logs are kept: a name that is part of a longer word is not replaced. What is quoted is kept too.
    """
    # Safe: escaped, and symbols of our own glossary.
    return Markup(_outside_quotes(_set, text, quoted=lambda part: str(escape(part))))


def in_words(text: str) -> str:
    """The text for a terminal: names of effects in words, powers and minus signs as printed, symbols as typed.

    What is quoted is to be typed as it is: `kind = "sensor_scale"`.
    """
    return _outside_quotes(_as_printed, text)


def _outside_quotes(change: Callable[[str], str], text: str, quoted: Callable[[str], str] = str) -> str:
    """The text with what is not between double quotes changed, and what is as by `quoted`."""
    parts = _QUOTED.split(text)
    return "".join(quoted(part) if n % 2 else change(part) for n, part in enumerate(parts))


def _set(text: str) -> str:
    return _PRODUCT.sub("·", _TERM.sub(_set_term, str(escape(_as_printed(text)))))


def _as_printed(text: str) -> str:
    text = _KINDS.sub(lambda found: found[1].replace("_", " "), text)
    text = _TERM.sub(lambda found: found[0].replace("^", "\0"), text)
    text = _POWER.sub(lambda found: found[1].translate(SUPERSCRIPTS), text)
    return _MINUS.sub("−", text).replace("\0", "^")


def _set_term(found: re.Match[str]) -> str:
    """A term as a formula; a single name that is its own symbol stays text."""
    text = found[0]
    if text in CHANNELS and symbol(text) == Symbol(text):
        return text
    parts = []
    for name, power in _PART.findall(text):
        base, subscript = symbol(name)
        raised = f"<sup>{power.replace('-', '−')}</sup>" if power else ""
        lowered = f"<sub>{subscript}</sub>" if subscript else ""
        parts.append(f"<var>{base}{lowered}</var>{raised}")
    return f'<span class="formula">{"·".join(parts)}</span>' if len(parts) > 1 else parts[0]
