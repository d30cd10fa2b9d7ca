"""Settings of the noise estimates, filters and residual tests on plain arrays."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class NoiseSettings:
    """Settings of the noise level of a channel and of what is calmed in it.

    Attributes
    ----------
    trim : float
        Standard deviations, 1, of the differences beyond which they are left out: corners of the manoeuvre and spikes
        lie there. Chosen; the estimate is corrected for it.
    fewest : int
        Differences of one order, or without a gap, below which they say nothing. Chosen.
    clear : float
        Standard deviations, 1, of the noise within which a mean takes in a sample: corners are left alone, and of white
        noise three samples in a hundred.
    half_windows : tuple of int
        Half widths, samples, of the means; the widest passes a quarter of a hertz at 100 samples per second.
    even : float
        Share of the sampling interval, 1, by which stamps may jitter without showing in the weights of differences.
    rest : float
        s; windows whose standard deviations are compared to find a channel at rest. Chosen: several times the memory of
        a recorder's noise.
    quietest : float
        Quantile of them, 1, that is taken for rest. Chosen.
    most_coloured : float
        Largest ratio of coloured noise to its white part, 1. Chosen: first-order noise that remembers twelve samples.
    """

    trim: float = 3.0
    fewest: int = 8
    clear: float = 2.5
    half_windows: tuple[int, ...] = (1, 2, 4, 8, 16)
    even: float = 0.02
    rest: float = 2.0
    quietest: float = 0.1
    most_coloured: float = 5.0


@dataclass(frozen=True)
class ReprocessingSettings:
    """When an estimate of noise is not to be believed, since samples are not a sensor's own; chosen.

    Attributes
    ----------
    finest : float
        Of the channel's range, 1: a sensor whose noise is less does not exist; 16 bits over the range leave 1.5e-5, and
        their quantum over sqrt(12) is 4e-6. Effect: below it the channel counts as filtered.
    repeated_share : float
        Of the steps of a channel that moves, 1: with more of them zero, samples are repeated.
    level_share : float
        Distinct values over samples, 1: with fewer, repeated samples are those of a coarse quantum.
    straight_share : float
        Of the second differences of a channel that moves, 1: with more of them zero within rounding, it is
        interpolated.
    rounding : float
        Of the channel's range, 1: differences below it are zero. Seven printed digits leave 1e-7.
    fewest : int
        Samples, or steps, below which nothing is doubted.
    window : int
        Samples within which a channel that moves travels.
    travel : float
        Of the channel's range, 1, that it travels within the window where it moves.
    """

    finest: float = 2e-5
    repeated_share: float = 0.4
    level_share: float = 0.1
    straight_share: float = 0.4
    rounding: float = 2e-7
    fewest: int = 20
    window: int = 21
    travel: float = 0.01


@dataclass(frozen=True)
class PrefilterSettings:
    """Settings of the common cut-off and of its filter.

    Attributes
    ----------
    margin : float
        Cut-off over the frequency where the signal sinks into the noise, 1: 0.96 of the signal still passes there.
    worth : float
        Share of the noise's deviation, 1, beyond which a filter that leaves it costs phase and ends for nothing.
    gap_periods : float
        Periods of the cut-off, 1, from which a straight line across a gap says nothing: the record is split there.
    even : float
        Share of the sampling interval, 1, by which stamps may jitter and a digital filter with fixed coefficients run.
    """

    margin: float = 1.5
    worth: float = 0.9
    gap_periods: float = 0.5
    even: float = 0.02


@dataclass(frozen=True)
class WhitenessSettings:
    """Settings of the tests whether a residual is what a sensor leaves.

    Attributes
    ----------
    lags : int
        Lags, samples, of Ljung and Box's test: it loses power with many, and misses slow swings with few.
    longest_memory : float
        Time, s, beyond which sensor noise has forgotten itself; what a wrong model leaves follows the motion.
    neighbours : int
        Samples either way over which two channels are compared.
    doubt : float
        Probability, 1, below which a residual is not what it was taken for. Chosen.
    """

    lags: int = 20
    longest_memory: float = 0.3
    neighbours: int = 2
    doubt: float = 1e-4


@dataclass(frozen=True)
class ColourSettings:
    """Settings of the noise models by which covariances are corrected.

    Attributes
    ----------
    highest_order : int
        Highest autoregressive order, samples, among which Akaike's criterion chooses: the length of a usual antialias
        filter's memory at the samples of a recorder. Chosen.
    most_reflection : float
        Largest reflection coefficient, 1: a noise model must not remember for longer than records last.
    least_innovation : float
        Share of a residual's variance, 1, that its noise model must not predict from the past; below it the residual is
        averaged over blocks of samples. A memory of .8 a sample leaves as much, and is modelled well; with .1 standard
        errors in simulated filtered noise remained up to a fifth too small (regressions on slow noise, seed 2).
    kept_energy : float
        Sum of squares of each regressor, 1, that the means over blocks must keep. Chosen.
    fewest_blocks : int
        Blocks that must remain of each group. Chosen.
    neighbours : int
        Frequencies over which a cross-spectrum is averaged, of a record padded to twice its length: some four and a
        half independent ones, so that a variance of one column is known to a third (Priestley 1981, section 6.2).
    """

    highest_order: int = 12
    most_reflection: float = 0.995
    least_innovation: float = 0.35
    kept_energy: float = 0.98
    fewest_blocks: int = 60
    neighbours: int = 9


NOISE = NoiseSettings()
REPROCESSING = ReprocessingSettings()
PREFILTER = PrefilterSettings()
WHITENESS = WhitenessSettings()
COLOUR = ColourSettings()
