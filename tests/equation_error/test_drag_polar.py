"""A drag polar as a term: regressed on the model's lift, found as a candidate, and simulated."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from equations_decided import decided
from numpy.testing import assert_allclose
from problems import BODY_POLAR, LIFT_AND_DRAG, LIGHT, POLAR, POLAR_EXPANDED, SILENT, Problem, declaring, entry

from aerosid.aircraft import Aircraft
from aerosid.aircraft.reading import aircraft_from_text
from aerosid.errors import AircraftError
from aerosid.loop.closed_loop import close_loop
from aerosid.loop.settings import LoopSettings

QUIET = {"V": 0.05, "alpha": 5e-4, "q": 5e-4, "theta": 5e-4, "a_x": 0.01, "a_z": 0.02, "h": 0.2, "delta_e": 1e-5}
SHAKEN = {"elevator": "3211", "amplitude": 0.09, "duration": 16.0, "noise": QUIET}


def perturbed(aircraft: Aircraft, share: float) -> Aircraft:
    """The aircraft with every derivative that is no constant in error by a fraction, alternating in sign."""
    rows = {
        (d.coefficient, str(d.term)): d.value * (1.0 + share * (-1) ** n)
        for n, d in enumerate(aircraft.derivatives)
        if d.term.factors
    }
    return declaring(aircraft, rows)


@pytest.mark.parametrize(
    ("aircraft", "polar"), [(POLAR, ("C_D", "C_L^2")), (BODY_POLAR, ("C_X", "C_Z^2"))], ids=["C_L", "C_Z"]
)
def test_a_declared_polar_is_estimated_from_values_a_third_off(aircraft: Aircraft, polar: tuple[str, str]) -> None:
    logs = [Problem(aircraft, **SHAKEN).fly(seed, f"flight {seed}") for seed in (1, 2)]
    found = decided(perturbed(aircraft, 0.33), logs[:1], logs[1:])
    assert polar[0] not in {row.hypothesis.where for row in found.findings}
    place = found.completed.design.unknowns.index(("term", entry(*polar)))
    value, error = found.completed.solution.values[place], np.sqrt(found.covariance[place, place])
    true = next(d.value for d in aircraft.derivatives if (d.coefficient, str(d.term)) == polar)
    assert abs(value - true) < 4.0 * error
    assert error < 0.1 * abs(true)


def test_a_candidate_polar_is_selected_instead_of_powers_of_alpha() -> None:
    logs = [Problem(POLAR, **SHAKEN).fly(seed, f"flight {seed}") for seed in (3, 4)]
    hypotheses = replace(LIFT_AND_DRAG, candidates={"C_D": (entry("C_D", "C_L^2")[1],)})
    found = decided(hypotheses, logs[:1], logs[1:])
    (first,) = found.findings
    # A hundredth of its column is independent where alpha moves so little: it is selected for its gain.
    assert first.hypothesis.label == ("aero_term", "C_D", "C_L^2")
    assert abs(first.value - 0.05) < 4.0 * first.std_error
    assert found.completed.gain_over(found.before) > 20.0


def test_a_declared_polar_passes_the_whole_loop() -> None:
    logs = [Problem(POLAR, **SHAKEN).fly(seed, f"flight {seed}") for seed in (5, 6)]
    result = close_loop(logs[:1], perturbed(POLAR, 0.1), validation=logs[1:], settings=LoopSettings(next_flight=False))
    row = next(r for r in result.derivatives if (r.coefficient, r.term) == ("C_D", "C_L^2"))
    assert row.std_error is not None
    assert abs(row.value - 0.05) < 4.0 * row.std_error
    assert result.effects == ()
    completed = result.completed_aircraft
    again = aircraft_from_text(completed.text, completed.path, completed.sha256)
    written = {(d.coefficient, str(d.term)): d.value for d in again.derivatives}
    assert written["C_D", "C_L^2"] == pytest.approx(row.value, rel=1e-4)


def test_a_polar_flight_equals_that_with_the_expanded_drag() -> None:
    """Both simulated by the package, which is compared with an independent integration elsewhere; the terms differ."""
    polar, expanded = (Problem(aircraft, duration=6.0, noise=SILENT).fly() for aircraft in (POLAR, POLAR_EXPANDED))
    for name in ("V", "alpha", "q", "theta", "a_x", "a_z"):
        assert_allclose(polar[name], expanded[name], rtol=1e-10, atol=1e-12)


BODY = '[derivatives.C_X]\n"{}" = {{ value = 1.0 }}\n[derivatives.C_Z]\n"{}" = {{ value = 1.0 }}\n[derivatives.C_m]\n'
WIND = '[derivatives.C_D]\n"{}" = {{ value = 1.0 }}\n[derivatives.C_L]\n"{}" = {{ value = 1.0 }}\n[derivatives.C_m]\n'


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (BODY.format("C_L^2", "alpha"), "does not have"),
        (WIND.format("1", "C_L*alpha"), "other coefficients"),
        (BODY.format("1", "C_Z^2"), "other coefficients"),
        (WIND.format("1", "alpha") + '[candidates]\nC_D = ["C_Z^2"]', "does not have"),
    ],
)
def test_a_missing_or_recursive_lift_is_rejected_with_a_message(text: str, message: str) -> None:
    head = "\n".join(
        [
            'schema = 1\naircraft = { name = "x" }',
            f"reference = {{ wing_area = {LIGHT.wing_area}, mean_chord = {LIGHT.mean_chord} }}",
            "mass = { mass = 2000.0, I_yy = 5000.0 }",
        ]
    )
    with pytest.raises(AircraftError, match=message) as caught:
        aircraft_from_text(f"{head}\n{text}\n", "x.toml", "0" * 64)
    assert "x.toml" in str(caught.value)
