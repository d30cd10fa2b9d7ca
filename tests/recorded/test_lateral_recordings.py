"""Lateral recordings of real aircraft against what others published of them; skipped where absent."""

from pathlib import Path

import pytest
from recordings import recording

from aerosid.aircraft import load_aircraft
from aerosid.logs.flight_log import FlightLog
from aerosid.logs.formats import read_log
from aerosid.loop.closed_loop import close_loop
from aerosid.loop.result import ClosedLoop, Effect
from aerosid.loop.settings import LoopSettings

pytestmark = pytest.mark.slow

BRIEF = LoopSettings(next_flight=False, linear_analysis=False, paper_chain=False)


def read(name: str, channel_map: str = "") -> FlightLog:
    path = Path(recording(f"lateral/{name}"))
    return read_log(path, Path(recording(f"lateral/{channel_map}"))) if channel_map else read_log(path)


def by_name(result: ClosedLoop) -> dict[tuple[str, str], Effect]:
    return {(effect.kind, effect.where): effect for effect in result.effects}


def test_the_twin_otter_has_a_low_yaw_rate_an_accelerometer_below_and_a_late_aileron_and_nothing_else() -> None:
    aircraft = load_aircraft(Path(recording("lateral/twin_otter.aircraft.toml")))
    result = close_loop([read("twin_otter_f1_017.csv")], aircraft, [read("twin_otter_f1_014.csv")], settings=BRIEF)
    found = by_name(result)
    assert set(found) == {("sensor_bias", "r"), ("sensor_position", "a_y"), ("control_delay", "delta_a")}
    assert found["sensor_bias", "r"].value == pytest.approx(-0.0157, abs=0.001)
    # Along x it is less than three standard errors, and not named.
    assert found["sensor_position", "a_y"].along == "z"
    assert found["sensor_position", "a_y"].value == pytest.approx(0.60, abs=0.03)
    assert found["control_delay", "delta_a"].value == pytest.approx(0.018, abs=0.001)
    unseen = {row.channel: row.r2_trimmed for row in result.errors if row.role == "validation"}
    least = {"p": 0.9985, "r": 0.998, "a_y": 0.982, "beta": 0.996, "phi": 0.989}
    assert {name for name, value in least.items() if (unseen[name] or 0.0) < value} == set()


def test_attas_has_gyros_and_attitudes_that_disagree_in_scale_and_gyros_that_are_off_zero() -> None:
    aircraft = load_aircraft(Path(recording("lateral/attas.aircraft.toml")))
    logs = [read(f"attas_{name}1.csv", "attas.channels.toml") for name in ("ail", "rud")]
    found = by_name(close_loop(logs, aircraft, settings=BRIEF))
    assert found["sensor_bias", "p"].value == pytest.approx(0.0011, abs=0.0002)
    assert found["sensor_bias", "r"].value == pytest.approx(0.0010, abs=0.0002)
    assert found["sensor_scale", "p"].value == pytest.approx(1.0 / 0.973, abs=0.004)
    assert -0.065 < found["control_delay", "delta_r"].value < -0.025


def test_the_citation_has_its_lateral_accelerometer_in_the_nose_and_side_force_against_sideslip() -> None:
    """No sideslip is recorded: of one window alone C_Y beta and the place are known together."""
    aircraft = load_aircraft(Path(recording("lateral/citation.aircraft.toml")))
    windows = ("dutch_roll", "dutch_roll_damped", "rolls")
    logs = [read(f"citation_ref_{name}.csv", "citation.channels.toml") for name in windows]
    result = close_loop(logs, aircraft, settings=BRIEF)
    assert 4.1 < by_name(result)["sensor_position", "a_y"].parameters["x"].value < 4.7
    (side,) = [row for row in result.derivatives if (row.coefficient, row.term) == ("C_Y", "beta")]
    assert side.value < -3.0 * (side.std_error or 1.0)


def unseen(result: ClosedLoop) -> dict[str, tuple[float, float]]:
    """R^2 before and after of the coefficients of the only validation flight."""
    (log,) = (log.name for log in result.validation)
    return {row.coefficient: (row.r2_before, row.r2_after) for row in result.coefficients if row.log == log}


def test_what_one_control_does_not_show_is_not_spoilt_for_the_other() -> None:
    """Output error made C_l delta_r of the aileron .075 +- .006, published .02, and R^2 of the rudder's C_l -.4."""
    aircraft = load_aircraft(Path(recording("lateral/attas.aircraft.toml")))
    aileron, rudder = (read(f"attas_{name}1.csv", "attas.channels.toml") for name in ("ail", "rud"))
    shares = unseen(close_loop([aileron], aircraft, [rudder], settings=BRIEF))
    assert all(after > before - 0.005 for before, after in shares.values())
    assert all(after > 0.95 for _, after in shares.values())
    # The rudder's flight alone gives C_n p_hat .35 +- .23: C_n of the aileron's was -3.2 with it, declared .96.
    shares = unseen(close_loop([rudder], aircraft, [aileron], settings=BRIEF))
    assert shares["C_n"][0] < 0.0
    assert shares["C_n"][1] > 0.9
    assert shares["C_Y"][0] < 0.5
    assert shares["C_Y"][1] > 0.9
    assert shares["C_l"][1] > 0.9


def test_a_declared_value_that_the_other_flight_contradicts_is_not_kept() -> None:
    """C_n p_hat of two Dutch rolls is -.13 +- .06, declared -.06: with that C_n of the rolls was .63."""
    aircraft = load_aircraft(Path(recording("lateral/citation.aircraft.toml")))
    windows = ("dutch_roll", "dutch_roll_damped", "rolls")
    logs = [read(f"citation_ref_{name}.csv", "citation.channels.toml") for name in windows]
    result = close_loop(logs[:2], aircraft, logs[2:], settings=BRIEF)
    assert all(after > before for before, after in unseen(result).values())
    assert unseen(result)["C_n"][1] > 0.85
    (roll,) = [row for row in result.derivatives if (row.coefficient, row.term) == ("C_n", "p_hat")]
    assert roll.by_validation
    assert roll.estimate is None


def test_a_step_that_spoils_the_other_flight_is_refuted_though_that_flight_has_one_too() -> None:
    """A step of C_n of -.0008 left R^2 of C_n of the rolls at .86 in place of .94, since the rolls hold one as well."""
    aircraft = load_aircraft(Path(recording("lateral/citation.aircraft.toml")))
    logs = [read(f"citation_ref_{name}.csv", "citation.channels.toml") for name in ("dutch_roll", "rolls")]
    result = close_loop(logs[:1], aircraft, logs[1:], settings=BRIEF)
    assert ("step_change", "C_n") not in by_name(result)
    assert all(after > before - 0.01 for before, after in unseen(result).values())
