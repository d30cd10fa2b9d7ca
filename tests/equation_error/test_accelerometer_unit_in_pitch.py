"""Accelerometers in one unit off its declared place in pitch: one parameter of a_x and a_z."""

from dataclasses import replace
from pathlib import Path

import pytest
from equations_decided import decided, identified

from aerosid.aircraft import Aircraft, load_aircraft
from aerosid.effects.family import at_null
from aerosid.effects.hypothesis import Hypothesis
from aerosid.effects.kinds import UNIT
from aerosid.effects.sensor_position import sensor_place
from aerosid.equation_error.decision import EquationErrorDecision
from aerosid.equation_error.equations.sensors import position
from aerosid.equation_error.selection.accelerometer_unit import in_one_unit
from aerosid.equation_error.selection.redundancy import share_a_distance
from aerosid.logs.flight_log import FlightLog
from aerosid.logs.formats import read_log
from benchmarks.displaced_accelerometers import written

TOGETHER, ALONE, VANE = (("sensor_position", where, "") for where in (UNIT, "a_z", "alpha"))


def flown(folder: Path, number: int) -> tuple[Aircraft, list[FlightLog]]:
    """A pair of the seed on which the rules were tuned."""
    written(folder, "gusts", 8600, number)
    logs = [read_log(folder / f"{role}.csv") for role in ("identification", "validation")]
    return load_aircraft(folder / "aircraft.toml"), logs


def values(found: EquationErrorDecision) -> dict[tuple[str, str, str], tuple[float, float]]:
    """Value and standard error of each finding."""
    return {row.hypothesis.label: (row.value, row.std_error) for row in found.findings}


def test_what_it_adds_to_the_axial_force_is_no_term_of_the_pitch_rate(tmp_path: Path) -> None:
    """C_X q_hat^2 was 266 +- 20 beside the position of a_z; its height stays that of a_x."""
    aircraft, (fitted, unseen) = flown(tmp_path, 9)
    found = decided(aircraft, [fitted], [unseen])
    named = values(found)
    assert set(named) == {TOGETHER, ("sensor_position", "a_x", "")}
    value, error = named[TOGETHER]
    assert value == pytest.approx(-1.05, abs=3.0 * error)
    (row,) = [row for row in found.alternatives if row.hypothesis.label == ALONE]
    assert row.replaces.label == TOGETHER
    assert 0.0 <= row.deficit < row.margin


@pytest.mark.slow
def test_it_takes_the_place_of_a_vane_that_kinematics_cannot_tell_from_it(tmp_path: Path) -> None:
    """With the vane 1.4 m ahead C_X was given q_hat^2, and derivatives were up to eight standard errors off."""
    aircraft, (fitted, unseen) = flown(tmp_path, 10)
    errors = identified(aircraft, [fitted], [unseen])
    assert errors.selected.labels == (VANE,)
    named = values(decided(aircraft, [fitted], [unseen]))
    assert set(named) == {TOGETHER, ("sensor_position", "a_x", ""), ("cg_shift", "x", "")}
    value, error = named[TOGETHER]
    assert value == pytest.approx(-1.33, abs=3.0 * error)


def test_an_axial_force_that_contradicts_it_leaves_the_vertical_accelerometer_displaced_alone(tmp_path: Path) -> None:
    aircraft, (fitted, unseen) = flown(tmp_path, 2)
    named = values(decided(aircraft, [fitted], [unseen]))
    assert set(named) == {ALONE, ("control_lag", "delta_e", "")}
    value, error = named[ALONE]
    assert value == pytest.approx(4.72, abs=3.0 * error)


def test_accelerometers_that_are_declared_apart_are_no_unit(tmp_path: Path) -> None:
    aircraft, logs = flown(tmp_path, 9)
    errors = identified(aircraft, logs[:1], logs[1:])
    unit = in_one_unit(errors.selected, errors.hypotheses)
    assert unit is not None
    found = unit.identified.estimate
    (recording, _) = found.problem.recordings
    ahead = [position(recording, found.point.effects, channel)[0] for channel in ("a_x", "a_z")]
    assert ahead[0] == ahead[1] == pytest.approx(-1.05, abs=0.4)
    apart = [replace(log, positions={"a_x": (0.4, 0.0, 0.0)}) for log in logs]
    errors = identified(aircraft, apart[:1], apart[1:])
    assert ALONE in errors.selected.labels
    assert in_one_unit(errors.selected, errors.hypotheses) is None


def test_a_height_is_no_part_of_the_unit_s_distance_in_pitch() -> None:
    def placed(where: str, axes: str) -> Hypothesis:
        return Hypothesis("sensor_position", where, effects=(at_null(sensor_place(where, axes)),))

    unit = placed(UNIT, "x")
    assert [share_a_distance(unit, placed(where, axes)) for where, axes in (("a_z", "x"), ("alpha", "x"))] == [True] * 2
    assert not any(share_a_distance(placed(where, "z"), unit) for where in ("a_x", "V"))
    assert share_a_distance(placed(UNIT, "xz"), placed("a_x", "z"))
