"""State of the fixed-interval sweeps on flights: a structure with its numbers, d(t) and its statistics."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from aerosid.effects import ActiveEffect
from aerosid.flight_model.aerodynamics import AerodynamicModel, Entry
from aerosid.model_error.term_selection.partial_correlation import Coloured, ColourSettings

Array = NDArray[np.float64]


@dataclass(frozen=True)
class SweepSettings:
    """Settings of the sweeps.

    Attributes
    ----------
    sweeps : int
        At most; five are usual, more means a structure that does not fit.
    tolerance : float
        Share of a deviation by which a sweep moves no estimate any more.
    first_spread, first_memory : float
        Where the search of d's statistics begins: some thousandths of a coefficient (None: the spread of the forward
        estimate's d), half a second. The maximum that it ends in does not depend on them.
    least_spread, most_spread : float
        Bounds of the spread of d in each coefficient: rounding of a seven-digit log, and a coefficient of order one.
    shortest_memory, longest_memory : float
        s; bounds of the time for which d remembers. A slower misfit is to be explained by terms and not by noise:
        3 s is some five times a short period's time constant (found on the twelve practice flights of
        real_flights.md, where the cut at 3 s stopped slow terms from passing as noise).
    searches : tuple of int
        Sweeps before which spreads and memory are sought; the motion moves little after the first two.
    turns : int
        Quasi-Newton steps for each coefficient in the search of spreads and memory.
    settled : float
        Fall of -2 ln L by less than which a step of that search is its last; 0: as far as rounding lets it.
    shown : float
        Fall of -2 ln L that a spread above the least must bring, else it is the least; 0: none. 2.7 is brought by
        chance in one of twenty where there is no d (half chi-square, the spread being at its bound: Self & Liang 1987,
        Journal of the American Statistical Association 82).
    unlike_noise : float
        Size of the innovations, in units of the noise that successive samples show, from which that noise is not the
        sensors': a hundred, as where the recorder's filter is told of. On 21 own flights in gusts with up to four
        things wrong it was 546 or more where the recording was smoothed afterwards, elsewhere 4 or less.
    matchings : int
        Most rounds in which the noise is then matched to the innovations, each channel's to a factor of two.
    most_noise : float
        Share of a channel's motion that its matched noise may be: a tenth, the noisiest case of the paper's table 4.
    halvings : int
        Of a step that raises the cost.
    colour : ColourSettings
        Of what the sensors' noise leaves.
    coloured : bool
        Whether the innovations' own colour is allowed for beside d's.
    smoothed : bool
        Whether the motion is that of the fixed-interval d(t); else of the forward estimate alone (for the study of
        stages).
    """

    sweeps: int = 8
    tolerance: float = 0.05
    first_spread: float | None = 2e-3
    first_memory: float = 0.5
    least_spread: float = 1e-6
    most_spread: float = 1.0
    shortest_memory: float = 0.05
    longest_memory: float = 3.0
    searches: tuple[int, ...] = (0, 2)
    turns: int = 4
    settled: float = 0.0
    shown: float = 0.0
    unlike_noise: float = 100.0
    matchings: int = 8
    most_noise: float = 0.1
    halvings: int = 4
    colour: ColourSettings = field(default_factory=ColourSettings)
    coloured: bool = True
    smoothed: bool = True


@dataclass(frozen=True)
class ErrorStatistics:
    """What d(t) is taken for where nothing explains it.

    Attributes
    ----------
    spread : tuple of float
        Standard deviation in each coefficient.
    memory : float
        s; correlation exp(-|t|/memory).
    variance : (outputs,) array
        Of each output's noise, SI squared.
    gust : ActiveEffect or None
        How the air moves across the flight path: standard deviations, m/s, and scale length, m; None: still air.
    """

    spread: tuple[float, ...]
    memory: float
    variance: Array
    gust: ActiveEffect | None = None

    @property
    def density(self) -> Array:
        """Square root of d's spectral density in each coefficient at the motion's frequencies, but for a factor, s^1/2.

        Of a shorter memory the same d has a greater spread.
        """
        return np.asarray(np.array(self.spread) * np.sqrt(self.memory))


@dataclass(frozen=True)
class SweptModel:
    """A structure with its numbers.

    Attributes
    ----------
    model : AerodynamicModel
        Values of all terms; without columns for d(t).
    free : tuple of Entry
        Terms that are estimated.
    effects : tuple of ActiveEffect
        Sensors, controls and jumps, with their numbers, which are estimated.
    states : tuple of (n,) arrays
        The initial state of each flight.
    forces : tuple of (N, coefficients) arrays
        d(t) of each flight, of which the motion is the reference. The air is still there: its velocity moves the
        aircraft to first order alone.
    statistics : ErrorStatistics
    """

    model: AerodynamicModel
    free: tuple[Entry, ...]
    effects: tuple[ActiveEffect, ...]
    states: tuple[Array, ...]
    forces: tuple[Array, ...]
    statistics: ErrorStatistics

    @property
    def slopes(self) -> int:
        """How many numbers the effects have."""
        return sum(active.slopes for active in self.effects)


@dataclass(frozen=True)
class Rows:
    """Whitened rows of all flights: the target, and how it moves with each column.

    Attributes
    ----------
    target : (R,) array
        Innovations over their deviation.
    known : (R, m) array
        Free terms, effects' numbers, then the initial state of each flight.
    asked : (R, c) array
        Candidates: entries, then numbers of tested effects.
    lengths : tuple of int
        Rows of each channel of each flight, one group after another.
    log_sum : float
        Sum of the logarithms of the innovations' variances.
    channels : tuple of (int, int)
        Flight and output of each group.
    """

    target: Array
    known: Array
    asked: Array
    lengths: tuple[int, ...]
    log_sum: float
    channels: tuple[tuple[int, int], ...]


@dataclass(frozen=True)
class Sweep:
    """The estimate of one structure.

    Attributes
    ----------
    swept : SweptModel
        With the estimated numbers.
    rows : Rows
        At these numbers, nothing asked.
    fit : Coloured
        The regression of the last sweep.
    cost : float
        -2 ln L but for a constant, colour and the number of its coefficients charged.
    deviation : tuple of (N, coefficients) arrays
        Standard deviation of d(t) of each flight, the estimates taken as known; none where it was not asked for.
    converged : bool
    """

    swept: SweptModel
    rows: Rows
    fit: Coloured
    cost: float
    deviation: tuple[Array, ...]
    converged: bool
