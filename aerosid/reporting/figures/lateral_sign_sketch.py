"""A sketch of the positive lateral directions: an aircraft from above, nose to the right, and from behind.

Every arrow points in the direction in which its channel increases.
"""

from __future__ import annotations

import math

import numpy as np

from aerosid.reporting.figures.arrows import arc, arrow, head, line
from aerosid.reporting.figures.chart import Axis, Chart, FloatArray, Mark, Outline, Panel, Role, Words

_WIDTH, _HEIGHT = 540.0, 228.0
"""Display: pt, of the drawing."""

_ABOVE, _BEHIND = np.array([134.0, 124.0]), np.array([406.0, 124.0])  # centres of gravity
_SIDESLIP = math.radians(-18.0)  # direction of flight as drawn: to the right of the nose, the wind from the right
_RUDDER, _AILERON = math.radians(26.0), 13.0  # trailing edge left; pt below the wing

_BODY = np.array(
    [(104, 0), (92, 7), (60, 11), (-20, 10), (-100, 3), (-100, -3), (-20, -10), (60, -11), (92, -7)]
)  # fmt: skip
_WINGS = np.array([(22, 10), (8, 88), (-12, 88), (-20, 10), (-20, -10), (-12, -88), (8, -88), (22, -10)])
_TAIL = np.array([(-78, 4), (-84, 34), (-97, 34), (-97, -34), (-84, -34), (-78, -4)])
_HINGE = np.array([-100.0, 0.0])
_SECTION = 13.0 * np.column_stack([np.cos(np.linspace(0.0, 6.2, 32)), np.sin(np.linspace(0.0, 6.2, 32))])
_SPAN = np.array([(-104, 5), (-12, -1), (12, -1), (104, 5), (104, 2), (12, -6), (-12, -6), (-104, 2)])
_FIN = np.array([(-2, 11), (-1, 46), (1, 46), (2, 11)])


def lateral_sign_sketch() -> Chart:
    """The sketch, as large as a column of the report."""
    marks = [*_from_above(), *_from_behind()]
    bare = Axis("", (0.0, _WIDTH), bare=True)
    panel = Panel(0.0, 0.0, _WIDTH, _HEIGHT, bare, Axis("", (0.0, _HEIGHT)), tuple(marks), framed=False)
    return Chart(_WIDTH, _HEIGHT, (panel,))


def _from_above() -> list[Mark]:
    """X to the right of the page, y down."""
    marks: list[Mark] = [_shape(_WINGS, _ABOVE, "muted"), _shape(_TAIL, _ABOVE, "muted"), _shape(_BODY, _ABOVE)]
    marks += arrow(_ABOVE, 0.0, 138.0, "x, u")
    marks += arrow(_ABOVE, -math.pi / 2.0, 104.0, "y, a_{y}, v")
    marks += arrow(_ABOVE, _SIDESLIP, 132.0, "V", "after")
    marks += arc(_ABOVE, 120.0, 0.0, _SIDESLIP, "β", "after")
    marks += arc(_ABOVE, 62.0, math.radians(80.0), math.radians(22.0), "r, C_{n}, ψ", away=20.0)
    length = 26.0
    turn = np.array([-math.cos(_RUDDER), math.sin(_RUDDER)])
    resting = _ABOVE + np.array([_HINGE, _HINGE - (length, 0.0)])
    deflected = _ABOVE + np.array([_HINGE, _HINGE + length * turn])
    angles = np.linspace(math.pi, math.pi - _RUDDER, 12)
    turned = _ABOVE + _HINGE + 1.2 * length * np.column_stack([np.cos(angles), np.sin(angles)])
    marks += [line(resting, "muted", 0.7), line(deflected, "ink", 2.6), line(turned, "ink")]
    marks += head(turned[-1], turned[-1] - turned[-2], "ink")
    marks.append(Words(2.0, float(_ABOVE[1]) + 56.0, "δ_{r}, trailing", "ink", "left"))
    marks.append(Words(2.0, float(_ABOVE[1]) + 44.0, "edge left", "ink", "left"))
    marks.append(Words(float(_ABOVE[0]), _HEIGHT - 8.0, "from above", "muted", "center"))
    return marks


def _from_behind() -> list[Mark]:
    """Y to the right of the page, z down."""
    marks: list[Mark] = [_shape(_SPAN, _BEHIND, "muted"), _shape(_FIN, _BEHIND, "muted"), _shape(_SECTION, _BEHIND)]
    marks += arrow(_BEHIND, 0.0, 112.0, "")
    marks.append(Words(float(_BEHIND[0]) + 116.0, float(_BEHIND[1]) - 12.0, "y", "ink", "left"))
    marks += arrow(_BEHIND, -math.pi / 2.0, 84.0, "z")
    marks += arc(_BEHIND, 58.0, math.radians(78.0), math.radians(22.0), "p, C_{l}, φ", away=20.0)
    for side in (1.0, -1.0):  # right down, left up
        inner, outer = (_BEHIND + np.array([reach * side, rise]) for reach, rise in ((58.0, 0.0), (92.0, 3.0)))
        drop = np.array([0.0, -_AILERON * side])
        marks.append(line(np.array([inner, inner + drop, outer + drop, outer]), "ink", 1.6))
    begin = _BEHIND + np.array([75.0, -_AILERON - 3.0])
    marks += arrow(begin, -math.pi / 2.0, 24.0, "")
    marks.append(
        Words(float(begin[0]) - 14.0, float(begin[1]) - 38.0, "δ_{a}, right trailing edge down", "ink", "center")
    )
    marks.append(Words(float(_BEHIND[0]), _HEIGHT - 8.0, "from behind", "muted", "center"))
    return marks


def _shape(shape: FloatArray, centre: FloatArray, role: Role = "surface") -> Mark:
    places = shape.astype(np.float64) + centre
    return Outline(places[:, 0], places[:, 1], role)
