"""Output error or regression, in calm air behind a recorder: what predicts validation flights better as written."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from aerosid.aircraft import Aircraft
from aerosid.loop.insignificant_derivatives import Completion, fix_insignificant
from aerosid.notation import listed, number
from aerosid.search.attribution import Attribution
from aerosid.search.structure_search import StructureSearch


@dataclass(frozen=True)
class CompletedEstimate:
    """An estimate with all derivatives free, and its completed model.

    Attributes
    ----------
    found : Attribution
    completion : Completion
    lost : mapping of (str, str) to float
        Where the regression is taken in place of output error: R^2 that output error loses, by log and coefficient.
    """

    found: Attribution
    completion: Completion
    lost: Mapping[tuple[str, str], float] = field(default_factory=dict)


def completed_estimate(
    found: Attribution, aircraft: Aircraft, search: StructureSearch, *, excited: bool
) -> CompletedEstimate:
    """The completed model of an estimate, or of the regression of its structure.

    Both are compared as they are written, with insignificant derivatives at declared values. The regression is taken
    where the coefficients of the validation flights lose more R^2 by output error than by it, beyond their noise.

    Parameters
    ----------
    found : Attribution
        With all declared derivatives free; its `by_regression` is the other estimate.
    aircraft : Aircraft
        The declared values.
    search : StructureSearch
        The flights that were fitted, with the settings.
    excited : bool
        Whether the flights are excited at all.
    """
    completion = fix_insignificant(found, aircraft, search, excited=excited)
    regression, predictions = found.by_regression, found.predictions
    if regression is None or predictions is None or not excited:
        return CompletedEstimate(found, completion)
    other = fix_insignificant(regression, aircraft, search, excited=excited)
    simulated, regressed = completion.found.completed, other.found.completed
    lost, gained = predictions.worse(simulated, regressed), predictions.worse(regressed, simulated)
    if sum(lost.values()) > sum(gained.values()):
        return CompletedEstimate(regression, other, lost)
    return CompletedEstimate(found, completion)


def note_on_regression(estimate: CompletedEstimate) -> tuple[str, ...]:
    """Note that the regression was taken, and why; none where it was not."""
    if not estimate.lost:
        return ()
    rows = [f"{coefficient} of {log} by {number(fall, 2)}" for (log, coefficient), fall in estimate.lost.items()]
    note = (
        "The air is calm, but the values are those of the equations: by output error the completed model, as it is "
        f"written, would lose R² of {listed(rows)}. What the model lacks, which a simulation integrates, biases it."
    )
    return (note,)
