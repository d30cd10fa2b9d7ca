"""The sketch of positive directions, checked against the sign conventions."""

from __future__ import annotations

import re

import numpy as np

from aerosid.reporting.figures.chart import Line, Words
from aerosid.reporting.figures.sign_sketch import sign_sketch


def named(text: str) -> np.ndarray:
    """Corners of the line whose arrowhead and name follow it."""
    marks = sign_sketch().panels[0].marks
    place = next(
        i for i, mark in enumerate(marks) if isinstance(mark, Words) and re.split("[,_]", mark.text)[0] == text
    )
    line = next(mark for mark in reversed(marks[: place - 1]) if isinstance(mark, Line))
    return np.column_stack([line.x, line.y])


def direction(text: str) -> np.ndarray:
    corners = named(text)
    return (corners[-1] - corners[0]) / np.linalg.norm(corners[-1] - corners[0])


def turning(text: str) -> float:
    """Positive where an arc runs anticlockwise, which with the nose to the right is nose up."""
    corners = named(text)
    first, last = corners[1] - corners[0], corners[-1] - corners[-2]
    return float(first[0] * last[1] - first[1] * last[0])


def test_axes_and_angles_point_where_the_glossary_says() -> None:
    x, z, speed = direction("x"), direction("z"), direction("V")
    assert x[0] > 0.9  # nose to the right
    assert np.isclose(x @ z, 0.0, atol=1e-12)
    assert x[0] * z[1] - x[1] * z[0] < 0.0  # z is down where x is forward
    assert x[0] * speed[1] - x[1] * speed[0] < 0.0  # positive alpha: the velocity is below the nose
    assert direction("h")[1] == 1.0
    for arc in ("α", "θ", "q"):
        assert turning(arc) > 0.0, arc
    # alpha runs from the velocity to x, theta from the horizon to x.
    centre = named("x")[0]
    for arc, start in (("α", speed), ("θ", np.array([1.0, 0.0]))):
        ends = [(end - centre) / np.linalg.norm(end - centre) for end in named(arc)[[0, -1]]]
        np.testing.assert_allclose(ends, [start, x], atol=1e-9)


def test_the_elevators_trailing_edge_goes_down() -> None:
    arc = named("δ")
    x, z = direction("x"), direction("z")
    assert (arc[-1] - arc[0]) @ z > 0.0
    assert (arc[0] - named("x")[0]) @ x < 0.0  # behind the centre of gravity
