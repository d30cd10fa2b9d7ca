"""All tables of the paper, computed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from aerosid.errors import UsageError
from aerosid.studies.paper.table1 import Table1, make_table1
from aerosid.studies.paper.table2 import Table2, make_table2
from aerosid.studies.paper.table3 import Correlation, make_table3
from aerosid.studies.paper.table4 import SNRS, NoiseLevel, make_table4

SEEDS = 200
"""Design: noise seeds per signal-to-noise ratio: the standard error of the mean is then below 0.1 %."""


@dataclass(frozen=True)
class Reproduction:
    """Tables 1 to 4 with supplementary studies."""

    table1: Table1
    table2: Table2
    table3: tuple[Correlation, ...]
    table4: tuple[NoiseLevel, ...]


def steps(seeds: int) -> int:
    """Number of calls of `tick` by `reproduce`."""
    return 3 + 1 + seeds * sum(snr is not None for snr in SNRS)


def reproduce(seeds: int = SEEDS, tick: Callable[[], None] = lambda: None) -> Reproduction:
    """Tables 1 to 4.

    Parameters
    ----------
    seeds : int
        Noise seeds per signal-to-noise ratio in table 4.
    tick : callable
        Called `steps(seeds)` times.

    Raises
    ------
    UsageError
        Where `seeds` is below 2.
    """
    if seeds < 2:
        raise UsageError(f"--seeds is {seeds}; a mean with its scatter needs at least 2.")
    table1 = make_table1()
    tick()
    table2 = make_table2()
    tick()
    table3 = make_table3()
    tick()
    return Reproduction(table1, table2, table3, make_table4(seeds, tick))
