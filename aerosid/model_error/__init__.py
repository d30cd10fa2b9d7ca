"""Deterministic model error d(t) by invariant embedding (Parameswaran & Raol 1994).

| package | what it contains |
|---|---|
| `invariant_embedding` | one exact step of S and of the mean with frozen linearisation, compiled, on plain arrays |
| `estimators` | the estimators (9)-(12) and (21)-(26) for any model given as functions, and their weights |
| `term_selection` | selection of missing terms by partial correlation with d(t) in coloured noise |
| `aircraft_error` | d(t) of an aircraft's equations of motion, forward and smoothed |
| `paper_chain` | the chain on flight logs: prefilter, d(t), correlation, recursive least squares; also in flight |
| `flight_sweeps` | fixed-interval d(t) of flights, with every candidate passed through the same estimator |

The first three work for any dynamic system; their public names are importable from here. Nothing is imported before it
is used.
"""

from __future__ import annotations

TYPE_CHECKING = False  # as in `aerosid`
if TYPE_CHECKING:
    from typing import Any

    from aerosid.model_error.estimators.consistency import (
        covariance_constrained_weights,
        judge_consistency,
        most_likely_weights,
    )
    from aerosid.model_error.estimators.continuous import estimate_continuous
    from aerosid.model_error.estimators.discrete import estimate_discrete
    from aerosid.model_error.estimators.fixed_interval import (
        FixedInterval,
        fixed_interval_continuous,
        fixed_interval_discrete,
    )
    from aerosid.model_error.estimators.functions import Partials
    from aerosid.model_error.estimators.history import ModelErrorHistory
    from aerosid.model_error.estimators.initial_states import estimate_forward_backward, with_unknown_initial
    from aerosid.model_error.estimators.response import respond
    from aerosid.model_error.estimators.streaming import StreamingModelError, StreamingSettings
    from aerosid.model_error.estimators.weights import Weights, continuous_weights, discrete_weights
    from aerosid.model_error.term_selection.partial_correlation import coloured_regression, partial_correlations
    from aerosid.model_error.term_selection.stepwise_selection import (
        Candidate,
        SelectionSettings,
        TermSelection,
        select_terms_continuous,
        select_terms_discrete,
    )

_HOMES = {
    "Candidate": "term_selection.stepwise_selection",
    "FixedInterval": "estimators.fixed_interval",
    "ModelErrorHistory": "estimators.history",
    "Partials": "estimators.functions",
    "SelectionSettings": "term_selection.stepwise_selection",
    "StreamingModelError": "estimators.streaming",
    "StreamingSettings": "estimators.streaming",
    "TermSelection": "term_selection.stepwise_selection",
    "Weights": "estimators.weights",
    "coloured_regression": "term_selection.partial_correlation",
    "continuous_weights": "estimators.weights",
    "covariance_constrained_weights": "estimators.consistency",
    "discrete_weights": "estimators.weights",
    "estimate_continuous": "estimators.continuous",
    "estimate_discrete": "estimators.discrete",
    "estimate_forward_backward": "estimators.initial_states",
    "fixed_interval_continuous": "estimators.fixed_interval",
    "fixed_interval_discrete": "estimators.fixed_interval",
    "judge_consistency": "estimators.consistency",
    "most_likely_weights": "estimators.consistency",
    "partial_correlations": "term_selection.partial_correlation",
    "respond": "estimators.response",
    "select_terms_continuous": "term_selection.stepwise_selection",
    "select_terms_discrete": "term_selection.stepwise_selection",
    "with_unknown_initial": "estimators.initial_states",
}
"""Module of this package that defines each public name; it is imported at the first access to the name."""

__all__ = [
    "Candidate",
    "FixedInterval",
    "ModelErrorHistory",
    "Partials",
    "SelectionSettings",
    "StreamingModelError",
    "StreamingSettings",
    "TermSelection",
    "Weights",
    "coloured_regression",
    "continuous_weights",
    "covariance_constrained_weights",
    "discrete_weights",
    "estimate_continuous",
    "estimate_discrete",
    "estimate_forward_backward",
    "fixed_interval_continuous",
    "fixed_interval_discrete",
    "judge_consistency",
    "most_likely_weights",
    "partial_correlations",
    "respond",
    "select_terms_continuous",
    "select_terms_discrete",
    "with_unknown_initial",
]


def __getattr__(name: str) -> Any:
    """A public name, imported from the module that defines it; AttributeError for any other."""
    if name not in _HOMES:
        raise AttributeError(f"module 'aerosid.model_error' has no attribute {name!r}")
    import importlib

    value = getattr(importlib.import_module(f"{__name__}.{_HOMES[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """The public names."""
    return list(__all__)
