"""JSBSim's units in SI."""

FOOT = 0.3048
"""Standard: m."""

POUND_FORCE = 4.4482216152605
"""Standard: N."""

SLUG = POUND_FORCE / FOOT
"""kg"""
POUNDS_PER_SLUG = 32.174049
"""Standard: lb/slug, with which JSBSim turns weight in pounds into mass in slugs."""
INCH = FOOT / 12.0
KNOT = 1852.0 / 3600.0
"""Standard: m/s."""
