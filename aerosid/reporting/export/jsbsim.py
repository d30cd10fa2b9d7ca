"""The model as JSBSim's `<aerodynamics>`, alone or in place of that of another aircraft."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path

from aerosid.aircraft import Aircraft
from aerosid.errors import UsageError
from aerosid.reporting.export.jsbsim_xml import ExportSettings, actuator_xml, aerodynamics_xml, as_text, put_into
from aerosid.reporting.export.options import Exported, ExportOptions, left_out


def jsbsim_text(aircraft: Aircraft, options: ExportOptions) -> Exported:
    """The section, or the whole aircraft into which it was inserted; standard deviations are in comments.

    Raises
    ------
    AircraftError
        As `aerosid.reporting.export.jsbsim_xml`; and where actuators are declared and no aircraft is given for them.
    UsageError
        Where the target cannot be read.
    """
    settings = ExportSettings(
        aero_reference=options.aero_reference or (0.0, 0.0),
        alpha_range=options.alpha_range,
        airspeed=options.airspeed,
        folded_thrust=options.folded_thrust or 0.0,
        properties=options.properties,
    )
    notes = left_out(aircraft)
    if options.into is not None:
        if options.aero_reference is None:
            note = "AERORP is taken for the centre of gravity that the model refers to; where it is not, give --aerorp."
            notes = (*notes, f"{options.into}: {note}")
        return Exported(as_text(put_into(_target(options.into), aircraft, settings)), notes)
    text = aerodynamics_xml(aircraft, settings)
    if actuator_xml(aircraft, settings) is not None:
        raise UsageError(
            f"{aircraft.path}: declared lags, delays or rate limits of controls need a <system> beside <aerodynamics>; "
            "give the JSBSim aircraft that takes both with --into."
        )
    return Exported(text, notes)


def _target(path: Path) -> ET.Element:
    try:
        # Comments and everything else that JSBSim reads or ignores are kept in place.
        parser = ET.XMLParser(target=ET.TreeBuilder(insert_comments=True))
        root = ET.fromstring(path.read_bytes(), parser=parser)
    except OSError as error:
        raise UsageError(
            f"{path} cannot be read ({error.strerror}); give the XML file of a JSBSim aircraft with --into."
        ) from None
    except ET.ParseError as error:
        raise UsageError(
            f"{path} is not valid XML ({error}); give the XML file of a JSBSim aircraft with --into."
        ) from None
    if root.tag != "fdm_config":
        raise UsageError(
            f"{path} begins with <{root.tag}>, expected <fdm_config>; give the XML file of a JSBSim aircraft with "
            "--into."
        )
    return root
