"""Page and paper of a result decided by the equations: no multiples of the noise, no columns of another method."""

from __future__ import annotations

import dataclasses
import io

import pytest
from hostile_pages import Page
from problems_report import closed_loop
from pypdf import PdfReader

from aerosid.compatibility import Agreement, ChannelAgreement, KinematicConsistency
from aerosid.loop.effect_rows import Effect, Evidence
from aerosid.loop.result import ClosedLoop
from aerosid.loop.verdict import Verdict, summarise
from aerosid.reporting.judgement import open_points
from aerosid.reporting.page import compose
from aerosid.reporting.paper import report_pdf
from aerosid.reporting.words import effect_sentence


@pytest.fixture(scope="module")
def result() -> ClosedLoop:
    return closed_loop(samples=120)


def words(result: ClosedLoop, name: str = "") -> str:
    """The words of one section, or of the whole page."""
    report = compose(result)
    bodies = [str(body) for section, body in report.parts if name in ("", section.name)]
    return " ".join(" ".join(" ".join(Page(body).texts) for body in bodies).split())


def decided(result: ClosedLoop, **changes: object) -> ClosedLoop:
    return dataclasses.replace(result, decided_by="equations", **changes)


def test_where_the_equations_decide_no_error_is_counted_in_units_of_the_noise(result: ClosedLoop) -> None:
    large = tuple(dataclasses.replace(row, noise=1e-5 * (row.before or 1.0)) for row in result.errors)
    by_likelihood = dataclasses.replace(result, errors=large)
    assert "times)" in " ".join(open_points(by_likelihood))
    assert "multiples of the measurement noise" in words(by_likelihood, "residual")
    assert "times the noise" in words(by_likelihood, "decision")
    by_equations = decided(result, errors=large)
    text = " ".join(open_points(by_equations))
    assert "the ratio to the noise does not measure the model" in text
    assert "times)" not in text
    assert "per cent of the standard deviation of the channel" in words(by_equations, "residual")
    assert "times the noise" not in words(by_equations)


def test_what_misses_a_channel_is_told_as_a_share_of_its_variation(result: ClosedLoop) -> None:
    fit = tuple(dataclasses.replace(row, r2=0.75 if row.channel == "q" else 0.99) for row in result.fit)
    assert "per cent of the standard deviation of the channel: q 50" in words(decided(result, fit=fit), "residual")


def test_noise_that_cannot_be_estimated_is_a_dash_among_the_instruments_too(result: ClosedLoop) -> None:
    log = result.identification[0].name
    rows = tuple(ChannelAgreement(log, name, "rad", 0.02, 0.01, 0.0123, True) for name in ("alpha", "theta"))
    agreement = KinematicConsistency((log,), Agreement.CONSISTENT, (), (), (), rows, "")
    doubted = tuple(
        dataclasses.replace(row, noise_doubt="it was filtered" if row.channel == "alpha" else "")
        for row in result.errors
    )
    text = words(decided(result, errors=doubted, kinematics=agreement), "instruments")
    assert text.count("0.70") == 1  # 0.0123 rad, only in theta
    assert "– white" in text


def test_the_appendix_has_no_column_that_nobody_filled(result: ClosedLoop) -> None:
    assert "independence" in words(result, "screening")
    empty = tuple(dataclasses.replace(row, gain=0.0, independence=0.0) for row in result.screening)
    text = words(decided(result, screening=empty), "screening")
    assert "independence" not in text
    assert "gain" not in text
    # Sorted by the available measure: the partial correlation.
    assert text.index("0.998") < text.index("0.333")


def test_a_legend_holds_what_is_drawn(result: ClosedLoop) -> None:
    nothing = tuple(dataclasses.replace(history, terms=()) for history in result.model_error)
    rivals = tuple(dataclasses.replace(picture, chosen=False) for picture in result.regressors)
    bare = decided(result, model_error=nothing, regressors=rivals)
    assert "identified terms" in words(result, "residual")
    assert "identified terms" not in words(bare, "residual").split("Figure")[0].split("comparison.")[-1]
    assert "entered the model" in words(result, "candidates").split("Figure")[0]
    assert "entered the model" not in words(bare, "candidates").split("Figure")[0]
    assert "closest competing term, not included" in words(bare, "candidates")


def test_a_slope_against_the_value_is_told_beside_the_value(result: ClosedLoop) -> None:
    assert "opposite sign to the value" not in words(result, "candidates")
    turned = tuple(
        dataclasses.replace(picture, slope=2.2) if picture.chosen else picture for picture in result.regressors
    )
    text = words(decided(result, regressors=turned), "candidates")
    assert "has the opposite sign to the value" in text
    assert "value −1.71" in text


def test_a_number_that_chance_could_have_made_is_not_proven(result: ClosedLoop) -> None:
    assert "by chance" not in " ".join(open_points(result))
    first = result.effects[0]
    weak = dataclasses.replace(first, std_error=0.55, evidence=dataclasses.replace(first.evidence, p_value=0.27))
    text = " ".join(open_points(dataclasses.replace(result, effects=(weak,))))
    assert "3.1 standard errors from its null value, would occur by chance in 27 % of such searches" in text


def test_a_place_is_told_with_its_axis_and_many_effects_with_the_first() -> None:
    evidence = Evidence(None, 1e-9, None, 40.0)
    place = Effect(1, "sensor_position", "a_x", "", -0.77, 0.11, "m", evidence, along="z")
    shift = Effect(2, "cg_shift", "z", "", -0.85, 0.11, "m", evidence)
    text = summarise(Verdict.EXPLAINED, [place, shift], ())
    assert "a sensor position of a_x along z (−0.77 ± 0.11 m)" in text
    assert "a shift of the centre of gravity along z (−0.85 ± 0.11 m)" in text
    many = summarise(Verdict.EXPLAINED, [place] * 7, ())
    assert many.count("±") == 4
    assert many.endswith("and 3 more.")


def test_what_is_ahead_of_the_others_is_told_as_early() -> None:
    late = Effect(1, "sensor_delay", "a_z", "", 0.18, 0.02, "s", Evidence(None, 1e-9, None, 40.0))
    assert effect_sentence(late) == "a_z is recorded with a time delay"
    assert effect_sentence(dataclasses.replace(late, value=-0.18)) == "a_z is recorded early (negative time delay)"
    control = dataclasses.replace(late, kind="control_delay", where="delta_e", value=-0.05)
    assert effect_sentence(control) == "delta_e acts before it is recorded (negative time delay)"


def test_a_model_error_that_no_aircraft_has_is_compared_with_nothing(result: ClosedLoop) -> None:
    first, *others = result.model_error
    d = first.d.copy()
    d[40] = -2.3
    wild = decided(result, model_error=(dataclasses.replace(first, d=d), *others))
    text = words(wild, "residual")
    assert f"C X : at {first.time[40]:.1f} s d(t) exceeds any plausible error of the coefficient" in text
    assert text.count("correlation") == 1  # for C_m


def test_the_first_sheet_holds_what_a_signature_needs(result: ClosedLoop) -> None:
    sheet = " ".join(PdfReader(io.BytesIO(report_pdf(result, compose(result)))).pages[0].extract_text().split())
    wanted = ["SHA-256", result.aircraft.sha256, "reference", "Signs", "Explained", "Action:"]
    wanted += [
        "Effects missing from the declared model",
        "Error before and after",
        "Derivatives, declared and completed",
    ]
    wanted += ["−1.711 ± 0.019", "3.593 ± 0.041", "not significant", "keeps its declared value"]
    for phrase in wanted:
        assert phrase.lower() in sheet.lower(), phrase


def test_what_a_likelihood_contains_of_declared_values_is_said(result: ClosedLoop) -> None:
    uncertain = tuple(dataclasses.replace(row, sigma=0.1 * abs(row.value)) for row in result.aircraft.derivatives)
    exact = tuple(dataclasses.replace(row, sigma=None) for row in result.aircraft.derivatives)
    disagreement = "with the disagreement of the derivatives with those declared with a sigma"
    for derivatives, told in ((uncertain, True), (exact, False)):
        aircraft = dataclasses.replace(result.aircraft, derivatives=derivatives)
        by_equations = decided(result, aircraft=aircraft)
        assert by_equations.alternatives
        assert (disagreement in words(by_equations, "alternatives")) is told
        assert disagreement not in words(dataclasses.replace(result, aircraft=aircraft), "alternatives")
