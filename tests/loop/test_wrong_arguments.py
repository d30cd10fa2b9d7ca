"""Wrong arguments from Python are one sentence that says what to pass, in place of an error from deep inside."""

from __future__ import annotations

from typing import Any

import pytest

import aerosid
from aerosid.errors import UsageError

LOG = aerosid.read_log(aerosid.bundled_folder("flight_data") / "light_transport_doublet.csv")
AIRCRAFT = aerosid.load_aircraft("light_transport")


@pytest.mark.parametrize(
    ("arguments", "error", "words"),
    [
        (([], AIRCRAFT), UsageError, r"no log to identify from; pass at least one"),
        ((LOG, AIRCRAFT), TypeError, r"identification is one FlightLog, .* pass it as \[log\]"),
        (([LOG], "light_transport"), TypeError, r"the aircraft is str 'light_transport', .* load_aircraft\("),
        ((["x.csv"], AIRCRAFT), TypeError, r"identification holds str 'x.csv', .* read_log\("),
        (("x.csv", AIRCRAFT), TypeError, r"identification is str 'x.csv', .* \[read_log\("),
        (([LOG], AIRCRAFT, LOG), TypeError, r"validation is one FlightLog"),
        ((AIRCRAFT, [LOG]), TypeError, r"the aircraft is a list, expected an Aircraft"),
    ],
)
def test_close_loop_says_what_to_pass(arguments: tuple[Any, ...], error: type[Exception], words: str) -> None:
    with pytest.raises(error, match=words):
        aerosid.close_loop(*arguments)


def test_an_unknown_bundled_folder_is_named_with_those_there_are() -> None:
    name: Any = "foo"
    with pytest.raises(UsageError, match=r"'foo'; give one of aircraft_models, flight_data"):
        aerosid.bundled_folder(name)
