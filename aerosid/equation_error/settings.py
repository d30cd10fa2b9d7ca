"""Settings of the equation-error regression and of the structure determination by it."""

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
        Probability, 1, that an effect is selected on a flight with nothing missing: the prior odds of each hypothesis
        are this fraction over the number tested, so that an effect enters where its posterior odds by Schwarz's
        criterion exceed one: gain in ln L - (k/2) ln N > ln(tested/false_alarm). Verified by Monte Carlo in
        tests/equation_error/test_false_alarms.py.
    declared_tail : float
        Distance of an estimate from its a-priori value, standard deviations of both, beyond which it counts linearly in
        the choice between structures. Two: the largest that most engineers would not question. Tried on flights of
        benchmarks/field_detection.py, seeds 160 and 161; no other value was tried.
    declared_misjudged : float
        Standard deviation, 1, of the logarithm of a common factor by which a-priori standard deviations are too small.
        A factor of the square root of two; chosen among .2, .35 and .7 on flights 7 and 27 of seed 160 of
        benchmarks/field_detection.py, of which the first is decided rightly by .35 and the second by none.
    anything_missing : float
        Prior probability, 1, that a flight lacks anything, shared among the hypotheses as `false_alarm` is: by it a
        near-significant effect is weighted in the standard errors. Even odds: a flight is analysed because it may.
    contradicted : float
        Largest prior probability that a coefficient lacks a term, however much it loses in ln L by the identified
        instrument errors. 0.5: even odds.
    sideways_false_alarm : float
        As `false_alarm` where sideslip is compared: an effect may be selected on two of 200 clean flights, by whatever
        method, and real flights leave residuals in C_l and C_n that no term of the library explains.
    deviations : float
        Least t-ratio of a final value, with corrected standard errors. Three: one in 370 by chance.
    order : int
        Order, samples, of the autoregression of the residuals. Klein & Morelli, Aircraft System Identification, section
        6.3, use correlation up to a short-period's length; four poles represent a resonance, a roll-off and a drift.
    fewest : int
        Samples in the band, twice that order, below which a record's equations are not compared.
    memory : float
        Longest memory, s, of the colour of a coefficient's residual, and of the paths of bank, heading and sideslip,
        which a gyro bias bends: slower residuals must be explained.
        About the scale of moderate turbulence over the airspeed (MIL-F-8785C: 530 m at 180 m/s).
    derived_forces : float
        Time constant, s, of the low-pass behind which forces derived from air data are compared, for lack of
        accelerometers. Chosen: the longest memory of a coefficient's residual; no other was tried.
    light_turbulence, turbulence_scale : float
        Vertical gusts, m/s, and their scale length, m, that a height integrated from air data may contain: light
        turbulence above 2000 ft (MIL-F-8785C, 3.7.2: a tenth of 15 knots; 1750 ft).
    band_ratio : float
        Power of q over its noise floor, 1, down to which frequencies are used: the band in which the motion is known.
    band_depth : float
        Power of q over its maximum, 1, below which a frequency contains no motion: amplitudes of a hundredth.
    band_lowest, band_highest : float
        Limits of the band's upper edge, Hz: a short period with its damping needs the first, rigid-body motion ends at
        the second.
    band_share : float
        Highest upper edge as a fraction of the sampling frequency, 1; beyond, the derivative of q through samples loses
        more than one part in a hundred.
    coarsest : float
        Sampling interval, s, above which samples are interpolated: a delay between two samples, interpolated linearly,
        attenuates 1 Hz of such a control by at most 0.8 %, and by 5 % at 0.1 s.
    blend, blend_aside : float
        Time, s, over which the difference between measured and integrated signals is smoothed for the regressors, of
        alpha and V and of beta: above that frequency the inertial path is more accurate, below it the sensors.
    blends : tuple of float
        Other times, s, of alpha and V, used where they are likelier: on three of four flights in gusts of
        `benchmarks/field_detection.py`, seeds 21 and 23. A shorter one of .25 s was too, and moved the vane's lag on
        HFB-320 further from its kinematic estimate.
    blend_compared : float
        The same where a model's coefficients are compared with the measured ones, s: up to the upper edge of the band
        the gusts shown by vanes count as motion, to which a model has to respond. Chosen: a Gaussian's half power at
        1.3 Hz.
    wind_memory : float
        Time, s, over which the differences of airspeed and vane from their paths are smoothed to give the velocities
        from which the paths are integrated: faster, the difference is gusts, which do not move the aircraft; slower, it
        is the integrated bias of sensors. Some scale lengths of light turbulence at a glider's airspeed; found on
        flight 57 of tests/equation_error/test_false_alarms.py.
    drifts : mapping of str to float
        Standard deviation of the drift of each kinematic equation from record to record, unit/s: of gyros (0.006
        deg/s), of the wind and of vertical air motion.
    path_errors : mapping of str to float
        Where no vane measures sideslip, standard deviations of the bias of the angle of attack, rad, and of the scale
        factor error of the bank angle, 1, that may affect its path: of usual vanes and attitude systems, not found on
        any data.
    asymmetry : mapping of str to float
        Standard deviation, 1, of the constants of side force, rolling and yawing moment: aircraft are nearly symmetric
        and trimmed. About the effect of a degree of sideslip or a third of a degree of aileron.
    separation_range : float
        Range of alpha, rad, from which flow separation is a candidate: three degrees, of which a flight near the stall
        is enough to reduce the lift slope. Found on flights 37 and 5 of benchmarks/field_detection.py, seeds 101 and
        102, where powers of alpha and pitch rate were selected in its place below six.
    factor_odds : float
        Prior odds, 1, of a term with one factor more against the simpler one: of equal fits the simpler is selected.
    height_bend : float
        Standard deviation of the constant vertical acceleration, m/s^2, that accelerometer biases leave in the height:
        the drift of alpha times a usual airspeed.
    least_noise : mapping of str to float
        Least standard deviation, SI, of the low-frequency noise of a sensor, whatever its successive differences
        indicate: smoothed records show none. Two thousandths of g, and a fiftieth of a degree.
    noise_memory : float
        Correlation time, s, of the noise of accelerometers and attitude: times its variance it is the density of the
        random walk of the integrated height. Chosen: about the scale of vibration and of a filter of 1 Hz.
    wander_modes : int
        Cosines of the record's length that represent it: beyond, the height's own noise is larger.
    shortlist : int
        Candidates per round that are fitted with the colour re-estimated; ranked by the score at the given colour.
    fitted : int
        Candidates per round whose parameters, and all others, are re-estimated: the likeliest of the shortlist.
    most : int
        Largest number of selected effects; a flight that lacks more misses something that is no sum of effects.
    distinct : float
        Least fraction, 1, of a term's whitened column that no other column explains: a tenth of its size. In usual
        manoeuvres alphadot has less in the presence of q and alpha, which then replace it; it is listed as an
        alternative. By reasoning; the first record on which it decided is the Twin Otter 018. With three hundredths
        ATTAS elv1 got a lift of the stabiliser, which hardly moves there, of twice that of alpha.
    overwhelming : float
        Multiple of its penalty, 1, by which the gain of such a term suffices all the same: an error of a percent in the
        columns of others makes no gain of a hundred in ln L. By reasoning, on the drag polar of
        tests/equation_error/test_drag_polar.py, of whose column a hundredth of its size is independent.
    alike : float
        Deficit in ln L, plus three parts in a hundred of the selected one's gain, up to which another hypothesis in its
        place is listed as its alternative. Two standard deviations of the difference between non-nested structures, 2
        sqrt(2 x 8) = 8 (Vuong, Econometrica 57, 1989).
    alike_instruments : float
        The same of instrument errors, at two and a half deviations, 12.5: delayed vanes and lever arms differ by less
        than the path error of a real sensor.
    gained_beside : float
        Fraction, 1, of an alternative's gain in the place of an effect from which on it is none if it gains that beside
        the effect too: more than half is something else.
    clearly : float
        Gain in penalised ln L from which another hypothesis replaces a selected one. Chosen.
    contradiction : float
        Reduction of ln L by disagreement with declared values from which the search is repeated with these as a-priori
        information, and by which the structure found then has to be likelier. Chosen: eight orders of magnitude; with
        half of it alike structures changed places on seed 199 of `benchmarks/field_detection.py`, flight 1.
    nearly : float
        First-order gain in ln L less the penalty, from which a hypothesis is estimated. Chosen.
    near_share, near_deviations : float
        Least gain as a fraction of the penalty, 1, and least t-ratio by corrected standard errors of a near-significant
        effect: among so many hypotheses most of those ranked first by chance gain less. Chosen.
    agreement : float
        Standard deviations of their difference by which two records' estimates of an instrument error may differ.
    agreement_share : float
        Fraction, 1, of an instrument error by which records may differ beyond that: biases vary slightly from flight to
        flight, and missing effects shift the records' estimates differently. Chosen.
    choice_gain : float
        Joint gain in ln L of kinematics and coefficients from which another instrument error replaces a selected one:
        odds of fifty. Chosen.
    choice_share : float
        Fraction, 1, of an error's kinematic gain that a replacement must reach to count as the same effect. Chosen.
    rounds : int
        Times that the search is continued without the effects refuted by validation records.
    gust_answer : float
        Standard deviations from one within which the response of lift or side force to a vane must lie, 1.
    gust_certain : float
        Its least t-ratio from zero, 1: forces do not respond to vane noise.
    gust_possible : float
        The t-ratio, 1, from which the air is no longer taken as calm. Chosen: four pairs with nothing missing (seeds
        217, 219 and 220 of benchmarks/field_detection.py) whose gusts a coarse recorder hid have 2.0 to 5.6.
    gust_hidden : float
        The least response, 1, that then counts: below it the vane shows its own noise, whatever the t-ratio. Chosen:
        half of the least of those pairs.
    followed : float
        Fraction, 1, of the heading's variance about its line that the integrated rates must explain for it to be the
        heading of this motion.
    support : float
        Least t-ratio, 1, of the kinematic estimate of an instrument error that is to be a candidate of the
        coefficients, and the corresponding gain in ln L: one in twenty by chance, and the joint gain has to exceed the
        penalty. Chosen.
    doubt : float
        Standard deviations of its mean by which the squared residual of a validation coefficient may rise with an
        effect before that record refutes it.
    blocks : int
        Largest number of blocks into which a single record is divided without a validation record; each is predicted
        from the rest. Four: each estimate then keeps three quarters of the motion.
    block_length : float
        Least length, s, of a block: twice the memory of the colour.
    block_doubt : float
        As `doubt`, of a block of a single record. Two: there are up to twelve coefficients of blocks, where `doubt`
        applies to three of a record.
    rise_of_rest : float
        Fraction, 1, of the unexplained variance of a validation coefficient, and no more than `least_rise` of the
        whole, by which it may rise with other parameters of an instrument error before that record rejects them. Chosen
        after the Citation's short periods (reports/recorded_flights.md).
    calm : float
        Fraction of the sideslip, 1, by which its vane may differ from the inertial path for the air to be calm: an
        output-error estimate then gives the parameters of the structure that the equations selected. Chosen: a tenth.
    closed : float
        Kinematic residual over the in-band white noise predicted from successive differences, 1, up to which the
        kinematics of a flight are consistent: white noise gives one, that of integrated gyros and accelerometers up to
        two. Beyond it the air moves or the recorder adds noise of its own, open-loop errors are no measurement noise,
        and the equations decide. Flights in white noise have 1.0 to 2.0 (`benchmarks/wide_detection.py --plant none`,
        seed 77), in gusts behind a recorder of 50 Hz 3.2 or more (`benchmarks/field_detection.py`, seeds 111 and 120);
        coloured noise in calm air has 2 to 7, and up to this the likelihood models it correctly.
    laguerre_times : tuple of float
        Time constants, s, of the Laguerre functions of the controls that are tried as instrumental variables: short
        periods from an unmanned aircraft's to a large transport's.
    laguerre_slower : float
        Ratio of the second set's time constant to the first: the airspeed and the attitude respond over some short
        periods.
    laguerre_order : int
        Functions of each set: twice an oscillation's two states and a delay.
    regressor_order, regressor_false_alarm, regressor_doubt : int, float, float
        Functions of each set with which least squares is compared (few: each draws the estimate towards least squares);
        probabilities of the difference below which standard errors contain it, and instrumental variables are reported.
    usual_excess : float
        Expected power of whitened kinematic residuals in the space of the instrumental variables over their power in
        all directions, 1: four poles do not whiten slow noise. Mean of 40 simulated flights in turbulence with nothing
        missing (benchmarks/turbulent_flights.py, seeds 4000 to 4039).
    usual_freedom : float
        Degrees of freedom of this prior expectation: about as many as one flight has of its own; the scatter over those
        flights was no wider than that of chi squared.
    fewest_early : int
        Least number of early sensors for which kinematics alone prefer the alternative, that others are late: one alone
        is modelled most simply as early, unless the coefficients disagree. By reasoning.
    needed_share : float
        Fraction, 1, of the residual variance of a validation coefficient that an effect shown by few blocks of the
        identification records must remove, where the validation record's gain in ln L does not confirm it. Chosen: a
        half.
    least_rise : float
        Least accompanying fall of R^2, 1: less is due to the uncertainty of the effect's parameters. Where hardly any
        variance is unexplained, as above R^2 of .98, `rise_of_rest` is stricter on an instrument error.
    """

    false_alarm: float = 0.01
    declared_tail: float = 2.0
    declared_misjudged: float = 0.35
    anything_missing: float = 0.5
    contradicted: float = 0.5
    sideways_false_alarm: float = 0.003
    deviations: float = 3.0
    order: int = 4
    fewest: int = 8
    memory: float = 3.0
    derived_forces: float = 3.0
    light_turbulence: float = 0.77
    turbulence_scale: float = 530.0
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
    contradiction: float = 20.0
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
    gust_possible: float = 2.0
    gust_hidden: float = 0.05
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
    regressor_order: int = 2
    regressor_false_alarm: float = 0.05
    regressor_doubt: float = 0.01
    distinct: float = 0.01
    overwhelming: float = 10.0
    alike: float = 8.0
    alike_instruments: float = 12.5
    gained_beside: float = 0.5
    usual_excess: float = 1.4
    usual_freedom: float = 20.0
    fewest_early: int = 2
    needed_share: float = 0.5

    def alarm(self, axes: Axes) -> float:
        """Probability that an effect is selected on a flight of a case with nothing missing."""
        return self.sideways_false_alarm if "v" in axes.integrated else self.false_alarm


@dataclass(frozen=True)
class DeviationSettings:
    """Settings of standard errors by block deletion; chosen, and verified on the simulated regressions of
    tests/equation_error/test_standard_errors.py.

    Attributes
    ----------
    lags : int
        Samples in the band over which scores may be correlated; more increase the scatter of the standard errors.
    most_followed : float
        Largest fraction of a block's own whitened residual, 1, that the fit is taken to follow (leverage): a block that
        alone determines a parameter would change it without limit.
    fewest_blocks : int
        Blocks of each record from which on they are as long as scores may be correlated.
    """

    lags: int = 6
    most_followed: float = 0.8
    fewest_blocks: int = 12


DEVIATIONS = DeviationSettings()
"""Of every regression."""


@dataclass(frozen=True)
class TrialSettings:
    """Settings of the preselection of hypotheses for a full estimate; chosen, to save time.

    Attributes
    ----------
    behind : float
        First-order penalised ln L by which a hypothesis may lie behind the best that was estimated.
    asked : float
        Fraction of its least penalty, 1, that its first-order gain must reach.
    hopeless : float
        Multiple of the margin of alternatives, 1, that a replacement may lie behind to first order, in addition to the
        next.
    hopeless_share : float
        Fraction of the selected one's gain, 1, by which it may lie further behind: the error of a first-order gain. Of
        863 replacements on records of seven aircraft and halves none was within the margin that was predicted, after
        one step of its own parameters, to stay so far beyond it.
    losing_share : float
        The same fraction, 1, of a term in place of another where only what is likelier than the selected one is of
        interest: of 37 that won on three long segments of the Citation's flight each was predicted to win by .02 of it.
    necessary, necessary_nonlinear : float
        Multiple of its penalty, 1, from which a term's or a step change's loss to first order, or another effect's,
        shows without a re-estimate that its deletion is no gain. Of 125 effects beyond it on five simulated flights
        each lost 2.6 penalties or more.
    asked_in_pairs, pairs : int
        Instrument errors that are tested in pairs where none is significant alone, the likeliest by themselves, and
        pairs that are estimated.
    repeated : float
        Ratio of distinct values to samples, 1, up to which a channel is quantised.
    """

    behind: float = 6.0
    asked: float = 0.3
    hopeless: float = 2.0
    hopeless_share: float = 0.3
    losing_share: float = 0.1
    necessary: float = 2.0
    necessary_nonlinear: float = 8.0
    asked_in_pairs: int = 6
    pairs: int = 2
    repeated: float = 0.7


TRIALS = TrialSettings()
"""Of every search."""
