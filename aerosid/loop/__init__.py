"""Closed-loop model completion: the chain from logs and an aircraft to findings, verdict and completed model."""
