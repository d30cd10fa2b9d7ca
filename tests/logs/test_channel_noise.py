"""Noise of a channel: declared values take precedence, estimates where possible, marked where unreliable."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.ndimage import uniform_filter1d

from aerosid.errors import ChannelMapError
from aerosid.logs.channel_noise import channel_noise, noise_deviation, with_declared_noise
from aerosid.logs.flight_log import FlightLog
from aerosid.logs.formats import read_log
from aerosid.logs.quality import Problem, check_log

TIME = np.arange(0.0, 40.0, 0.04)
MOTION = 0.1 * np.sin(1.7 * TIME) * np.exp(-0.05 * TIME) + 0.05 * np.sin(0.4 * TIME)


def log_of(values: np.ndarray, **declared: dict[str, float]) -> FlightLog:
    return FlightLog("flight", TIME, {"alpha": values}, {"alpha": "rad"}, **declared)


@given(st.integers(0, 2**32 - 1), st.floats(1e-5, 1e-2))
def test_white_noise_is_estimated_and_believed(seed: int, deviation: float) -> None:
    values = MOTION + deviation * np.random.default_rng(seed).standard_normal(TIME.size)
    known = channel_noise(log_of(values), "alpha")
    assert known.doubt == ""
    assert not known.declared
    assert known.deviation == pytest.approx(deviation, rel=0.25)


def noisy() -> np.ndarray:
    return MOTION + 1e-3 * np.random.default_rng(7).standard_normal(TIME.size)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        (MOTION, "filtered, or computed"),
        (uniform_filter1d(uniform_filter1d(uniform_filter1d(noisy(), 51), 51), 51), "filtered, or computed"),
        (np.interp(TIME, TIME[::5], noisy()[::5]), "interpolated"),
        (np.repeat(noisy()[::4], 4)[: TIME.size], "repeated"),
    ],
    ids=["computed", "filtered", "interpolated", "repeated"],
)
def test_what_cannot_be_estimated_is_said(values: np.ndarray, words: str) -> None:
    assert words in channel_noise(log_of(values), "alpha").doubt
    findings = [finding for finding in check_log(log_of(values)).findings if finding.problem is Problem.NOISE_UNKNOWN]
    assert [finding.subject for finding in findings] == ["alpha"]


def test_of_a_quantised_channel_the_quantum_is_the_least_noise() -> None:
    coarse = log_of(np.round(MOTION / 0.01) * 0.01)
    known = channel_noise(coarse, "alpha")
    assert known.doubt == ""
    assert known.deviation >= 0.99 * 0.01 / np.sqrt(12.0)
    assert Problem.COARSE in {finding.problem for finding in check_log(coarse).findings}


def test_a_declared_noise_wins_and_is_not_doubted() -> None:
    known = channel_noise(log_of(MOTION, noise={"alpha": 2e-3}), "alpha")
    assert (known.deviation, known.declared, known.doubt) == (2e-3, True, "")
    assert check_log(log_of(MOTION, noise={"alpha": 2e-3})).channels[0].noise == 2e-3


def test_a_declared_resolution_is_the_least_noise() -> None:
    known = channel_noise(log_of(MOTION, resolution={"alpha": 0.012}), "alpha")
    assert known.deviation == pytest.approx(0.012 / np.sqrt(12.0))
    assert known.declared
    both = channel_noise(log_of(MOTION, noise={"alpha": 0.001}, resolution={"alpha": 0.012}), "alpha")
    assert both.deviation == pytest.approx(0.012 / np.sqrt(12.0))


def test_the_aircraft_files_noise_gives_way_to_the_maps() -> None:
    log = log_of(MOTION, noise={"alpha": 1e-3})
    assert with_declared_noise(log, {"alpha": 5e-3, "q": 1.0}, {}).noise == {"alpha": 1e-3}
    assert with_declared_noise(log_of(MOTION), {"alpha": 5e-3, "q": 1.0}, {}).noise == {"alpha": 5e-3}


def test_a_map_gives_noise_in_the_files_unit(tmp_path: Path) -> None:
    path = tmp_path / "flight.csv"
    rows = "\n".join(f"{t:.2f},{np.degrees(value):.9f}" for t, value in zip(TIME, MOTION, strict=True))
    path.write_text(f"t,aoa\n{rows}\n")
    mapping = tmp_path / "channels.toml"
    entry = 'alpha = { column = "aoa", unit = "deg", scale = 2.0, noise = 0.1, resolution = 0.02 }'
    mapping.write_text(f'schema = 1\ntime = {{ column = "t", unit = "s" }}\n[channels]\n{entry}\n')
    log = read_log(path)
    assert log.noise["alpha"] == pytest.approx(np.radians(0.1))
    assert log.resolution["alpha"] == pytest.approx(np.radians(0.02))
    assert log.between(0.0, 10.0).noise == log.noise
    mapping.write_text(mapping.read_text().replace("noise = 0.1", "noise = -0.1"))
    with pytest.raises(ChannelMapError, match="noise"):
        read_log(path)


@pytest.mark.parametrize("declared", [{}, {"noise": {"alpha": 3e-3}}, {"resolution": {"alpha": 1e-2}}])
def test_the_deviation_alone_is_the_same(declared: dict[str, dict[str, float]]) -> None:
    log = log_of(noisy(), **declared)
    assert noise_deviation(log, "alpha") == channel_noise(log, "alpha").deviation
