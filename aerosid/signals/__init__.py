"""Noise, filters, whitening and least squares on plain arrays; nothing here knows an aircraft."""
