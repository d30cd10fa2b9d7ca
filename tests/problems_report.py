"""A closed loop made up for the report: a plain short-period oscillation with noise, and rows of invented numbers."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from aerosid.aircraft import Aircraft, load_aircraft
from aerosid.logs.flight_log import ChannelSource, FlightLog
from aerosid.loop.derivative_table import DerivativeRow
from aerosid.loop.effect_rows import Effect, Evidence
from aerosid.loop.flying_qualities.linear_analysis import LinearRow, ModeRow, StepRow
from aerosid.loop.flying_qualities.mode_levels import Level
from aerosid.loop.model_error_pictures import PrefilterNote
from aerosid.loop.model_validation.goodness import CorrelationMatrix, InnovationRow, fit_rows
from aerosid.loop.model_validation.open_loop_errors import ErrorRow, Simulated
from aerosid.loop.model_validation.predictions import AHEAD, ONE_STEP, OPEN_LOOP, PredictionRow
from aerosid.loop.quantity import Parameter
from aerosid.loop.result import ClosedLoop
from aerosid.loop.verdict import Verdict
from aerosid.model_error.aircraft_error.force_history import ErrorHistory
from aerosid.model_error.paper_chain.coefficient_match import CoefficientRow
from aerosid.model_error.paper_chain.screening import RegressorPicture, ScreeningRow
from aerosid.nomenclature import CHANNELS

OUTPUTS = ("V", "alpha", "q", "theta", "a_x", "a_z", "h")
LEVEL = {"V": 100.0, "alpha": 0.0146, "theta": 0.0146, "a_z": -9.8, "a_x": 0.14, "h": 1500.0, "q": 0.0}
NOISE = {"V": 0.1, "alpha": 0.001, "q": 0.0012, "theta": 0.001, "a_x": 0.01, "a_z": 0.03, "h": 0.1}


def pulses(time: NDArray[np.float64], widths: tuple[float, ...], unit: float) -> NDArray[np.float64]:
    """Elevator steps of alternating sign, rad."""
    elevator = np.zeros(time.size)
    start, sign = 1.0, 1.0
    for width in widths:
        elevator[(time >= start) & (time < start + width * unit)] = 0.05 * sign
        start, sign = start + width * unit, -sign
    return elevator


def response(time: NDArray[np.float64], elevator: NDArray[np.float64], stiffness: float) -> dict[str, NDArray]:
    """All outputs of a linear short period of squared frequency `stiffness`, integrated with Euler's rule."""
    step = float(time[1] - time[0])
    state = np.zeros((time.size, 4))  # alpha, q, theta, h
    for k in range(time.size - 1):
        alpha, q, theta, _ = state[k]
        rates = (-1.9 * alpha + 0.96 * q, -stiffness * alpha - 2.6 * q - 9.0 * elevator[k], q, 100.0 * (theta - alpha))
        state[k + 1] = state[k] + step * np.array(rates)
    alpha, q, theta, h = state.T
    acceleration = np.gradient(q, step)
    return {
        "V": 100.0 - 8.0 * np.cumsum(theta) * step,
        "alpha": LEVEL["alpha"] + alpha,
        "q": q,
        "theta": LEVEL["theta"] + theta,
        "a_x": LEVEL["a_x"] + 25.0 * alpha**2 + 0.3 * alpha,
        "a_z": LEVEL["a_z"] - 150.0 * alpha,
        "h": LEVEL["h"] + h,
        "q_dot": acceleration,
    }


def simulated(name: str, role: str, widths: tuple[float, ...], samples: int = 470, seed: int = 1) -> Simulated:
    """One log with its three models; `declared` is too soft, `before` in between."""
    generator = np.random.default_rng(seed)
    time = 0.03 * np.arange(samples)
    elevator = pulses(time, widths, 1.0)
    truth = response(time, elevator, 6.5)
    measured = {channel: truth[channel] + NOISE[channel] * generator.standard_normal(samples) for channel in OUTPUTS}
    measured["alpha"][40:44] = np.nan
    channels = {**measured, "delta_e": elevator + 0.0227, "thrust": np.full(samples, 5580.0)}
    sources = {channel: ChannelSource((channel,), CHANNELS[channel].unit) for channel in channels}
    sources["delta_e"] = ChannelSource(("EL_L", "EL_R"), "deg", sign=-1.0, scale=0.5, offset=1.3, delay=0.02)
    log = FlightLog(
        name,
        time,
        channels,
        {channel: CHANNELS[channel].unit for channel in channels},
        sources,
        {"a_z": (1.2, 0.0, 0.4)},
        ("4 samples of alpha are missing",),
        f"flights/{name}.csv",
        f"{seed:064x}",
    )
    models = {
        "declared": {
            channel: values for channel, values in response(time, elevator, 4.5).items() if channel in OUTPUTS
        },
        "before": {channel: values for channel, values in response(time, elevator, 6.0).items() if channel in OUTPUTS},
        "after": {channel: truth[channel] for channel in OUTPUTS},
        "trimmed": {channel: truth[channel] + 1e-5 for channel in OUTPUTS},
    }
    return Simulated(log, role, measured, **models)


def error_rows(response_: Simulated) -> tuple[ErrorRow, ...]:
    """The root-mean-squares of one log."""

    def rms(channel: str, model: str) -> float | None:
        difference = response_.measured[channel] - getattr(response_, model)[channel]
        value = float(np.sqrt(np.nanmean(difference**2)))
        return value if np.isfinite(value) else None

    return tuple(
        ErrorRow(
            response_.log.name,
            response_.role,
            channel,
            CHANNELS[channel].unit,
            *(rms(channel, model) for model in ("declared", "before", "after", "trimmed")),
            noise=NOISE[channel],
            r2_trimmed=0.998,
        )
        for channel in OUTPUTS
    )


def derivative_rows(aircraft: Aircraft) -> tuple[DerivativeRow, ...]:
    """The declared derivatives, slightly moved, and the two found terms."""
    rows = [
        DerivativeRow(
            d.coefficient,
            str(d.term),
            d.value,
            0.96 * d.value,
            1.01 * d.value,
            0.02 * abs(d.value),
            0.008 * abs(d.value),
            1.005 * d.value,
            0.03 * abs(d.value),
            0.31 + 0.05 * k,
            str(d.term) != "V_hat",
        )
        for k, d in enumerate(aircraft.derivatives)
    ]
    rows.insert(2, DerivativeRow("C_X", "alpha^2", None, None, 3.593, 0.041, 0.02, 3.61, 0.05, 0.64, True))
    rows.append(DerivativeRow("C_m", "alpha^2", None, None, -1.7106, 0.019, 0.006, -1.73, 0.03, 0.91, True))
    rows.append(DerivativeRow("C_m", "alpha_dot_hat", -4.0, None, -3.1, None, None, None, None, None, False))
    return tuple(rows)


def screening_rows() -> tuple[ScreeningRow, ...]:
    """Candidates of both equations."""
    terms = ("alpha^2", "alpha^3", "alpha*delta_e", "V_hat^2", "q_hat^2", "alpha*q_hat", "pos(alpha - 0.05)^2")
    return tuple(
        ScreeningRow(coefficient, term, 0.999 / (1 + k), 0.998 / (1 + 2 * k), gain / (1 + k) ** 2, 0.9, k == 0)
        for coefficient, gain in (("C_X", 5210.0), ("C_m", 8120.0))
        for k, term in enumerate(terms)
    )


def histories(response_: Simulated, seed: int = 3) -> tuple[ErrorHistory, ...]:
    """d(t) of the three equations."""
    generator = np.random.default_rng(seed)
    alpha = response_.after["alpha"]
    rows = []
    for coefficient, slope, terms in (("C_X", 3.6, ("alpha^2",)), ("C_Z", 0.0, ()), ("C_m", -1.7, ("alpha^2",))):
        share = slope * alpha**2
        d = share + 0.0008 * generator.standard_normal(alpha.size)
        rows.append(ErrorHistory(response_.log.name, coefficient, response_.log.time, d, share, 0.997, terms))
    return tuple(rows)


def regressors(response_: Simulated, seed: int = 4) -> tuple[RegressorPicture, ...]:
    """d(t) over a term that explains it and over one that does not."""
    generator = np.random.default_rng(seed)
    alpha = response_.after["alpha"]
    rows = []
    for coefficient, term, slope, chosen in (("C_m", "alpha^2", -1.7, True), ("C_m", "alpha*delta_e", 0.0, False)):
        candidate = alpha**2 if chosen else alpha * response_.log["delta_e"]
        left = -1.7 * alpha**2 + 2e-4 * generator.standard_normal(alpha.size)
        rows.append(RegressorPicture(coefficient, term, candidate, left, slope, 0.99 if chosen else 0.4, chosen))
    return tuple(rows)


def linear_rows() -> tuple[LinearRow, ...]:
    """Both models: a short period with its step, a phugoid; the declared one without deviations."""
    time = np.linspace(0.0, 6.0, 61)
    rows = []
    for model, frequency, known in (("declared", 4.5, None), ("completed", 5.0, 0.01)):

        def given(value: float, unit: str, share: float | None = known) -> Parameter:
            return Parameter(value, None if share is None else share * abs(value), unit)

        swing = np.exp(-2.5 * time) * np.cos(frequency * time)
        step = {"V": 2.0 * time, "alpha": swing - 1.0, "q": -0.07 * (1.0 - swing), "theta": -0.07 * time}
        rows.append(
            LinearRow(
                model=model,
                airspeed=100.0,
                density=0.9077,
                mass=2280.0,
                trim={"alpha": given(0.0146, "rad"), "delta_e": given(0.0227, "rad"), "thrust": given(5580.0, "N")},
                states=("u", "w", "q", "theta"),
                inputs=("delta_e",),
                A=np.diag([-0.05, -2.6, -3.1, 0.0]),
                B=np.array([[0.0], [-18.8], [-46.8], [0.0]]),
                modes=(
                    ModeRow("short_period", {"frequency": given(frequency, "rad/s"), "damping": given(0.57, "1")}),
                    ModeRow("phugoid", {"frequency": given(0.115, "rad/s"), "time_to_half": given(28.7, "s")}),
                ),
                qualities={"n_alpha": given(26.2, "g/rad"), "cap": given(0.97, "1/(g s^2)")},
                category="B",
                aircraft_class="II",
                levels={"short_period": Level(1, None if known is None else (1, 2)), "phugoid": Level(4)},
                steps=(
                    StepRow(
                        "delta_e",
                        np.pi / 180.0,
                        time,
                        step,
                        {} if known is None else {name: 0.02 * np.abs(values) for name, values in step.items()},
                    ),
                ),
            )
        )
    return tuple(rows)


def prediction_rows(simulated: Simulated) -> tuple[PredictionRow, ...]:
    """What the models explain of each channel, ever less the further ahead; the declared one diverges in open loop."""
    rows = []
    for channel in simulated.measured:
        for n, (horizon, seconds) in enumerate(((ONE_STEP, 0.03), (AHEAD, 5.0), (OPEN_LOOP, 12.0))):
            r2 = {
                "declared": None if horizon == OPEN_LOOP else 0.97 - 0.2 * n,
                "before": 0.98 - 0.1 * n,
                "after": 0.995,
            }
            theil = {name: None if value is None else 0.5 * (1.0 - value) for name, value in r2.items()}
            rows.append(PredictionRow(simulated.log.name, simulated.role, channel, horizon, seconds, 0.99, r2, theil))
    return tuple(rows)


def closed_loop(*, samples: int = 470, verdict: Verdict = Verdict.EXPLAINED, validated: bool = True) -> ClosedLoop:
    """A whole result."""
    aircraft = load_aircraft("light_transport")
    completed = aircraft.completed({("C_X", "alpha^2"): (3.593, 0.041), ("C_m", "alpha^2"): (-1.7106, 0.019)})
    first = simulated("light_transport_doublet", "identification", (1, 1), samples, 1)
    second = simulated("light_transport_3211", "validation", (3, 2, 1, 1), samples, 2)
    responses = (first, second) if validated else (first,)
    gain = 14.2 if validated else None
    moment = Effect(1, "aero_term", "C_m", "alpha^2", -1.7106, 0.019, "1", Evidence(0.999, 1e-40, gain, 8120.4))
    force = Effect(2, "aero_term", "C_X", "alpha^2", 3.593, 0.041, "1", Evidence(0.998, 3e-31, gain, 5210.0))
    other = Effect(
        1,
        "aero_term",
        "C_m",
        "alpha*delta_e",
        2.61,
        0.05,
        "1",
        Evidence(0.94, 2e-5, gain, 3.1),
        instead_of="C_m alpha^2",
    )
    return ClosedLoop(
        version="0.1.0",
        seed=0,
        aircraft=aircraft,
        completed_aircraft=completed,
        identification=(first.log,),
        validation=(second.log,) if validated else (),
        verdict=verdict,
        summary="C_m and C_X each lack a term in alpha^2; with both the model follows the flight down to the noise.",
        effects=(moment, force),
        alternatives=(other,),
        derivatives=derivative_rows(aircraft),
        coefficients=tuple(
            CoefficientRow(name, response_.log.name, 0.903, 0.984)
            for response_ in responses
            for name in ("C_X", "C_Z", "C_m")
        ),
        errors=tuple(row for response_ in responses for row in error_rows(response_)),
        simulated=responses,
        screening=screening_rows(),
        model_error=histories(first),
        prefilter=PrefilterNote(
            "butterworth, zero phase", 4.2, "the spectra of all channels reach noise there", "0.3 %"
        ),
        fit=tuple(row for response_ in responses for row in fit_rows(response_)),
        innovations=(InnovationRow(first.log.name, "alpha", 1.02, (1.0, 0.05, -0.02), 0.41),),
        predictions=tuple(row for response_ in responses for row in prediction_rows(response_)),
        correlation=CorrelationMatrix(("C_m alpha", "C_m q_hat"), ((1.0, -0.6), (-0.6, 1.0))),
        linear=linear_rows(),
        notes=("The air density is the aircraft file's, 0.9077 kg/m^3.",),
        regressors=regressors(first),
    )
