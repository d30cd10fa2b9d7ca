"""Residuals of the coefficient equations without columns against those of the stacked regression."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from equations_decided import decided

from aerosid.effects.cg_shift import cg_shift
from aerosid.effects.control import control_lag
from aerosid.effects.family import at_null
from aerosid.effects.flow_separation import flow_separation
from aerosid.effects.hypothesis import Hypothesis
from aerosid.effects.sensor import sensor_delay, sensor_scale
from aerosid.effects.sensor_position import sensor_position
from aerosid.effects.step_change import step_change
from aerosid.equation_error.equations.channels import KINEMATIC
from aerosid.equation_error.equations.kinematic import predicted_records, reconstruct
from aerosid.equation_error.equations.points import Equations, Point
from aerosid.equation_error.equations.sensors import corrected
from aerosid.equation_error.regression.design import design_of
from aerosid.equation_error.regression.estimate import Estimate, residual_of
from aerosid.equation_error.selection.candidates import with_hypothesis
from benchmarks.turbulent_flights import BODIES, aircraft_of, flown


@cache
def declared() -> Estimate:
    """The declared structure of two flights in gusts."""
    body = BODIES[2]
    logs = [flown(name, body, 6000 + n, air=0.5, seconds=20.0) for n, name in enumerate(("one", "two"))]
    return decided(aircraft_of(body, 0.08, np.random.default_rng(6)), logs[:1], logs[1:]).before


@pytest.mark.parametrize("seconds", [0.0, 0.03])
def test_residuals_need_no_columns(seconds: float) -> None:
    found = declared()
    late = Hypothesis("sensor_delay", "q", effects=(at_null(sensor_delay("q")),))
    point = with_hypothesis(found.point, late)
    point = point.with_effects([point.effects[-1].perturbed(0, seconds)])
    design = design_of(found.problem.segments(point), found.problem.settings)
    values = np.random.default_rng(7).standard_normal(len(design.unknowns))
    assert ("gust", "C_m") in design.unknowns
    left = residual_of(found.problem, dict(zip(design.unknowns, values, strict=True)), point)
    np.testing.assert_allclose(left, design.target - design.columns @ values, atol=1e-11 * np.abs(left).max())


def visited() -> list[Point]:
    """A point with a lag, a step, a shifted centre of gravity, a displaced sensor and separation, and neighbours."""
    first = declared().point
    (lift, *_) = (entry[0] for entry in first.free if entry[0] in ("C_L", "C_Z"))
    effects = [
        (control_lag("delta_e"), (0.05,)),
        (step_change("C_m", 8.0, 0.02), (0.01, 8.0)),
        (cg_shift("x"), (0.1,)),
        (sensor_position("a_z", "x"), (0.7,)),
        (flow_separation(0.1, lift, ("C_m",)), (0.08, 30.0, 0.2, 0.1, 0.05)),
    ]
    acting = tuple(replace(at_null(effect), values=values) for effect, values in effects)
    point = first.with_effects((*first.effects, *acting))
    beside = [
        (i, active.perturbed(k, 10.0 * active.effect.parameters[k].step))
        for i, active in enumerate(point.effects)
        for k in range(len(active.values))
    ]
    return [point, *(replace(point, effects=(*point.effects[:i], a, *point.effects[i + 1 :])) for i, a in beside)]


def test_the_cache_of_points_changes_no_bit() -> None:
    """Each point by equations that evaluated the others before, there and back, and by fresh ones."""
    problem, points = declared().problem, visited()

    def left(equations: Equations, point: Point) -> bytes:
        values = {("term", entry): 1.0 + n for n, entry in enumerate(point.free)}
        return equations.residuals(point, values).tobytes()

    def fresh() -> Equations:
        recordings = [replace(recording) for recording in problem.recordings]  # with empty caches
        return Equations(recordings, problem.settings, problem.kinds, all_fitted=True)

    cached = fresh()
    by_itself = [left(fresh(), point) for point in points]
    assert len(set(by_itself)) == len(points)
    for n in (*range(len(points)), *reversed(range(len(points)))):
        assert left(cached, points[n]) == by_itself[n]


def test_cached_kinematic_equations_match_fresh_ones() -> None:
    """Also with errors of the height sensor, which do not change the path relative to the air."""
    found = declared()
    problem = replace(found.problem, kinds=KINEMATIC)
    errors = [(sensor_scale("h"), (1.05,)), (sensor_delay("alpha"), (0.04,)), (sensor_delay("h"), (0.1,))]
    acting = [replace(at_null(effect), values=values) for effect, values in errors]
    for n in range(len(acting) + 1):
        point = found.point.with_effects(acting[:n])
        design = problem.design(point)
        for segment, target in zip(problem.segments(point), np.split(design.target, design.bounds[1:-1]), strict=True):
            recording = problem.recordings[segment.recording]
            path = reconstruct(recording, (), recording.channels, problem.settings).path
            true = corrected(recording, acting[:n], lambda path=path: path)  # type: ignore[misc]
            motion = reconstruct(recording, acting[:n], true, problem.settings)
            predicted = predicted_records(recording, acting[:n], motion)[segment.equation]
            left = recording.band(recording.channels[segment.equation] - predicted)
            np.testing.assert_allclose(target, left, atol=1e-10 * np.abs(recording.channels[segment.equation]).max())
        anew = design_of(problem.segments(point), problem.settings)
        assert anew.unknowns == design.unknowns
        np.testing.assert_array_equal(anew.columns, design.columns)
