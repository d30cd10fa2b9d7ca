"""Patterns between declared and estimated derivatives that indicate an error of a file and not aerodynamics.

A wrong mass, wing area or density scales all of C_Z and C_X by one factor, a wrong moment of inertia or chord all of
C_m, an airspeed in another unit the static derivatives of all coefficients by the square of the units' ratio; a
derivative per degree is off by a factor of 57.3, one per q c/V by 2; a sign convention reverses a sign, and so
does an accelerometer far from its declared position.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from aerosid.aircraft import Aircraft
from aerosid.compatibility.remedies import SPEEDS
from aerosid.effects.sensor_position import farthest_place
from aerosid.loop.derivative_table import DerivativeRow, derivative_name
from aerosid.loop.model_validation.open_loop_errors import ErrorRow
from aerosid.nomenclature import is_surface
from aerosid.notation import listed, number, with_deviation
from aerosid.search.declared_inertia import InertiaChange, inertia_change, sentence_on_inertia
from aerosid.search.settings import DeclaredInertiaSettings

__all__ = ["PatternSettings", "notes_on_patterns"]


@dataclass(frozen=True)
class PatternSettings:
    """Thresholds from which a pattern is reported.

    Attributes
    ----------
    many : float
        Times the declared value, or part of it, from which a single derivative is reported. Derivatives of one
        configuration differ by less than a factor of 3 between sources (Roskam, Airplane Flight Dynamics, appendix B).
    deviations : float
        Of its own, by which a number must differ from what it is compared with.
    near : float
        Relative distance from 180/pi, or from 2, at which a unit is questioned.
    near_half : float
        Relative distance from 2 or 1/2 at which q c/V is questioned, where its standard error is small enough.
    sharp : float
        Largest standard error of a factor, relative to 2 or 1/2, with which q c/V is questioned: a less certain one is
        near either by chance. Chosen: a fifth of the way from 1 to 1/2.
    apart : float
        Relative scatter of factors that still are one.
    common : float
        Relative distance from 1 at which a common factor is reported.
    fewest : int
        Derivatives that must share it; constants do not count, they hold trim and instrument zeros.
    worse : float
        Times the error before, from which the completed model fits its own data worse.
    contradicted : float
        Standard deviations of the declared and the estimated value together from which a derivative contradicts its
        a-priori standard deviation. Five, since those are judgements: on the flights of benchmarks/field_detection.py,
        seeds 160 and 161, of which every effect was identified, three derivatives were further off than 3, by 3.5 to
        5.1.
    """

    many: float = 5.0
    deviations: float = 3.0
    near: float = 0.25
    near_half: float = 0.05
    sharp: float = 0.1
    apart: float = 0.12
    common: float = 0.15
    fewest: int = 3
    worse: float = 1.05
    contradicted: float = 5.0


PATTERNS = PatternSettings()

_CAUSES = {
    "C_Z": "mass, wing area or air density",
    "C_L": "mass, wing area or air density",
    "C_m": "moment of inertia, mean chord, wing area or air density",
}


LIFTING = ("C_Z", "C_L")
"""Coefficients that the vertical accelerometer shows: along body z, and against it as near as small angles tell."""


def notes_on_patterns(
    rows: Sequence[DerivativeRow],
    errors: Sequence[ErrorRow],
    aircraft: Aircraft | None,
    inertia: DeclaredInertiaSettings,
) -> tuple[str, ...]:
    """One sentence for each pattern, whatever the verdict.

    Parameters
    ----------
    rows : sequence of DerivativeRow
        The derivatives; insignificant ones are not tested.
    errors : sequence of ErrorRow
        Of the logs that were fitted and others.
    aircraft : Aircraft or None
        Whose derivatives they are, for the position of the accelerometer.
    inertia : DeclaredInertiaSettings
        From when derivatives of roll and yaw are a wrong product of inertia.
    """
    tested = [row for row in rows if _known(row)]
    misread = _misread_airspeed(tested)
    common = [] if misread else _common_factors(tested)
    shared = {coefficient for coefficient, _ in common}
    lagged = {row.coefficient for row in rows if "alpha_dot_hat" in row.term}
    turned = _reversed_controls(tested)
    shows_lift = any(row.channel == "a_z" for row in errors)

    def elsewhere(row: DerivativeRow) -> str:
        if aircraft is None or not shows_lift or not _is_reversed(row):
            return ""
        return _accelerometer_of(row, tested, aircraft)

    change = _product_of_inertia(rows, aircraft, inertia)
    by_inertia = set() if change is None else {(c, str(term)) for c, term in change.explained}
    sigmas = {} if aircraft is None else {(d.coefficient, str(d.term)): d.sigma for d in aircraft.derivatives}

    def sentence_on(row: DerivativeRow) -> str | None:
        pattern = _single(row, row.coefficient in shared | lagged)
        if pattern is None and row.coefficient not in shared:
            return _contradiction(row, sigmas.get((row.coefficient, row.term)))
        return pattern

    single = [
        sentence + elsewhere(row)
        for row in (() if misread else tested)  # every one of them is off
        if row.term not in turned and (row.coefficient, row.term) not in by_inertia and (sentence := sentence_on(row))
    ]
    coupled = () if change is None else (sentence_on_inertia(change),)
    return (
        *misread,
        *(sentence for _, sentence in common),
        *turned.values(),
        *coupled,
        *single,
        *_worse(errors, rows),
    )


def _product_of_inertia(
    rows: Sequence[DerivativeRow], aircraft: Aircraft | None, settings: DeclaredInertiaSettings
) -> InertiaChange | None:
    """The change of I_xz that explains how the derivatives of roll and yaw differ; None where none does."""
    if aircraft is None:
        return None
    known = {(row.coefficient, row.term): (row.value, row.std_error) for row in rows if _known(row)}
    estimates = {}
    for derivative in aircraft.derivatives:
        value, error = known.get((derivative.coefficient, str(derivative.term)), (0.0, None))
        if error is not None:
            estimates[derivative.coefficient, derivative.term] = value, error
    return inertia_change(estimates, aircraft, settings)


def _known(row: DerivativeRow) -> bool:
    return row.shown and bool(row.declared) and row.std_error is not None and math.isfinite(row.value)


def _is_of_surface(row: DerivativeRow) -> bool:
    """Whether the row's term is a surface's deflection, one of its powers or a product that begins with it."""
    return is_surface(row.term)


def _ratio(row: DerivativeRow) -> tuple[float, float]:
    """Estimated over declared, and its standard error."""
    declared = row.declared or 1.0
    return row.value / declared, (row.std_error or 0.0) / abs(declared)


def _common_factors(rows: Sequence[DerivativeRow]) -> list[tuple[str, str]]:
    """Coefficients all of whose derivatives are off by one factor, with the sentence."""
    found = []
    for coefficient, causes in _CAUSES.items():
        ratios = np.array([_ratio(row) for row in rows if row.coefficient == coefficient and row.term != "1"])
        if len(ratios) < PATTERNS.fewest:
            continue
        values, deviations = ratios.T
        weights = 1.0 / np.maximum(deviations, 0.02 * np.abs(values)) ** 2
        factor = float(np.sum(weights * values) / np.sum(weights))
        spread = np.abs(values - factor)
        alike = np.all(spread <= np.maximum(PATTERNS.deviations * deviations, PATTERNS.apart * abs(factor)))
        certain = abs(factor - 1.0) > PATTERNS.deviations / math.sqrt(float(np.sum(weights)))
        if factor > 0.0 and alike and certain and abs(math.log(factor)) > math.log(1.0 + PATTERNS.common):
            sentence = (
                f"All derivatives of {coefficient} are {number(factor)} times the declared values "
                f"({number(values.min())} to {number(values.max())}): "
                f"check {causes} before assuming an aerodynamic cause."
            )
            found.append((coefficient, sentence))
    return found


def _misread_airspeed(rows: Sequence[DerivativeRow]) -> tuple[str, ...]:
    """Sentence on an airspeed in another unit, which divides all static derivatives by the square of its ratio.

    Dynamic pressure alone does that to forces and moments alike; q c/(2 V) and V_hat contain the airspeed once more.
    """
    static = [row for row in rows if row.term in ("alpha", "beta") or _is_of_surface(row)]
    ratios = [(row.coefficient, *_ratio(row)) for row in static]
    certain = [(name, factor) for name, factor, error in ratios if error < PATTERNS.sharp * abs(factor)]
    names = list(dict.fromkeys(name for name, _ in certain))
    if len(certain) < PATTERNS.fewest or len(names) < 2 or any(factor <= 0.0 for _, factor in certain):
        return ()
    factors = np.array([factor for _, factor in certain])
    # Knots and miles an hour are 15 % apart, as are their squares by 32 %: the nearer one is named.
    others = [(unit, size) for unit, size in SPEEDS.items() if unit != "m/s"]
    meant = {f"{unit} read as m/s": size**2 for unit, size in others}
    meant |= {f"m/s read as {unit}": size**-2 for unit, size in others}
    distance = {name: float(np.max(np.abs(np.log(factors / size)))) for name, size in meant.items()}
    nearest = min(distance, key=distance.__getitem__)
    if distance[nearest] > math.log(1.0 + PATTERNS.near):
        return ()
    sentence = (
        f"The static derivatives of {listed(names)} are {number(factors.min())} to {number(factors.max())} times the "
        f"declared values, as with an airspeed in {nearest} ({number(meant[nearest])}): check the unit of V in the "
        "channel map, then air density and wing area."
    )
    return (sentence,)


def _reversed_controls(rows: Sequence[DerivativeRow]) -> dict[str, str]:
    """Controls all of whose certain derivatives, in several coefficients, have the other sign, with the sentence."""
    found = {}
    for term in dict.fromkeys(row.term for row in rows if _is_of_surface(row)):
        ratios = [(row.coefficient, *_ratio(row)) for row in rows if row.term == term]
        certain = [(name, factor) for name, factor, error in ratios if abs(factor) > PATTERNS.deviations * error]
        if len(certain) > 1 and all(factor < 0.0 for _, factor in certain):
            names = " and ".join(name for name, _ in certain)
            found[term] = (
                f"{term} has the opposite sign to the declared one in {names}: the recorder probably uses the opposite "
                f"sign convention; set sign = -1 in the channel map and run again."
            )
    return found


def _single(row: DerivativeRow, rate_reported: bool) -> str | None:
    """Sentence on an unusual ratio of one derivative to its declared value.

    `rate_reported`: that of q_hat is off with all of its coefficient, or shares its part with a derivative of
    alpha_dot_hat, whose sum a flight shows: its own factor then is no evidence for q c/V.
    """
    factor, deviation = _ratio(row)
    name = f"{row.coefficient} {row.term}"
    if row.term == "1" or abs(factor) <= PATTERNS.deviations * deviation:
        return None
    if _is_reversed(row):
        return (
            f"{name} has the opposite sign to the declared value ({number(row.value)} against {number(row.declared)}): "
            "check the sign conventions of the aircraft file and of the recorder."
        )
    per_degree = math.degrees(1.0)
    for unit, meant in ((per_degree, "per degree"), (1.0 / per_degree, "per radian where the log is in degrees")):
        if abs(math.log(factor / unit)) < math.log(1.0 + PATTERNS.near):
            return f"{name} is {number(factor)} times the declared value: is it declared {meant}?"
    if "q_hat" in row.term and not rate_reported:
        for unit, check in ((2.0, "is it declared per q c/V"), (0.5, "was it converted from q c/V twice")):
            near = abs(factor - unit) <= max(PATTERNS.deviations * deviation, PATTERNS.near_half * unit)
            sharp = deviation <= PATTERNS.sharp * unit
            if near and sharp and abs(factor - 1.0) > PATTERNS.deviations * deviation:
                return f"{name} is {number(factor)} times the declared value: {check}? q_hat is q c/(2 U0)."
    if not 1.0 / PATTERNS.many < factor < PATTERNS.many:
        return f"{name} is {number(factor)} times the declared value: check its unit and decimal point."
    return None


def _contradiction(row: DerivativeRow, sigma: float | None) -> str | None:
    """Sentence on a derivative that lies many of its a-priori standard deviations, `sigma`, from its declared value."""
    if row.term == "1" or sigma is None or row.declared is None or row.std_error is None:
        return None
    distance = abs(row.value - row.declared) / math.hypot(sigma, row.std_error)
    if distance < PATTERNS.contradicted:
        return None
    return (
        f"{row.coefficient} {row.term} of {with_deviation(row.value, row.std_error)} contradicts its declared value "
        f"{with_deviation(row.declared, sigma)} by {number(distance, 2)} standard deviations: the declared accuracy is "
        "too high, or an effect that acts like this derivative is missing or wrongly identified."
    )


def _is_reversed(row: DerivativeRow) -> bool:
    """Whether an estimate certainly has the other sign than the declared value."""
    factor, deviation = _ratio(row)
    return row.term != "1" and factor < -PATTERNS.deviations * deviation


def _accelerometer_of(row: DerivativeRow, rows: Sequence[DerivativeRow], aircraft: Aircraft) -> str:
    """Position of the vertical accelerometer at which a control's lift would be as declared; empty without one.

    One that sits x ahead of its declared place shows -x q_dot more, and q_dot is q_bar S c C_m / I_yy, so that C_Z
    seems to gain -x (m c / I_yy) C_m (Klein & Morelli, Aircraft System Identification, section 10.2). Where C_Z holds
    the same terms as C_m the record cannot distinguish the two.
    """
    moments = [other for other in rows if (other.coefficient, other.term) == ("C_m", row.term)]
    if row.coefficient not in LIFTING or not _is_of_surface(row) or not moments:
        return ""
    (moment,) = moments
    if moment.value * (moment.declared or 0.0) <= 0.0:
        return ""
    more = row.value - (row.declared or 0.0)
    too_much = more if row.coefficient == "C_Z" else -more
    ahead = -too_much * aircraft.I_yy / (aircraft.mass * aircraft.mean_chord * moment.value)
    if abs(ahead) > farthest_place("a_z", aircraft.mean_chord, aircraft.length):
        return ""
    side = "ahead of" if ahead > 0.0 else "behind"
    return (
        f" Check the accelerometer positions as well: with a_z measured {number(abs(ahead))} m {side} its declared "
        f"position, the pitching acceleration that it senses appears as {row.coefficient} {row.term}, which is then as "
        "declared; these records cannot distinguish the two."
    )


def _worse(errors: Sequence[ErrorRow], derivatives: Sequence[DerivativeRow]) -> list[str]:
    """Fitted logs that the completed model fits worse than the declared structure re-estimated."""
    sentences = []
    kept = [row for row in derivatives if row.by_validation and row.estimate is not None]
    names = listed([derivative_name(row.coefficient, row.term) for row in kept])
    advice = (
        f": the validation flights are predicted better with {names} as declared, and these data are fitted better "
        "with other values; fly what shows them"
        if kept
        else ": do not adopt it"
    )
    for log in dict.fromkeys(row.log for row in errors if row.role == "identification"):
        rows = [row for row in errors if row.log == log and row.before and row.after is not None]
        if not rows:
            continue
        ratio = float(np.exp(np.mean([math.log(max(row.after or 0.0, 1e-300) / (row.before or 1.0)) for row in rows])))
        if ratio > PATTERNS.worse:
            most = max(rows, key=lambda row: (row.after or 0.0) / (row.before or 1.0))
            sentences.append(
                f"The completed model fits its own identification data on {log} worse than the declared structure "
                f"re-estimated, by a factor of {number(ratio)} over all channels and "
                f"{number((most.after or 0.0) / (most.before or 1.0))} in {most.channel}{advice}."
            )
    return sentences
