"""Random walk of the integrated height against its Monte Carlo, and the effect of gusts on the path."""

import numpy as np
import pytest
from equations_decided import questioned
from numpy.typing import NDArray

from aerosid.equation_error.equations.height_random_walk import height_random_walk
from aerosid.equation_error.equations.kinematic import predicted_records, reconstruct
from aerosid.equation_error.equations.recording import Recording
from aerosid.equation_error.equations.regular_recordings import read_recordings
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


def height_path(recording: Recording, channels: dict[str, Array], settings: EquationErrorSettings) -> Array:
    return reconstruct(recording, (), channels, settings).path["h"]


def test_modes_have_the_covariance_of_what_the_noise_of_all_sensors_leaves_in_the_path() -> None:
    recording = recorded(BODIES[2], 8000, 0.0)
    settings = EquationErrorSettings(wander_modes=40)
    manoeuvre, step = recording.manoeuvre, recording.interval
    modes = about_a_parabola(recording.time, height_random_walk(recording, recording.time, settings)[:, :-1])
    predicted = float(np.sqrt(np.mean(np.sum(modes**2, axis=1))))
    generator = np.random.default_rng(1)
    shown = dict(zip(manoeuvre.axes.outputs, manoeuvre.noise, strict=True))
    size = {name: max(shown[name], settings.least_noise.get(name, 0.0)) for name in ("a_x", "a_z", "q", "theta")}
    rate = np.sqrt(settings.noise_memory / step)  # white noise of that density on samples
    clean, trials = dict(recording.channels), []
    undisturbed = height_path(recording, clean, settings)
    for _ in range(400):
        noise = {name: rate * each * generator.standard_normal(recording.time.size) for name, each in size.items()}
        noisy = clean | {name: clean[name] + each for name, each in noise.items()}
        trials.append(about_a_parabola(recording.time, height_path(recording, noisy, settings) - undisturbed))
    # Four hundred trials determine the size to three parts in a hundred; the few slow modes count most.
    assert predicted == pytest.approx(float(np.sqrt(np.mean(np.square(trials)))), rel=0.12)


def test_gusts_do_not_bias_the_height_path() -> None:
    """Glider in gusts of 1 m/s; integrated from velocities as measured the height is .5 m off, its noise is .3."""
    differences = []
    for seed in range(8100, 8112):
        recording = recorded(BODIES[1], seed, 1.0)
        motion = reconstruct(recording, (), recording.channels, EquationErrorSettings())
        left = predicted_records(recording, (), motion)["h"] - recording.channels["h"]
        differences.append(about_a_parabola(recording.time, left).std())
    assert np.sqrt(np.mean(np.square(differences))) < 0.4
