"""One exact step of the invariant-embedding estimator with frozen linearisation, compiled, on plain arrays."""
