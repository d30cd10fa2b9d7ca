"""A sketch of the positive directions: an aircraft from the side, nose to the right, pitched up and descending.

Every arrow points in the direction in which its channel increases.
"""

from __future__ import annotations

import math

import numpy as np

from aerosid.reporting.figures.arrows import arc, arrow, head, line
from aerosid.reporting.figures.chart import Axis, Chart, FloatArray, Mark, Outline, Panel, Role, Words

_WIDTH, _HEIGHT = 540.0, 196.0
"""Display: pt, of the drawing."""

_CENTRE = np.array([250.0, 112.0])  # of gravity
_PITCH, _PATH = math.radians(14.0), math.radians(-4.0)  # theta, and the direction of flight
_DEFLECTION = math.radians(-24.0)  # of the elevator: trailing edge down

_FUSELAGE = np.array(
    [
        (-118, 8), (-108, 34), (-88, 34), (-72, 13), (10, 17), (30, 26), (52, 24), (66, 13), (96, 8), (106, 1),
        (96, -7), (50, -13), (-20, -12), (-90, -2),
    ]
)  # fmt: skip
_WING = np.array([(-26, -4), (-8, 1), (16, 2), (27, -1), (18, -5), (-8, -6)])
_STABILISER = np.array([(-102, 6), (-78, 8), (-76, 5), (-102, 3)])
_ELEVATOR_HINGE = np.array([-102.0, 4.5])


def sign_sketch() -> Chart:
    """The sketch, as large as a column of the report."""
    marks: list[Mark] = [_shape(_FUSELAGE), _shape(_WING, "muted"), _shape(_STABILISER, "muted"), *_elevator()]
    x, y = (float(place) for place in _CENTRE)
    marks.append(line(np.array([(x + 20.0, y), (x + 225.0, y)]), "muted", 0.7))
    marks.append(Words(x + 228.0, y - 3.0, "horizon", "muted"))
    marks += arrow(_CENTRE, _PITCH, 205.0, "x, a_{x}, u")
    marks += arrow(_CENTRE, _PITCH - math.pi / 2.0, 92.0, "z, a_{z}, w")
    marks += arrow(_CENTRE, _PATH, 170.0, "V", "after")
    marks += arc(_CENTRE, 150.0, _PATH, _PITCH, "α", "after")
    marks += arc(_CENTRE, 188.0, 0.0, _PITCH, "θ")
    marks += arc(_CENTRE, 44.0, math.radians(118.0), math.radians(196.0), "q, C_{m}", away=20.0)
    marks += arrow(np.array([40.0, 60.0]), math.pi / 2.0, 60.0, "h")
    bare = Axis("", (0.0, _WIDTH), bare=True)
    panel = Panel(0.0, 0.0, _WIDTH, _HEIGHT, bare, Axis("", (0.0, _HEIGHT)), tuple(marks), framed=False)
    return Chart(_WIDTH, _HEIGHT, (panel,))


def _placed(shape: FloatArray) -> FloatArray:
    """Points of the body, x forward and up, in coordinates of the sketch."""
    turn = np.array([[math.cos(_PITCH), math.sin(_PITCH)], [-math.sin(_PITCH), math.cos(_PITCH)]])
    return np.asarray(shape @ turn + _CENTRE)


def _shape(shape: FloatArray, role: Role = "surface") -> Mark:
    places = _placed(shape.astype(np.float64))
    return Outline(places[:, 0], places[:, 1], role)


def _elevator() -> list[Mark]:
    """The elevator behind its hinge, deflected, and the angle of its neutral position."""
    length = 26.0
    turn = np.array([-math.cos(_DEFLECTION), math.sin(_DEFLECTION)])
    resting = _placed(np.array([_ELEVATOR_HINGE, _ELEVATOR_HINGE - (1.4 * length, 0.0)]))
    deflected = _placed(np.array([_ELEVATOR_HINGE, _ELEVATOR_HINGE + length * turn]))
    angles = np.linspace(math.pi, math.pi - _DEFLECTION, 12)
    turned = _placed(_ELEVATOR_HINGE + 1.25 * length * np.column_stack([np.cos(angles), np.sin(angles)]))
    marks: list[Mark] = [line(resting, "muted", 0.7), line(deflected, "ink", 2.6), line(turned, "ink")]
    marks += head(turned[-1], turned[-1] - turned[-2], "ink")
    marks.append(
        Words(float(turned[-1, 0]) - 8.0, float(turned[-1, 1]) - 14.0, "δ_{e}, trailing edge down", "ink", "center")
    )
    return marks
