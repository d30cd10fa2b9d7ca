"""The compiled coefficient equations against an implementation by whole series in numpy."""

from dataclasses import replace
from functools import cache

import lateral_flights as commuter
import numpy as np
import pytest
from equations_decided import questioned
from oracles.coefficient_equations import CoefficientEquations as BySeries

from aerosid.effects import ActiveEffect
from aerosid.effects.cg_shift import cg_shift
from aerosid.effects.control import control_lag
from aerosid.effects.flow_separation import flow_separation
from aerosid.effects.inertia import inertia
from aerosid.effects.kinds import Effect
from aerosid.effects.sensor import sensor_bias, sensor_delay, sensor_scale
from aerosid.effects.sensor_position import sensor_place
from aerosid.effects.step_change import step_change
from aerosid.equation_error.equations.coefficient import CoefficientEquations
from aerosid.equation_error.equations.kinematic import reconstruct
from aerosid.equation_error.equations.recording import Recording
from aerosid.equation_error.equations.regular_recordings import read_recordings
from aerosid.equation_error.settings import EquationErrorSettings
from aerosid.estimation.effect_columns import with_columns_of
from aerosid.flight_model.aerodynamics import AerodynamicModel
from aerosid.flight_model.terms import parse_term

SETTINGS = EquationErrorSettings()
PLACES = {"alpha": (3.0, 0.5, 0.2), "a_x": (0.4, -0.1, 0.3), "a_y": (-1.0, 0.3, 0.6), "a_z": (0.5, 0.2, -0.4)}
BODY_AXES = {**commuter.PITCH, **commuter.SIDE}
WIND_AXES = {("C_D" if c == "C_X" else "C_L" if c == "C_Z" else c, term): v for (c, term), v in BODY_AXES.items()}
TERMS = {"lateral": commuter.SIDE, "body axes": BODY_AXES, "wind axes": WIND_AXES}
FURTHER = {
    "C_X": ("C_T", "mach", "pos(alpha - 0.05)^2", "C_Z^2"),
    "C_D": ("thrust", "V_hat", "abs(delta_e)", "C_L^2"),
    "C_Y": ("beta*alpha", "p_hat"),
    "C_l": ("abs(beta)*delta_a", "phi"),
    "C_m": ("alpha_dot_hat", "alpha*delta_e", "C_T"),
    "C_n": ("delta_r^2", "alpha*r_hat"),
}
LEVERS: tuple[tuple[Effect, tuple[float, ...]], ...] = (
    (cg_shift("x"), (0.1,)),
    (cg_shift("y"), (-0.05,)),
    (cg_shift("z"), (0.2,)),
    (sensor_place("a_z", "xy"), (0.7, 0.2)),
)
OTHERS: tuple[tuple[Effect, tuple[float, ...]], ...] = (
    (control_lag("delta_e"), (0.05,)),
    (step_change("C_m", 5.0, 0.02), (0.01, 5.0)),
    (sensor_delay("q"), (0.03,)),
    (sensor_scale("a_z"), (1.1,)),
    (sensor_bias("a_x", "m/s^2", 0.01), (0.3,)),
)


@cache
def recording_of(axes: str) -> tuple[AerodynamicModel, Recording]:
    aircraft = commuter.aircraft(TERMS[axes])
    log = commuter.Lateral(noise=1.0, positions=PLACES, interval=0.04, duration=10.0).log()
    model, manoeuvre = questioned(aircraft, replace(log, positions=PLACES))
    touched = {coefficient for coefficient, _ in TERMS[axes]}
    names = [(c, parse_term(text)) for c, texts in FURTHER.items() for text in texts if c in touched]
    extended = model.extended(names)
    values = np.where(extended.values == 0.0, 0.1, extended.values)
    (recording,) = read_recordings([manoeuvre], [], SETTINGS)
    return extended.with_values(values), recording


@pytest.mark.parametrize("linear", [False, True], ids=["smooth", "linear"])
@pytest.mark.parametrize("acting", ["nothing", "levers", "all"])
@pytest.mark.parametrize("axes", ["lateral", "body axes", "wind axes"])
def test_compiled_equations_match_the_numpy_oracle(axes: str, acting: str, linear: bool) -> None:
    model, recording = recording_of(axes)
    recording = replace(recording, linear_inputs=linear)
    chosen = {"nothing": (), "levers": LEVERS, "all": (*LEVERS, *OTHERS)}[acting]
    effects = [ActiveEffect(effect, numbers) for effect, numbers in chosen]
    if acting == "all" and axes != "lateral":
        lift = "C_L" if axes == "wind axes" else "C_Z"
        effects.append(ActiveEffect(flow_separation(0.1, lift, ("C_m",)), (0.08, 30.0, 0.2, 0.1, 0.05)))
        effects.append(ActiveEffect(inertia("I_xz", 1000.0), (300.0,)))
    if axes == "lateral":
        effects = [active for active in effects if active.effect.where in ("x", "z", "C_l", "p", "a_y")]
    model = with_columns_of(model, effects)
    motion = reconstruct(recording, effects, recording.channels, SETTINGS)
    free = [entry for n, entry in enumerate(model.entries) if n % 2 and not entry[0].startswith("step")]
    values = {entry: 1.0 + 0.1 * n for n, entry in enumerate(free)}
    found = CoefficientEquations(recording, model, effects, motion, free)
    with_values = CoefficientEquations(recording, model, effects, motion, free, values)
    expected = BySeries(recording, model, effects, motion, free)
    touching, columns = found.columns(free)
    left, place = expected.left(values), 0
    for name in found.names:
        entries, series = expected.columns(name, free)
        assert touching[name] == entries
        both = np.column_stack([expected.target(name), series])
        near = 1e-11 * np.abs(both).max()
        np.testing.assert_allclose(columns[:, place : place + both.shape[1]], both, rtol=1e-10, atol=near)
        np.testing.assert_allclose(with_values.target(name), left[name], rtol=1e-10, atol=near)
        place += both.shape[1]
    assert place == columns.shape[1]
