"""Predictions over a horizon, against a plain loop over scipy's integrator, and what they say of models."""

from __future__ import annotations

import io
import math
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from numpy.typing import NDArray
from problems import BOTH_SQUARES, LIGHT, Problem
from rich.console import Console
from scipy.integrate import solve_ivp

from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.flight_model.aerodynamics import AerodynamicModel
from aerosid.flight_model.restarted_simulation import predict_ahead
from aerosid.loop.closed_loop import close_loop
from aerosid.loop.model_validation.predictions import AHEAD, ONE_STEP, OPEN_LOOP, PredictionRow
from aerosid.loop.result import ClosedLoop
from aerosid.loop.settings import LoopSettings
from aerosid.model_error.paper_chain.chain import ChainSettings, feed
from aerosid.model_error.paper_chain.coefficient_match import Corrected
from aerosid.notation import number
from aerosid.reporting import print_predictions
from aerosid.reporting.result_json import result_file

Array = NDArray[np.float64]

QUICK = LoopSettings(paper_chain=False, second_opinion=False, linear_analysis=False, next_flight=False)


def flown_by_hand(start: Array, time: Array, inputs: dict[str, Array], values: dict[tuple[str, str], float]) -> Array:
    """V, alpha, q, theta (N, 4) of eqs. (33) to (36) written out, inputs linear between samples."""
    S, c, m, I = LIGHT.wing_area, LIGHT.mean_chord, LIGHT.mass, LIGHT.I_yy  # noqa: E741

    def rates(t: float, x: Array) -> list[float]:
        u, w, q, theta = x
        at = {name: float(np.interp(t, time, series)) for name, series in inputs.items()}
        alpha, force = math.atan2(w, u), 0.5 * at["rho"] * (u * u + w * w) * S
        hat, e = q * c / 200.0, at["delta_e"]
        terms = {"1": 1.0, "alpha": alpha, "alpha^2": alpha**2, "q_hat": hat, "delta_e": e}
        total = dict.fromkeys(("C_X", "C_Z", "C_m"), 0.0)
        for (coefficient, text), value in values.items():
            total[coefficient] += value * terms[text]
        return [
            (force * total["C_X"] + at["thrust"]) / m - q * w - 9.80665 * math.sin(theta),
            force * total["C_Z"] / m + q * u + 9.80665 * math.cos(theta),
            force * c * total["C_m"] / I,
            q,
        ]

    x, rows = start, [start]
    for first, last in pairwise(time):
        x = solve_ivp(rates, (first, last), x, method="DOP853", rtol=1e-11, atol=1e-12).y[:, -1]
        rows.append(x)
    u, w, q, theta = np.array(rows).T
    return np.column_stack([np.hypot(u, w), np.arctan2(w, u), q, theta])


def begun(model: AerodynamicModel, manoeuvre: Manoeuvre) -> Array:
    return Corrected.of(model, (), manoeuvre, feed(manoeuvre, ChainSettings())).states


def by_hand(model: AerodynamicModel, manoeuvre: Manoeuvre, length: int, last: int) -> dict[str, Array]:
    """Every channel predicted `length` samples ahead, one stretch after the other, up to a last sample."""
    flight, states = manoeuvre.flight, begun(model, manoeuvre)
    inputs = dict(zip(model.columns, flight.inputs.T, strict=True))
    values = {(c, str(t)): float(v) for (c, t), v in zip(model.entries, model.values, strict=True)}
    found = np.full((flight.time.size, 4), np.nan)
    for start in range(0, last, length):
        stop = min(start + length + 1, flight.time.size)
        part = {name: inputs[name][start:stop] for name in ("rho", "thrust", "delta_e")}
        found[start + 1 : stop] = flown_by_hand(states[start, :4], flight.time[start:stop], part, values)[1:]
    return dict(zip(("V", "alpha", "q", "theta"), found.T, strict=True))


@pytest.mark.parametrize(("length", "last"), [(1, 60), (33, 120)])
def test_predictions_are_those_of_scipy_s_integrator(length: int, last: int) -> None:
    problem = Problem(undeclared=BOTH_SQUARES, elevator="3211", duration=6.0)
    model, manoeuvre = problem.prepared(problem.fly(3))
    states = begun(model, manoeuvre)
    starts = np.arange(0, manoeuvre.flight.time.size - 1, length)
    found = predict_ahead(
        starts, length, states, manoeuvre.flight, np.array(model.values), model.table, model.constants
    )
    assert np.isnan(found[0]).all()
    assert np.isfinite(found[1:]).all()
    for channel, wanted in by_hand(model, manoeuvre, length, last).items():
        rows = np.isfinite(wanted)
        assert rows.sum() >= last
        seen = found[rows, manoeuvre.row(channel)]
        # Runge-Kutta of fourth order at 30 ms leaves some 3e-7.
        assert_allclose(seen, wanted[rows], rtol=0.0, atol=1e-6 * float(np.abs(wanted[rows]).max()))


@pytest.fixture(scope="module")
def completed() -> ClosedLoop:
    problem = Problem(undeclared=BOTH_SQUARES, elevator="3211", duration=16.0)
    logs = [problem.fly(seed, f"flight {seed}") for seed in (1, 2)]
    return close_loop(logs[:1], LIGHT, logs[1:], settings=QUICK)


def row(result: ClosedLoop, log: str, channel: str, horizon: str) -> PredictionRow:
    (found,) = [r for r in result.predictions if (r.log, r.channel, r.horizon) == (log, channel, horizon)]
    return found


def test_shares_and_coefficients_are_those_of_a_plain_loop(completed: ClosedLoop) -> None:
    problem = Problem(undeclared=BOTH_SQUARES, elevator="3211", duration=16.0)
    model, manoeuvre = problem.prepared(problem.fly(2, "flight 2"))
    samples = manoeuvre.flight.time.size
    length = round(5.0 / 0.03)
    for channel, wanted in by_hand(model, manoeuvre, length, samples - 1).items():
        found = row(completed, "flight 2", channel, AHEAD)
        z, y = manoeuvre.flight.measured[1:, manoeuvre.row(channel)], wanted[1:]
        share = 1.0 - np.sum((z - y) ** 2) / np.sum((z - z.mean()) ** 2)
        unequal = np.sqrt(np.mean((z - y) ** 2)) / (np.sqrt(np.mean(z**2)) + np.sqrt(np.mean(y**2)))
        assert found.r2["declared"] == pytest.approx(share, abs=2e-6)
        assert found.theil["declared"] == pytest.approx(unequal, abs=2e-6)
        assert found.seconds == pytest.approx(length * 0.03)
        assert found.predicted == pytest.approx((samples - 1) / samples)


def test_the_completed_model_explains_most_at_every_horizon(completed: ClosedLoop) -> None:
    for horizon in (ONE_STEP, AHEAD, OPEN_LOOP):
        for channel in ("alpha", "q", "theta"):
            found = row(completed, "flight 2", channel, horizon)
            after, before = found.r2["after"], found.r2["before"]
            assert after is not None and before is not None  # noqa: PT018
            assert after > 0.97
            assert after > before - 1e-3
    assert _r2(completed, AHEAD, "declared") < _r2(completed, AHEAD, "after") - 0.005
    # The further ahead, the more of what the declared model lacks is seen.
    assert (
        _r2(completed, OPEN_LOOP, "declared") < _r2(completed, AHEAD, "declared") < _r2(completed, ONE_STEP, "declared")
    )


def _r2(result: ClosedLoop, horizon: str, variant: str) -> float:
    value = row(result, "flight 2", "theta", horizon).r2[variant]
    assert value is not None
    return value


def test_a_log_without_height_is_predicted_as_one_with_it(completed: ClosedLoop) -> None:
    problem = Problem(undeclared=BOTH_SQUARES, elevator="3211", duration=16.0)
    logs = []
    for seed in (1, 2):
        log = problem.fly(seed, f"flight {seed}")
        logs.append(replace(log, channels={name: values for name, values in log.channels.items() if name != "h"}))
    without = close_loop(logs[:1], LIGHT, logs[1:], settings=QUICK)
    for horizon in (ONE_STEP, AHEAD):
        found, wanted = (row(result, "flight 2", "q", horizon) for result in (without, completed))
        assert found.predicted == wanted.predicted > 0.9
        assert found.r2["declared"] == pytest.approx(wanted.r2["declared"], abs=1e-3)


def test_rows_stand_in_result_json(completed: ClosedLoop) -> None:
    written = [entry.model_dump() for entry in result_file(completed).predictions]
    assert len(written) == len(completed.predictions) == 2 * 3 * len(completed.simulated[0].measured)
    first: dict[str, Any] = written[0]
    assert set(first["r2"]) == {"declared", "before", "after"} == set(first["theil"])


def test_the_summary_tells_the_unseen_flight(completed: ClosedLoop) -> None:
    stream = io.StringIO()
    print_predictions(completed, Console(file=stream, width=120))
    said = stream.getvalue()
    assert "flight 2" in said
    assert "flight 1" not in said
    found = row(completed, "flight 2", "q", AHEAD)
    assert f"{number(found.r2['before'], 3)} -> {number(found.r2['after'], 3)}" in said
    empty = io.StringIO()
    print_predictions(replace(completed, predictions=()), Console(file=empty))
    assert empty.getvalue() == ""
