"""Logs of one name in one loop: each has a name of its own, and steps belong to one of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from aerosid.logs.flight_log import FlightLog
from aerosid.loop.roles import named_apart

TIME = 0.1 * np.arange(50)


def log_of(name: str, path: str = "", start: float = 0.0) -> FlightLog:
    return FlightLog(name, TIME + start, {"V": np.full(TIME.size, 50.0)}, path=path)


def test_files_of_one_name_go_by_their_folders_and_spans_of_one_file_by_their_times() -> None:
    monday, tuesday = log_of("flight", "monday/flight.csv"), log_of("flight", "tuesday/flight.csv")
    other = log_of("other", "monday/other.csv")
    (one,), (two, three) = named_apart([monday], [tuesday, other])
    assert (one.name, two.name) == ("monday_flight", "tuesday_flight")
    assert three is other
    early, late = log_of("flight", "flight.csv"), log_of("flight", "flight.csv", 10.0)
    (one,), (two,) = named_apart([early], [late])
    assert (one.name, two.name) == ("flight_0-4.9", "flight_10-14.9")
    made = [replace(early, path=""), replace(early, path="")]
    assert [log.name for log in named_apart(made)[0]] == ["flight_1", "flight_2"]


@given(
    st.lists(
        st.tuples(
            st.sampled_from(["a", "a_1", "a_2", "x_a", "a_0-4.9"]),
            st.sampled_from(["", "x/a.csv", "y/a.csv"]),
            st.sampled_from([0.0, 1.0]),
        ),
        max_size=8,
    )
)
def test_names_are_distinct_and_those_that_were_stay(rows: list[tuple[str, str, float]]) -> None:
    logs = [log_of(*row) for row in rows]
    (named,) = named_apart(logs)
    assert len({log.name for log in named}) == len(logs)
    for log, found in zip(logs, named, strict=True):
        if sum(other.name == log.name for other in logs) == 1:
            assert found is log
