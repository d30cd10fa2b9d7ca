"""Whether two logs contain the same samples: by file and span, or by rows independent of the clocks."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from aerosid.errors import UsageError
from aerosid.logs.flight_log import FlightLog
from aerosid.logs.settings import DUPLICATES
from aerosid.logs.shared_samples import shared_samples
from aerosid.loop.roles import require_separate

CHANNELS = ("V", "alpha", "q", "delta_e")


def recorded(seed: int, samples: int = 200, path: str = "", sha256: str = "") -> FlightLog:
    generator = np.random.default_rng(seed)
    values = {name: np.round(generator.normal(size=samples), 4) for name in CHANNELS}
    return FlightLog(f"log{seed}", 0.1 * np.arange(samples), values, path=path, sha256=sha256)


def test_one_file_overlaps_itself_by_its_spans() -> None:
    whole = recorded(1, path="a.csv", sha256="1" * 64)
    first, second, across = whole.between(0.0, 9.9), whole.between(10.0, 19.9), whole.between(8.0, 12.0)
    assert shared_samples(whole, whole) == (0.0, pytest.approx(19.9))
    assert shared_samples(first, second) is None
    assert shared_samples(whole.between(0.0, 10.0), second) is None  # adjacent spans
    assert shared_samples(across, first) == pytest.approx((8.0, 9.9))
    renamed = replace(across, path="b.csv")
    assert shared_samples(renamed, first) == pytest.approx((8.0, 9.9))
    unhashed = replace(across, sha256="")
    assert shared_samples(unhashed, first) == pytest.approx((8.0, 9.9))


@given(st.integers(0, 150), st.integers(DUPLICATES.fewest_rows, 50), st.floats(-1e3, 1e3))
def test_a_cut_is_known_again_whatever_its_clock_says(start: int, length: int, shift: float) -> None:
    whole = recorded(2)
    part = slice(start, start + length)
    cut = FlightLog("cut", whole.time[part] + shift, {name: whole[name][part] for name in CHANNELS[:3]})
    found = shared_samples(cut, whole)
    assert found is not None
    assert found == pytest.approx((cut.time[0], cut.time[-1]))
    assert shared_samples(whole, cut) == pytest.approx((whole.time[part][0], whole.time[part][-1]))


def test_two_flights_and_few_rows_share_nothing() -> None:
    one, two = recorded(3), recorded(4)
    assert shared_samples(one, two) is None
    few = {name: np.where(np.arange(200) < DUPLICATES.fewest_rows - 1, one[name], two[name]) for name in CHANNELS}
    assert shared_samples(FlightLog("few", one.time, few), one) is None
    still = {name: np.zeros(200) for name in CHANNELS}
    assert shared_samples(FlightLog("ground", one.time, still), FlightLog("ground too", one.time, still)) is None


@pytest.mark.parametrize(
    ("places", "words"),
    [((0, 1), "--validate"), ((0, 2), "--hold-out"), ((1, 2), "--hold-out"), ((0, 0), "counted once")],
)
def test_what_is_given_twice_is_refused_by_name(places: tuple[int, int], words: str) -> None:
    roles: list[list[FlightLog]] = [[recorded(5)], [recorded(6)], [recorded(7)]]
    require_separate(*roles)
    twin = recorded(8, path="flights/twin.csv")
    for place in places:
        roles[place].append(twin)
    with pytest.raises(UsageError, match=r"twin\.csv") as caught:
        require_separate(*roles)
    assert words in str(caught.value)
    assert caught.value.exit_code == 2
