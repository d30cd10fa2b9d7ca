"""report.html as read by a browser: well formed, self-contained, escaped, complete, and small for long flights."""

from __future__ import annotations

import base64
import dataclasses
import hashlib
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hostile_pages import HOSTILE, Page, hostile_result
from problems_report import closed_loop

from aerosid.compatibility import Agreement, ChannelAgreement, KinematicConsistency
from aerosid.loop.effect_rows import Confirmation, Effect, Evidence
from aerosid.loop.flying_qualities.linear_analysis import LinearRow
from aerosid.loop.model_validation.open_loop_errors import ErrorRow
from aerosid.loop.quantity import Parameter
from aerosid.loop.result import ClosedLoop
from aerosid.loop.second_opinion import CompetingStructure, SecondOpinion
from aerosid.loop.verdict import Verdict
from aerosid.reporting import report_html
from aerosid.reporting.page import compose
from aerosid.reporting.templating import page_environment


@pytest.fixture(scope="module")
def result() -> ClosedLoop:
    return closed_loop()


@pytest.fixture(scope="module")
def html(result: ClosedLoop) -> str:
    return report_html(result, interactive=False)


@pytest.fixture(scope="module")
def page(html: str) -> Page:
    return Page(html)


def test_ids_are_unique_and_every_reference_leads_somewhere(page: Page) -> None:
    ids = [attributes["id"] for _, attributes in page.elements if "id" in attributes]
    assert len(ids) == len(set(ids))
    values = [value or "" for _, attributes in page.elements for value in attributes.values()]
    wanted = {found for value in values for found in re.findall(r"url\(#([^)]+)\)", value)}
    wanted |= {value[1:] for _, attributes in page.elements if (value := attributes.get("href") or "").startswith("#")}
    wanted |= {attributes["aria-labelledby"] for attributes in page.all("section")}
    assert wanted <= set(ids)
    assert wanted


def test_nothing_is_loaded_and_nothing_runs(html: str, page: Page) -> None:
    assert "http:" not in html
    assert "https:" not in html
    assert not {"script", "link", "img", "iframe", "object"} & {tag for tag, _ in page.elements}
    assert not [name for _, attributes in page.elements for name in attributes if name.startswith("on")]
    policy = next(a["content"] for a in page.all("meta") if a.get("http-equiv") == "Content-Security-Policy")
    assert policy == "default-src 'none'; style-src 'unsafe-inline'"


def test_what_is_to_be_decided_comes_first(page: Page) -> None:
    sections = [attributes["id"] for attributes in page.all("section")]
    assert sections[0] == "decision"
    story = ["residual", "candidates", "effects", "prediction", "alternatives"]
    assert [name for name in sections if name in story] == story
    assert {"derivatives", "readings", "glossary"} <= set(sections[1 + len(story) :])


def test_the_page_holds_what_the_engineer_needs(result: ClosedLoop, page: Page) -> None:
    wanted = [
        result.verdict.value,
        "−1.711 ± 0.019",
        "3.593 ± 0.041",
        "not used in the fit",
        "0.9700 ± 0.0097",  # CAP of the completed model
        "0.8365 ± 0.0084",  # alpha of level flight, deg
        "5.000 ± 0.050",  # frequency of the short period, rad/s
        "1 (1 to 2 within 2 σ)",
        "worse than 3",
        "EL_L + EL_R",
        "1.2, 0, 0.4",
        result.prefilter.effect_on_estimates,
        result.aircraft.sha256,
        *(log.sha256 for log in (*result.identification, *result.validation)),
        np.__version__,
    ]
    for words in wanted:
        assert words in page.text, words
    sentences = ["Cm and CX each lack a term in α2;", "cannot distinguish Cm α·δe from Cm α2", "information on Cm α̇̂"]
    for sentence in (*sentences, "0.9077 kg/m³", "4 samples of α are missing"):
        assert "".join(sentence.split()) in "".join(page.text.split()), sentence


@pytest.mark.parametrize("unit", ["rad", "rad/s"])
def test_an_angle_stands_beside_the_unit_that_its_number_has(result: ClosedLoop, unit: str) -> None:
    """0.0200 rad are 1.15 deg, wherever an effect or its value is shown."""
    bias = Effect(1, "sensor_bias", "alpha", "", 0.02, 0.001, unit, Evidence(None, 1e-9, None, 50.0))
    second = dataclasses.replace(bias, parameters={"limit": Parameter(0.02, 0.001, unit)})
    shown = dataclasses.replace(result, effects=(second,), alternatives=(bias,))
    text = " ".join(Page(report_html(shown, interactive=False)).text.split())
    degrees = unit.replace("rad", "deg")
    count = text.count(f"0.0200 ± 0.0010 {unit} (1.15 {degrees})")
    assert count == text.count("0.0200 ± 0.0010") >= 4


def test_a_number_without_a_standard_error_says_why(result: ClosedLoop) -> None:
    stall = Effect(1, "flow_separation", "C_L", "", 0.27, 0.001, "rad", Evidence(None, 1e-9, None, 50.0))
    numbers = {"sharpness": Parameter(150.0, None, "1/rad"), "delay": Parameter(0.11, 0.05, "s")}
    shown = dataclasses.replace(result, effects=(dataclasses.replace(stall, parameters=numbers),), alternatives=())
    text = " ".join(Page(report_html(shown, interactive=False)).text.split())
    assert text.count("at its limit or not determined") == text.count("150.0 1/rad (at its limit") == 1


def test_figures_are_drawn_labelled_and_follow_the_style_sheet(html: str, page: Page) -> None:
    drawings = [attributes for attributes in page.all("svg") if attributes.get("role") == "img"]
    assert len(drawings) == len(page.all("figcaption")) == len(compose(closed_loop()).figures)
    assert all(attributes["aria-label"] for attributes in drawings)
    classes = {name for _, attributes in page.elements for name in (attributes.get("class") or "").split()}
    assert {"measured", "declared", "before", "after", "trimmed", "noise"} <= classes
    styled = html[html.index("</style>") :]
    assert not re.findall(r"(?:fill|stroke)[:=]", styled)
    assert {"[deg/s]", "[m/s²]"} <= set(re.findall(r"\[[^\]]*\]", page.text))


def test_the_drawn_line_is_the_simulated_one() -> None:
    """The line of `after` in the first strip, read back from the picture, is the history up to its scale."""
    made = closed_loop(samples=200, validated=False)
    body = report_html(made, interactive=False)
    strip = body[body.index('id="prediction"') :]
    path = re.search(r'<path class="line after"[^>]* d="M(\d+) (\d+)l([^"M]*)"', strip)
    assert path is not None
    moves = np.array(re.findall(r"-?\d+", path[3]), dtype=float).reshape(-1, 2)
    corners = np.cumsum(np.vstack([[float(path[1]), float(path[2])], moves]), axis=0)
    history = made.simulated[0].after["V"]
    expected = np.interp(
        np.interp(corners[:, 0], [corners[0, 0], corners[-1, 0]], made.simulated[0].log.time[[0, -1]]),
        made.simulated[0].log.time,
        history,
    )
    slope, offset = np.polyfit(corners[:, 1], expected, 1)
    assert slope < 0.0  # SVG counts downward
    assert np.max(np.abs(slope * corners[:, 1] + offset - expected)) < 0.01 * np.ptp(history)


def test_tables_have_headers_with_scope(page: Page) -> None:
    assert page.all("th")
    assert all(attributes.get("scope") in {"col", "row", "rowgroup"} for attributes in page.all("th"))


@pytest.mark.parametrize("interactive", [False, True])
def test_hostile_texts_stay_texts(interactive: bool) -> None:
    page = Page(report_html(hostile_result(), interactive=interactive))
    assert not page.all("img")
    assert not [name for _, attributes in page.elements for name in attributes if name.startswith("on")]
    assert page.text.count(HOSTILE) > 12


@pytest.mark.parametrize("verdict", list(Verdict))
def test_a_result_with_almost_nothing_in_it_still_makes_a_page(verdict: Verdict) -> None:
    made = closed_loop(samples=60, verdict=verdict, validated=False)
    nothing = np.full(60, np.nan)
    first = made.simulated[0]
    first = dataclasses.replace(
        first, measured={"q": nothing, "h": np.zeros(60)}, declared={}, before={"h": nothing}, after={"q": nothing}
    )
    rows = (ErrorRow(first.log.name, "identification", "q", "rad/s", None, None, None, None, 0.0),)
    bare = dataclasses.replace(
        made, effects=(), alternatives=(), derivatives=(), coefficients=(), errors=rows, simulated=(first,),
        screening=(), model_error=(), notes=(),
    )  # fmt: skip
    text = Page(report_html(bare, interactive=False)).text
    assert verdict.value in text
    assert "leaves |α| < 1.5 rad" in text
    identified = verdict is not Verdict.INCONSISTENT_DATA
    assert ("No flight was reserved for validation" in text) is identified
    assert ("Nothing was identified" in text) is not identified


def test_an_hour_at_100_hz_stays_small() -> None:
    made = closed_loop(samples=400)
    time = np.arange(360_000) / 100.0
    generator = np.random.default_rng(5)

    def stretched(histories: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
        return {
            name: np.resize(values, time.size) + 1e-3 * generator.standard_normal(time.size)
            for name, values in histories.items()
        }

    long = []
    for response in made.simulated:
        log = dataclasses.replace(response.log, time=time, channels=stretched(dict(response.log.channels)))
        models = {
            name: stretched(dict(getattr(response, name)))
            for name in ("measured", "declared", "before", "after", "trimmed")
        }
        long.append(dataclasses.replace(response, log=log, **models))
    result = dataclasses.replace(made, simulated=tuple(long))
    still, zoomed = (len(report_html(result, interactive=interactive)) for interactive in (False, True))
    assert still < 2_000_000
    assert zoomed < 12_000_000


def decoded(block: dict[str, Any], number: int) -> np.ndarray:
    held = block["arrays"][number]
    return np.frombuffer(base64.b64decode(held["bytes"]), dtype=f"<{held['dtype']}")


def test_zoomable_figures_hold_the_histories(result: ClosedLoop) -> None:
    """The traces of q on the validation log, read back from the page, equal the log's."""
    text = report_html(result)
    block = json.loads(Page(text).data["figure-data"])
    flight = next(simulated for simulated in result.simulated if simulated.role == "validation")
    figure = next(f for f in block["figures"] if any(trace["name"].startswith("q [") for trace in f["data"]))
    assert figure["timeline"] == flight.log.name
    traces = {trace["meta"]: trace for trace in figure["data"] if trace["name"].startswith("q [")}
    for role in ("measured", "declared", "before", "after"):
        np.testing.assert_array_equal(decoded(block, traces[role]["x"]), flight.log.time)
        expected = np.degrees(getattr(flight, role)["q"])
        np.testing.assert_allclose(decoded(block, traces[role]["y"]), expected, rtol=2e-7)
    row = next(row for row in result.errors if row.role == "validation" and row.channel == "q")
    strip = {t["meta"]: t for t in figure["data"] if t["yaxis"] == f"y{int(traces['after']['yaxis'][1:]) + 1}"}
    residual = decoded(block, strip["after"]["y"]).astype(float)
    assert np.sqrt(np.mean(residual**2)) == pytest.approx(np.degrees(row.after or 0.0), rel=1e-5)


def test_only_the_pages_own_scripts_may_run(result: ClosedLoop) -> None:
    text = report_html(result)
    scripts = re.findall(r"<script>(.*?)</script>", text, re.DOTALL)
    assert len(scripts) == 2
    sums = [base64.b64encode(hashlib.sha256(script.encode()).digest()).decode() for script in scripts]
    page = Page(text)
    policy = next(a["content"] for a in page.all("meta") if a.get("http-equiv") == "Content-Security-Policy")
    assert policy is not None
    rules = dict(rule.strip().split(" ", 1) for rule in policy.split(";"))
    assert rules["default-src"] == "'none'"
    assert set(rules["script-src"].split()) == {f"'sha256-{number}'" for number in sums}
    assert set(rules) == {"default-src", "style-src", "script-src", "img-src"}
    assert not {"link", "img", "iframe", "object"} & {tag for tag, _ in page.elements}


def test_interactive_labels_are_text(result: ClosedLoop) -> None:
    block = json.loads(Page(report_html(hostile_result())).data["figure-data"])
    titles = [axis["title"]["text"] for f in block["figures"] for name, axis in f["layout"].items() if "axis" in name]
    names = [trace["name"] for f in block["figures"] for trace in f["data"]]
    assert any("&lt;img" in text for text in titles)
    for text in (*titles, *names):
        assert "<" not in re.sub(r"</?sub>", "", text)


def doubted(result: ClosedLoop) -> ClosedLoop:
    """The same with unreliable noise estimates of two channels."""
    why = "it is smoother than any sensor: it was filtered, or computed"
    rows = tuple(
        dataclasses.replace(row, noise_doubt=why, noise=1.2345e-7) if row.channel in ("q", "a_z") else row
        for row in result.errors
    )
    return dataclasses.replace(result, errors=rows)


def test_nothing_is_said_in_units_of_a_noise_that_cannot_be_estimated(result: ClosedLoop) -> None:
    text = " ".join(Page(report_html(doubted(result), interactive=False)).text.split())
    assert "1.2·10" not in text
    assert "0000" not in text.split("Residual of the declared structure")[1].split("Model error by equation")[0]
    assert "The noise cannot be estimated from the recording for q and a z (it is smoother" in text


def test_what_validation_decided_is_told_in_words(result: ClosedLoop) -> None:
    decided = dataclasses.replace(
        result, decided_by_validation=("confirmed C_m alpha^2", "refuted sensor_scale of theta")
    )
    html = report_html(decided, interactive=False)
    tags = re.findall(r'<span class="tag validation">(.*?)</span>', html)
    assert tags
    for tag in tags:
        assert "_" not in re.sub(r"<[^>]*>", "", tag), tag
        assert "sensor scale of <var>θ</var>" in tag


def test_what_the_validation_flights_say_by_themselves_stands_with_the_effect(result: ClosedLoop) -> None:
    confirmation_value = Confirmation(-13.21, 1.18, 3e-9)
    first = result.effects[0]
    confirmed = dataclasses.replace(
        first, evidence=dataclasses.replace(first.evidence, confirmation=confirmation_value)
    )
    shown = dataclasses.replace(result, effects=(confirmed, *result.effects[1:]))
    section = {s.name: body for s, body in compose(shown).parts}["effects"]
    rows = [" ".join(re.sub(r"<[^>]*>", " ", row).split()) for row in re.findall(r"<tr.*?</tr>", section, re.DOTALL)]
    (row,) = [row for row in rows if row.startswith("validation flights alone")]
    assert "−13.2 ± 1.2" in row
    assert "3.0·10⁻⁹" in row
    assert "validation flights alone" not in {s.name: body for s, body in compose(result).parts}["effects"]


def test_a_mode_slower_than_the_record_is_marked_with_the_record_s_length(result: ClosedLoop) -> None:
    def stretched(row: LinearRow) -> LinearRow:
        modes = tuple(
            dataclasses.replace(mode, extrapolated=tuple(mode.numbers) if mode.name == "phugoid" else ())
            for mode in row.modes
        )
        return dataclasses.replace(row, modes=modes, record=14.07)

    made = dataclasses.replace(result, linear=tuple(stretched(row) for row in result.linear))
    body = {s.name: text for s, text in compose(made).parts}["linear"]
    rows = [" ".join(re.sub(r"<[^>]*>", " ", row).split()) for row in re.findall(r"<tr.*?</tr>", body, re.DOTALL)]
    marked = [row for row in rows if "†" in row]
    # Frequency, time to half and level of the phugoid, for both models; no row of the short period.
    assert [row.count("†") for row in marked] == [2, 2, 2]
    assert marked[-1].startswith("level of the phugoid")
    assert "14.1 s" in body
    assert "†" not in {s.name: text for s, text in compose(result).parts}["linear"]


def test_an_alternative_that_fits_better_than_the_chosen_effect_is_not_called_equal(result: ClosedLoop) -> None:
    def listed(worse_by: float) -> str:
        (other,) = result.alternatives
        made = dataclasses.replace(result, alternatives=(dataclasses.replace(other, worse_by=worse_by, margin=57.0),))
        return " ".join(Page(report_html(made, interactive=False)).text.split())

    near = listed(-50.0)
    assert "These manoeuvres cannot distinguish" in near
    assert "the fit improves" not in near
    far = listed(-1295.3)
    assert "These manoeuvres cannot distinguish" not in far
    assert "the fit improves in −2 ln L by more than the margin of 57 with C m α · δ e (by 1300)" in far
    assert "some of them better than the chosen one by more than the margin" in far


def test_an_error_that_trimming_makes_worse_is_told_with_those_that_it_mends(result: ClosedLoop) -> None:
    def trimmed(row: ErrorRow) -> ErrorRow:
        if row.role != "validation" or row.after is None or row.channel not in ("V", "alpha"):
            return row
        return dataclasses.replace(row, trimmed=row.after * (0.4 if row.channel == "V" else 2.5))

    made = dataclasses.replace(result, errors=tuple(map(trimmed, result.errors)))
    text = " ".join(Page(report_html(made, interactive=False)).text.split())
    assert "or an effect is missing: that of α increases from" in text
    assert "increases from" not in " ".join(Page(report_html(result, interactive=False)).text.split())


def test_a_residual_strip_has_two_round_numbers_whatever_the_browser_would_choose(result: ClosedLoop) -> None:
    figures = json.loads(Page(report_html(result)).data["figure-data"])["figures"]
    axes = [axis for figure in figures for name, axis in figure["layout"].items() if name.startswith("yaxis")]
    quiet = [axis for axis in axes if axis["title"]["text"].startswith("Δ") and axis["title"]["font"]["size"] == 10]
    assert quiet
    for axis in quiet:
        low, high = axis["range"]
        assert 2 <= sum(low <= value <= high for value in axis["tickvals"]) <= 4


def test_a_channel_that_fits_less_well_corrected_is_explained(result: ClosedLoop) -> None:
    name = result.identification[0].name

    def text(after: float) -> str:
        rows = (
            ChannelAgreement(name, "V", "m/s", 0.036, after, 0.015, True),
            ChannelAgreement(name, "theta", "rad", 0.002, 0.001, 0.0001, False),
        )
        agreement = KinematicConsistency((name,), Agreement.CORRECTED, (), (), (), rows, "")
        made = dataclasses.replace(result, kinematics=agreement)
        return " ".join(Page(report_html(made, interactive=False)).text.split())

    assert f"V of {name} fits less well after the correction than as recorded" in text(0.049)
    assert "fits less well" not in text(0.030)


@pytest.mark.parametrize("rest", ["", "A residual of 0.5 deg remains. Check the signs."])
def test_the_first_sentence_of_the_summary_is_the_headline(result: ClosedLoop, rest: str) -> None:
    """The checks that follow are read, not seen from across the room; decimals do not end a sentence."""
    first = "The declared model lacks a sensor delay of alpha (0.1655 ± 0.0090 s)."
    made = dataclasses.replace(result, summary=f"{first} {rest}".strip())
    body = {s.name: text for s, text in compose(made).parts}["decision"]
    headline = re.search(r'<p class="summary">(.*?)</p>', body, re.DOTALL)
    assert headline is not None
    assert headline[1].endswith("s).")
    assert "residual" not in headline[1]
    assert body.count("Check the signs.") == bool(rest)


def test_two_methods_are_compared_by_one_measure_in_sentence_and_table(result: ClosedLoop) -> None:
    """Their errors over the noise, medians each, may stand the other way round than the median of their ratios."""
    rows = (
        CompetingStructure("likelihood", ("C_X alpha^2",), 104.0),
        CompetingStructure("iebmee", ("sensor_bias of V",), 65.0),
    )
    methods = (
        "On the validation flight the open-loop error of the latter is 1.27 times that of the former (median channel)."
    )
    made = dataclasses.replace(result, second_opinion=SecondOpinion(False, methods, "validation", rows, 1.2708))
    body = {s.name: text for s, text in compose(made).parts}["alternatives"]
    cells = re.findall(r'<td class="n">([^<]*)</td></tr>', body.split("</table>")[0])
    assert cells == ["1.00", "1.27"]
    assert "104" not in body
    assert "sensor bias of V" in body


def test_templates_that_were_compiled_before_fill_the_same_page(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """From the template, from what was kept of it, and where the folder that keeps it is damaged."""
    monkeypatch.setenv("AEROSID_CACHE_DIR", str(tmp_path / "cache"))
    folder = tmp_path / "pages"
    folder.mkdir()
    (folder / "page.html").write_text("<p>{{ text }}</p>", encoding="utf-8")

    def filled() -> str:
        page_environment.cache_clear()
        return page_environment(folder).get_template("page.html").render(text="a < b")

    pages = [filled(), filled()]
    (kept,) = (tmp_path / "cache" / "templates").iterdir()
    kept.write_bytes(b"no bytecode")
    pages.append(filled())
    (folder / "page.html").write_text("<p>{{ text }}!</p>", encoding="utf-8")
    pages.append(filled())
    page_environment.cache_clear()
    assert pages == ["<p>a &lt; b</p>"] * 3 + ["<p>a &lt; b!</p>"]


@pytest.mark.parametrize("verdict", list(Verdict))
def test_the_verdict_is_said_once(verdict: Verdict) -> None:
    """Where nothing is named the summary begins with the verdict's own sentence."""
    made = dataclasses.replace(closed_loop(samples=60, verdict=verdict), summary=f"{verdict.value} More.")
    assert Page(report_html(made, interactive=False)).text.count(verdict.value) == 1


@pytest.mark.parametrize(
    ("decided_by", "words"), [("equations", "response of the force"), ("likelihood", "likelihood")]
)
def test_what_value_and_p_value_of_turbulence_refer_to_is_said(decided_by: str, words: str) -> None:
    length = Parameter(120.0, None, "m")
    gust = Effect(1, "gust", "", "", 0.23, 0.02, "m/s", Evidence(None, 1e-9, None, 50.0), parameters={"length": length})
    made = dataclasses.replace(closed_loop(samples=60), effects=(gust,), decided_by=decided_by)
    text = Page(report_html(made, interactive=False)).text
    assert text.count("Its value and ± are of the standard deviation of that wind; its p-value is of ") == 1
    assert words in text.partition("its p-value is of ")[2].partition(" and does not follow")[0]


def test_turbulence_has_one_name() -> None:
    gust = Effect(1, "gust", "", "", 0.232, 0.02, "m/s", Evidence(None, 1e-9, None, 50.0))
    text = Page(report_html(dataclasses.replace(closed_loop(samples=60), effects=(gust,)), interactive=False)).text
    decision = text.partition("Effects missing from the declared model")[2].partition("Error before and after")[0]
    assert "vertical turbulence" in decision
    assert "gust" not in decision


def test_a_simulation_that_leaves_its_range_has_a_dash_for_its_whiteness() -> None:
    made = closed_loop(samples=60)
    fit = tuple(dataclasses.replace(row, r2=None, theil=None, whiteness=None) for row in made.fit)
    assert report_html(dataclasses.replace(made, fit=fit), interactive=False)
