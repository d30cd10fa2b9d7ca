"""Selection by d(t) in lateral and six axes: simulated effects found with their size, no false findings."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest
from lateral_flights import INERTIA, PITCH, SIDE, Lateral, aircraft

from aerosid.aircraft import Aircraft
from aerosid.errors import EstimationError
from aerosid.estimation.manoeuvre import prepare
from aerosid.logs.flight_log import FlightLog
from aerosid.loop.identification import declared_with_candidates
from aerosid.loop.identification_problem import IdentificationProblem
from aerosid.loop.methods import by_model_error
from aerosid.loop.settings import LoopSettings
from aerosid.search.attribution import Attribution
from aerosid.search.findings import named
from benchmarks.sideways_flights import BODIES, aircraft_of, flown

TERMS: Mapping[tuple[str, str], float] = SIDE
WHOLE: Mapping[tuple[str, str], float] = {**PITCH, **SIDE}


def found_in(log: FlightLog, declared: Aircraft) -> Attribution:
    model, candidates = declared_with_candidates([log], [], declared)
    asked = IdentificationProblem(declared, model, (), candidates, (prepare(log, declared, model.columns),), ())
    return by_model_error(asked, LoopSettings(method="iebmee"), lambda _stage: None).found


def names(found: Attribution) -> set[str]:
    return {named((f.kind, f.where, f.term)) for f in found.findings}


@pytest.mark.parametrize(
    ("flight", "terms", "name", "value"),
    [
        (Lateral(extra={("C_n", "beta^3"): 3.0}, seed=3, size=1.6), TERMS, "C_n beta^3", 3.0),
        pytest.param(
            Lateral(extra={("C_l", "alpha*beta"): 4.0}, seed=8, size=1.6),
            TERMS,
            "C_l alpha*beta",
            4.0,
            marks=pytest.mark.slow,
        ),
        pytest.param(
            Lateral(positions={"a_y": (1.5, 0.0, 0.0)}, seed=5),
            TERMS,
            "sensor_position of a_y",
            1.5,
            marks=pytest.mark.slow,
        ),
        pytest.param(
            Lateral(surfaces={"delta_r": lambda t, v: np.interp(t - 0.1, t, v)}, seed=6),
            TERMS,
            "control_delay of delta_r",
            0.1,
            marks=pytest.mark.slow,
        ),
        pytest.param(
            Lateral(extra={("C_m", "beta^2"): -1.5}, seed=7), WHOLE, "C_m beta^2", -1.5, marks=pytest.mark.slow
        ),
    ],
    ids=["C_n", "C_l", "place", "rudder", "six axes"],
)
def test_one_missing_effect_is_named_alone_within_four_standard_errors(
    flight: Lateral, terms: Mapping[tuple[str, str], float], name: str, value: float
) -> None:
    """Derivatives are declared a tenth off; the flights are the suite's own rigid body."""
    found = found_in(flight.log(), aircraft(terms, 1.1))
    assert names(found) == {name}
    (one,) = found.findings
    assert abs(one.value - value) < 4.0 * one.std_error
    assert one.p_value < 1e-6
    away = [
        (found.completed.model.value(entry) - terms[entry[0], str(entry[1])]) / deviation
        for entry, deviation in zip(found.completed.free, found.completed_deviations.corrected, strict=True)
        if (entry[0], str(entry[1])) in terms
    ]
    assert len(away) == len(terms)
    assert np.sqrt(np.mean(np.square(away))) < 1.6


@pytest.mark.parametrize("terms", [pytest.param(TERMS, marks=pytest.mark.slow), WHOLE], ids=["lateral", "six axes"])
def test_nothing_is_named_without_a_missing_effect(terms: Mapping[tuple[str, str], float]) -> None:
    assert names(found_in(Lateral(seed=4).log(), aircraft(terms, 1.1))) == set()


@pytest.mark.slow
def test_of_lateral_turbulence_only_its_size_is_named() -> None:
    body, generator = BODIES[0], np.random.default_rng(1)
    sigma = 0.02 * body.airspeed
    log = flown("gusts", body, 77, gust=sigma, interval=0.04, seconds=25.0)
    found = found_in(log, aircraft_of(body, 0.08, generator))
    assert names(found) == {"side_gust"}
    (one,) = found.findings
    # Of 25 s at 75 m/s and a scale of 180 m a sample's own size scatters by a sixth.
    assert 0.5 * sigma < one.value < 2.0 * sigma
    inside = [
        abs(found.completed.model.value(entry) - body.terms[entry[0], str(entry[1])]) < 4.0 * deviation
        for entry, deviation in zip(found.completed.free, found.completed_deviations.corrected, strict=True)
        if str(entry[1]) != "1"
    ]
    assert all(inside)
    assert len(inside) > len(INERTIA)


def test_the_error_of_a_lateral_model_that_cannot_be_simulated_names_its_cause() -> None:
    backwards = replace(aircraft(TERMS), derivatives=tuple(_turned(d) for d in aircraft(TERMS).derivatives))
    with pytest.raises(EstimationError, match=r"\|beta\| < 1.5 rad; check the signs of delta_a, delta_r, C_n_beta"):
        found_in(Lateral(seed=9, duration=8.0).log(), backwards)


def _turned(derivative):  # type: ignore[no-untyped-def]
    far = {("C_l", "p_hat"): 400.0, ("C_n", "beta"): -40.0}
    value = far.get((derivative.coefficient, str(derivative.term)))
    return derivative if value is None else replace(derivative, value=value, fixed=True)
