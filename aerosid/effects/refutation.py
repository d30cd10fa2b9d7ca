"""Grounds on which an effect that the likelihood selected is refuted."""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum, auto


class Refutation(Enum):
    """`PREDICTION`: it degrades the prediction of validation flights, or of parts of the flights from the rest.

    `OWN_FIT`: it lowers R^2 of its own coefficient on the identification flights and raises it on no other.
    """

    PREDICTION = auto()
    OWN_FIT = auto()


Refuted = Mapping[tuple[str, str, str], Refutation]
"""Grounds of refutation by label: kind, channel or coefficient, and term."""
