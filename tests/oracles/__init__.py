"""Naive, dense writings of what the package computes; the package never imports them."""
