"""The declared aircraft: geometry, mass, thrust and aerodynamic model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from aerosid.flight_model.axes import LATERAL, LONGITUDINAL, Axes, loads_of
from aerosid.flight_model.terms import Term


@dataclass(frozen=True)
class Derivative:
    """One declared derivative: `value` times `term` adds to `coefficient`.

    Attributes
    ----------
    coefficient
        C_X, C_Z, C_m, C_L, C_D, C_Y, C_l or C_n.
    term
        What the value is multiplied with.
    value
        In 1 (terms carry their own SI units).
    sigma
        A-priori standard deviation of the value, None where none is given.
    fixed
        Neither estimated nor named as an effect.
    shown
        False in a completed file: the flights hold too little information, and the value is as it was declared.
    """

    coefficient: str
    term: Term
    value: float
    sigma: float | None = None
    fixed: bool = False
    shown: bool = True


@dataclass(frozen=True)
class DeclaredEffect:
    """An effect that is no term, as `[[effects]]` of the aircraft file holds it.

    Attributes
    ----------
    kind
        As in result.json: control_lag, sensor_delay, step_change and so on.
    where
        Channel or coefficient, empty for a gust.
    value
        In the unit of the kind (s, rad/s, rad, 1 or the channel's); None where only `parameters` say it.
    term
        Term in canonical text, empty for most kinds.
    time
        Time of a sudden change, s of its log.
    log
        Name of the log that a sudden change happened on; empty: any that is identified.
    parameters
        Further numbers by name, SI.
    std_error
        Standard error of the value, None where unknown.
    """

    kind: str
    where: str
    value: float | None = None
    term: str = ""
    time: float | None = None
    parameters: Mapping[str, float] = field(default_factory=dict)
    std_error: float | None = None
    log: str = ""


@dataclass(frozen=True)
class LogOfCompletion:
    """A log that a completed model is from: `start` and `stop` are the span that was used, s of the log's own time."""

    name: str
    role: str
    sha256: str
    start: float
    stop: float


@dataclass(frozen=True)
class CompletionRecord:
    """What made the numbers of a completed file, as its table `[completed]` holds it.

    Attributes
    ----------
    program : str
        Name and version.
    date : str
        As 2026-11-22, UTC.
    verdict : str
        Of the loop, as in result.json.
    declared_file, declared_sha256, declared_source : str
        The file that was completed (its name), the hash of its text, and what it said of its numbers.
    logs : tuple of LogOfCompletion
    settings : mapping of str to text
        Those that differ from the usual ones, as they print.
    not_shown : tuple of str
        Coefficient and term of each derivative that keeps its declared value.
    bounds : str
        What `sigma` is.
    """

    program: str
    date: str
    verdict: str
    declared_file: str = ""
    declared_sha256: str = ""
    declared_source: str = ""
    logs: tuple[LogOfCompletion, ...] = ()
    settings: Mapping[str, str] = field(default_factory=dict)
    not_shown: tuple[str, ...] = ()
    bounds: str = ""


@dataclass(frozen=True)
class FuelTable:
    """How mass, inertia and centre of gravity follow the fuel used, linear between the entries and level beyond.

    Attributes
    ----------
    used
        Fuel used, kg, increasing.
    mass
        kg at each; empty: the aircraft's mass less the fuel used.
    I_yy
        kg m^2 at each; empty: the aircraft's.
    x_cg
        m by which the centre of gravity lies ahead of the declared one at each; empty: it stays there.
    """

    used: tuple[float, ...]
    mass: tuple[float, ...] = ()
    I_yy: tuple[float, ...] = ()
    x_cg: tuple[float, ...] = ()

    def mass_at(self, used: NDArray[np.float64], full: float) -> NDArray[np.float64]:
        """Mass, kg, with this fuel used, kg; `full` that of the aircraft file, with none used."""
        return np.interp(used, self.used, self.mass) if self.mass else full - used

    def inertia_at(self, used: NDArray[np.float64], declared: float) -> NDArray[np.float64]:
        """I_yy, kg m^2, with this fuel used, kg."""
        return np.interp(used, self.used, self.I_yy) if self.I_yy else np.full(used.shape, declared)

    def centre_at(self, used: NDArray[np.float64]) -> NDArray[np.float64]:
        """How far the centre of gravity lies ahead of the declared one, m, with this fuel used, kg."""
        return np.interp(used, self.used, self.x_cg) if self.x_cg else np.zeros(used.shape)


@dataclass(frozen=True, repr=False)
class Aircraft:
    """The aircraft file as read, SI and radians.

    Attributes
    ----------
    name, source
        Name of the aircraft; where its numbers come from.
    wing_area
        m^2
    mean_chord
        m
    airspeed
        U0 of q_hat and V_hat, m/s; None: the current airspeed in q_hat, the log's mean airspeed in V_hat.
    mass
        kg; a mass channel in the log wins.
    I_yy
        kg m^2
    density
        Air density, kg/m^3, None where the log must give it.
    thrust
        Force along body x, N, None where the log must give it.
    thrust_incidence
        Angle of the thrust line, rad, positive where thrust pushes up: F_z = -T sin(incidence).
    thrust_z_arm
        Thrust line below the centre of gravity, m: pitching moment = T z_arm.
    axes
        The case of the equations of motion that the declared coefficients make.
    derivatives
        The declared model by coefficient, terms in the order of the file.
    candidates
        Further terms to screen, by coefficient; terms that are declared already are left out.
    effects
        Declared effects that are no terms.
    limits
        Of a flight to come, lowest and highest alpha [rad], n_z [1], V [m/s], theta [rad], delta_e [rad] and
        delta_e_rate [rad/s]; only those that the file gives.
    path, sha256, text
        The file, the hash of its text, and the text itself.
    configuration
        Centre of gravity, flaps and gear as flown, in the words of the file; only what it gives.
    length
        From nose to tail, m, None where the file does not say: no sensor lies further from the centre of gravity.
    fuel
        How mass, inertia and centre of gravity follow the fuel used, None where the file does not say.
    noise, resolution
        Of recorded channels, SI, where the file gives them: they win over what is estimated from a log, and a log's
        channel map wins over them.
    span
        Whole span, m, the length of p_hat, r_hat, C_l and C_n; None where the file does not say.
    I_xx, I_zz, I_xz
        kg m^2, I_xz the integral of x z dm; None where the file does not say.
    flight_phase, aircraft_class
        Category and class after MIL-F-8785C for the flying qualities, None where the file does not say.
    completion
        What made the numbers of a completed file; None of any other.
    """

    name: str
    source: str
    wing_area: float
    mean_chord: float
    airspeed: float | None
    mass: float
    I_yy: float
    density: float | None
    thrust: float | None
    thrust_incidence: float
    thrust_z_arm: float
    derivatives: tuple[Derivative, ...]
    candidates: Mapping[str, tuple[Term, ...]]
    effects: tuple[DeclaredEffect, ...]
    path: str
    sha256: str
    text: str
    flight_phase: str | None = None
    aircraft_class: str | None = None
    limits: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    configuration: Mapping[str, str] = field(default_factory=dict)
    length: float | None = None
    completion: CompletionRecord | None = None
    fuel: FuelTable | None = None
    noise: Mapping[str, float] = field(default_factory=dict)
    resolution: Mapping[str, float] = field(default_factory=dict)
    span: float | None = None
    I_xx: float | None = None
    I_zz: float | None = None
    I_xz: float | None = None
    axes: Axes = LONGITUDINAL

    def __repr__(self) -> str:
        """One line: name, file and how many derivatives and effects it declares."""
        return (
            f"<Aircraft {self.name}: {len(self.derivatives)} derivatives in {', '.join(self.coefficients)}, "
            f"{len(self.effects)} effects; {self.path}>"
        )

    @property
    def coefficients(self) -> tuple[str, ...]:
        """The coefficients of this model, in body axes or with C_D and C_L in place of C_X and C_Z."""
        lift_and_drag = any(entry.coefficient in self.axes.wind_axes for entry in self.derivatives)
        symmetric = ("C_D", "C_L", "C_m") if lift_and_drag else LONGITUDINAL.coefficients
        return tuple(name for name in (*symmetric, *LATERAL.coefficients) if name in loads_of(self.axes))

    @property
    def free(self) -> tuple[tuple[str, Term], ...]:
        """Coefficient and term of the derivatives that are estimated, in order."""
        return tuple((d.coefficient, d.term) for d in self.derivatives if not d.fixed)

    @property
    def variables(self) -> frozenset[str]:
        """The variables of all terms."""
        return frozenset(name for d in self.derivatives for name in d.term.variables)

    def completed(
        self,
        values: Mapping[tuple[str, str], tuple[float, float | None]],
        effects: Sequence[DeclaredEffect] = (),
        not_shown: Sequence[tuple[str, str]] = (),
        record: CompletionRecord | None = None,
    ) -> Aircraft:
        """The aircraft with what was found, its text being the given file's with its comments and layout kept.

        Parameters
        ----------
        values
            (coefficient, term in any spelling) -> (value, standard error or None). A declared derivative takes the
            value, and the standard error as its sigma; any other becomes a new derivative. Fixed derivatives stay.
        effects
            Added to the declared ones; one of the same kind, place, term and time replaces the declared one.
        not_shown
            (coefficient, term) of the declared derivatives that keep their value and are marked with `shown = false`.
        record
            What made the numbers: it becomes the table `[completed]`, and the source says so.

        Raises
        ------
        AircraftError
            Where a value is no finite number or a term cannot be read.
        """
        from aerosid.aircraft.completion import complete  # which reads its own text back into an Aircraft

        return complete(self, values, effects, not_shown, record)
