"""Parameters of effects within the parameter vector of an estimate."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from aerosid.effects import ActiveEffect, InputEffect, StateEffect


def direction_places(first: int, effects: Sequence[ActiveEffect], tested: Sequence[ActiveEffect]) -> NDArray[np.int64]:
    """The columns, from `first` on, of the effects' parameters that act through the inputs."""
    places: list[int] = []
    for kinds, group in (((InputEffect,), effects), ((InputEffect, StateEffect), tested)):
        for active in group:
            if isinstance(active.effect, kinds):
                places.extend(range(first, first + len(active.values)))
            first += active.slopes
    return np.array(places, dtype=np.int64)


def parameters_of(effects: Sequence[ActiveEffect], *kinds: type) -> Iterator[tuple[ActiveEffect, int]]:
    """Every parameter of the effects of some kinds: the effect and the parameter's place in it."""
    for active in effects:
        if isinstance(active.effect, kinds):
            for n in range(len(active.values)):
                yield active, n
