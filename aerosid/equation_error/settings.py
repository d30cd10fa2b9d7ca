"""Settings of the equation-error regression and of the search for structure in it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from aerosid.flight_model.axes import Axes


def _drifts() -> Mapping[str, float]:
    return {"theta": 1e-4, "phi": 2e-4, "psi": 2e-4, "alpha": 3e-4, "beta": 3e-4, "V": 0.01, "h": 0.5}


def _path_errors() -> Mapping[str, float]:
    return {"alpha": 0.02, "phi": 0.02}


def _least_noise() -> Mapping[str, float]:
    return {"a_z": 0.02, "theta": 3e-4}


def _asymmetry() -> Mapping[str, float]:
    return {"C_Y": 0.005, "C_l": 0.001, "C_n": 0.002}


@dataclass(frozen=True)
class EquationErrorSettings:
    """Settings of the equation-error engine, each with quantity, unit, effect and source.

    Attributes
    ----------
    false_alarm : float
        Probability, 1, that a flight with nothing missing has something named: the prior odds of each hypothesis are
        this share over the number of hypotheses asked, so that an effect enters where its posterior odds by Schwarz's
        criterion pass one: gain in ln L - (k/2) ln N > ln(asked/false_alarm). Verified by Monte Carlo in
        tests/equation_error/test_false_alarms.py.
    contradicted : float
        Probability, at most, that the price of the terms of a coefficient rests on: that it lacks something, however
        much it loses in ln L by the proven faults. 0.5: even odds.
    sideways_false_alarm : float
        The same where sideslip is compared: two of 200 clean flights may have something named, by whatever method, and
        real flights leave in C_l and C_n what no term of the library is.
    deviations : float
        Corrected deviations between a final value and its null value at least. Three: one in 370 by chance.
    order : int
        Order, samples, of the autoregression that colours the residuals. Klein & Morelli, Aircraft System
        Identification, section 6.3, use correlation up to a short-period's length; four poles hold a resonance, a bend
        and a drift.
    fewest : int
        Samples in the band, twice that order, below which a recording's equations are not compared.
    memory : float
        Longest memory, s, that the colour of a coefficient's residual may have, and of the paths of bank, heading and
        sideslip, which a gyro's zero bends: what is slower must be explained.
        About the scale of moderate turbulence over the airspeed (MIL-F-8785C: 530 m at 180 m/s).
    band_ratio : float
        Power of q over its noise floor, 1, up to which frequencies are used: the band in which the motion is known.
    band_depth : float
        Power of q over its greatest, 1, below which a frequency holds no motion: amplitudes of a hundredth.
    band_lowest, band_highest : float
        Limits of that band's end, Hz: a short period with its damping needs the first, rigid-body motion ends at the
        second.
    band_share : float
        Highest end of the band as a share of the sampling frequency, 1; beyond, the derivative of q through samples
        loses more than one part in a hundred.
    coarsest : float
        Interval between samples, s, beyond which others are put between them: a delay between two samples, taken along
        the straight line, makes 1 Hz of such a control smaller by at most 0.8 %, and 5 % at 0.1 s.
    blend, blend_aside : float
        Time, s, over which the difference between what is measured and what is integrated is smoothed for the
        regressors, of alpha and V and of beta: faster, the inertial path is the better; slower, the sensors are.
    blends : tuple of float
        Other times, s, of alpha and V, where they are likelier: on three of four flights in gusts of
        `benchmarks/field_detection.py`, seeds 21 and 23. A shorter one of .25 s was too, and moved the vane's lag on
        HFB-320 further from what its kinematics show.
    blend_compared : float
        The same where a model's coefficients are compared with the measured ones, s: up to the end of the band the
        gusts that vanes show are motion, which a model has to answer. Chosen: a Gaussian's half power at 1.3 Hz.
    wind_memory : float
        Time, s, over which airspeed and vane less their paths are smoothed to give the velocities that the paths are
        integrated from: faster, their difference is gusts, which move no aircraft; slower, it is what zeros of sensors
        integrate to. Some scale lengths of light turbulence at a glider's airspeed; found on flight 57 of
        tests/equation_error/test_false_alarms.py.
    drifts : mapping of str to float
        Standard deviation of the drift of each kinematic equation from recording to recording, unit/s: rates of gyros
        (0.006 deg/s), of the wind and of vertical air.
    path_errors : mapping of str to float
        Where no vane shows sideslip, standard deviations of the zero of the angle of attack, rad, and of the scale of
        the bank angle, 1, that its path may suffer from: of usual vanes and attitude systems, not found on any data.
    asymmetry : mapping of str to float
        Standard deviation, 1, of the constants of side force, rolling and yawing moment: aircraft are nearly symmetric
        and trimmed. About what a degree of sideslip or a third of a degree of aileron makes.
    separation_range : float
        Span of alpha, rad, from which on flow separation is asked: three degrees, of which a flight near the stall is
        enough to bend lift. Found on flights 37 and 5 of benchmarks/field_detection.py, seeds 101 and 102, where powers
        of alpha and pitch rate stood in its place below six.
    factor_odds : float
        Prior odds, 1, of a term with one factor more against the simpler one: of equal fits the simpler is named.
    height_bend : float
        Standard deviation of the constant vertical acceleration, m/s^2, that accelerometers' zeros leave in the height:
        the drift of alpha over a usual airspeed.
    least_noise : mapping of str to float
        Standard deviation, SI, that the slow noise of a sensor has at least, whatever its samples' differences show:
        recordings that were smoothed show none. Two thousandths of g, and a fiftieth of a degree.
    noise_memory : float
        Time, s, over which the noise of accelerometers and attitude is remembered: times its variance it is the density
        with which the integrated height goes astray. Chosen: about the scale of vibration and of a filter of 1 Hz.
    wander_modes : int
        Cosines of the record's length that hold it: beyond, its own noise is more.
    shortlist : int
        Candidates a round that are fitted with the colour estimated anew; the score with a given colour ranks them.
    fitted : int
        Candidates a round whose numbers, and all others, are estimated anew: the likeliest of the shortlist.
    most : int
        Effects that may be named; a flight that lacks more misses something that is no sum of effects.
    distinct : float
        Share, 1, of a term's whitened column that no other column explains, without which the term is not named: a
        tenth of its size. In usual manoeuvres alphadot leaves less beside q and alpha, which then stand for it; it is
        listed as an alternative. By reasoning; the first recording on which it decided is the Twin Otter 018. With
        three hundredths ATTAS elv1 got a lift of the stabiliser, which hardly moves there, of twice that of alpha.
    overwhelming : float
        Times its price, 1, that such a term must gain to be named all the same: an error of a percent in the columns of
        others makes no gain of a hundred in ln L. By reasoning, on the drag polar of
        tests/equation_error/test_drag_polar.py, of whose column a hundredth of its size is its own.
    alike : float
        Difference in ln L, beside three parts in a hundred of the chosen one's gain, within which another hypothesis in
        its place is listed as its alternative. Two standard deviations of the difference between structures neither of
        which holds the other, 2 sqrt(2 x 8) = 8 (Vuong, Econometrica 57, 1989).
    alike_instruments : float
        The same of faults of instruments, at two and a half deviations, 12.5: late vanes and arms differ by less than
        what the path of a real sensor makes of either.
    clearly : float
        Gain in ln L, prices counted, from which another hypothesis takes a chosen one's place. Chosen.
    nearly : float
        Gain in ln L beyond the price, to first order, from which a hypothesis is worth an estimate of its own. Chosen.
    near_share, near_deviations : float
        Share of its price, 1, that a hypothesis must bring to be told as not proven, and its corrected deviations from
        the null value: of those that chance puts first among so many most bring less. Chosen.
    agreement : float
        Deviations of their difference by which two recordings' numbers of one instrument may differ.
    agreement_share : float
        Share, 1, of an instrument's fault by which recordings may differ beyond that: its zero moves a little from
        flight to flight, and what is still missing pulls the recordings' numbers apart. Chosen.
    choice_gain : float
        Gain in ln L of kinematics and coefficients together from which another instrument's fault takes a chosen one's
        place: odds of fifty. Chosen.
    choice_share : float
        Share, 1, of what a fault brings to the kinematics that another must bring to be about the same thing. Chosen.
    rounds : int
        Times that the search goes on without what the unseen recordings refused.
    gust_answer : float
        Deviations from one within which the answer of lift or side force to a vane must lie, 1.
    gust_certain : float
        Deviations from zero that it must have, 1: vane noise answers nothing.
    followed : float
        Share, 1, of a heading about its line that the integrated rates must explain for it to be that of this motion.
    support : float
        Standard deviations, 1, by which kinematics must show an instrument's fault for coefficients to be asked of it,
        and gain in ln L that this is: one in twenty by chance, and both together have to pay the price. Chosen.
    doubt : float
        Deviations of its mean by which the squares of an unseen coefficient's residual may rise with an effect before
        that recording refuses it.
    blocks : int
        Parts at most into which a single recording is cut where no other is left unseen; each is predicted from the
        rest. Four: each estimate then keeps three quarters of the motion.
    block_length : float
        Length, s, that a part has at least: twice the memory of the colour.
    block_doubt : float
        As `doubt`, of a part of a single recording. Two: there are up to twelve coefficients of parts, where
        `doubt` judges three of a recording.
    rise_of_rest : float
        Share, 1, of what is left of an unseen coefficient by which it may rise with other numbers of an instrument
        before that recording keeps the numbers as they were. Chosen after the Citation's short periods
        (reports/recorded_flights.md).
    calm : float
        Share of the sideslip, 1, that its vane may show beyond the inertial path for the air to be calm: an
        output-error estimate then gives the numbers of the structure that the equations decided. Chosen: a tenth.
    closed : float
        Kinematic residual over what white noise of the size that successive samples show leaves in the band, 1, up to
        which the kinematics of a flight are closed: white noise leaves one, that of integrated gyros and accelerometers
        up to two. Beyond it the air moves or the recorder makes a noise of its own, open-loop errors are no measurement
        noise, and the equations decide. Flights in white noise have 1.0 to 2.0 (`benchmarks/wide_detection.py --plant
        none`, seed 77), in gusts behind a recorder of 50 Hz 3.2 or more (`benchmarks/field_detection.py`, seeds
        111 and 120); coloured noise in calm air has 2 to 7, and up to this the likelihood takes it for what it is.
    laguerre_times : tuple of float
        Time constants, s, of the Laguerre functions of the controls that are tried as instruments: short
        periods from an unmanned aircraft's to a large transport's.
    laguerre_slower : float
        How much slower the second set of Laguerre functions is: the airspeed and the attitude answer over some short
        periods.
    laguerre_order : int
        Functions of each set: twice an oscillation's two states and a delay.
    usual_excess : float
        Power of whitened kinematic residuals in the space of the instruments over their power in all directions, 1,
        that is expected: four poles do not whiten what is slow. Mean of 40 simulated flights in turbulence with nothing
        missing (benchmarks/turbulent_flights.py, seeds 4000 to 4039).
    fewest_early : int
        Sensors that have to be early for the same to be tried as the others late: one alone is told most simply as
        early. By reasoning.
    needed_share : float
        Share, 1, of what is left of an unseen coefficient that has to fall away with an effect which few blocks of the
        fitted recordings show, where the unseen recording's gain in ln L does not confirm it. Chosen: a half.
    usual_freedom : float
        Degrees of freedom that this expectation counts for: about as many as one flight has of its own; the spread over
        those flights was no wider than that of chi squared.
    least_rise : float
        Fall of R^2, 1, that goes with it at least: less is what the uncertainty of the effect's numbers does.
    """

    false_alarm: float = 0.01
    contradicted: float = 0.5
    sideways_false_alarm: float = 0.003
    deviations: float = 3.0
    order: int = 4
    fewest: int = 8
    memory: float = 3.0
    band_ratio: float = 10.0
    band_depth: float = 1e-4
    band_lowest: float = 0.8
    band_highest: float = 4.0
    band_share: float = 0.25
    coarsest: float = 0.04
    blend: float = 1.0
    blend_aside: float = 1.0
    blends: tuple[float, ...] = (0.5,)
    blend_compared: float = 0.1
    wind_memory: float = 10.0
    drifts: Mapping[str, float] = field(default_factory=_drifts)
    path_errors: Mapping[str, float] = field(default_factory=_path_errors)
    asymmetry: Mapping[str, float] = field(default_factory=_asymmetry)
    separation_range: float = 0.05
    factor_odds: float = 0.3
    height_bend: float = 0.02
    least_noise: Mapping[str, float] = field(default_factory=_least_noise)
    noise_memory: float = 0.3
    wander_modes: int = 8
    shortlist: int = 8
    fitted: int = 3
    most: int = 12
    clearly: float = 1.0
    nearly: float = -4.0
    near_share: float = 0.5
    near_deviations: float = 2.0
    agreement: float = 3.0
    agreement_share: float = 0.05
    choice_gain: float = 4.0
    choice_share: float = 0.8
    rounds: int = 3
    gust_answer: float = 3.0
    gust_certain: float = 6.0
    followed: float = 0.5
    support: float = 2.0
    doubt: float = 1.0
    rise_of_rest: float = 0.1
    least_rise: float = 0.002
    blocks: int = 4
    block_length: float = 6.0
    block_doubt: float = 2.0
    calm: float = 0.1
    closed: float = 3.0
    laguerre_times: tuple[float, ...] = (0.05, 0.1, 0.2, 0.4, 0.8)
    laguerre_slower: float = 8.0
    laguerre_order: int = 5
    distinct: float = 0.01
    overwhelming: float = 10.0
    alike: float = 8.0
    alike_instruments: float = 12.5
    usual_excess: float = 1.4
    usual_freedom: float = 20.0
    fewest_early: int = 2
    needed_share: float = 0.5

    def alarm(self, axes: Axes) -> float:
        """Probability that a flight of a case with nothing missing has something named."""
        return self.sideways_false_alarm if "v" in axes.integrated else self.false_alarm


@dataclass(frozen=True)
class DeviationSettings:
    """Settings of standard deviations by deleted blocks; chosen, and seen to hold on the simulated regressions of
    tests/equation_error/test_standard_errors.py.

    Attributes
    ----------
    lags : int
        Samples in the band over which scores may be correlated; more widen the deviations by their own scatter.
    most_followed : float
        Share of a block's own whitened residual, 1, that the fit may be taken to follow: a block that alone shows a
        number would move it without limit.
    fewest_blocks : int
        Blocks of each recording from which on they are as long as scores may be correlated.
    """

    lags: int = 6
    most_followed: float = 0.8
    fewest_blocks: int = 12


DEVIATIONS = DeviationSettings()
"""Of every regression."""


@dataclass(frozen=True)
class TrialSettings:
    """Which hypotheses are worth a whole estimate; chosen, to save time: what lies further behind is not estimated.

    Attributes
    ----------
    behind : float
        ln L less its price, to first order, by which a hypothesis may lie behind the best that was estimated.
    asked : float
        Share of its least price, 1, that its first-order gain must reach.
    hopeless : float
        Times the margin of alternatives, 1, that a rival may lie behind to first order from none, beside the next.
    hopeless_share : float
        Share of the chosen one's gain, 1, by which it may lie further behind: a first order errs by so much. Of 863
        rivals on recordings of seven aircraft and halves none came back that, after its own numbers were set, promised
        to stay so far beyond the margin.
    losing_share : float
        The same share, 1, of a term in place of another where only what is likelier than the chosen one is of interest:
        of 37 that won on three long stretches of the Citation's flight each promised to win by .02 of it.
    asked_in_pairs, pairs : int
        Faults that are asked in pairs where none pays alone, the likeliest by themselves, and pairs that are estimated.
    repeated : float
        Distinct values over samples, 1, up to which a channel has steps.
    """

    behind: float = 6.0
    asked: float = 0.3
    hopeless: float = 2.0
    hopeless_share: float = 0.3
    losing_share: float = 0.1
    asked_in_pairs: int = 6
    pairs: int = 2
    repeated: float = 0.7


TRIALS = TrialSettings()
"""Of every search."""
