"""A recorded flight: read from any format, in SI units, on one time base, with a check of its quality."""
