"""Optimal input design: the manoeuvre to fly next, with most expected information on what is left open."""
