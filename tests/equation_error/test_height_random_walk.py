"""How far noise leads the integrated height astray, against its Monte Carlo, and what gusts do to the path."""

import numpy as np
import pytest
from equations_decided import questioned
from numpy.typing import NDArray

from aerosid.equation_error.equations.height_random_walk import height_random_walk
from aerosid.equation_error.equations.kinematic import predicted_records, reconstruct
from aerosid.equation_error.equations.recording import Recording, read_recordings
from aerosid.equation_error.settings import EquationErrorSettings
from benchmarks.planted_aircraft import Body
from benchmarks.turbulent_flights import BODIES, aircraft_of, flown

Array = NDArray[np.float64]


def recorded(body: Body, seed: int, air: float) -> Recording:
    log = flown("one", body, seed, air=air, seconds=36.0)
    _, manoeuvre = questioned(aircraft_of(body, 0.0, np.random.default_rng(0)), log)
    (recording,) = read_recordings([manoeuvre], [], EquationErrorSettings())
    return recording


def about_a_parabola(time: Array, values: Array) -> Array:
    basis = np.linalg.qr(np.vander(time, 3))[0]
    return np.asarray(values - basis @ (basis.T @ values))


def test_modes_leave_what_integrated_noise_leaves() -> None:
    recording = recorded(BODIES[2], 8000, 0.0)
    settings = EquationErrorSettings(wander_modes=40)
    manoeuvre, step = recording.manoeuvre, recording.interval
    modes = about_a_parabola(recording.time, height_random_walk(recording, recording.time, settings)[:, :-1])
    predicted = float(np.sqrt(np.mean(np.sum(modes**2, axis=1))))
    generator = np.random.default_rng(1)
    shown = dict(zip(manoeuvre.axes.outputs, manoeuvre.noise, strict=True))
    size = {name: max(shown[name], settings.least_noise[name]) for name in ("a_z", "theta")}
    rate = np.sqrt(settings.noise_memory / step)  # white noise of that density on samples
    trials = []
    for _ in range(400):
        acceleration, angle = generator.standard_normal((2, recording.time.size)) * rate
        climb = np.cumsum(size["a_z"] * acceleration) * step + size["theta"] * angle * recording.channels["V"].mean()
        trials.append(about_a_parabola(recording.time, np.cumsum(climb) * step))
    # Four hundred trials know the size to three parts in a hundred; slow parts, of which there are few, count most.
    assert predicted == pytest.approx(float(np.sqrt(np.mean(np.square(trials)))), rel=0.12)


def test_gusts_do_not_lead_the_path_astray() -> None:
    """Of a glider in gusts of 1 m/s; integrated from velocities as measured the height is .5 m off, its noise is .3."""
    away = []
    for seed in range(8100, 8112):
        recording = recorded(BODIES[1], seed, 1.0)
        motion = reconstruct(recording, (), recording.channels, EquationErrorSettings())
        left = predicted_records(recording, (), motion)["h"] - recording.channels["h"]
        away.append(about_a_parabola(recording.time, left).std())
    assert np.sqrt(np.mean(np.square(away))) < 0.4
