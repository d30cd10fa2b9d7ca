"""Arrows, arcs and their labels for sketches; page coordinates, x right and y up, pt."""

from __future__ import annotations

import math

import numpy as np

from aerosid.reporting.figures.chart import FloatArray, Line, Mark, Role, Words


def line(places: FloatArray, role: Role, width: float = 1.1) -> Line:
    """Points joined by a line."""
    return Line(places[:, 0], places[:, 1], role, width)


def arrow(start: FloatArray, angle: float, length: float, text: str, role: Role = "ink") -> list[Mark]:
    """A straight arrow, labelled beyond its tip where it has a name; angle in rad, anticlockwise from the right."""
    direction = np.array([math.cos(angle), math.sin(angle)])
    end = start + length * direction
    label = end + 11.0 * direction - (0.0, 3.0)
    beside = bool(direction[0] > 0.5)
    words = Words(
        float(label[0]) - (7.0 if beside else 0.0), float(label[1]), text, "ink", "left" if beside else "center"
    )
    return [line(np.array([start, end]), role), *head(end, direction, role), *([words] if text else [])]


def arc(
    centre: FloatArray, radius: float, start: float, stop: float, text: str, role: Role = "ink", away: float = 9.0
) -> list[Mark]:
    """An arc about a point with an arrowhead at its end, labelled outside its middle; angles in rad, anticlockwise."""
    angles = np.linspace(start, stop, 24)
    bow = centre + radius * np.column_stack([np.cos(angles), np.sin(angles)])
    middle = 0.5 * (start + stop)
    label = centre + (radius + away) * np.array([math.cos(middle), math.sin(middle)])
    words = Words(float(label[0]), float(label[1]) - 3.0, text, "ink", "center")
    return [line(bow, role), *head(bow[-1], bow[-1] - bow[-2], role), words]


def head(tip: FloatArray, direction: FloatArray, role: Role) -> list[Mark]:
    """The two strokes of an arrowhead."""
    along = direction / np.linalg.norm(direction)
    across = np.array([-along[1], along[0]])
    corners = np.array([tip - 7.0 * along + 2.8 * across, tip, tip - 7.0 * along - 2.8 * across])
    return [line(corners, role)]
