"""Extrapolation in time: numbers of a mode that lasts longer than the recordings it was identified from."""

from __future__ import annotations

import math
from collections.abc import Mapping

from aerosid.loop.quantity import Parameter

_TIMES = ("period", "time_constant", "time_to_half", "time_to_double")


def beyond_record(numbers: Mapping[str, Parameter], record: float) -> tuple[str, ...]:
    """The names of those numbers of a mode that no recording of that length holds.

    Parameters
    ----------
    numbers : mapping of str to Parameter
        Of frequency (rad/s), damping, root (1/s), period, time constant and times to half and double (s) those that
        the mode has.
    record : float
        Length of the longest recording, s.

    Notes
    -----
    A time is extrapolated where it is longer than the recording. Frequency and damping are where one cycle is: one
    period, the time 2 pi/omega where both roots are real; a single root where its time constant is. They follow from
    derivatives that the faster motion shows, and their standard errors do not count what the model leaves out in slower
    motion.
    """
    names = [name for name in _TIMES if name in numbers and numbers[name].value > record]
    if "period" in numbers:
        cycle = numbers["period"].value
    elif "frequency" in numbers and numbers["frequency"].value > 0.0:
        cycle = 2.0 * math.pi / numbers["frequency"].value
    else:
        cycle = 0.0
    if cycle > record:
        names += [name for name in ("frequency", "damping") if name in numbers]
    if "time_constant" in names and "root" in numbers:
        names.append("root")
    return tuple(name for name in numbers if name in names)
