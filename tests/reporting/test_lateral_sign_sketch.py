"""The lateral sketch of positive directions, checked against the sign conventions."""

from __future__ import annotations

import re

import numpy as np

from aerosid.nomenclature import CHANNELS
from aerosid.reporting.figures.chart import Line, Words
from aerosid.reporting.figures.lateral_sign_sketch import lateral_sign_sketch

MARKS = lateral_sign_sketch().panels[0].marks


def line_before(text: str) -> np.ndarray:
    """Corners of the last arrow or arc before a name, without its head."""
    place = next(i for i, m in enumerate(MARKS) if isinstance(m, Words) and re.split("[,_]", m.text)[0] == text)
    lines = [mark for mark in MARKS[:place] if isinstance(mark, Line)]
    return np.column_stack([lines[-2].x, lines[-2].y])


def clockwise(corners: np.ndarray) -> bool:
    first, last = corners[1] - corners[0], corners[-1] - corners[-2]
    return bool(first[0] * last[1] - first[1] * last[0] < 0.0)


def test_from_above_with_the_nose_to_the_right_right_is_down_the_page() -> None:
    x, y, speed = (np.diff(line_before(name)[[0, -1]], axis=0)[0] for name in ("x", "y", "V"))
    assert x[0] > 0.0
    assert x[1] == 0.0
    assert y[1] < 0.0
    assert abs(y[0]) < 1e-9
    assert speed @ y > 0.0  # the velocity has a part to the right: the wind comes from there
    assert clockwise(line_before("β"))  # from the nose to the velocity
    assert clockwise(line_before("r"))  # seen from above: nose right


def test_from_behind_the_right_wing_goes_down() -> None:
    assert clockwise(line_before("p"))
    z = np.diff(line_before("z")[[0, -1]], axis=0)[0]
    assert z[1] < 0.0


def test_surfaces_move_as_the_glossary_says() -> None:
    rudder = line_before("δ")
    assert "trailing edge left" in CHANNELS["delta_r"].positive
    assert rudder[-1, 1] > rudder[0, 1]  # left is up the page
    flaps = [np.column_stack([m.x, m.y]) for m in MARKS if isinstance(m, Line) and len(m.x) == 4]
    right, left = sorted(flaps, key=lambda corners: -corners[:, 0].mean())[:2]
    assert "right trailing edge down" in CHANNELS["delta_a"].positive
    assert right[1, 1] < right[0, 1]
    assert left[1, 1] > left[0, 1]


def test_everything_lies_on_the_page() -> None:
    chart = lateral_sign_sketch()
    for mark in MARKS:
        x, y = np.atleast_1d(np.asarray(mark.x)), np.atleast_1d(np.asarray(mark.y))
        assert x.min() >= 0.0
        assert x.max() <= chart.width
        assert y.min() >= 0.0
        assert y.max() <= chart.height
