"""Printed values of Parameswaran & Raol 1994, as legible in the scan; None where a value was given or is lost."""

from __future__ import annotations

TABLE_1: dict[str, dict[str, float | None]] = {
    "I": {"a1": None, "a2": None, "a3": None, "a4": -0.0499},
    "II": {"a1": 0.4996, "a2": None, "a3": None, "a4": -0.05},
    "III": {"a1": 0.4998, "a2": 0.6161, "a3": None, "a4": -0.05},
    "IV": {"a1": 0.5000, "a2": 0.6118, "a3": None, "a4": -0.05},
}
"""Coefficients of (29); a3's column is illegible in the scan, the text states that it is near zero."""

TABLE_3: dict[str, tuple[float, float]] = {
    "alpha^2": (0.9995, 0.9995),
    "alpha^3": (0.9854, 0.9853),
    "alpha^4": (0.9599, 0.9596),
    "alpha^2 + alpha^3": (0.9982, 0.9982),
    "alpha^2 + alpha^4": (0.9988, 0.9987),
    "alpha^3 + alpha^4": (0.9800, 0.9798),
    "alpha^2 + alpha^3 + alpha^4": (0.9970, 0.9969),
}
"""Published: correlation with the pitch-moment and with the axial-force error."""

TABLE_4: dict[float | None, tuple[float, float]] = {None: (3.605, -1.656), 20.0: (3.649, -1.625), 10.0: (3.562, -1.633)}
"""Published: C_X_alpha2 and C_m_alpha2 at a signal-to-noise ratio; None: no noise. True: 3.609, -1.715."""
