"""How fast the estimator and the whole loop are, and how both grow: `make benchmark`."""
