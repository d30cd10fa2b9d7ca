"""JSBSim aircraft for tests: the paper's equations written out by hand, and configurations to freeze and fly."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from aerosid.aircraft import Aircraft
from aerosid.reporting.export.jsbsim_xml import ExportSettings, aerodynamics_element
from aerosid.studies.jsbsim.configuration import driven_controls, thrust_force
from aerosid.studies.jsbsim.polynomial import geometry_and_mass
from aerosid.studies.jsbsim.process import run_job
from aerosid.studies.jsbsim.properties import DEVIATION, THRUST

Array = NDArray[np.float64]

# Constants and equations (33)-(35) of the paper's light transport in feet, slugs and degrees where they differ from
# what the package writes: 2 q_bar S = rho V^2 S from speed and density, alpha from the body velocities.
PAPER_BY_HAND = """
<aerodynamics>
 <function name="hand/alpha"><atan2><p>velocities/w-aero-fps</p><p>velocities/u-aero-fps</p></atan2></function>
 <function name="hand/force-lbs"><product><v>0.5</v><p>atmosphere/rho-slugs_ft3</p>
   <p>velocities/vt-fps</p><p>velocities/vt-fps</p><v>250.04563898016684</v></product></function>
 <axis name="X">
  <function name="hand/x0"><product><v>-0.054</v><p>hand/force-lbs</p></product></function>
  <function name="hand/xa"><product><v>0.233</v><p>hand/alpha</p><p>hand/force-lbs</p></product></function>
  <function name="hand/xa2"><product><v>3.6089</v><p>hand/alpha</p><p>hand/alpha</p>
    <p>hand/force-lbs</p></product></function>
 </axis>
 <axis name="Z">
  <function name="hand/z0"><product><v>-0.12</v><p>hand/force-lbs</p></product></function>
  <function name="hand/za"><product><v>-5.68</v><p>hand/alpha</p><p>hand/force-lbs</p></product></function>
  <function name="hand/zq"><product><v>-4.32</v><v>1.5875</v><p>velocities/q-rad_sec</p><v>0.005</v>
    <p>hand/force-lbs</p></product></function>
  <function name="hand/ze"><product><v>-0.407</v><p>fcs/elevator-pos-rad</p><p>hand/force-lbs</p></product></function>
 </axis>
 <axis name="PITCH">
  <function name="hand/m"><product><v>5.208333333333333</v><p>hand/force-lbs</p><sum>
    <v>0.055</v><product><v>-0.729</v><p>hand/alpha</p></product>
    <product><v>-1.715</v><pow><p>hand/alpha</p><v>2</v></pow></product>
    <product><v>-16.3</v><v>1.5875</v><p>velocities/q-rad_sec</p><v>0.005</v></product>
    <product><v>-1.94</v><p>fcs/elevator-pos-rad</p></product></sum></product></function>
 </axis>
</aerodynamics>
"""


def configuration(aircraft: Aircraft, aerodynamics: ET.Element, moved: tuple[float, float] = (0.0, 0.0)) -> ET.Element:
    """A whole aircraft; AERORP lies `moved` m forward and below the centre of gravity."""
    config = ET.Element("fdm_config", name="case", version="2.0", release="BETA")
    config.extend(geometry_and_mass(aircraft))
    location = config.find("metrics/location")
    assert location is not None
    for axis, place in (("x", -moved[0]), ("z", -moved[1])):
        element = location.find(axis)
        assert element is not None
        element.text = repr(place / 0.0254)
    ET.SubElement(config, "ground_reactions")
    config.append(driven_controls(0.4, 30.0, ["aerosid/channel/delta_f", "aerosid/channel/ice"]))
    config.append(aerodynamics)
    ET.SubElement(config, "external_reactions").append(thrust_force((1.0, 0.0)))
    return config


PLAIN = ExportSettings()


def exported(aircraft: Aircraft, settings: ExportSettings = PLAIN) -> ET.Element:
    return configuration(aircraft, aerodynamics_element(aircraft, settings), settings.aero_reference)


def job(**further: Any) -> dict[str, Any]:
    return {
        "task": "fly",
        "clean": "case",
        "flown": "case",
        "frame": 0.002,
        "altitude": 1500.0,
        "airspeed": 100.0,
        "properties": {"atmosphere/override/density": 0.9077 * 0.3048**4 / 4.4482216152605},
        "reads": [],
        "thrust_below": 0.0,
        "places": [],
        "after_trim": {},
        "attached": None,
    } | further


def freeze(config: ET.Element, states: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Coefficients and readings in each state."""
    answer, _ = run_job({"case": config}, job(task="freeze", states=[dict(state) for state in states]))
    return answer


def fly(config: ET.Element, deviation: Array) -> dict[str, Array]:
    """Histories of a flight, one frame a sample."""
    drives = {DEVIATION: deviation, THRUST: np.ones(deviation.size)}
    _, histories = run_job({"case": config}, job(), drives)
    return histories
