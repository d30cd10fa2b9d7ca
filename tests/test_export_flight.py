"""An aircraft of JSBSim identified from its flight, exported, and flown again beside its source."""

from __future__ import annotations

import numpy as np
import pytest

from aerosid.closed_loop import LoopSettings, close_loop
from aerosid.jsbsim_export import ExportSettings

NOT_A_TERM = LoopSettings(catalogue="terms", next_flight=False)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["L410", "c310", "DHC6"])
def test_the_exported_model_flies_an_unseen_doublet_as_its_source_does(name: str) -> None:
    """Fitted on a 3-2-1-1 with usual sensor noise; w and q within 2 % of the peak-to-peak at every instant.

    Measured, w and q: L410 0.41 % and 0.39 %, c310 0.28 % and 0.12 %, DHC6 1.52 % and 1.23 %.
    """
    pytest.importorskip("jsbsim", reason="the source is one of JSBSim's aircraft")
    from jsbsim_cases import exported, job

    from aerosid.jsbsim_flight.elevator_inputs import manoeuvre
    from aerosid.jsbsim_flight.flight import fly_jsbsim
    from aerosid.jsbsim_flight.plan import FlightPlan
    from aerosid.jsbsim_flight.process import run_job
    from aerosid.jsbsim_flight.properties import DEVIATION, THRUST
    from aerosid.jsbsim_flight.stock import CONDITIONS

    airspeed, altitude = CONDITIONS[name]
    fitted = fly_jsbsim(FlightPlan(name, manoeuvre("3211", 0.04, 0.5, 12.0, 0.03), airspeed, altitude, seed=1))
    doublet = manoeuvre("doublet", 0.03, 0.8, 8.0, 0.02)
    source = fly_jsbsim(FlightPlan(name, doublet, airspeed, altitude, noise=0.0)).states
    completed = close_loop([fitted.log], fitted.aircraft, settings=NOT_A_TERM).completed_aircraft
    frames = 0.002 * np.arange(4001.0)
    drives = {DEVIATION: np.interp(frames, doublet.time, doublet.deviation), THRUST: np.ones(frames.size)}
    config = exported(completed, ExportSettings(airspeed=airspeed))
    _, flown = run_job({"case": config}, job(airspeed=airspeed, altitude=altitude, properties={}), drives)
    for channel in ("w", "q"):
        wanted = source[channel] - source[channel][0]
        missed = np.abs(wanted - (flown[channel][::10] - flown[channel][0])).max()
        assert missed < 0.02 * np.ptp(wanted), channel
