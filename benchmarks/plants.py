"""What may be wrong with a flight: every kind of the catalogue, and kinds that the catalogue does not hold."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.signal import lfilter

Array = NDArray[np.float64]
History = Callable[[Array], Array]


@dataclass(frozen=True)
class Plant:
    """One thing that is wrong.

    `accept` and `near`: what names it, as (kind, where, term), an empty where or term for any; no `accept`: nothing of
    the catalogue does. `terms` flown and not declared. `control` from the recorded to the acting elevator. `driven`
    adds to a coefficient. `inputs` deflect surfaces. `push` changes thrust. `gust` (sigma m/s, length m). `stall`,
    `ground` (gain), `shift` (m, s). `memory` (coefficient, number, source, time constant s): a coefficient knows a
    variable's past. `places` (x, z in m) of accelerometers that are declared at the centre of gravity. `sensors` change
    the true channel given all outputs, `recorders` what is recorded, `logged` adds channels.
    """

    label: str
    accept: tuple[tuple[str, str, str], ...] = ()
    near: tuple[tuple[str, str, str], ...] = ()
    terms: tuple[tuple[str, str, float], ...] = ()
    control: Callable[[Array, Array], Array] | None = None
    driven: tuple[tuple[str, History], ...] = ()
    inputs: tuple[tuple[str, History], ...] = ()
    push: Callable[[Array, Array], Array] | None = None
    gust: tuple[float, float] | None = None
    stall: Mapping[str, float] | None = None
    ground: float | None = None
    shift: tuple[float, float] | None = None
    memory: tuple[str, float, str, float] | None = None
    places: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    sensors: tuple[tuple[str, Callable[[Array, Array, Mapping[str, Array]], Array]], ...] = ()
    recorders: tuple[tuple[str, Callable[[Array, Array, np.random.Generator], Array]], ...] = ()
    logged: tuple[tuple[str, History], ...] = ()


@dataclass(frozen=True)
class Scale:
    """How a flight without anything wrong went: what sizes are measured in.

    `alpha`, `speed` the largest excursions, rad, 1; `elevator` that of the input, rad; `share(coefficient, term)` the
    largest swing of a term with number one over that of the coefficient; `end` the record's, s; `chord`, m.
    """

    alpha: float
    elevator: float
    share: Callable[[str, str], float]
    end: float
    chord: float
    thrust: float
    airspeed: float
    swing: Mapping[str, float]


def lagged(time: Array, values: Array, constant: float) -> Array:
    """First-order lag on a fine uniform grid, bilinear."""
    a = 0.5 * (time[1] - time[0]) / constant
    b = [a / (1.0 + a), a / (1.0 + a)]
    return np.asarray(lfilter(b, [1.0, -(1.0 - a) / (1.0 + a)], values - values[0]) + values[0])


def finely_lagged(time: Array, values: Array, constant: float) -> Array:
    """The same of samples, linear between them, through a fine grid."""
    return _lagged_between(time, lambda fine: np.interp(fine, time, values), constant)


def _lagged_between(time: Array, course: Callable[[Array], Array], constant: float) -> Array:
    """What a course does between samples, through a first-order lag, at the samples."""
    fine = np.linspace(time[0], time[-1], 1 + (time.size - 1) * 8)
    return np.interp(time, fine, lagged(fine, course(fine), constant))


def late(time: Array, values: Array, delay: float) -> Array:
    """What is linear between samples, as a surface here, some time later."""
    return np.interp(time - delay, time, values)


def sensed_late(time: Array, values: Array, delay: float) -> Array:
    """A motion, smooth between samples, some time later: interpolated linearly it would be low-passed as well."""
    return np.asarray(CubicSpline(time, values)(np.maximum(time - delay, time[0])))


def sensed_lagging(time: Array, values: Array, constant: float) -> Array:
    """A motion, smooth between samples, through a first-order lag."""
    return _lagged_between(time, CubicSpline(time, values), constant)


def rate_limited(time: Array, values: Array, rate: float) -> Array:
    """What a surface of limited rate follows."""
    out = [float(values[0])]
    for step, aim in zip(np.diff(time), values[1:], strict=True):
        out.append(out[-1] + float(np.clip(aim - out[-1], -rate * step, rate * step)))
    return np.array(out)


def backlash(_time: Array, values: Array, play: float) -> Array:
    """What follows through a play."""
    out = [float(values[0])]
    for aim in values[1:]:
        out.append(float(np.clip(out[-1], aim - play, aim + play)))
    return np.array(out)


def sticking(values: Array, play: float) -> Array:
    """A surface that rests until it is wanted further off than `play`, and then goes there at once."""
    out = [float(values[0])]
    for aim in values[1:]:
        out.append(float(aim) if abs(aim - out[-1]) > play else out[-1])
    return np.array(out)


def overshooting(time: Array, values: Array, frequency: float, damping: float) -> Array:
    """What follows as a second-order system of that frequency, rad/s, on a fine uniform grid."""
    step = float(time[1] - time[0])
    root = np.exp(step * frequency * complex(-damping, np.sqrt(1.0 - damping**2)))
    a = [1.0, -2.0 * root.real, abs(root) ** 2]
    return np.asarray(lfilter([sum(a)], a, values - values[0]) + values[0])


TERMS = (
    ("C_m", "alpha^2", ("alpha^3", "pos")),
    ("C_m", "alpha^3", ("alpha^2", "alpha^4", "pos")),
    ("C_m", "alpha*delta_e", ("delta_e^2",)),
    ("C_m", "delta_e^2", ("alpha*delta_e",)),
    ("C_m", "delta_e^3", ()),
    ("C_m", "V_hat", ("alpha*V_hat", "delta_e*V_hat")),
    ("C_m", "alpha*q_hat", ()),
    ("C_X", "alpha^2", ("alpha^3", "pos")),
    ("C_X", "delta_e", ()),
    ("C_X", "alpha^3", ("alpha^2", "pos", "alpha^4")),
    ("C_Z", "alpha^3", ("alpha^2", "alpha^4", "pos")),
    ("C_Z", "alpha^2", ("alpha^3", "pos")),
    ("C_Z", "V_hat", ("alpha*V_hat",)),
    ("C_m", "alpha_dot_hat", ("alpha*q_hat",)),
)
BIAS = {"alpha": 0.015, "V": 3.0, "theta": 0.012, "q": 0.006, "a_x": 0.2, "a_z": 0.4}


def _of_terms(s: Scale, size: float, sign: float, n: int) -> Plant:
    coefficient, term, alike = TERMS[n % len(TERMS)]
    number = 0.2 * size * sign / max(s.share(coefficient, term), 1e-9)
    near = tuple(("aero_term", coefficient, other) for other in alike)
    return Plant(
        f"{coefficient} {term} {number:.3g}",
        (("aero_term", coefficient, term),),
        near,
        terms=((coefficient, term, number),),
    )


def _step(size: float, sign: float, when: float, names: tuple[str, ...]) -> Plant:
    jump = {"C_m": 0.012 * size * sign, "C_Z": -0.08 * size * sign, "C_X": -0.015 * size}
    return Plant(
        f"step {'+'.join(names)} at {when:.2f}",
        tuple(("step_change", name, "") for name in names),
        (("thrust_change", "", ""), ("cg_shift", "", "")),
        driven=tuple((name, lambda t, n=name: jump[n] * (t >= when)) for name in names),
    )


def in_catalogue(n: int, s: Scale, generator: np.random.Generator) -> Plant:
    """The n-th of the kinds of the catalogue, at a size between barely visible and gross."""
    size = float(np.exp(generator.uniform(np.log(0.4), np.log(2.2))))
    sign = float(generator.choice([-1.0, 1.0]))
    when = float(generator.uniform(0.25, 0.6)) * s.end
    k = int(generator.integers(1000))

    def bias() -> Plant:
        channel = tuple(BIAS)[k % 6]
        b = sign * size * BIAS[channel]
        return Plant(
            f"bias {channel} {b:.3g}",
            (("sensor_bias", channel, ""),),
            (("sensor_bias", "", ""),),
            sensors=((channel, lambda _t, y, _o: y + b),),
        )

    def scale() -> Plant:
        channel = ("q", "alpha", "V", "a_z", "theta")[k % 5]
        f = 1.0 + sign * size * (0.04 if channel == "V" else 0.08)
        return Plant(
            f"scale {channel} {f:.3g}",
            (("sensor_scale", channel, ""),),
            (("sensor_bias", channel, ""),),
            sensors=((channel, lambda _t, y, _o: f * y),),
        )

    def delay() -> Plant:
        channel = ("alpha", "q", "theta", "a_z", "V")[k % 5]
        d = (0.6 if channel == "V" else 0.1) * size
        return Plant(
            f"delay {channel} {d:.3g}",
            (("sensor_delay", channel, ""),),
            (("sensor_lag", channel, ""),),
            sensors=((channel, lambda t, y, _o: late(t, y, d)),),
        )

    def lag() -> Plant:
        channel = ("alpha", "q", "a_z", "V")[k % 4]
        d = (0.8 if channel == "V" else 0.1) * size
        return Plant(
            f"lag {channel} {d:.3g}",
            (("sensor_lag", channel, ""),),
            (("sensor_delay", channel, ""),),
            sensors=((channel, lambda t, y, _o: finely_lagged(t, y, d)),),
        )

    def stall() -> Plant:
        # size as in a manoeuvre that reaches about the angle where half of the flow has separated
        p = {
            "alpha_star": s.swing["alpha_highest"] + 0.03 / size,
            "sharpness": 26.0,
            "delay": 0.2,
            "relaxation": 0.25,
            "C_X": -0.05,
            "C_m": -0.06,
        }
        near = tuple(("aero_term", c, t) for c in ("C_Z", "C_m") for t in ("alpha^2", "alpha^3", "alpha^4", "pos"))
        return Plant(f"stall {p['alpha_star']:.3g}", (("flow_separation", "", ""),), near, stall=p)

    rate = s.swing["elevator_rate"]
    kinds: tuple[Callable[[], Plant], ...] = (
        lambda: _of_terms(s, size, sign, k),
        lambda: Plant(
            f"control lag {0.1 * size:.3g}",
            (("control_lag", "delta_e", ""),),
            (("control_delay", "delta_e", ""),),
            control=lambda t, x: lagged(t, x, 0.1 * size),
        ),
        lambda: Plant(
            f"control delay {0.08 * size:.3g}",
            (("control_delay", "delta_e", ""),),
            (("control_lag", "delta_e", ""),),
            control=lambda t, x: late(t, x, 0.08 * size),
        ),
        lambda: Plant(
            "rate limit",
            (("control_rate_limit", "delta_e", ""),),
            (("control_lag", "delta_e", ""), ("control_delay", "delta_e", "")),
            control=lambda t, x: rate_limited(t, x, rate / size),
        ),
        bias,
        scale,
        delay,
        lag,
        lambda: _step(size, sign, when, ("C_m",)),
        lambda: _step(size, sign, when, ("C_X", "C_Z", "C_m")),
        lambda: Plant(
            f"gust {0.8 * size:.2g}",
            (("gust", "", ""),),
            (("unexplained", "", ""),),
            gust=(0.012 * s.airspeed * size, 200.0),
        ),
        stall,
        lambda: Plant(
            f"cg shift {0.05 * sign * size * s.chord:.3g} at {when:.2f}",
            (("cg_shift", "x", ""),),
            (("step_change", "C_m", ""),),
            shift=(0.05 * sign * size * s.chord, when),
        ),
        lambda: Plant(
            f"thrust change at {when:.2f}",
            (("thrust_change", "thrust", ""),),
            (("step_change", "C_X", ""),),
            push=lambda t, x: x - 0.35 * size * x * (t >= when),
        ),
        lambda: Plant(
            "thrust factor",
            (("thrust_scale", "thrust", ""),),
            (("aero_term", "C_X", "C_T"),),
            push=lambda t, x: x * (1.0 + 0.4 * np.sin(0.7 * t)),
            logged=(("thrust", lambda t: s.thrust * (1.0 + 0.4 * np.sin(0.7 * t)) / (1.0 + 0.3 * sign * size)),),
        ),
        lambda: _of_terms(s, size, sign, k + 5),
        lambda: Plant("ground effect", (("ground_effect", "C_Z", ""),), (), ground=0.3 * size),
        lambda: Plant(
            "flap logged",
            (("aero_term", "C_m", "delta_f"), ("aero_term", "C_Z", "delta_f")),
            (),
            terms=(("C_m", "delta_f", -0.05 * size), ("C_Z", "delta_f", -0.5 * size)),
            inputs=(("delta_f", lambda t: 0.3 * np.clip((t - when) / 2.0, 0.0, 1.0)),),
            logged=(("delta_f", lambda t: 0.3 * np.clip((t - when) / 2.0, 0.0, 1.0)),),
        ),
        lambda: Plant(
            "stabiliser trim logged",
            (("aero_term", "C_m", "delta_h"),),
            (("aero_term", "C_Z", "delta_h"),),
            terms=(("C_m", "delta_h", -1.5 * size), ("C_Z", "delta_h", -0.4 * size)),
            inputs=(("delta_h", lambda t: 0.015 * np.clip((t - when) / 1.5, 0.0, 1.0)),),
            logged=(("delta_h", lambda t: 0.015 * np.clip((t - when) / 1.5, 0.0, 1.0)),),
        ),
        lambda: Plant(
            "dead band",
            (("control_deadband", "delta_e", ""),),
            (),
            control=lambda _t, x: x - np.clip(x - x[0], -0.25 * size * s.elevator, 0.25 * size * s.elevator),
        ),
    )
    return kinds[n % len(kinds)]()


KINDS = 20
OUTSIDE = 24


def outside(n: int, s: Scale, generator: np.random.Generator) -> Plant:
    """The n-th of the kinds that the catalogue does not hold."""
    size = float(np.exp(generator.uniform(np.log(0.4), np.log(2.2))))
    slow = float(generator.uniform(0.25, 0.8))
    middle = float(generator.uniform(0.3, 0.6)) * s.end
    e = s.elevator

    def dead(_t: Array, y: Array, o: Mapping[str, Array]) -> Array:
        away = y - y[0]
        return y - np.clip(away, -0.15 * size * np.ptp(o["q"]), 0.15 * size * np.ptp(o["q"]))

    def rolling(t: Array) -> Array:
        return np.clip((t - middle) / 1.5, 0.0, 1.0) * np.clip((middle + 5.0 - t) / 1.5, 0.0, 1.0)

    def shaking(t: Array, y: Array, o: Mapping[str, Array], gain: float) -> Array:
        step = float(t[1] - t[0])
        root = np.exp((-0.04 + 1j) * 2.0 * np.pi * 3.5 * step)
        answer = lfilter([1.0], [1.0, -2.0 * root.real, abs(root) ** 2], np.gradient(o["delta_e"], t) * step)
        return y + gain * size * answer

    def dropped(_t: Array, y: Array, g: np.random.Generator) -> Array:
        out = y.copy()
        for start in g.integers(10, y.size - 10, 6):
            out[start : start + int(g.integers(2, 12))] = out[start]
        return out

    kinds: tuple[Callable[[], Plant], ...] = (
        lambda: Plant("elevator backlash", control=lambda t, x: backlash(t, x, 0.2 * size * e)),
        lambda: Plant("hinge-moment float", control=lambda t, x: x + lagged(t, 0.15 * size * (x - x[0]) ** 2 / e, 0.4)),
        lambda: Plant("propwash that lags alpha", memory=("C_m", 0.25 * size, "alpha", 0.4)),
        lambda: Plant("lift that lags the elevator", memory=("C_Z", -0.4 * size, "delta_e", 0.5)),
        lambda: Plant("rate gyro with a dead band", sensors=(("q", dead),)),
        lambda: Plant(
            "alpha vane at its stop",
            sensors=(("alpha", lambda _t, y, _o: np.minimum(y, y.max() - 0.25 * size * np.ptp(y))),),
        ),
        lambda: Plant(
            "structural mode in q and a_z",
            sensors=(("q", lambda t, y, o: shaking(t, y, o, 0.3)), ("a_z", lambda t, y, o: shaking(t, y, o, 20.0))),
        ),
        lambda: Plant(
            "unrecorded roll",
            driven=(
                ("C_m", lambda t: -0.01 * size * rolling(t)),
                ("C_Z", lambda t: -0.06 * size * rolling(t)),
                ("C_X", lambda t: -0.01 * size * rolling(t)),
            ),
        ),
        lambda: Plant(
            "fuel slosh", driven=(("C_m", lambda t: 0.006 * size * np.sin(2.0 * np.pi * slow * t) * np.exp(-t / 12.0)),)
        ),
        lambda: Plant(
            "alpha drifts with temperature", sensors=(("alpha", lambda t, y, _o: y + 0.0015 * size * (t - t[0])),)
        ),
        lambda: Plant(
            "coarse alpha", recorders=(("alpha", lambda _t, y, _g: 0.006 * size * np.round(y / (0.006 * size))),)
        ),
        lambda: Plant("frozen samples", recorders=(("q", dropped), ("a_z", dropped), ("alpha", dropped))),
        lambda: Plant(
            "slow drift of C_m",
            driven=(("C_m", lambda t: 0.012 * size * np.clip((t - 0.25 * s.end) / (0.5 * s.end), 0.0, 1.0)),),
        ),
        lambda: Plant("slow drift of C_X", driven=(("C_X", lambda t: -0.02 * size * t / s.end),)),
        lambda: Plant("a bump in C_Z", driven=(("C_Z", lambda t: 0.08 * size * np.exp(-(((t - middle) / 0.5) ** 2))),)),
        lambda: Plant(
            "pilot-induced pulse unrecorded",
            control=lambda t, x: x + 0.5 * size * e * ((t > middle) & (t < middle + 0.6)),
        ),
        lambda: Plant(
            "q nonlinear", sensors=(("q", lambda _t, y, _o: y + 0.3 * size * y * np.abs(y) / np.abs(y).max()),)
        ),
        lambda: Plant(
            "theta oscillates", sensors=(("theta", lambda t, y, _o: y + 0.008 * size * np.sin(2.0 * np.pi * slow * t)),)
        ),
        lambda: Plant(
            "clock jitter of alpha",
            sensors=(
                ("alpha", lambda t, y, _o: np.interp(t - 0.08 * size * (1.0 + np.sin(2.0 * np.pi * 0.15 * t)), t, y)),
            ),
        ),
        lambda: Plant(
            "unseen surface oscillates",
            driven=(("C_m", lambda t: 0.004 * size * np.sign(np.sin(2.0 * np.pi * slow * t))),),
        ),
        lambda: Plant("elevator sticks", control=lambda _t, x: sticking(x, 0.3 * size * e)),
        lambda: Plant("elevator at its stop", control=lambda _t, x: np.minimum(x, x.max() - 0.2 * size * np.ptp(x))),
        lambda: Plant("actuator that overshoots", control=lambda t, x: overshooting(t, x, 9.0 / size, 0.35)),
        lambda: Plant(
            "clock of alpha and V runs slow",
            sensors=tuple(
                (channel, lambda t, y, _o: np.interp(t - 0.012 * size * (t - t[0]), t, y)) for channel in ("alpha", "V")
            ),
        ),
    )
    return kinds[n % len(kinds)]()
