"""An estimate in a form to transfer between processes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from aerosid.effects import ActiveEffect, with_numbers
from aerosid.estimation.maximum_likelihood import Refinement
from aerosid.flight_model.aerodynamics import AerodynamicModel, Entry


class TransferredFit(NamedTuple):
    """An estimate in a form to transfer between processes: of its effects, which hold functions, only their values."""

    values: NDArray[np.float64]
    numbers: tuple[tuple[float, ...], ...]
    rest: dict[str, Any]

    @classmethod
    def of(cls, fit: Refinement) -> TransferredFit:
        """The transferred form of an estimate."""
        known = ("states", "variance", "cost", "information", "converged", "held_to_data")
        rest = {name: getattr(fit, name) for name in known}
        return cls(fit.model.values, tuple(active.values for active in fit.effects), rest)

    def refinement(
        self, model: AerodynamicModel, free: tuple[Entry, ...], effects: Sequence[ActiveEffect]
    ) -> Refinement:
        """The estimate of the structure that its fit started with."""
        own = with_numbers(effects, self.numbers)
        return Refinement(model=model.with_values(self.values), free=free, effects=own, **self.rest)
