"""Names shared by the two processes of a flight: our own JSBSim properties, and the files of a job."""

PLANET = "planet.xml"
JOB = "job.json"
DRIVES = "drives.npz"
ANSWER = "answer.json"
HISTORIES = "histories.npz"

ELEVATOR = "aerosid/elevator-rad"
"""Elevator at trim."""
DEVIATION = "aerosid/elevator-deviation-rad"
"""Commanded deviation from it, the input of an actuator where there is one."""
AT_TRIM = {"delta_e": ELEVATOR, "delta_a": "aerosid/aileron-rad", "delta_r": "aerosid/rudder-rad"}
"""Each control at trim."""
DEVIATIONS = {
    "delta_e": DEVIATION,
    "delta_a": "aerosid/aileron-deviation-rad",
    "delta_r": "aerosid/rudder-deviation-rad",
}
"""Commanded deviation of each from its trim."""
SURFACES = {
    "delta_e": (("fcs/elevator-pos-rad", 1.0),),
    "delta_a": (("fcs/right-aileron-pos-rad", 1.0), ("fcs/left-aileron-pos-rad", -1.0)),
    "delta_r": (("fcs/rudder-pos-rad", 1.0),),
}
"""JSBSim's normalised positions of each, and the factor from ours."""
FLAP = "aerosid/flap-norm"
GEAR = "aerosid/gear-norm"
THRUST = "external_reactions/thrust/magnitude"
THRUST_PLACE = "external_reactions/thrust/location-{x}-in"
