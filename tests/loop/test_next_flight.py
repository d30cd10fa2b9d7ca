"""What to fly next: the input keeps its limits, does what it promises, and says so where no input can."""

from __future__ import annotations

import dataclasses
import io
import itertools
import json
import re
from pathlib import Path

import numpy as np
import pytest
from hostile_pages import HOSTILE, Page
from problems import LIGHT, NOISE, Problem, entry, with_channels
from problems_report import closed_loop
from pypdf import PdfReader

from aerosid.aircraft.reading import aircraft_from_text
from aerosid.effects import ActiveEffect
from aerosid.effects.sensor import sensor_bias
from aerosid.errors import AircraftError, UsageError
from aerosid.estimation.deviations import Deviations, deviations
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.estimation.maximum_likelihood import Refinement, refine
from aerosid.flight_model.axes import LONGITUDINAL
from aerosid.flight_model.simulation import fly, trim
from aerosid.logs.flight_log import FlightLog
from aerosid.logs.formats import read_log
from aerosid.loop.derivative_table import DerivativeRow
from aerosid.loop.next_flight.flight_limits import RANGES, FlightLimits, read_limit
from aerosid.loop.next_flight.input_design import DesignSettings
from aerosid.loop.next_flight.plan import plan_next_flight
from aerosid.loop.next_flight.planned_flight import NextFlight, PlannedInput
from aerosid.loop.result import ClosedLoop
from aerosid.nomenclature import CHANNELS
from aerosid.reporting import report_html, write_report
from aerosid.reporting.page import compose
from aerosid.reporting.paper import report_pdf
from aerosid.reporting.result_json import result_text
from aerosid.search.attribution import Attribution, attribute_by_search
from aerosid.search.findings import Finding
from aerosid.search.hypotheses import effect_hypotheses, term_hypotheses
from aerosid.search.settings import AttributionSettings
from aerosid.search.structure_search import StructureSearch

FREE = tuple((d.coefficient, d.term) for d in LIGHT.derivatives)
PLANTED = Problem(undeclared={("C_m", "delta_e^2"): -0.5}, duration=8.0, amplitude=0.08)
QUICK = DesignSettings(base_times=(0.8, 1.8), refined=1, rounds=1)


def finding(kind: str, where: str, term: str, number: float, **more: object) -> Finding:
    found = entry(where, term) if kind == "aero_term" else None
    return Finding(kind, where, term, found, number, 0.02 * abs(number), "1", None, 1e-9, 3.0, **more)  # type: ignore[arg-type]


def estimate(
    manoeuvre: Manoeuvre, model: object, term: str | None = None, effects: tuple[ActiveEffect, ...] = ()
) -> Refinement:
    free = FREE if term is None else (*FREE, entry("C_m", term))
    return refine(model.extended(free), [manoeuvre], free, effects=effects)  # type: ignore[attr-defined]


def white(fitted: Refinement, manoeuvre: Manoeuvre) -> Deviations:
    return deviations(fitted, [manoeuvre], quick=True)


@pytest.fixture(scope="module")
def undecided() -> tuple[Attribution, Manoeuvre]:
    """A three-level input that cannot tell delta_e^2 from delta_e^3, both fitted."""
    model, manoeuvre = PLANTED.prepared(PLANTED.fly(4))
    before = estimate(manoeuvre, model)
    chosen, rival = (estimate(manoeuvre, model, term) for term in ("delta_e^3", "delta_e^2"))
    loss = rival.cost - chosen.cost
    assert abs(loss) < 20.0  # the record leaves it open
    found = Attribution(
        before,
        chosen,
        white(chosen, manoeuvre),
        (finding("aero_term", "C_m", "delta_e^3", -7.3),),
        (finding("aero_term", "C_m", "delta_e^2", -0.5, fit=rival, instead_of="C_m delta_e^3"),),
        (),
    )
    return found, manoeuvre


@pytest.fixture(scope="module")
def plan(undecided: tuple[Attribution, Manoeuvre]) -> NextFlight:
    found, manoeuvre = undecided
    ahead = plan_next_flight(found, [manoeuvre], [], {}, QUICK)
    assert ahead is not None
    return ahead


def planned_input(plan: NextFlight) -> PlannedInput:
    assert plan.input is not None
    return plan.input


def flown(problem: Problem, planned: PlannedInput, noise: dict[str, float], seed: int) -> FlightLog:
    """The planned input flown by the truth of a problem, from its own trim."""
    level = trim(problem.truth, 100.0, LIGHT.density, LIGHT.mass)
    log = fly(
        problem.truth,
        level,
        planned.time,
        planned.deflections["delta_e"],
        density=LIGHT.density,
        mass=LIGHT.mass,
        noise=noise,
        seed=seed,
        name="next",
    )
    channels = {**log.channels, "thrust": np.full(log.time.size, level.thrust)}
    return FlightLog(log.name, log.time, channels, {**log.units, "thrust": "N"})


def truths(found: Attribution) -> dict[str, Problem]:
    """Either answer, with the number that the record gives it."""
    return {
        term: dataclasses.replace(PLANTED, undeclared={("C_m", term): fit.model.value(entry("C_m", term))})
        for term, fit in (("delta_e^3", found.completed), ("delta_e^2", found.alternatives[0].fit))
        if fit is not None
    }


def test_the_question_is_decided_by_one_flight(plan: NextFlight) -> None:
    (question,) = plan.questions
    assert (question.kind, question.subject, question.rival) == ("alternative", "C_m delta_e^3", "C_m delta_e^2")
    assert question.repeats == 1
    assert question.expected is not None
    assert question.expected > question.needed
    assert question.probability is not None
    assert question.probability > 0.95
    assert question.elsewhere == ""


@pytest.mark.parametrize("truth", ["delta_e^2", "delta_e^3"])
def test_limits_hold_on_the_simulated_flight(
    undecided: tuple[Attribution, Manoeuvre], plan: NextFlight, truth: str
) -> None:
    planned = planned_input(plan)
    log = flown(truths(undecided[0])[truth], planned, dict.fromkeys(NOISE, 0.0), 0)
    shown = {name: log[name] for name in ("alpha", "V", "theta", "delta_e", "q")} | {"n_z": -log["a_z"] / 9.80665}
    assert {peak.name for peak in planned.peaks} == set(shown)
    for peak in planned.peaks:
        values = shown[peak.name]
        span = peak.highest - peak.lowest
        assert values.max() == pytest.approx(peak.highest, abs=0.03 * span), peak.name
        assert values.min() == pytest.approx(peak.lowest, abs=0.03 * span), peak.name
    limited = {peak.name: peak for peak in planned.peaks if peak.limit_low is not None and peak.limit_high is not None}
    assert {"alpha", "n_z", "V", "theta"} <= set(limited)
    for name, peak in limited.items():
        low, high = peak.limit_low or 0.0, peak.limit_high or 0.0
        assert low < shown[name].min() < shown[name].max() < high, name
        # The search simulates at a coarser interval: a hundredth of the way may be lost.
        assert peak.highest <= peak.trim + (1.01 - RANGES.margin) * (high - peak.trim), name
        assert peak.lowest >= peak.trim + (1.01 - RANGES.margin) * (low - peak.trim), name
    interval = planned.time[1] - planned.time[0]
    assert np.max(np.abs(np.diff(planned.deflections["delta_e"]))) <= planned.rate * interval * (1.0 + 1e-9)
    assert planned.deflections["delta_e"][0] == planned.deflections["delta_e"][-1] == 0.0


def test_given_limits_are_kept_and_narrower_ones_tell_less(
    undecided: tuple[Attribution, Manoeuvre], plan: NextFlight
) -> None:
    found, manoeuvre = undecided
    given = {"alpha": (-0.03, 0.06), "delta_e_rate": (-0.2, 0.2)}
    narrow = plan_next_flight(found, [manoeuvre], [], given, QUICK)
    assert narrow is not None
    assert narrow.questions[0].expected is not None
    assert plan.questions[0].expected is not None
    assert narrow.questions[0].expected < plan.questions[0].expected
    limited = planned_input(narrow)
    (alpha,) = (peak for peak in limited.peaks if peak.name == "alpha")
    assert alpha.given
    assert -0.03 < alpha.lowest < alpha.highest < 0.06
    assert limited.rate == 0.2


def test_the_plan_is_the_same_to_the_last_bit(undecided: tuple[Attribution, Manoeuvre], plan: NextFlight) -> None:
    found, manoeuvre = undecided
    again = plan_next_flight(found, [manoeuvre], [], {}, QUICK)
    assert again is not None
    assert again.questions == plan.questions
    assert planned_input(again).deflections["delta_e"].tobytes() == planned_input(plan).deflections["delta_e"].tobytes()


def test_nothing_open_is_no_plan(undecided: tuple[Attribution, Manoeuvre]) -> None:
    found, manoeuvre = undecided
    assert plan_next_flight(dataclasses.replace(found, alternatives=()), [manoeuvre], [], {}, QUICK) is None


def test_a_bias_of_a_x_and_of_theta_cannot_be_told_apart_by_any_input() -> None:
    """A small bias of a_x is one of theta and another C_X: both see gravity along x, and h is not measured here."""
    problem = Problem(duration=8.0)
    log = problem.fly(5)
    model, manoeuvre = problem.prepared(with_channels(log, a_x=log["a_x"] + 0.03, h=None))
    fits = [
        estimate(manoeuvre, model, effects=(ActiveEffect(sensor_bias(name, CHANNELS[name].unit, NOISE[name]), (0.0,)),))
        for name in ("a_x", "theta")
    ]
    assert abs(fits[0].cost - fits[1].cost) < 3.0
    found = Attribution(
        estimate(manoeuvre, model),
        fits[0],
        white(fits[0], manoeuvre),
        (finding("sensor_bias", "a_x", "", 0.03),),
        (finding("sensor_bias", "theta", "", -0.003, fit=fits[1], instead_of="sensor_bias of a_x"),),
        (),
    )
    ahead = plan_next_flight(found, [manoeuvre], [], {}, QUICK)
    assert ahead is not None
    (question,) = ahead.questions
    assert ahead.input is None
    assert question.repeats is None
    assert question.expected is not None
    assert question.expected < 3.0
    assert "No elevator input within these limits distinguishes them" in question.elsewhere
    assert "independent sensor" in question.elsewhere


def test_a_derivative_that_is_not_shown_gets_an_input_that_shows_it() -> None:
    """A timid doublet leaves C_Z q_hat unknown; the deviation after the proposed one is that of a real refit."""
    problem = Problem(duration=8.0, amplitude=0.012)
    model, manoeuvre = problem.prepared(problem.fly(6))
    fitted = estimate(manoeuvre, model)
    spread = white(fitted, manoeuvre)
    found = Attribution(fitted, fitted, spread, (), (), ())
    n = FREE.index(entry("C_Z", "q_hat"))
    error = float(spread.corrected[n])
    value = fitted.model.value(FREE[n])
    row = DerivativeRow("C_Z", "q_hat", -4.32, value, value, error, error, None, None, None, False)
    given = {"alpha": (-0.15, 0.15), "delta_e": (-0.1, 0.1), "theta": (-0.5, 0.5), "V": (85.0, 115.0), "n_z": (-3, 5)}
    ahead = plan_next_flight(found, [manoeuvre], [row], given, QUICK)
    assert ahead is not None
    (question,) = ahead.questions
    assert question.kind == "derivative"
    assert question.expected is not None
    assert question.expected < 0.5 * error
    log = flown(problem, planned_input(ahead), dict(problem.noise), 8)
    _, second = problem.prepared(log)
    both = refine(fitted.model, [manoeuvre, second], FREE)
    after = float(np.sqrt(np.diag(both.covariance))[n])
    colour = max(1.0, error / float(spread.white[n]))
    assert question.expected == pytest.approx(colour * after, rel=0.25)


@pytest.fixture(scope="module")
def reported(plan: NextFlight) -> ClosedLoop:
    return dataclasses.replace(closed_loop(samples=120), next_flight=plan)


def test_the_input_is_written_as_a_native_log(reported: ClosedLoop, tmp_path: Path) -> None:
    write_report(reported, tmp_path, interactive=False)
    log = read_log(tmp_path / "next_input.csv")
    planned = reported.next_flight.input if reported.next_flight else None
    assert planned is not None
    assert log["delta_e"] == pytest.approx(planned.deflections["delta_e"], abs=1e-9)
    assert log.time == pytest.approx(planned.time, abs=1e-9)
    # A later run that leaves nothing open takes it away: it would be flown for this one's.
    write_report(dataclasses.replace(reported, next_flight=None), tmp_path, interactive=False)
    assert not (tmp_path / "next_input.csv").exists()
    assert "next_flight" not in json.loads((tmp_path / "result.json").read_text())


def test_result_json_holds_the_plan(reported: ClosedLoop) -> None:
    ahead = json.loads(result_text(reported))["next_flight"]
    assert set(ahead) == {"input", "questions", "tried", "note"}
    assert set(ahead["input"]) == {"name", "amplitude", "rate", "airspeed", "density", "steps", "peaks"}
    assert ahead["questions"][0]["repeats"] == 1
    steps = ahead["input"]["steps"]
    assert len(steps) > 1
    for one, other in itertools.pairwise(steps):
        assert one["start"] + one["duration"] == pytest.approx(other["start"])


def test_the_pilots_card_holds_every_step_and_limit(reported: ClosedLoop) -> None:
    page = Page(report_html(reported, interactive=False))
    (card,) = page.all("article")
    assert card["class"] == "card"
    planned = planned_input(reported.next_flight) if reported.next_flight else None
    assert planned is not None
    for step in planned.steps:
        assert f"{np.degrees(step.deflection):.2f}".replace("-", "−") in page.text
    assert "next_input.csv" in page.text
    plain = Page(report_html(dataclasses.replace(reported, next_flight=None), interactive=False))
    assert not plain.all("article")
    assert "next_flight" not in {attributes.get("id") for attributes in plain.all("section")}


def test_the_card_is_whole_on_one_sheet(reported: ClosedLoop) -> None:
    reader = PdfReader(io.BytesIO(report_pdf(reported, compose(reported))))
    (sheet,) = (text for page in reader.pages if "card:" in (text := page.extract_text()))
    planned = planned_input(reported.next_flight) if reported.next_flight else None
    assert planned is not None
    printed = [
        tuple(float(part.replace("−", "-")) for part in pair)
        for pair in re.findall(r"(−?[0-9]+\.?[0-9]*) to (−?[0-9]+\.?[0-9]*)", sheet)
    ]
    limits = {
        peak.name: np.array([peak.limit_low, peak.limit_high]) * (np.degrees(1.0) if peak.unit == "rad" else 1.0)
        for peak in planned.peaks
        if peak.limit_low is not None and peak.limit_high is not None and peak.name != "V"  # in knots there
    }
    assert {"alpha", "n_z", "theta"} <= set(limits)
    for name, pair in limits.items():
        # A card has one decimal of a degree.
        assert any(np.allclose(other, pair, rtol=0.0, atol=0.051) for other in printed), name
    assert "Purpose:" in sheet
    assert "Next flight" not in sheet


def test_names_out_of_files_are_escaped_in_the_plan(reported: ClosedLoop) -> None:
    ahead = reported.next_flight
    assert ahead is not None
    questions = tuple(dataclasses.replace(q, subject=HOSTILE, rival=HOSTILE) for q in ahead.questions)
    planned = dataclasses.replace(planned_input(ahead), rival=HOSTILE)
    hostile = dataclasses.replace(ahead, questions=questions, input=planned)
    page = Page(report_html(dataclasses.replace(reported, next_flight=hostile), interactive=False))
    assert not page.all("img")
    assert HOSTILE in page.text


@pytest.mark.parametrize(
    ("text", "limits"),
    [
        ("alpha=-2:12deg", (np.radians(-2.0), np.radians(12.0))),
        ("alpha = -0.05 : 0.2", (-0.05, 0.2)),
        ("n_z=0.2:1.8", (0.2, 1.8)),
        ("V=80:120m/s", (80.0, 120.0)),
        ("delta_e_rate=20deg/s", (-np.radians(20.0), np.radians(20.0))),
    ],
)
def test_limits_are_read_with_their_unit(text: str, limits: tuple[float, float]) -> None:
    name, found = read_limit(text)
    assert name == text.split("=")[0].strip()
    assert found == pytest.approx(limits)


@pytest.mark.parametrize(
    "text", ["", "alpha", "alpha=", "alpha=3", "alpha=3:2", "alpha=a:b", "h=0:3", "n_z=1:2deg", "V=nan:3", "V=1:inf"]
)
def test_a_limit_that_is_none_is_one_sentence(text: str) -> None:
    with pytest.raises(UsageError, match="--limit"):
        read_limit(text)


def test_limits_of_the_aircraft_file() -> None:
    text = LIGHT.text + "\n[limits]\nalpha = [-0.05, 0.2]\ndelta_e_rate = 1\n"
    assert aircraft_from_text(text, "a.toml", "0" * 64).limits == {"alpha": (-0.05, 0.2), "delta_e_rate": (-1.0, 1.0)}
    for wrong in ("alpha = [0.2, -0.05]", "alpha = [0.2]", "alpha = 0.2", "delta_e_rate = -1.0", "gamma = [0.0, 1.0]"):
        with pytest.raises(AircraftError, match="limits"):
            aircraft_from_text(f"{LIGHT.text}\n[limits]\n{wrong}\n", "a.toml", "0" * 64)


@pytest.mark.slow
@pytest.mark.parametrize("truth", ["delta_e^2", "delta_e^3"])
@pytest.mark.parametrize("seed", [11, 12, 13])
def test_the_proposed_flight_decides_whichever_is_true(
    undecided: tuple[Attribution, Manoeuvre], plan: NextFlight, truth: str, seed: int
) -> None:
    """Flown by the one and by the other, and closed again with the first record: what is true is found alone."""
    problem = truths(undecided[0])[truth]
    logs = [problem.fly(seed, "first"), flown(problem, planned_input(plan), dict(problem.noise), seed + 100)]
    model, first = problem.prepared(logs[0])
    manoeuvres = [first, problem.prepared(logs[1])[1]]
    before = refine(model, manoeuvres, FREE)
    hypotheses = (
        *term_hypotheses(problem.candidates(logs[0])),
        *effect_hypotheses(model, manoeuvres, LIGHT.coefficients),
    )
    search = StructureSearch(tuple(manoeuvres), hypotheses, LIGHT.coefficients, before, AttributionSettings())
    found = attribute_by_search(search, [])
    assert [(f.where, f.term) for f in found.findings] == [("C_m", truth)]
    assert ("C_m", {"delta_e^2": "delta_e^3", "delta_e^3": "delta_e^2"}[truth]) not in {
        (other.where, other.term) for other in found.alternatives
    }


def test_a_model_with_a_sensor_offset_is_judged_by_its_excursions() -> None:
    """An airspeed that reads 20 m/s too much flies no other manoeuvre."""
    limits = FlightLimits(
        {"alpha": (-0.1, 0.2), "n_z": (-1.0, 3.0), "V": (95.0, 105.0), "theta": (-0.3, 0.3), "delta_e": (-0.2, 0.2)},
        {"delta_e": 0.5},
        frozenset(),
        LONGITUDINAL,
    )
    outputs = np.zeros((3, 8))
    outputs[:, 0], outputs[:, 5] = (100.0, 102.0, 99.0), -9.80665
    still = {"alpha": 0.0, "n_z": 1.0, "V": 100.0, "theta": 0.0, "delta_e": 0.0}
    room = limits.room(outputs, {"delta_e": np.zeros(3)}, still)
    assert room == pytest.approx(1.0 - 2.0 / 5.0 / (1.0 - RANGES.margin))
    outputs[:, 0] += 20.0
    assert limits.room(outputs, {"delta_e": np.zeros(3)}, still) == pytest.approx(room)
    outputs[1, 0] += 3.0
    assert limits.room(outputs, {"delta_e": np.zeros(3)}, still) < 0.0
    assert limits.room(outputs, {"delta_e": np.zeros(3)}, {**still, "V": 106.0}) == -np.inf
