"""A loop called from Python runs its linear algebra on one thread and leaves the caller's setting as it was."""

from __future__ import annotations

import pytest
import threadpoolctl

import aerosid


def threads() -> set[int]:
    """Threads that each library of linear algebra may use now."""
    return {library["num_threads"] for library in threadpoolctl.threadpool_info() if library["user_api"] == "blas"}


class StopError(Exception):
    """Ends a loop at its first stage."""


def test_a_loop_holds_linear_algebra_to_one_thread_and_gives_the_setting_back() -> None:
    folder = aerosid.bundled_folder("flight_data")
    log = aerosid.read_log(folder / "light_transport_doublet.csv")
    inside: list[set[int]] = []

    def stop(_stage: str) -> None:
        inside.append(threads())
        raise StopError

    with threadpoolctl.threadpool_limits(limits=2, user_api="blas"):
        assert threads() == {2}
        with pytest.raises(StopError):
            aerosid.close_loop([log], aerosid.load_aircraft("light_transport"), progress=stop)
        assert threads() == {2}
    assert inside == [{1}]
