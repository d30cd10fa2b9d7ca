"""Generalised least squares over the equations of all records, with the colour of their residuals estimated."""
