"""The equations and the channels that they compare, by name."""

KINEMATIC = ("theta", "alpha", "V", "h")
"""Channels that kinematics predict by integration."""

COEFFICIENT = ("C_X", "C_Z", "C_m")
"""Body-axis coefficients, each with the channel that measures it: a_x, a_z and the derivative of q."""

MEASURED_BY = {"C_X": "a_x", "C_Z": "a_z", "C_m": "q"}
"""The sensor whose faults are seen in each coefficient's own equation."""
