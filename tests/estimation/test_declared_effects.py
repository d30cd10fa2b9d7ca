"""Effects of an aircraft file: declared and held parameters; a wrong one is refused with a sentence."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from problems import LIGHT, Problem, declaring, with_channels
from scipy.signal import lsim

from aerosid.aircraft import Aircraft
from aerosid.aircraft.reading import aircraft_from_text
from aerosid.errors import AircraftError
from aerosid.estimation.declared_effects import declared_effects
from aerosid.loop.closed_loop import close_loop
from aerosid.loop.verdict import Verdict

Array = NDArray[np.float64]
PROBLEM = Problem(duration=8.0, elevator="3211")


def effects_file(*tables: str) -> Aircraft:
    text = declaring(LIGHT, {}).text + "".join(f"[[effects]]\n{table}\n" for table in tables)
    return aircraft_from_text(text, "light.toml", "0" * 64)


def lag(time: Array, values: Array, constant: float) -> Array:
    system = ([[-1.0 / constant]], [[1.0 / constant]], [[1.0]], [[0.0]])
    return np.asarray(lsim(system, values, time, X0=[values[0]], interp=True)[1])


def test_declared_effects_are_neither_findings_nor_estimated() -> None:
    """A vane delay and a pitch angle bias, both declared: the same as a flight without them."""
    log = PROBLEM.fly(3)
    alpha = lag(PROBLEM.time, log["alpha"], 0.12)
    log = with_channels(log, alpha=alpha + 0.0015 * np.random.default_rng(0).standard_normal(alpha.size))
    log = with_channels(log, theta=log["theta"] + 0.03)
    aircraft = effects_file(
        'kind = "sensor_lag"\nwhere = "alpha"\nvalue = 0.12',
        'kind = "sensor_bias"\nwhere = "theta"\nvalue = 0.03',
    )
    result = close_loop([log], aircraft)
    assert result.verdict is Verdict.NOTHING_MISSING
    assert not result.effects
    assert [effect.value for effect in result.completed_aircraft.effects] == [0.12, 0.03]
    for row in result.errors:
        assert row.declared is not None
        assert row.declared < 1.3 * row.noise


def test_values_are_held_and_step_changes_act_on_their_log() -> None:
    _, first = PROBLEM.prepared(PROBLEM.fly(1, "first"))
    _, second = PROBLEM.prepared(PROBLEM.fly(2, "second"))
    aircraft = effects_file(
        'kind = "control_lag"\nwhere = "delta_e"\nvalue = 0.2',
        'kind = "gust"\nvalue = 0.7\nparameters = { sigma = { value = 0.8 }, length = { value = 200.0 } }',
        'kind = "step_change"\nwhere = "C_m"\nvalue = 0.01\ntime = 4.0\nlog = "second"',
        'kind = "step_change"\nwhere = "C_Z"\nvalue = 0.02\ntime = 5.0',
    )
    found = declared_effects(aircraft, ["delta_e"], [first, second])
    assert [(active.name, active.held, active.log) for active in found] == [
        (("control_lag", "delta_e"), (0.2,), ""),
        (("gust", ""), (0.8, 200.0), ""),
        (("step_change", "C_m"), (0.01, 4.0), "second"),
        (("step_change", "C_Z"), (0.02, 5.0), "first"),
        (("step_change", "C_Z"), (0.02, 5.0), "second"),
    ]
    assert all(active.slopes == 0 and active.values == () for active in found)


@pytest.mark.parametrize(
    ("table", "said"),
    [
        ('kind = "step_change"\nwhere = "C_m"\nvalue = 0.01', [r"effects[1] (step_change) lacks time", "time = ..."]),
        ('kind = "sensor_bias"\nwhere = "beta"\nvalue = 0.01', ["effects[1] (sensor_bias)", "beta", "alpha"]),
        (
            'kind = "sensor_position"\nwhere = "acelerometers"\nparameters = { x = { value = 1.0 } }',
            ["effects[1] (sensor_position)", "acelerometers, which is no sensor", "accelerometers for all"],
        ),
        ('kind = "control_lag"\nwhere = "delta_h"\nvalue = 0.1', ["delta_h, which no declared term uses", "delta_e"]),
        ('kind = "gust"\nvalue = 1.0', ["effects[1] (gust) lacks length"]),
        ('kind = "control_delay"\nwhere = "delta_e"\nvalue = 1e9', ["delay = 1e+09 s, expected from 0 to", "its unit"]),
        (
            'kind = "flow_separation"\nwhere = "C_Z"\nparameters = { alpha_star = { value = 0.2 } }',
            ["lacks sharpness, delay, relaxation", "sharpness = { value = ... }"],
        ),
    ],
)
def test_an_effect_that_cannot_act_is_refused_with_a_sentence(table: str, said: list[str]) -> None:
    _, manoeuvre = PROBLEM.prepared(PROBLEM.fly(1))
    with pytest.raises(AircraftError) as error:
        declared_effects(effects_file(table), ["delta_e"], [manoeuvre])
    for part in ("light.toml", *said):
        assert part in str(error.value)
