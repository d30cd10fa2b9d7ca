"""Aircraft of JSBSim identified from a flight, exported, and flown again for comparison with the originals."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from aerosid.aircraft import Aircraft
from aerosid.loop.closed_loop import close_loop
from aerosid.loop.settings import LoopSettings
from aerosid.reporting.export.jsbsim_xml import ExportSettings, put_into

TERMS_ALONE = LoopSettings(catalogue="terms", next_flight=False)
FRAME = 0.002

# AERORP from the centre of gravity, m forward and below, of the flown variants: fuel as in the files, no engines.
AERORP = {"L410": (-0.2128, -0.3216), "c310": (-0.0081, 0.1235), "DHC6": (-0.0683, -0.2982)}


def flights(name: str, completed: Aircraft, doublet: Any) -> dict[str, dict[str, NDArray[np.float64]]]:
    """The doublet flown by the exported model on its own body, and in place of the original's aerodynamics."""
    from jsbsim_cases import exported, job

    from aerosid.studies.jsbsim.flight import _configuration, _job, _parts
    from aerosid.studies.jsbsim.plan import FlightPlan
    from aerosid.studies.jsbsim.process import run_job
    from aerosid.studies.jsbsim.properties import DEVIATION, THRUST
    from aerosid.studies.jsbsim.stock import CONDITIONS

    airspeed, altitude = CONDITIONS[name]
    frames = FRAME * np.arange(round(doublet.time[-1] / FRAME) + 1.0)
    drives = {DEVIATION: np.interp(frames, doublet.time, doublet.deviation), THRUST: np.ones(frames.size)}
    own = exported(completed, ExportSettings(airspeed=airspeed))
    _, alone = run_job({"case": own}, job(airspeed=airspeed, altitude=altitude, properties={}), drives)
    plan = FlightPlan(name, doublet, airspeed, altitude, noise=0.0)
    parts = _parts(plan, {})
    settings = ExportSettings(airspeed=airspeed, aero_reference=AERORP[name])
    target = put_into(_configuration(parts, None), completed, settings)
    task = job(airspeed=airspeed, altitude=altitude) | _job(plan, parts, "fly", FRAME)
    _, inside = run_job({"clean": target, "flown": target}, task, drives)
    return {"on its own": alone, "in its source": inside}


@pytest.mark.slow
@pytest.mark.parametrize("name", AERORP)
def test_the_exported_model_flies_an_unseen_doublet_as_its_source_does(name: str) -> None:
    """Fitted on a 3-2-1-1 with usual sensor noise; w and q within 2 % of the peak-to-peak at every instant.

    Measured, w and q: L410 0.41 % and 0.39 %, c310 0.28 % and 0.12 %, DHC6 1.52 % and 1.23 %, in either place.
    """
    pytest.importorskip("jsbsim", reason="the source is one of JSBSim's aircraft")
    from aerosid.studies.jsbsim.control_inputs import manoeuvre
    from aerosid.studies.jsbsim.flight import fly_jsbsim
    from aerosid.studies.jsbsim.plan import FlightPlan
    from aerosid.studies.jsbsim.stock import CONDITIONS

    airspeed, altitude = CONDITIONS[name]
    fitted = fly_jsbsim(FlightPlan(name, manoeuvre("3211", 0.04, 0.5, 12.0, 0.03), airspeed, altitude, seed=1))
    doublet = manoeuvre("doublet", 0.03, 0.8, 8.0, 0.02)
    source = fly_jsbsim(FlightPlan(name, doublet, airspeed, altitude, noise=0.0)).states
    completed = close_loop([fitted.log], fitted.aircraft, settings=TERMS_ALONE).completed_aircraft
    for where, flown in flights(name, completed, doublet).items():
        for channel in ("w", "q"):
            wanted = source[channel] - source[channel][0]
            missed = np.abs(wanted - (flown[channel][::10] - flown[channel][0])).max() / np.ptp(wanted)
            assert missed < 0.02, (where, channel)
