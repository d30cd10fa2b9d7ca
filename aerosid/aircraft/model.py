"""What an aircraft is to the rest of aerosid: geometry, mass, thrust and the declared aerodynamic model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from aerosid.flight_model.terms import Term


@dataclass(frozen=True)
class Derivative:
    """One declared derivative: `value` times `term` adds to `coefficient`.

    Attributes
    ----------
    coefficient
        C_X, C_Z, C_m, C_L or C_D.
    term
        What the value is multiplied with.
    value
        In 1 (terms carry their own SI units).
    sigma
        A-priori standard deviation of the value, None where none is given.
    fixed
        Neither estimated nor named as an effect.
    """

    coefficient: str
    term: Term
    value: float
    sigma: float | None = None
    fixed: bool = False


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
    flight_phase, aircraft_class
        Category and class after MIL-F-8785C for the flying qualities, None where the file does not say.
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

    @property
    def coefficients(self) -> tuple[str, str, str]:
        """The three coefficients of this model: C_X, C_Z, C_m, or C_D, C_L, C_m."""
        lift_and_drag = any(entry.coefficient in ("C_L", "C_D") for entry in self.derivatives)
        return ("C_D", "C_L", "C_m") if lift_and_drag else ("C_X", "C_Z", "C_m")

    def completed(
        self,
        values: Mapping[tuple[str, str], tuple[float, float | None]],
        effects: Sequence[DeclaredEffect] = (),
    ) -> Aircraft:
        """The aircraft with what was found, its text being the given file's with its comments and layout kept.

        Parameters
        ----------
        values
            (coefficient, term in any spelling) -> (value, standard error or None). A declared derivative takes the
            value, and the standard error as its sigma; any other becomes a new derivative. Fixed derivatives stay.
        effects
            Added to the declared ones; one of the same kind, place, term and time replaces the declared one.

        Raises
        ------
        AircraftError
            Where a value is no finite number or a term cannot be read.
        """
        from aerosid.aircraft.completion import complete  # which reads its own text back into an Aircraft

        return complete(self, values, effects)
