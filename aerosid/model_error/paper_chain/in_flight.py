"""On-line identification: d(t), derivatives with deviations and the first name, sample by sample.

Forward estimate (21)-(23), one causal filter on d(t) and on every candidate's picture in it, recursive regression and
recursive screening: what is shown at a moment has seen no later sample. The weights alone are set beforehand.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.flight_model.aerodynamics import AerodynamicModel, Entry, controls_of
from aerosid.model_error.aircraft_error.forward_estimate import AircraftErrorHistory, estimate_aircraft_error
from aerosid.model_error.paper_chain.chain import ChainSettings, choose_error_density, feed
from aerosid.model_error.term_selection.streaming_screening import Screened, ScreeningSettings, StreamingScreening
from aerosid.signals.delay_and_lag import lagged
from aerosid.signals.recursive_filter import butterworth_sections, filtered_from_steady

Array = NDArray[np.float64]


LATE = "late"
"""Name of a candidate that is the lag of a control instead of a term."""


@dataclass(frozen=True)
class InFlightSettings:
    """Settings of the estimate while flying.

    Attributes
    ----------
    step : float
        s between two frames; a person reads four a second.
    shown : int
        Candidates in each frame, strongest first.
    false_alarm : float
        Share of flights with nothing missing in which something may be named, by design, over all frames: each is
        judged at this over the number of frames of the flight.
    reach : float
        Difference of -2 ln L by which a name must lead the other candidates of its coefficient: odds of 20 to 1.
    most : int
        Terms that may be named on one flight.
    settling : float
        s at the beginning that are left out: the filter's own transient.
    cut_off_hz : float
        Of the causal second-order low-pass on d(t) and on the candidates' pictures: twice the usual short period.
    rate_hz : float
        Samples of the low-passed d(t) that enter the regression: four times the cut-off hold all that passes it.
    lags : tuple of float
        Time constants, s, of the lags of controls that a term has to outdo before it is named.
    chain : ChainSettings
        Weights; channels enter unfiltered.
    screening : ScreeningSettings
    """

    step: float = 0.25
    shown: int = 6
    false_alarm: float = 0.001
    reach: float = 6.0
    most: int = 4
    settling: float = 1.0
    rate_hz: float = 8.0
    cut_off_hz: float = 2.0
    lags: tuple[float, ...] = (0.05, 0.1, 0.2)
    chain: ChainSettings = field(default_factory=ChainSettings)
    screening: ScreeningSettings = field(default_factory=ScreeningSettings)


@dataclass(frozen=True)
class DerivativeNow:
    """The present estimate of a derivative; NaN until it is determined."""

    coefficient: str
    term: str
    value: float
    deviation: float


@dataclass(frozen=True)
class CandidateNow:
    """Statistics of a candidate so far: partial correlation with d(t), t-ratio, p-value over candidates and frames.

    `reason`: a sentence on why it is not identified; empty where it was not evaluated.
    """

    coefficient: str
    term: str
    correlation: float
    ratio: float
    p_value: float
    reason: str = ""

    @property
    def label(self) -> str:
        """As a person writes it."""
        return f"{self.coefficient} {self.term}"


@dataclass(frozen=True)
class Named:
    """A term that d(t) showed to be missing, and when, s."""

    coefficient: str
    term: str
    time: float


@dataclass(frozen=True)
class Frame:
    """What is known at one moment.

    Attributes
    ----------
    time : float
        s.
    model_error : tuple of float
        d in the coefficients of the model's case, about body axes; NaN where a sample is missing.
    derivatives : tuple of DerivativeNow
    candidates : tuple of CandidateNow
        The strongest.
    names : tuple of Named
        What has become significant, in that order; each is a derivative from then on as well.
    """

    time: float
    model_error: tuple[float, ...]
    derivatives: tuple[DerivativeNow, ...]
    candidates: tuple[CandidateNow, ...]
    names: tuple[Named, ...]


def frames(
    model: AerodynamicModel,
    manoeuvre: Manoeuvre,
    entries: Sequence[Entry],
    candidates: Sequence[Entry],
    settings: InFlightSettings,
) -> Iterator[Frame]:
    """The frames of a flight, in order.

    Parameters
    ----------
    model : AerodynamicModel
        The declared one.
    manoeuvre : Manoeuvre
        A recorded flight, taken as if its samples were just coming in.
    entries : sequence of Entry
        Declared terms that are estimated.
    candidates : sequence of Entry
        Terms that are screened.

    Raises
    ------
    EstimationError
        Where the recursion leaves the model's range.
    """
    chain = replace(settings.chain, filtering="off")
    density = choose_error_density(model, [manoeuvre], chain)
    fed = feed(manoeuvre, chain)
    extended = model.extended(candidates)
    history = _low_passed(estimate_aircraft_error(extended, fed.flight, fed.variance, density), manoeuvre, settings)
    yield from _judged(extended, history, manoeuvre.flight.time, entries, candidates, settings)


def _low_passed(
    history: AircraftErrorHistory, manoeuvre: Manoeuvre, settings: InFlightSettings
) -> AircraftErrorHistory:
    """The history through the causal low-pass, all columns alike; as it is where the sampling is too slow for it."""
    interval = manoeuvre.interval
    if settings.cut_off_hz * interval >= 0.4:
        return history
    sections = butterworth_sections(2, settings.cut_off_hz, interval)
    present = np.isfinite(history.d).all(axis=1)

    def passed(values: Array) -> Array:
        found = np.full_like(values, np.nan)
        found[present] = filtered_from_steady(sections, values[present])
        return found

    return replace(history, d=passed(history.d), responded=passed(history.responded), initial=passed(history.initial))


def _judged(
    model: AerodynamicModel,
    history: AircraftErrorHistory,
    time: Array,
    entries: Sequence[Entry],
    candidates: Sequence[Entry],
    settings: InFlightSettings,
) -> Iterator[Frame]:
    moving = history.rate_per_unit.shape[1]
    columns = _columns(model, history, entries, candidates)
    known = [*range(len(entries)), *range(len(entries) + len(candidates), columns.shape[2])]
    controls, late = _late_controls(model, columns, entries, time, settings.lags)
    columns = np.concatenate([columns, late], axis=2)
    screening = StreamingScreening(columns.shape[2], moving, settings=settings.screening)
    count = max(1, round((time[-1] - time[0]) / settings.step))
    stride = max(1, round(1.0 / (settings.rate_hz * float(np.median(np.diff(time))))))
    structure = list(entries)
    due = time[0] + settings.step
    names: list[Named] = []
    for k in range(time.size):
        if time[k] - time[0] >= settings.settling and k % stride == 0:
            screening.update(history.d[k, :moving], columns[k])
        if time[k] < due and k + 1 < time.size:
            continue
        due = time[k] + settings.step
        found = screening.ask(known, len(candidates) * count)
        screened = _candidates_now(found, entries, candidates, structure) + _late_now(found, controls)
        strongest = _told_apart(screened, settings)
        if strongest is not None and len(names) < settings.most:
            names.append(Named(strongest.coefficient, strongest.term, float(time[k])))
            place = _place(candidates, strongest)
            known.append(len(entries) + place)
            structure.append(candidates[place])
            found = screening.ask(known, len(candidates) * count)
            screened = _candidates_now(found, entries, candidates, structure) + _late_now(found, controls)
        d = history.d[k, :moving] / history.rate_per_unit[k]
        ranked = sorted(
            (row for row in screened if row.term != LATE), key=lambda row: (row.p_value, -abs(row.correlation))
        )
        derivatives = _derivatives_now(model, found, entries, candidates, structure)
        shown = tuple(
            replace(row, reason=_reason(row, screened, len(names), settings)) for row in ranked[: settings.shown]
        )
        yield Frame(float(time[k]), tuple(float(v) for v in d), derivatives, shown, tuple(names))


def _told_apart(screened: Sequence[CandidateNow], settings: InFlightSettings) -> CandidateNow | None:
    """The strongest candidate, where it is significant and no other of its coefficient does nearly as well."""
    strongest = _strongest(screened)
    if strongest is None or strongest.p_value > settings.false_alarm or _rival(strongest, screened, settings):
        return None
    return strongest


def _strongest(screened: Sequence[CandidateNow]) -> CandidateNow | None:
    terms = [row for row in screened if row.term != LATE]
    return max(terms, key=lambda row: abs(row.correlation) if row.p_value < 1.0 else 0.0, default=None)


def _rival(row: CandidateNow, screened: Sequence[CandidateNow], settings: InFlightSettings) -> CandidateNow | None:
    """Of the other candidates of its coefficient, and of late controls, the best, where it does nearly as well."""
    left = max(1.0 - row.correlation**2, np.finfo(float).tiny)
    # As many independent samples as give this correlation its t-ratio.
    effective = row.ratio**2 * left / max(row.correlation**2, np.finfo(float).tiny)
    others = [
        other for other in screened if other is not row and (other.coefficient == row.coefficient or other.term == LATE)
    ]
    best = max(others, key=lambda other: abs(other.correlation), default=None)
    if best is None or effective * np.log((1.0 - best.correlation**2) / left) >= settings.reach:
        return None
    return best


def _reason(row: CandidateNow, screened: Sequence[CandidateNow], named: int, settings: InFlightSettings) -> str:
    """Reason why a candidate is not identified at this time."""
    if row.ratio == 0.0:
        return "collinear with the terms of the model"
    if row.p_value > settings.false_alarm:
        return f"not significant: p is to be below {settings.false_alarm:g}"
    if (rival := _rival(row, screened, settings)) is not None:
        return f"not distinguishable from {rival.label}"
    if named >= settings.most:
        return f"{named} terms are identified, the maximum"
    strongest = _strongest(screened)
    if strongest is None or strongest is row:
        return "significant, identified with the next frame if it remains so"
    return f"less correlated than {strongest.label}"


def _late_controls(
    model: AerodynamicModel, columns: Array, entries: Sequence[Entry], time: Array, lags: Sequence[float]
) -> tuple[list[str], Array]:
    """Controls, and what each that lags shows in d(t): one column (N, v, C) for each control and time constant.

    By what its declared terms show, lagged less as it is: the filters are linear and hardly change along a flight.
    """
    found: list[str] = []
    made = [np.zeros((*columns.shape[:2], 0))]
    for control in controls_of(model):
        shown = np.zeros(columns.shape[:2])
        for place, (coefficient, term) in enumerate(entries):
            if str(term) == control:
                shown = shown + model.value((coefficient, term)) * np.nan_to_num(columns[:, :, place])
        if shown.any():
            found += [control] * len(lags)
            made += [(lagged(time, shown, lag) - shown)[:, :, None] for lag in lags]
    return found, np.concatenate(made, axis=2)


def _late_now(found: Screened, controls: Sequence[str]) -> list[CandidateNow]:
    """How well late controls do, the last columns: with one of them nearly as good it is no time to name a term."""
    first = found.correlation.size - len(controls)
    return [
        CandidateNow(
            control,
            LATE,
            float(found.correlation[first + n]),
            float(found.ratio[first + n]),
            float(found.p_value[first + n]),
        )
        for n, control in enumerate(controls)
    ]


def _place(candidates: Sequence[Entry], row: CandidateNow) -> int:
    return next(n for n, (name, term) in enumerate(candidates) if (name, str(term)) == (row.coefficient, row.term))


def _columns(
    model: AerodynamicModel, history: AircraftErrorHistory, entries: Sequence[Entry], candidates: Sequence[Entry]
) -> Array:
    """Pictures in d(t) of declared terms, of candidates and of an error of the initial state, (N, v, K)."""
    places, moving = model.indices([*entries, *candidates]), history.rate_per_unit.shape[1]
    return np.concatenate([history.responded[:, :moving, :][:, :, places], history.initial[:, :moving, :]], axis=2)


def _derivatives_now(
    model: AerodynamicModel,
    found: Screened,
    entries: Sequence[Entry],
    candidates: Sequence[Entry],
    structure: Sequence[Entry],
) -> tuple[DerivativeNow, ...]:
    order = [*entries, *candidates]
    rows = []
    for entry in structure:
        n = order.index(entry)
        value = model.value(entry) + float(found.coefficients[n])
        rows.append(DerivativeNow(entry[0], str(entry[1]), value, float(found.deviations[n])))
    return tuple(rows)


def _candidates_now(
    found: Screened, entries: Sequence[Entry], candidates: Sequence[Entry], structure: Sequence[Entry]
) -> list[CandidateNow]:
    first = len(entries)
    return [
        CandidateNow(
            entry[0],
            str(entry[1]),
            float(found.correlation[first + n]),
            float(found.ratio[first + n]),
            float(found.p_value[first + n]),
        )
        for n, entry in enumerate(candidates)
        if entry not in structure
    ]
