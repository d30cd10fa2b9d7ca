"""Equation error with coloured residuals: kinematic and coefficient equations in one regression, without simulation."""
