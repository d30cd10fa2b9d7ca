"""Grammar of the aerodynamic model's terms.

A term is a product of powers of variables, such as `alpha^2`, `alpha*delta_e` or `pos(alpha - 0.2)^2`:

    term   = factor { "*" factor }
    factor = base [ "^" whole number from 1 to 9 ]
    base   = "1" | variable | "abs(" variable ")" | "pos(" variable [ ("+" | "-") number ] ")"

The text is split into tokens and read from left to right; nothing in it is ever evaluated as code.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Literal

from aerosid.errors import AircraftError
from aerosid.nomenclature import CHANNELS, is_surface

Shape = Literal["plain", "abs", "pos"]

VARIABLES = (
    "alpha",
    "q_hat",
    "V_hat",
    "alpha_dot_hat",
    "C_T",
    "mach",
    "beta",
    "p_hat",
    "r_hat",
    "phi",
    "p",
    "r",
    "theta",
    "C_L",
    "C_Z",
)
"""Slots of the kernel's array of variables that the flight model computes; the input columns follow them.

Where a case measures one of them it is an input column, and terms take it from there.
"""

LIFT = ("C_L", "C_Z")
"""Variables that are a coefficient themselves, the sum of its own terms: a drag polar is C_D `C_L^2`."""

VARIABLE_COUNT = len(VARIABLES)

SHAPES: tuple[Shape, ...] = ("plain", "abs", "pos")
_PRINTED_FIRST = ("alpha", "q_hat", "delta_e", "V_hat", "alpha_dot_hat", "C_T", "mach", "beta", "delta_f", "C_L", "C_Z")
_LONGEST_TEXT = 200
"""Format: characters of a term at most."""

_HIGHEST_POWER = 9
"""Format: power of a factor at most."""

_TOKEN = re.compile(
    r"[ \t]*(?:(?P<name>[A-Za-z_][A-Za-z0-9_]*)"
    r"|(?P<number>(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][+-]?[0-9]{1,3})?)"
    r"|(?P<sign>[*^()+-]))"
)

# Channels that the flight model answers with, or that say nothing about forces: driving a simulation with them would
# feed the measurement back into what it is compared with.
_DRIVING = {"rho", "thrust", "mass", "phi", "theta", "p", "r", "beta", "alpha", "mach"}
_ANSWERS = frozenset(name for name in CHANNELS if name not in _DRIVING and not is_surface(name))
_INSTEAD = {
    "V": "write V_hat, which is V/U0 - 1",
    "u": "write V_hat and alpha",
    "w": "write alpha",
    "q": "write q_hat, which is q c/(2 U0)",
    "q_bar": "write rho or V_hat",
}


@dataclass(frozen=True)
class Factor:
    """One factor of a term: a variable, its absolute value, or its part above an offset, raised to a power.

    Parameters
    ----------
    variable
        One of `VARIABLES` or the name of an input channel.
    shape
        "plain" is x, "abs" is |x|, "pos" is max(x - offset, 0).
    offset
        Start of the "pos" part, in the unit of the variable (SI); 0 for the other shapes.
    power
        Whole number from 1 to 9.
    """

    variable: str
    shape: Shape
    offset: float
    power: int

    def __str__(self) -> str:
        text = self.variable
        if self.shape == "pos" and self.offset != 0.0:
            text = f"{self.variable} {'-' if self.offset > 0.0 else '+'} {_decimal(abs(self.offset))}"
        if self.shape != "plain":
            text = f"{self.shape}({text})"
        return text if self.power == 1 else f"{text}^{self.power}"


@dataclass(frozen=True)
class Term:
    """A product of factors in canonical order, as `parse_term` makes it; the constant term has no factor.

    Two texts that say the same product give equal terms, and `str` gives the text that stands in files and tables.
    """

    factors: tuple[Factor, ...]

    def __hash__(self) -> int:
        return self._hash

    @cached_property
    def _hash(self) -> int:
        """Computed once: searches look terms up by the thousand."""
        return hash(self.factors)

    def __reduce__(self) -> tuple[type[Term], tuple[tuple[Factor, ...]]]:
        return Term, (self.factors,)  # another process hashes texts otherwise

    @cached_property
    def variables(self) -> frozenset[str]:
        """Names of the variables and input channels in the term."""
        return frozenset(factor.variable for factor in self.factors)

    def __str__(self) -> str:
        return "*".join(str(factor) for factor in self.factors) or "1"


@lru_cache(maxsize=4096)  # a catalogue names the same terms for every flight
def parse_term(text: str) -> Term:
    """The term that `text` says, in canonical form: `delta_e * alpha*alpha` becomes `alpha^2*delta_e`.

    Raises
    ------
    AircraftError
        Where the text is no product of powers, or names what a term may not depend on; the sentence holds the reason.
    """
    tokens = _tokens(text)
    factors: list[Factor] = []
    position = 0
    while True:
        factor, position = _factor(text, tokens, position)
        if factor is not None:
            factors.append(factor)
        if position == len(tokens):
            return Term(_canonical(text, factors))
        if tokens[position] != "*":
            raise _wrong(text, f"'*' or the end was expected before '{tokens[position]}'")
        position += 1


def _tokens(text: str) -> list[str]:
    """The text cut into names, numbers and signs; anything else is refused."""
    if len(text) > _LONGEST_TEXT:
        raise AircraftError(
            f"term '{text[:20]}...' has {len(text)} characters, at most {_LONGEST_TEXT} are read; "
            "write a product of a few powers such as alpha^2"
        )
    if not text.strip(" \t"):
        raise AircraftError("an empty term was found; write 1 for the constant, or a product of powers such as alpha^2")
    tokens: list[str] = []
    position = 0
    end = len(text.rstrip(" \t"))
    while position < end:
        match = _TOKEN.match(text, position)
        if match is None:
            character = text[position:].lstrip(" \t")[0]
            raise _wrong(text, f"the character {character!a} has no meaning in a term")
        tokens.append(match.group().strip(" \t"))
        position = match.end()
    return tokens


def _factor(text: str, tokens: list[str], position: int) -> tuple[Factor | None, int]:
    """The factor that starts at a token (None for a power of 1), and the position behind it."""
    at = [*tokens, "", "", "", "", "", ""]  # so that looking ahead needs no bounds
    head = at[position]
    shape: Shape = "plain"
    offset = 0.0
    name = head
    if head in ("abs", "pos"):
        shape = "abs" if head == "abs" else "pos"
        name = at[position + 2]
        if at[position + 1] != "(":
            raise _wrong(text, f"'{head}' needs brackets around one variable, as in {head}(alpha)")
        _check_variable(text, name)
        position += 3
        if shape == "pos" and at[position] in ("+", "-"):
            sign = 1.0 if at[position] == "-" else -1.0
            offset = sign * _offset(text, at[position + 1]) + 0.0  # + 0.0 makes -0.0 the plain zero
            position += 2
        if at[position] != ")":
            allowed = "one variable" if shape == "abs" else "one variable and a number, as in pos(alpha - 0.2)"
            raise _wrong(text, f"the brackets of '{head}' may hold {allowed}, found '{at[position] or 'the end'}'")
        position += 1
    elif head == "1":
        position += 1
    else:
        _check_variable(text, head)
        position += 1
    power = 1
    if at[position] == "^":
        power = _read_power(text, at[position + 1])
        position += 2
    return (None if head == "1" else Factor(name, shape, offset, power)), position


def _check_variable(text: str, name: str) -> None:
    """Refuse what is no name, and the channels that a simulation answers with."""
    if not name:
        raise _wrong(text, "it ends where a variable was expected")
    if not (name[0].isalpha() or name[0] == "_"):
        hint = "; write a power as alpha^2" if name == "*" else ""
        if name[0] in "0123456789.":
            hint = "; a number stands only in pos(x - number), the coefficient belongs in `value`"
        raise _wrong(text, f"a variable was expected and '{name}' found{hint}")
    if name in ("abs", "pos"):
        raise _wrong(text, f"'{name}' cannot stand inside brackets")
    if name in _ANSWERS:
        instead = _INSTEAD.get(name, "use alpha, q_hat, V_hat or an input channel")
        raise _wrong(text, f"{name} is an output of the simulation and cannot be used in a term; {instead}")


def _offset(text: str, token: str) -> float:
    if not token or token[0] not in "0123456789.":
        raise _wrong(text, f"a number was expected after the sign inside pos(), found '{token or 'the end'}'")
    value = float(token)
    if not math.isfinite(value):
        raise _wrong(text, f"the number {token} is too large")
    return value


def _read_power(text: str, token: str) -> int:
    if not token.isdigit() or len(token) > 1 or token == "0":
        raise _wrong(text, f"a power is a whole number from 1 to {_HIGHEST_POWER}, found '{token[:20] or 'the end'}'")
    return int(token)


def _canonical(text: str, factors: list[Factor]) -> tuple[Factor, ...]:
    """The factors merged and in printed order, with |x|^2 written x^2, so that equal products are equal terms."""
    powers: dict[tuple[str, Shape, float], int] = {}
    for factor in factors:
        key = (factor.variable, factor.shape, factor.offset)
        powers[key] = powers.get(key, 0) + factor.power
    for (name, shape, offset), power in list(powers.items()):
        if shape == "abs" and power > 1:
            powers[name, shape, offset] = power % 2
            powers[name, "plain", 0.0] = powers.get((name, "plain", 0.0), 0) + power - power % 2
    merged = [Factor(name, shape, offset, power) for (name, shape, offset), power in powers.items() if power > 0]
    for factor in merged:
        if factor.power > _HIGHEST_POWER:
            raise _wrong(
                text, f"it holds power {factor.power} of {factor.variable}, at most {_HIGHEST_POWER} is allowed"
            )
    return tuple(sorted(merged, key=_printed_order))


def _printed_order(factor: Factor) -> tuple[int, str, int, float]:
    name = factor.variable
    rank = _PRINTED_FIRST.index(name) if name in _PRINTED_FIRST else len(_PRINTED_FIRST)
    return rank, name, SHAPES.index(factor.shape), factor.offset


def _decimal(value: float) -> str:
    """Shortest text that reads back as the same number, whole numbers without a point."""
    return str(int(value)) if value.is_integer() and value < 1e15 else repr(value)


def _wrong(text: str, reason: str) -> AircraftError:
    shown = ascii(text)[1:-1]
    shown = shown if len(shown) <= 60 else shown[:57] + "..."
    return AircraftError(
        f"term '{shown}' cannot be read: {reason}; "
        "write a product of powers such as alpha^2*delta_e or pos(alpha - 0.2)^2"
    )
