"""Fixed-interval d(t) of flights by Gauss-Newton sweeps, with every candidate passed through the same estimator."""
