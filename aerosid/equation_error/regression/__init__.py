"""Generalised least squares over the equations of all recordings, with the colour of their residuals."""
