"""Model error d(t) of the declared and the completed structure: correlations, regressors, prefilter."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from aerosid.compiled.cores import begun
from aerosid.errors import EstimationError
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.flight_model.aerodynamics import AerodynamicModel, Entry
from aerosid.loop.settings import LoopSettings
from aerosid.model_error.aircraft_error.force_history import ErrorHistory, smoothed_histories
from aerosid.model_error.paper_chain.chain import Chain, ChainSettings, run_chain
from aerosid.model_error.paper_chain.screening import (
    RegressorPicture,
    ScreeningRow,
    closest_rivals,
    error_histories,
    regressor_pictures,
    screen,
)
from aerosid.notation import number
from aerosid.search.attribution import Attribution


@dataclass(frozen=True)
class PrefilterNote:
    """Prefilter of the model-error recursion, and its effect on the estimates."""

    kind: str
    cut_off_hz: float | None
    reason: str
    effect_on_estimates: str


@dataclass(frozen=True)
class ModelErrorPictures:
    """Results of the paper's chain: values of the completed structure with and without the filter, and pictures."""

    chain: Chain
    unfiltered: Chain
    screening: tuple[ScreeningRow, ...]
    histories: tuple[ErrorHistory, ...]
    correlations: dict[Entry, float]
    regressors: tuple[RegressorPicture, ...]


def model_error_pictures(
    declared: AerodynamicModel,
    manoeuvres: Sequence[Manoeuvre],
    candidates: Sequence[Entry],
    found: Attribution,
    coefficients: Sequence[str],
    settings: ChainSettings,
    declared_chain: Callable[[], Chain] | None = None,
) -> ModelErrorPictures | None:
    """The paper's chain on the declared and on the completed structure; None where its recursion breaks down.

    `declared_chain` gives the former where it has been begun already.
    """
    chosen = found.terms
    structure = (*found.before.free, *chosen)
    known_before = {active.key for active in found.before.effects}
    further = [active for active in found.completed.effects if active.key not in known_before]
    smoothed = begun(
        lambda: smoothed_histories(found.completed, manoeuvres, coefficients, chosen, further), yielding=True
    )
    try:
        deficient = declared_chain() if declared_chain is not None else None
        if deficient is None or deficient.entries != found.before.free:
            deficient = run_chain(declared, manoeuvres, found.before.free, settings)
        scores = found.rounds[0] if found.rounds else ()
        screening = screen(deficient, manoeuvres, candidates, chosen, scores, settings)
        completed = deficient
        if chosen:
            near = deficient.error_density
            completed = run_chain(declared.extended(chosen), manoeuvres, structure, settings, near)
        regressors = regressor_pictures(completed, manoeuvres, chosen, closest_rivals(screening, candidates), settings)
        off = replace(settings, filtering="off", error_density=tuple(completed.error_density.tolist()))
        unfiltered = completed
        if settings.filtering != "off" and any(part.butterworth for part in completed.fed):
            unfiltered = run_chain(declared.extended(chosen), manoeuvres, structure, off)
        histories, correlations = smoothed()  # which yields to what is computed here, and is waited for last
        if not histories:
            histories, correlations = error_histories(completed, manoeuvres, chosen, settings)
    except EstimationError:
        return None
    beyond = {history.coefficient for history in histories if history.left_its_range}
    known = {entry: value for entry, value in correlations.items() if entry[0] not in beyond}
    return ModelErrorPictures(completed, unfiltered, screening, histories, known, regressors)


def prefilter_note(seen: ModelErrorPictures | None, settings: LoopSettings) -> PrefilterNote:
    """Prefilter of the recursion, and its effect on the recursive least-squares estimates."""
    if not settings.paper_chain:
        return PrefilterNote("off", None, "The model error d(t) was not requested.", "")
    filtering = settings.chain.filtering
    if seen is None:
        return PrefilterNote(filtering, None, "The model-error recursion failed on this flight.", "")
    fed = seen.chain.fed[0]
    if fed.cut_off is None:
        return PrefilterNote("off", None, "Switched off.", "")
    reason = " ".join(f"{text}." for text in fed.cut_off.explanations)
    if seen.unfiltered is seen.chain:
        return PrefilterNote("off", None, reason, "")
    places = seen.chain.model.indices(seen.chain.entries)
    moved = np.abs(seen.chain.model.values - seen.unfiltered.model.values)[places] / seen.chain.std_errors
    most = int(np.nanargmax(moved))
    coefficient, term = seen.chain.entries[most]
    effect = (
        f"Without the filter the recursive least-squares estimates change by {number(float(np.nanmedian(moved)), 2)} "
        f"standard errors in the median and by at most {number(float(moved[most]), 2)} ({coefficient} {term}); the "
        "final estimates do not use it."
    )
    return PrefilterNote(filtering, fed.cut_off.cut_off_hz, reason, effect)
