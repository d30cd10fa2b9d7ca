"""The completed model is one model: what is not shown stays declared in it, in the file and in the errors after."""

from __future__ import annotations

import tomllib
from dataclasses import replace

import numpy as np
import pytest
from problems import BOTH_SQUARES, LIGHT, Problem, declaring

from aerosid.aircraft.declared_model import declared_model
from aerosid.errors import UsageError
from aerosid.estimation.manoeuvre import prepare
from aerosid.estimation.open_loop import respond
from aerosid.loop.closed_loop import close_loop
from aerosid.loop.derivative_table import is_shown
from aerosid.loop.model_validation.error_reduction import error_reduction
from aerosid.loop.report_date import EPOCH
from aerosid.loop.result import ClosedLoop
from aerosid.loop.settings import LoopSettings
from aerosid.loop.verdict import Verdict
from aerosid.reporting.export import FORMATS, ExportOptions, export
from aerosid.reporting.export.options import NOT_SHOWN

QUICK = LoopSettings(catalogue="terms", paper_chain=False, linear_analysis=False, next_flight=False)
FLIGHT = Problem(undeclared=BOTH_SQUARES, duration=6.0)
WEAK = declaring(LIGHT, {("C_Z", "V_hat^2"): 0.3, ("C_m", "1"): 0.05})
"""The airspeed hardly varies in a doublet: its square cannot be estimated."""


@pytest.fixture(scope="module")
def closed() -> ClosedLoop:
    elsewhere = Problem(undeclared=BOTH_SQUARES, duration=6.0, elevator="3211", amplitude=0.045)
    with pytest.MonkeyPatch.context() as patched:
        patched.setenv(EPOCH, "86400")
        return close_loop(
            [FLIGHT.fly(1, "doublet")],
            WEAK,
            [elsewhere.fly(2, "3211")],
            replace(QUICK, priors=False, seed=7),
            hold_out=[elsewhere.fly(3, "held")],
        )


def test_what_is_not_shown_keeps_its_declared_value_and_says_so(closed: ClosedLoop) -> None:
    rows = {(row.coefficient, row.term): row for row in closed.derivatives}
    hidden = rows["C_Z", "V_hat^2"]
    assert (hidden.shown, hidden.value, hidden.declared) == (False, 0.3, 0.3)
    assert hidden.std_error is not None
    assert hidden.estimate is not None
    assert hidden.std_error > max(abs(hidden.estimate), 0.3) / 3.0
    file = {(d.coefficient, str(d.term)): d for d in closed.completed_aircraft.derivatives}
    assert file["C_Z", "V_hat^2"].value == 0.3
    assert {key for key, entry in file.items() if not entry.shown} == {k for k, row in rows.items() if not row.shown}
    for key, row in rows.items():
        assert file[key].value == pytest.approx(row.value, rel=1e-10)
    assert any("keeps the declared value 0.3" in note for note in closed.notes)


def test_a_constant_that_is_not_shown_keeps_its_declared_value_too() -> None:
    """Flown without a constant of C_m, declared with one far below what its standard error lets be seen."""
    balanced = declaring(LIGHT, {("C_m", "1"): 0.0})
    given = declaring(LIGHT, {("C_m", "1"): 1e-5})
    closed = close_loop([replace(FLIGHT, aircraft=balanced).fly(5, "balanced")], given, settings=QUICK)
    row = next(row for row in closed.derivatives if (row.coefficient, row.term) == ("C_m", "1"))
    assert row.estimate is not None
    assert row.std_error is not None
    assert abs(row.estimate - 1e-5) < 3.0 * row.std_error
    assert (row.shown, row.value) == (False, 1e-5)
    entry = next(d for d in closed.completed_aircraft.derivatives if (d.coefficient, str(d.term)) == ("C_m", "1"))
    assert (entry.value, entry.shown) == (1e-5, False)
    assert any(
        "Not significant in these records: the constant of C_m" in note and "declared value 1·10⁻⁵" in note
        for note in closed.notes
    )
    for form in FORMATS:
        text = export(closed.completed_aircraft, form, ExportOptions()).text
        assert NOT_SHOWN in text or '"shown": false' in text, form


@pytest.mark.parametrize(
    ("value", "declared", "error", "constant", "shown"),
    [
        (-0.037, 0.029, 0.023, True, True),
        (-0.037, 0.029, 0.038, True, False),
        (-0.037, 0.029, 0.023, False, False),  # a derivative is asked for three standard errors
        (0.0, 0.0, 0.001, True, False),
        (0.0, 0.05, 0.01, True, True),
    ],
)
def test_a_constant_is_shown_where_its_standard_error_is_below_its_size(
    value: float, declared: float, error: float, constant: bool, shown: bool
) -> None:
    assert is_shown(value, declared, error, constant=constant) is shown


def test_the_errors_after_are_those_of_the_file(closed: ClosedLoop) -> None:
    """The file read again by the code that reads any aircraft, and simulated on the log that nothing was fitted to."""
    written = closed.completed_aircraft
    model = declared_model(written, 100.0, ())
    manoeuvre = prepare(closed.hold_out[0], written, model.columns)
    wanted = {row.channel: row.after for row in closed.errors if row.role == "hold_out"}
    found = respond(model, manoeuvre, np.where(np.isfinite(manoeuvre.noise), manoeuvre.noise, 1.0) ** 2).rms
    assert set(found) == set(wanted)
    for channel, error in found.items():
        assert error == pytest.approx(wanted[channel], rel=0.02), channel


def test_what_is_named_stands_by_its_own_number(closed: ClosedLoop) -> None:
    assert {(effect.where, effect.term) for effect in closed.effects} == set(BOTH_SQUARES)
    rows = {(row.coefficient, row.term): row for row in closed.derivatives}
    for effect in closed.effects:
        assert abs(effect.value) >= 3.0 * effect.std_error
        row = rows[effect.where, effect.term]
        assert (row.shown, row.value, row.std_error) == (True, effect.value, effect.std_error)


def test_each_effect_has_its_own_gain_and_the_headline_is_one_ratio(closed: ClosedLoop) -> None:
    gains = [effect.evidence.validation_gain for effect in closed.effects]
    held = [effect.evidence.hold_out_gain for effect in closed.effects]
    assert len(set(gains)) == len(gains) == 2
    assert min(gains) > 1.2
    assert min(held) > 1.2
    reduction = error_reduction(closed.errors)
    assert reduction is not None
    assert reduction.role == "hold_out"
    rows = [row for row in closed.errors if row.role == "hold_out"]
    assert reduction.median == pytest.approx(np.median([row.before / row.after for row in rows]))
    assert f"{reduction.median:.2f} in the median channel" in closed.summary
    assert "times the noise" not in closed.summary


def test_the_file_says_what_made_it(closed: ClosedLoop) -> None:
    record = closed.completed_aircraft.completion
    assert record is not None
    assert record.date == closed.provenance.date == "1970-01-02"
    assert [log.role for log in record.logs] == ["identification", "validation", "hold_out"]
    assert record.settings["seed"] == "7"
    assert "priors" not in record.settings
    assert record.not_shown == tuple(f"{r.coefficient} {r.term}" for r in closed.derivatives if not r.shown)
    document = tomllib.loads(closed.completed_aircraft.text)
    assert document["completed"]["logs"][0]["to"] == pytest.approx(closed.identification[0].time[-1])


def test_a_log_that_is_fitted_is_not_predicted() -> None:
    log = FLIGHT.fly(1, "doublet")
    for roles in ({"validation": [log]}, {"hold_out": [log]}):
        with pytest.raises(UsageError, match="doublet"):
            close_loop([log], LIGHT, settings=QUICK, **roles)


@pytest.mark.parametrize(("duration", "settings"), [(0.6, QUICK), (1.0, QUICK), (0.6, replace(QUICK, catalogue="all"))])
def test_half_a_second_teaches_nothing_and_changes_nothing(duration: float, settings: LoopSettings) -> None:
    """The elevator rests: whatever an estimate would say, the completed aircraft holds what was declared."""
    still = Problem(elevator="none", duration=duration)
    closed = close_loop([still.fly(4, "still")], LIGHT, settings=settings)
    assert closed.verdict is Verdict.NOT_EXCITED
    given = {(d.coefficient, d.term): d.value for d in LIGHT.derivatives}
    assert {(d.coefficient, d.term): d.value for d in closed.completed_aircraft.derivatives} == given
    assert not any(d.shown for d in closed.completed_aircraft.derivatives)
    assert [row.value for row in closed.derivatives] == list(given.values())
    for row in closed.errors:
        assert row.after == pytest.approx(row.declared, rel=0.05)
