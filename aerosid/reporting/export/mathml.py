"""Terms as MathML 2 content markup."""

from __future__ import annotations

from collections.abc import Mapping
from copy import deepcopy
from xml.etree.ElementTree import Element, SubElement

from aerosid.flight_model.terms import Factor, Term

NAMESPACE = "http://www.w3.org/1998/Math/MathML"


def maths(expression: Element) -> Element:
    """The `<math>` element around an expression."""
    element = Element("math", xmlns=NAMESPACE)
    element.append(expression)
    return element


def apply(operator: str, *operands: Element) -> Element:
    """`<apply>` of an operator to operands."""
    element = Element("apply")
    SubElement(element, operator)
    element.extend(operands)
    return element


def identifier(name: str) -> Element:
    """`<ci>`: a variable."""
    element = Element("ci")
    element.text = name
    return element


def number(value: float) -> Element:
    """`<cn>`: a number, in the shortest text that is read back unchanged."""
    element = Element("cn")
    element.text = repr(value)
    return element


def term_maths(derivative: str, term: Term, renamed: Mapping[str, str]) -> Element:
    """A derivative's variable times its term, with variables renamed by `names`."""
    factors = [_factor(factor, renamed) for factor in term.factors]
    return apply("times", identifier(derivative), *factors) if factors else identifier(derivative)


def _factor(factor: Factor, renamed: Mapping[str, str]) -> Element:
    base = identifier(renamed.get(factor.variable, factor.variable))
    if factor.shape == "abs":
        base = apply("abs", base)
    elif factor.shape == "pos":
        shifted = apply("minus", base, number(factor.offset)) if factor.offset else base
        base = _positive_part(shifted)
    return base if factor.power == 1 else apply("power", base, number(float(factor.power)))


def _positive_part(expression: Element) -> Element:
    """`<piecewise>`, which every reader of DAVE-ML supports: the expression where it is above zero, else zero."""
    piecewise = Element("piecewise")
    piece = SubElement(piecewise, "piece")
    piece.append(expression)
    piece.append(apply("gt", deepcopy(expression), number(0.0)))
    SubElement(piecewise, "otherwise").append(number(0.0))
    return piecewise
