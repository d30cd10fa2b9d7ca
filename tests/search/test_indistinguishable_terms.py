"""Terms that one coefficient cannot distinguish from a vane lag are listed, against equation error."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from problems import LIGHT, NOISE, Problem, with_channels
from scipy.signal import lsim

from aerosid.estimation.fit_settings import WRONG_STRUCTURE
from aerosid.estimation.maximum_likelihood import refine
from aerosid.logs.flight_log import FlightLog
from aerosid.search.attribution import Attribution, attribute_by_search
from aerosid.search.hypotheses import effect_hypotheses, term_hypotheses
from aerosid.search.indistinguishable_terms import (
    IndistinguishableTerm,
    indistinguishable_terms,
    note_on_indistinguishable_terms,
    with_indistinguishable_terms,
)
from aerosid.search.settings import AttributionSettings
from aerosid.search.structure_search import StructureSearch

USUAL = AttributionSettings()

LAG = 0.25

QUIET = Problem(duration=14.1, elevator="3211", amplitude=0.045, noise={c: 0.1 * s for c, s in NOISE.items()})


def findings_and_terms(problem: Problem, log: FlightLog) -> tuple[Attribution, list[IndistinguishableTerm]]:
    """The findings among terms and sensor errors, and the terms indistinguishable from them in one coefficient."""
    model, manoeuvre = problem.prepared(log)
    before = refine(model, [manoeuvre], model.entries, settings=WRONG_STRUCTURE)
    effects = effect_hypotheses(model, [manoeuvre])
    hypotheses = (*term_hypotheses(problem.candidates(log)), *(h for h in effects if h.kind.startswith("sensor")))
    search = StructureSearch((manoeuvre,), hypotheses, (), before, replace(USUAL, disturbances=False))
    found = attribute_by_search(search, [])
    return found, indistinguishable_terms(found, [manoeuvre], hypotheses, USUAL.coefficient_rivals)


def unexplained(log: FlightLog, alpha: NDArray[np.float64], *further: NDArray[np.float64]) -> float:
    """Residual sum of squares of equation error for C_m, by independent code."""
    assert LIGHT.density is not None
    pressure = 0.5 * LIGHT.density * log["V"] ** 2
    moment = LIGHT.I_yy * np.gradient(log["q"], log.time) / (pressure * LIGHT.wing_area * LIGHT.mean_chord)
    # The difference over two intervals is the mean of the moment between: what it is fitted to is averaged alike.
    columns = [alpha, log["q"] / log["V"], log["delta_e"], *further]
    averaged = [np.convolve(x, [0.25, 0.5, 0.25], "same") for x in columns]
    matrix = np.column_stack([np.ones(log.time.size), *averaged])[20:-20]
    matrix /= np.abs(matrix).max(axis=0)
    rest = moment[20:-20] - matrix @ np.linalg.lstsq(matrix, moment[20:-20], rcond=None)[0]
    return float(rest @ rest)


def test_alphadot_is_reported_as_indistinguishable_from_a_vane_lag_in_one_coefficient() -> None:
    log = QUIET.fly()
    true = log["alpha"]
    _, late, _ = lsim(([1.0 / LAG], [1.0, 1.0 / LAG]), true - true[0], log.time)
    log = with_channels(log, alpha=true[0] + late)
    found, indistinguishable = findings_and_terms(QUIET, log)
    assert [(f.kind, f.where) for f in found.findings] == [("sensor_lag", "alpha")]
    (moment,) = [term for term in indistinguishable if term.coefficient == "C_m"]
    assert (moment.finding.where, moment.finding.term) == ("C_m", "alpha_dot_hat")
    assert moment.finding.instead_of == "sensor_lag of alpha"
    # Its variance fraction is that of equation error, and all channels together reject it.
    plain = unexplained(log, log["alpha"])
    smooth = np.gradient(np.convolve(log["alpha"], np.ones(7) / 7.0, "same"), log.time)
    explained = plain - unexplained(log, true)
    assert moment.fraction == pytest.approx((plain - unexplained(log, log["alpha"], smooth)) / explained, abs=0.05)
    assert moment.finding.gain < -100.0
    listed = with_indistinguishable_terms(found, indistinguishable, np.inf).alternatives
    assert ("C_m", "alpha_dot_hat") in {(other.where, other.term) for other in listed}
    assert (
        with_indistinguishable_terms(
            with_indistinguishable_terms(found, indistinguishable, np.inf), indistinguishable, np.inf
        ).alternatives
        == listed
    )
    # A term that all channels together distinguish from the effect is a warning about one coefficient, no alternative.
    worse = max(-term.finding.gain for term in indistinguishable)
    assert with_indistinguishable_terms(found, indistinguishable, worse + 1.0).alternatives[-1].worse_by <= worse
    assert len(with_indistinguishable_terms(found, indistinguishable, worse - 1.0).alternatives) < len(listed)
    (sentence,) = [note for note in note_on_indistinguishable_terms(indistinguishable) if note.startswith("C_m alone")]
    assert "sensor_lag of alpha" in sentence
    assert "favour the effect" in sentence


def test_no_term_is_reported_for_a_term_or_for_an_error_that_no_term_imitates() -> None:
    squares = Problem(undeclared={("C_m", "alpha^2"): -1.7})
    found, indistinguishable = findings_and_terms(squares, squares.fly())
    assert [(f.where, f.term) for f in found.findings] == [("C_m", "alpha^2")]
    assert not indistinguishable
    log = QUIET.fly()
    found, indistinguishable = findings_and_terms(QUIET, with_channels(log, theta=log["theta"] + 0.02))
    assert [f.kind for f in found.findings] == ["sensor_bias"]
    assert not indistinguishable
