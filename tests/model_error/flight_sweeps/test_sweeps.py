"""The spreads of d(t): of what is missing, and none where the flight shows none."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest
from problems import LIGHT, NOISE, Problem, Truth, entry
from scipy.signal import butter, sosfiltfilt

from aerosid.effects.kinds import Signal
from aerosid.estimation.manoeuvre import prepare
from aerosid.logs.flight_log import FlightLog
from aerosid.loop.identification import declared_with_candidates
from aerosid.loop.identification_problem import IdentificationProblem
from aerosid.model_error.flight_sweeps.sweeps import FlightSweeps
from aerosid.model_error.flight_sweeps.swept_model import Sweep, SweepSettings, SweptModel
from aerosid.model_error.paper_chain.chain import ChainSettings
from aerosid.search.partial_correlation.attribution import swept_start
from aerosid.search.partial_correlation.settings import ModelErrorSearchSettings

QUICK = SweepSettings(searches=(0,), first_spread=None, first_memory=3.0, settled=0.1, shown=2.7)


def estimated(undeclared: Truth, settings: SweepSettings) -> Sweep:
    log = Problem(undeclared=undeclared, duration=8.0).fly(22)
    model, _ = declared_with_candidates([log], [], LIGHT)
    asked = IdentificationProblem(LIGHT, model, (), (), (prepare(log, LIGHT, model.columns),), ())
    search = ModelErrorSearchSettings(sweeps=settings)
    start = swept_start(model, asked.manoeuvres, asked.free, (), LIGHT.coefficients, ChainSettings(), search)
    return FlightSweeps(asked.manoeuvres, LIGHT.coefficients, settings).estimate(start)


def test_where_nothing_is_missing_every_spread_is_at_its_least() -> None:
    assert estimated({}, QUICK).swept.statistics.spread == (QUICK.least_spread,) * 3


def test_a_missing_term_leaves_its_own_coefficient_alone_with_error() -> None:
    quick = estimated({("C_m", "alpha^2"): -1.715}, QUICK).swept.statistics.spread
    assert quick[:2] == (QUICK.least_spread,) * 2
    whole = estimated({("C_m", "alpha^2"): -1.715}, SweepSettings()).swept.statistics.spread
    np.testing.assert_allclose(quick[2], whole[2], rtol=0.05)


def swept(channels: Mapping[str, Signal], log: FlightLog, settings: SweepSettings) -> tuple[SweptModel, Sweep]:
    """The start and the estimate of a flight with other channels."""
    model, _ = declared_with_candidates([log], [], LIGHT)
    manoeuvres = (prepare(FlightLog(log.name, log.time, dict(channels), log.units), LIGHT, model.columns),)
    free = IdentificationProblem(LIGHT, model, (), (), manoeuvres, ()).free
    search = ModelErrorSearchSettings()
    start = swept_start(model, manoeuvres, free, (), LIGHT.coefficients, ChainSettings(), search)
    return start, FlightSweeps(manoeuvres, LIGHT.coefficients, settings).estimate(start)


def test_of_a_recording_smoothed_afterwards_the_noise_is_matched_and_the_moments_come_back() -> None:
    log = Problem(duration=20.0, elevator="3211", amplitude=0.045).fly(23)
    after = butter(6, 2.0, fs=1.0 / 0.03, output="sos")
    smooth = {name: values[0] + sosfiltfilt(after, values - values[0]) for name, values in log.channels.items()}
    start, sweep = swept(smooth, log, SweepSettings())
    shown = np.sqrt(start.statistics.variance)
    row = LIGHT.axes.outputs.index
    assert max(shown[row(name)] / NOISE[name] for name in ("V", "alpha", "theta", "h")) < 0.001
    for name in ("V", "alpha", "theta", "h"):  # of white noise up to 17 Hz the low-pass leaves a third
        matched = np.sqrt(sweep.swept.statistics.variance[row(name)])
        assert 0.2 * NOISE[name] < matched < 0.7 * NOISE[name]
    # Through the low-pass a derivative of the moment is known to some per cent.
    for text in ("alpha", "q_hat", "delta_e"):
        name = entry("C_m", text)
        true = start.model.value(name)
        assert sweep.swept.model.value(name) == pytest.approx(true, rel=0.05)
    _, unmatched = swept(smooth, log, SweepSettings(unlike_noise=np.inf))
    assert max(unmatched.swept.statistics.spread) > 10.0 * max(sweep.swept.statistics.spread)


def test_noise_that_successive_samples_show_is_left_as_it_is() -> None:
    log = Problem(duration=8.0).fly(23)
    start, sweep = swept(log.channels, log, SweepSettings())
    np.testing.assert_array_equal(sweep.swept.statistics.variance, start.statistics.variance)
