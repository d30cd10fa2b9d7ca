"""A recorded flight: read from any recorder, brought to SI on one time base, judged."""
