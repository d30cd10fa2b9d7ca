"""The chain from logs and an aircraft to findings, verdict and completed model."""
