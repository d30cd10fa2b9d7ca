"""Make the sample flights of this folder: a light transport with two terms that its aircraft file does not declare.

    python flight_data/make_sample_flights.py

The aircraft is that of Parameswaran & Raol 1994, section 3.3, with constants after Raol; the flown model has
C_X alpha^2 = 3.6089 and C_m alpha^2 = -1.715 beside what aircraft_models/light_transport.toml declares. Both flights
start from the same trim at 100 m/s, last 14 s at 30 ms and carry white noise on every channel, the elevator included.
"""

from pathlib import Path

import numpy as np

from aerosid.aircraft import load_aircraft
from aerosid.aircraft.declared_model import declared_model
from aerosid.flight_model.simulation import doublet, fly, three_two_one_one, trim
from aerosid.flight_model.terms import parse_term
from aerosid.logs.log_writing import native_csv

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
    """Fly both manoeuvres and write them beside this script."""
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
