"""The chain of the paper on flight logs: prefilter, d(t), correlation, recursive least squares; also in flight."""
