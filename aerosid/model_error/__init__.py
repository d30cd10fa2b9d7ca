"""Deterministic model error d(t) by invariant embedding (Parameswaran & Raol 1994), on plain arrays.

| module | what it gives |
|---|---|
| `invariant_embedding` | the recursion's algebra, once: the exact step of S and of the mean, compiled |
| `residuals` | residuals with their weights at a sample and over a step, missing samples left out |
| `weights` | `Weights`, from covariances; the factor 2 settled: covariance = 2 S |
| `consistency` | do the weights fit the data; weights by likelihood or by the covariance constraint |
| `discrete` | `estimate_discrete`, (9)-(12) |
| `continuous` | `estimate_continuous`, (21)-(26) |
| `history` | `ModelErrorHistory`, what both return |
| `response` | `respond`: what a candidate model error would have become through the same estimator |
| `fixed_interval` | `fixed_interval_discrete`, `fixed_interval_continuous`: the minimiser of J, with covariances |
| `initial_states` | `estimate_forward_backward`, `with_unknown_initial` |
| `streaming` | `StreamingModelError`: estimate, causal filter, recursive least squares, one sample at a time |
| `streaming_screening` | recursive partial correlation of candidates in coloured noise |
| `partial_correlation` | regression and partial correlation of candidates in coloured noise |
| `term_selection` | `select_terms_continuous`, `select_terms_discrete`: what any model lacks |
| `aircraft_error`, `aircraft_recursion`, `measured_states` | (21)-(26) on an aircraft's equations of motion |
| `flight_sweep`, `swept_model`, `forward_start` | the fixed-interval d(t) of flights, all candidates as columns |
| `flights_in_error`, `sweep_rows` | the flights with d(t) acting, linearised; their rows through the filter of d(t) |
| `in_flight` | the method on board: derivatives, d(t) and names, frame by frame |
| `functions`, `records`, `sweeps` | how given functions are called; arrays checked; the fixed-interval sweeps |
"""
