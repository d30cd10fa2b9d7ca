"""The manoeuvre to fly next: the input with most expected information on what is left open."""
