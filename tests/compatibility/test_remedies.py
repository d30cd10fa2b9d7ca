"""Of a wrong unit only those are named that explain the factor, given the one that the channel map declares."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from problems import LIGHT, Problem, with_channels

from aerosid.compatibility.contradiction import contradictions
from aerosid.compatibility.recording import read_recording
from aerosid.compatibility.remedies import SPEEDS, sign_and_unit_remedies, unit_remedies
from aerosid.logs.flight_log import ChannelSource


@pytest.mark.parametrize(("unit", "declared", "size"), [("kt", "knots", SPEEDS["knots"]), ("m/s", "m/s", 1.0)])
def test_the_declared_unit_of_airspeed_is_the_wrong_one(unit: str, declared: str, size: float) -> None:
    found = unit_remedies("m/s", ChannelSource(("IAS",), unit))
    assert len(found) == 3 + (declared == "m/s")
    for factor, words in found:
        true = words.removeprefix("if its values are ").split(" and not ")[0]
        assert f"not {declared} (" in words
        assert factor == pytest.approx(SPEEDS[true] / size, rel=1e-5)


def test_a_unit_that_is_seldom_used_is_named_as_it_is_declared() -> None:
    (slow,) = (words for factor, words in unit_remedies("m/s", ChannelSource(("V",), "cm/s")) if factor == 100.0)
    assert slow.startswith("if its values are m/s and not cm/s")


@pytest.mark.parametrize(
    ("unit", "declared", "words"),
    [
        ("rad", "deg", "radians and not degrees"),
        ("rad", "rad", "degrees and not radians"),
        ("m/s^2", "g", "m/s^2 and not multiples of g"),
        ("m", "ft", "metres and not feet"),
        ("m", "m", "feet and not metres"),
    ],
)
def test_the_one_other_unit_of_a_channel_is_named(unit: str, declared: str, words: str) -> None:
    (_, sign), (_, other) = sign_and_unit_remedies(unit, ChannelSource(("x",), declared))
    assert "sign" in sign
    assert words in other


def test_where_no_unit_is_declared_any_two_may_have_been_mistaken() -> None:
    known = unit_remedies("m/s", ChannelSource(("V",), "kt"))
    assert set(known) < set(unit_remedies("m/s", None))
    assert unit_remedies("m/s", ChannelSource(("V",), "m/s", scale=0.5)) == unit_remedies("m/s", None)


def test_the_sentence_on_a_log_names_the_declared_unit_alone() -> None:
    """0.5925 is also the ratio of km/h and mph within what moving air leaves."""
    log = Problem(elevator="3211", duration=15.0, amplitude=0.06, aircraft=LIGHT).fly(4)
    wrong = with_channels(log, V=log["V"] * SPEEDS["knots"] / SPEEDS["ft/s"])
    recording = read_recording(replace(wrong, sources={"V": ChannelSource(("TAS",), "kt")}))
    assert recording is not None
    assert np.isfinite(recording.airspeed)
    (found,) = contradictions([recording])
    assert "ft/s and not knots (a factor of 0.5925)" in found.remedy
    assert "mph" not in found.remedy
