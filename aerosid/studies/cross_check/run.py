"""All steps of the cross-check."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from aerosid.errors import UsageError
from aerosid.studies.cross_check.effects_check import PLANTED, EffectCheck, check_effects
from aerosid.studies.cross_check.paper_flight import PaperFlight, check_paper
from aerosid.studies.cross_check.sideways_check import SidewaysCheck, check_sideways
from aerosid.studies.cross_check.stock_check import StockCheck, check_aircraft, require_condition
from aerosid.studies.jsbsim.flight import jsbsim_version
from aerosid.studies.jsbsim.process import require_jsbsim
from aerosid.studies.paper.table4 import SNRS

AIRCRAFT = ("L410", "DHC6", "c310", "t6texan2", "fokker50", "737")
AMPLITUDE = 0.04
"""Design: rad, of the elevator: alpha varies by 2 to 4 degrees."""


@dataclass(frozen=True)
class CrossCheck:
    """Result of the cross-check.

    Attributes
    ----------
    jsbsim : str
        Version of JSBSim.
    seed : int
    seeds : int
        Seeds of table 4.
    amplitude : float
        Of the manoeuvres of JSBSim's aircraft, rad.
    paper : PaperFlight
    aircraft : tuple of StockCheck
    effects : tuple of EffectCheck
    sideways : tuple of SidewaysCheck
        The same aircraft in their lateral axes.
    """

    jsbsim: str
    seed: int
    seeds: int
    amplitude: float
    paper: PaperFlight
    aircraft: tuple[StockCheck, ...]
    effects: tuple[EffectCheck, ...]
    sideways: tuple[SidewaysCheck, ...] = ()


def steps(aircraft: Sequence[str], seeds: int) -> int:
    """Number of calls of `tick` by `cross_check`."""
    return 1 + seeds * sum(snr is not None for snr in SNRS) + 2 * len(aircraft) + len(PLANTED)


def require_possible(aircraft: Sequence[str], seeds: int) -> None:
    """Nothing, where `cross_check` can fly these aircraft with so many noise records.

    Raises
    ------
    UsageError
        Where JSBSim is missing, an aircraft has no known condition, or there are too few noise records.
    """
    require_jsbsim()
    if seeds < 2:
        raise UsageError(f"--seeds is {seeds}; a mean with its scatter needs at least 2.")
    for name in aircraft:
        require_condition(name)


def cross_check(
    aircraft: Sequence[str] = AIRCRAFT,
    *,
    amplitude: float = AMPLITUDE,
    seed: int = 0,
    seeds: int = 50,
    tick: Callable[[int], None] = lambda _steps: None,
) -> CrossCheck:
    """The paper, JSBSim's aircraft and injected effects, all simulated by JSBSim.

    Parameters
    ----------
    aircraft : sequence of str
        Aircraft of JSBSim, with a known flight condition.
    amplitude : float
        rad.
    seed : int
        Of the sensors' noise.
    seeds : int
        Noise records per signal-to-noise ratio in table 4.
    tick : callable
        Called after each step.

    Raises
    ------
    UsageError
        Where JSBSim is missing, an aircraft has no known condition, or a number is out of range.
    """
    require_possible(aircraft, seeds)
    paper = check_paper(seeds, tick)
    checked = []
    for name in aircraft:
        checked.append(check_aircraft(name, amplitude, seed))
        tick(1)
    sideways = []
    for name in aircraft:
        sideways.append(check_sideways(name, amplitude, seed))
        tick(1)
    planted = check_effects(seed, tick)
    return CrossCheck(jsbsim_version(), seed, seeds, amplitude, paper, tuple(checked), planted, tuple(sideways))
