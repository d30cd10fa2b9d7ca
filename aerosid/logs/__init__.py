"""A recorded flight: read from any format, in SI, on one time base, and judged."""
