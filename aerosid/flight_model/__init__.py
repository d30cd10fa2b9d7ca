"""The equations of motion, their terms, simulation, sensitivities, trim and linear model; compiled."""
