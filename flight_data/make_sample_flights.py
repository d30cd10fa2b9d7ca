"""Make the sample flights of this folder, each with something that its aircraft file does not declare.

    python flight_data/make_sample_flights.py

Light transport, longitudinal: two terms, flown by this package's own simulation.

The aircraft is that of Parameswaran & Raol 1994, section 3.3, with constants after Raol; the flown model has
C_X alpha^2 = 3.6089 and C_m alpha^2 = -1.715 beside what aircraft_models/light_transport.toml declares. Both flights
start from the same trim at 100 m/s, last 14 s at 30 ms and carry white noise on every channel, the elevator included.

Navion, all six axes: flown by JSBSim (which must be installed) from the trim at 53.6 m/s. The rudder follows with a
first-order lag of 0.12 s, and the lateral accelerometer sits 1 m ahead of the centre of gravity, which the log does not
say; aileron, rudder and elevator move one after another, 25 samples a second.
"""

from pathlib import Path

import numpy as np

from aerosid.aircraft import load_aircraft
from aerosid.aircraft.declared_model import declared_model
from aerosid.flight_model.simulation import doublet, fly, three_two_one_one, trim
from aerosid.flight_model.terms import parse_term
from aerosid.logs.log_writing import native_csv
from aerosid.studies.jsbsim.control_inputs import ControlInput, sequence
from aerosid.studies.jsbsim.flight import fly_jsbsim
from aerosid.studies.jsbsim.injected import parse_effect
from aerosid.studies.jsbsim.plan import FlightPlan

HERE = Path(__file__).parent
UNDECLARED = {("C_X", parse_term("alpha^2")): 3.6089, ("C_m", parse_term("alpha^2")): -1.715}
NOISE = {
    "V": 0.15,
    "alpha": 0.0015,
    "q": 0.0012,
    "theta": 0.0012,
    "a_x": 0.02,
    "a_z": 0.05,
    "h": 0.3,
    "delta_e": 0.0002,
}


def main() -> None:
    """Fly all manoeuvres and write them beside this script."""
    light_transport()
    navion()


def navion() -> None:
    """Six axes by JSBSim: inputs to identify from, others in another order to validate with."""
    aircraft = load_aircraft(str(HERE.parent / "aircraft_models" / "navion.toml"))
    lacking = tuple(map(parse_effect, ("control_lag:delta_r=0.12", "sensor_position:a_y=1.0")))
    inputs = {
        "identify": (("delta_a", "doublet", 0.06, 0.8), ("delta_r", "211", 0.06, 0.6), ("delta_e", "3211", 0.03, 0.4)),
        "validate": (
            ("delta_e", "doublet", 0.03, 0.8),
            ("delta_r", "doublet", 0.06, 0.7),
            ("delta_a", "211", 0.06, 0.5),
        ),
    }
    for seed, (name, moves) in enumerate(inputs.items(), start=1969):
        flown = sequence([ControlInput(*move) for move in moves], None, 0.04)
        plan = FlightPlan(aircraft, flown, aircraft.airspeed or 0.0, effects=lacking, seed=seed)
        remark = f"Navion, flown by JSBSim: {', '.join(f'{move[0]} {move[1]}' for move in moves)}; seed {seed}"
        text = native_csv(fly_jsbsim(plan).log, remark)
        (HERE / f"navion_{name}.csv").write_text(text, encoding="utf-8")


def light_transport() -> None:
    """Two elevator manoeuvres."""
    aircraft = load_aircraft(str(HERE.parent / "aircraft_models" / "light_transport.toml"))
    model = declared_model(aircraft, 100.0).extended(UNDECLARED)
    values = model.values.copy()
    for entry, value in UNDECLARED.items():
        values[model.index(entry)] = value
    model = model.with_values(values)
    density, mass = aircraft.density, aircraft.mass
    assert density is not None  # the file gives it
    level = trim(model, 100.0, density, mass)
    time = np.arange(470) * 0.03
    inputs = {
        "doublet": (doublet(time, 1.02, 1.02, 0.06), "elevator doublet of 0.06 rad, 1 s each way"),
        "3211": (three_two_one_one(time, 1.02, 0.6, 0.045), "elevator 3-2-1-1 of 0.045 rad, unit 0.6 s"),
    }
    for seed, (name, (elevator, remark)) in enumerate(inputs.items(), start=1994):
        log = fly(model, level, time, elevator, density=density, mass=mass, noise=NOISE, seed=seed, name=name)
        text = native_csv(log, f"Simulated light transport, {remark}; seed {seed}")
        (HERE / f"light_transport_{name}.csv").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
