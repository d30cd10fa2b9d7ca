"""Estimation of deterministic model error d(t) by invariant embedding (Parameswaran & Raol 1994), on plain arrays."""
