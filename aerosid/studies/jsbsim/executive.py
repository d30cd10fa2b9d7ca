"""JSBSim with one aircraft: evaluation of frozen states, trim, and flight.

It runs in a process of its own, since JSBSim may abort. Imports are light, so that the process starts quickly.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from aerosid.errors import EstimationError
from aerosid.flight_model.settings import SIMULATION
from aerosid.reporting.export.jsbsim_units import FOOT, INCH, POUND_FORCE, SLUG
from aerosid.studies.jsbsim.properties import AT_TRIM, DEVIATIONS, PLANET, THRUST, THRUST_PLACE

Array = NDArray[np.float64]

RECORDED = {
    "V": ("velocities/vt-fps", FOOT),
    "alpha": ("aero/alpha-rad", 1.0),
    "beta": ("aero/beta-rad", 1.0),
    "u": ("velocities/u-aero-fps", FOOT),
    "v": ("velocities/v-aero-fps", FOOT),
    "w": ("velocities/w-aero-fps", FOOT),
    "p": ("velocities/p-rad_sec", 1.0),
    "q": ("velocities/q-rad_sec", 1.0),
    "r": ("velocities/r-rad_sec", 1.0),
    "phi": ("attitude/phi-rad", 1.0),
    "theta": ("attitude/theta-rad", 1.0),
    "psi": ("attitude/psi-rad", 1.0),
    "h": ("position/h-sl-ft", FOOT),
    "force_x": ("forces/fbx-total-lbs", POUND_FORCE),
    "force_y": ("forces/fby-total-lbs", POUND_FORCE),
    "force_z": ("forces/fbz-total-lbs", POUND_FORCE),
    "p_dot": ("accelerations/pdot-rad_sec2", 1.0),
    "q_dot": ("accelerations/qdot-rad_sec2", 1.0),
    "r_dot": ("accelerations/rdot-rad_sec2", 1.0),
    "mass": ("inertia/mass-slugs", SLUG),
    "rho": ("atmosphere/rho-slugs_ft3", SLUG / FOOT**3),
    "mach": ("velocities/mach", 1.0),
    "surface": ("fcs/elevator-pos-rad", 1.0),
    "aileron": ("fcs/right-aileron-pos-rad", 1.0),
    "rudder": ("fcs/rudder-pos-rad", 1.0),
}
"""Quantities read after every frame: JSBSim's property and the factor to SI. Nx and Nz would be a frame old."""

_SETTLING = 6
"""Numerical: successive initialisations after which JSBSim's initial condition no longer changes."""


@dataclass(frozen=True)
class State:
    """A state to be frozen: airspeed [m/s], alpha [rad], q [rad/s], delta_e [rad], thrust [N], path angle [rad].

    Sideslip, aileron and rudder [rad], roll and yaw rate [rad/s].
    """

    airspeed: float
    alpha: float
    q: float
    delta_e: float
    thrust: float
    path_angle: float = 0.0
    beta: float = 0.0
    delta_a: float = 0.0
    delta_r: float = 0.0
    p: float = 0.0
    r: float = 0.0


class Executive:
    """JSBSim with one aircraft loaded.

    Parameters
    ----------
    folder : Path
        Folder with `aircraft/NAME/NAME.xml` and the planet.
    name : str
        NAME.
    frame : float
        s; needed by actuators when the model is loaded.
    altitude : float
        m.
    properties : mapping of str to float
        Properties set once the model is loaded.
    reads : sequence of str
        Properties read by the aerodynamics; each has to exist, whether JSBSim defines it or not.
    thrust_below : float
        Height of the thrust's point below the centre of gravity, m.
    """

    def __init__(
        self,
        folder: Path,
        name: str,
        *,
        frame: float,
        altitude: float,
        properties: Mapping[str, float],
        reads: Sequence[str] = (),
        thrust_below: float = 0.0,
    ) -> None:
        import jsbsim

        base: Any = jsbsim.FGJSBBase()  # type: ignore[no-untyped-call]
        base.debug_lvl = 0
        self.fdm: Any = jsbsim.FGFDMExec(str(folder), None)
        self.fdm.set_debug_level(0)
        self.altitude = altitude
        self.attached: float | None = None  # alpha at which the flow reattaches before each state
        known = self.fdm.get_property_manager()
        for name_read in reads:
            if not known.hasNode(name_read):
                self[name_read] = 0.0  # output of engines or systems, which are not simulated
        self.fdm.set_dt(frame)
        if not self.fdm.load_planet(str(folder / PLANET), False) or not self.fdm.load_model(name):
            raise EstimationError(f"JSBSim could not load the aircraft {name}; try another aircraft.")
        for key, value in properties.items():
            self[key] = value
        self.freeze(State(100.0, 0.0, 0.0, 0.0, 0.0))  # which computes the centre of gravity
        self.centre = tuple(self[f"inertia/cg-{axis}-in"] * INCH for axis in "xyz")
        self.mass, self.I_yy = self["inertia/mass-slugs"] * SLUG, self["inertia/iyy-slugs_ft2"] * SLUG * FOOT**2
        self.I_xx, self.I_zz = (self[f"inertia/{name}-slugs_ft2"] * SLUG * FOOT**2 for name in ("ixx", "izz"))
        self.I_xz = -self["inertia/ixz-slugs_ft2"] * SLUG * FOOT**2  # element of the tensor
        self.span = self["metrics/bw-ft"] * FOOT
        self.wing_area, self.mean_chord = self["metrics/Sw-sqft"] * FOOT**2, self["metrics/cbarw-ft"] * FOOT
        self.place(THRUST_PLACE, 0.0, thrust_below)

    def __getitem__(self, name: str) -> float:
        return float(self.fdm.get_property_value(name))

    def __setitem__(self, name: str, value: float) -> None:
        self.fdm.set_property_value(name, float(value))

    def place(self, pattern: str, forward: float, below: float, right: float = 0.0) -> None:
        """Set a point in body coordinates from the first centre of gravity, m; JSBSim counts aft and up, in inches."""
        for axis, centre, offset in zip("xyz", self.centre, (-forward, right, -below), strict=True):
            name = pattern.format(x=axis, X=axis.upper())
            if not self.fdm.get_property_manager().hasNode(name):  # writing it would only create a new one
                raise EstimationError(
                    f"JSBSim has no property {name}; install the version that aerosid was tested with."
                )
            self[name] = (centre + offset) / INCH

    def freeze(self, state: State) -> None:
        """Set the aircraft to a state and iterate until alphadot, which is a frame old, has converged."""
        for control, name in AT_TRIM.items():
            self[name] = getattr(state, control)
            self[DEVIATIONS[control]] = 0.0
        self[THRUST] = state.thrust / POUND_FORCE
        for name, value in (
            ("ic/h-sl-ft", self.altitude / FOOT),
            ("ic/psi-true-rad", 0.0),
            ("ic/phi-rad", 0.0),
            ("ic/beta-rad", state.beta),
            ("ic/vt-fps", state.airspeed / FOOT),
            ("ic/alpha-rad", state.alpha),
            ("ic/theta-rad", state.alpha + state.path_angle),
            ("ic/p-rad_sec", state.p),
            ("ic/q-rad_sec", state.q),
            ("ic/r-rad_sec", state.r),
        ):
            self[name] = value
        if self.attached is not None:
            self["ic/alpha-rad"] = self["ic/theta-rad"] = self.attached
            self.fdm.run_ic()
            self["ic/alpha-rad"], self["ic/theta-rad"] = state.alpha, state.alpha + state.path_angle
        for _ in range(_SETTLING):
            self.fdm.run_ic()
        # JSBSim resets the integration of q and attitude to explicit Euler at every initialisation.
        for name, scheme in (("rate", 4), ("position", 7)):
            self[f"simulation/integrator/{name}/rotational"] = scheme
            self[f"simulation/integrator/{name}/translational"] = 4

    def accelerations(self) -> Array:
        """u', w' [m/s^2] and q' [rad/s^2] of the frozen state, (3,)."""
        u_dot, w_dot = self["accelerations/udot-ft_sec2"], self["accelerations/wdot-ft_sec2"]
        return np.array([u_dot * FOOT, w_dot * FOOT, self["accelerations/qdot-rad_sec2"]])

    def lateral_accelerations(self) -> Array:
        """V' [m/s^2], p' and r' [rad/s^2] of the frozen state, (3,)."""
        v_dot = self["accelerations/vdot-ft_sec2"] * FOOT
        return np.array([v_dot, self["accelerations/pdot-rad_sec2"], self["accelerations/rdot-rad_sec2"]])

    def coefficients(self) -> Array:
        """C_X, C_Z and C_m of the aerodynamics about the current centre of gravity, (3,)."""
        pressure_area = self["aero/qbar-psf"] * self["metrics/Sw-sqft"]
        moment = self["moments/m-aero-lbsft"] / self["metrics/cbarw-ft"]
        forces = self["forces/fbx-aero-lbs"], self["forces/fbz-aero-lbs"]
        return np.array([*forces, moment]) / pressure_area

    def lateral_coefficients(self) -> Array:
        """C_Y, C_l and C_n of the aerodynamics about the current centre of gravity, (3,)."""
        force = self["aero/qbar-psf"] * self["metrics/Sw-sqft"]
        moments = self["moments/l-aero-lbsft"], self["moments/n-aero-lbsft"]
        return np.array([self["forces/fby-aero-lbs"], *(each / self["metrics/bw-ft"] for each in moments)]) / force

    def trim(self, airspeed: float, sideways: bool = False) -> State:
        """Level flight without acceleration: Newton's method in alpha, elevator and thrust.

        Parameters
        ----------
        airspeed : float
            m/s.
        sideways : bool
            Whether sideslip, aileron and rudder are trimmed as well.

        Raises
        ------
        EstimationError
            Where no trim is found within 0.5 rad of alpha and 1 rad of elevator.
        """
        weight = self.mass * 9.80665

        def state(unknown: Array) -> State:
            alpha, delta_e, thrust, *aside = unknown.tolist()
            return State(airspeed, alpha, 0.0, delta_e, thrust * weight, 0.0, *aside)

        def unbalanced(unknown: Array) -> Array:
            self.freeze(state(unknown))
            if sideways:
                return np.concatenate([self.accelerations(), self.lateral_accelerations()])
            return self.accelerations()

        for start in (0.05, 0.0, 0.12):
            unknown = np.array([start, 0.0, 0.1, *([0.0] * 3 if sideways else [])])
            rest = unbalanced(unknown)
            for _ in range(40):
                slopes = np.column_stack(
                    [(unbalanced(unknown + step) - rest) / step.sum() for step in 1e-5 * np.eye(unknown.size)]
                )
                if not np.isfinite(slopes).all() or abs(np.linalg.det(slopes)) < 1e-12:
                    break
                # At most half a step where tables bend, or the iteration jumps across them.
                change = np.linalg.solve(slopes, rest)
                unknown = unknown - change * min(1.0, 0.1 / float(np.max(np.abs(change[:2])) + 1e-300))
                rest = unbalanced(unknown)
                if np.max(np.abs(rest)) < 1e-9 and abs(unknown[0]) < 0.5 and abs(unknown[1]) < 1.0:
                    return state(unknown)
        raise EstimationError(
            f"JSBSim found no level flight at {airspeed:g} m/s and {self.altitude:g} m; try another airspeed or "
            "altitude."
        )

    def fly(self, drives: Mapping[str, Array]) -> dict[str, Array]:
        """Quantities of `RECORDED` after each frame: (F,) each, the first of them those of the present state.

        Parameters
        ----------
        drives : mapping of str to (F,)
            Property -> its value in each frame, set before that frame.

        Raises
        ------
        EstimationError
            Where the flight leaves |alpha| < 1.5 rad.
        """
        fdm = self.fdm
        read, write, run = fdm.get_property_value, fdm.set_property_value, fdm.run
        columns = {name: values.tolist() for name, values in drives.items()}
        frames = len(next(iter(columns.values())))
        names = [name for name, _ in RECORDED.values()]
        table = np.empty((frames, len(names)))
        for k in range(frames):
            if k:
                for name, values in columns.items():
                    write(name, values[k])
                run()
            row = [read(name) for name in names]
            table[k] = row
            if not abs(row[names.index("aero/alpha-rad")]) < SIMULATION.flow_angle:
                raise EstimationError(
                    f"the flight leaves |alpha| < {SIMULATION.flow_angle:g} rad after {k * fdm.get_delta_t():.2f} s; "
                    "reduce the amplitude."
                )
        factors = np.array([factor for _, factor in RECORDED.values()])
        return dict(zip(RECORDED, (table * factors).T, strict=True))
