"""What may be wrong with a lateral or six-axis flight: one of every kind of the catalogue, by name and size."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial

import numpy as np
from numpy.typing import NDArray

from benchmarks.plants import finely_lagged, late, rate_limited, sensed_lagging, sensed_late

Array = NDArray[np.float64]
Changed = Callable[[Array, Array], Array]
Name = tuple[str, str, str]


@dataclass(frozen=True)
class SidePlant:
    """One thing that is wrong.

    Attributes
    ----------
    label : str
    accept, near : tuple of (kind, where, term)
        What names it, and what hardly differs from it; an empty where or term stands for any.
    cases : tuple of str
        Of `lateral` and `six`, those whose file can name it.
    terms : mapping of (coefficient, term) to float
        Flown beside those of the body, or in place of them.
    omitted : tuple of (coefficient, term)
        Flown and not declared.
    surfaces, sensors : mapping of str to callable
        (time, recorded) -> what the surface does; (time, true) -> what the sensor shows.
    positions : mapping of str to (x, y, z)
        Of sensors, m.
    product_of_inertia : float
        Beyond the declared I_xz, as a share of I_xx.
    engine : (moment s, share of all thrust that is lost, arm to the right m), optional
    centre : (to the right m, from when on s)
        Of gravity.
    jumps : mapping of str to (size, moment s)
        Of coefficients.
    channels : mapping of str to callable
        (time, generator) -> a further recorded channel that terms name.
    thrust_moves : bool
        Whether thrust is recorded and changes.
    """

    label: str
    accept: tuple[Name, ...] = ()
    near: tuple[Name, ...] = ()
    cases: tuple[str, ...] = ("lateral", "six")
    terms: Mapping[tuple[str, str], float] = field(default_factory=dict)
    omitted: tuple[tuple[str, str], ...] = ()
    surfaces: Mapping[str, Changed] = field(default_factory=dict)
    sensors: Mapping[str, Changed] = field(default_factory=dict)
    positions: Mapping[str, tuple[float, float, float]] = field(default_factory=dict)
    product_of_inertia: float = 0.0
    engine: tuple[float, float, float] | None = None
    centre: tuple[float, float] = (0.0, 0.0)
    jumps: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    channels: Mapping[str, Callable[[Array, np.random.Generator], Array]] = field(default_factory=dict)
    thrust_moves: bool = False


def _shifted(by: float, _time: Array, values: Array) -> Array:
    return values + by


def _scaled(by: float, _time: Array, values: Array) -> Array:
    return by * values


def _lagging(constant: float, time: Array, values: Array) -> Array:
    return finely_lagged(time, values, constant)


def _sensed_lagging(constant: float, time: Array, values: Array) -> Array:
    return sensed_lagging(time, values, constant)


def _sensed_late(delay: float, time: Array, values: Array) -> Array:
    return sensed_late(time, values, delay)


def _late(delay: float, time: Array, values: Array) -> Array:
    return late(time, values, delay)


def _limited(rate: float, time: Array, values: Array) -> Array:
    return rate_limited(time, values, rate)


def _banded(half: float, _time: Array, values: Array) -> Array:
    """Nothing happens within half a band of the first position."""
    return values - np.clip(values - values[0], -half, half)


def _levels(time: Array, generator: np.random.Generator) -> Array:
    """Steps of a further surface at random moments, 1."""
    out, at = np.zeros(time.size), 0.0
    while at < time[-1]:
        length = float(generator.uniform(1.0, 3.0))
        out[(time >= at) & (time < at + length)] = float(generator.choice([-1.0, 0.0, 1.0]))
        at += length
    return out


NO_PLANT = SidePlant("nothing")


def _term(coefficient: str, term: str, value: float, near: tuple[str, ...] = (), **more: object) -> SidePlant:
    label = f"{coefficient} {term}"
    alike = tuple(("aero_term", coefficient, other) for other in near)
    return SidePlant(
        label,
        (("aero_term", coefficient, term),),
        alike,
        terms={(coefficient, term): value},
        **more,  # type: ignore[arg-type]
    )


def _missing(coefficient: str, term: str, value: float, *near: Name) -> SidePlant:
    entry = (coefficient, term)
    name = ("aero_term", coefficient, term)
    return SidePlant(f"{coefficient} {term}", (name,), near, terms={entry: value}, omitted=(entry,))


def _of_terms(size: float, sign: float) -> tuple[SidePlant, ...]:
    s = size * sign
    alpha = tuple(("aero_term", c, t) for c in ("C_l", "C_n") for t in ("C_T", "C_T*beta"))
    return (
        _term("C_n", "beta^3", 2.5 * size, ("beta*abs(beta)",)),
        _term("C_l", "beta*abs(beta)", -0.35 * size, ("beta^3",)),
        _term("C_l", "alpha*beta", 0.8 * s, ("alpha^2*beta",)),
        _term("C_n", "alpha*p_hat", 1.2 * s),
        _term("C_l", "delta_a*abs(delta_a)", 0.7 * size, ("delta_a^3",)),
        _term("C_n", "abs(delta_r)", 0.02 * s, ("delta_r^2",)),
        _term("C_Y", "beta^3", -5.0 * size, ("beta*abs(beta)",)),
        _missing("C_Y", "p_hat", 0.25 * s),
        _missing("C_l", "delta_r", 0.03 * size),
        _missing("C_n", "delta_a", 0.016 * s, ("inertia", "I_xz", "")),
        _missing("C_n", "p_hat", -0.07 * size, ("inertia", "I_xz", "")),
        _missing("C_l", "r_hat", 0.14 * size),
        _term("C_n", "C_T", 0.05 * s, ("C_T*beta",), thrust_moves=True),
        _term("C_l", "C_T", 0.05 * s, ("C_T*beta",), thrust_moves=True),
        SidePlant(
            "C_n C_T*beta", (("aero_term", "C_n", "C_T*beta"),), alpha, terms={("C_n", "C_T*beta"): 1.0 * s},
            thrust_moves=True,
        ),
        _term("C_m", "beta^2", -0.9 * size, ("abs(beta)", "alpha*beta^2"), cases=("six",)),
        _term("C_m", "p_hat", 0.12 * s, (), cases=("six",)),
        _term("C_m", "abs(beta)", -0.08 * size, ("beta^2",), cases=("six",)),
        _term("C_Z", "beta^2", 4.0 * size, ("abs(beta)", "alpha*beta^2"), cases=("six",)),
        SidePlant(
            "C_n nozzle", (("aero_term", "C_n", "nozzle"),), terms={("C_n", "nozzle"): 0.0025 * s},
            channels={"nozzle": _levels},
        ),
        SidePlant(
            "C_l spoiler", (("aero_term", "C_l", "spoiler"),), (("aero_term", "C_n", "spoiler"),),
            terms={("C_l", "spoiler"): 0.005 * s, ("C_n", "spoiler"): 0.0005 * s}, channels={"spoiler": _levels},
        ),
    )  # fmt: skip


BIAS = {"beta": 0.02, "p": 0.012, "r": 0.008, "phi": 0.02, "a_y": 0.15}
SCALE = {"beta": 0.12, "p": 0.1, "r": 0.1, "phi": 0.1, "a_y": 0.12}
TIMING = {"beta": 0.1, "p": 0.06, "r": 0.08, "phi": 0.1, "a_y": 0.08}


def _of_sensors(size: float, sign: float, span: float) -> tuple[SidePlant, ...]:
    s = size * sign
    made = []
    # A zero of r, of a_y and of phi is one drift of the sideslip.
    drifts = {"r": ("a_y", "phi"), "a_y": ("r", "phi"), "phi": ("r", "a_y"), "p": ("phi",), "beta": ()}
    for channel, bias in BIAS.items():
        near = tuple(("sensor_bias", other, "") for other in drifts[channel])
        made.append(_faulty("bias", channel, partial(_shifted, bias * s), near))
        made.append(_faulty("scale", channel, partial(_scaled, 1.0 + SCALE[channel] * s)))
    for channel, timing in TIMING.items():
        near = (("sensor_lag", channel, ""), ("sensor_position", channel, ""))
        made.append(_faulty("delay", channel, partial(_sensed_late, timing * size), near))
        near = (("sensor_delay", channel, ""), ("sensor_position", channel, ""))
        made.append(_faulty("lag", channel, partial(_sensed_lagging, timing * size), near))
    for channel, label, at in (
        ("beta", "ahead", (0.25 * span * size, 0.0, 0.0)),
        ("beta", "on a boom", (0.3 * span * size, 0.0, -0.025 * span)),
        ("a_y", "ahead", (0.08 * span * s, 0.0, 0.0)),
        ("a_y", "below", (0.0, 0.0, 0.04 * span * s)),
        ("a_y", "to the right", (0.0, 0.15 * span * s, 0.0)),
    ):
        other = "a_y" if channel == "beta" else "beta"
        near = (("sensor_position", other, ""), ("sensor_lag", channel, ""), ("sensor_delay", channel, ""))
        name = f"position {channel} {label}"
        made.append(SidePlant(name, (("sensor_position", channel, ""),), near, positions={channel: at}))
    return tuple(made)


def _faulty(what: str, channel: str, change: Changed, near: tuple[Name, ...] = ()) -> SidePlant:
    return SidePlant(f"{what} {channel}", ((f"sensor_{what}", channel, ""),), near, sensors={channel: change})


def _of_controls(size: float) -> tuple[SidePlant, ...]:
    made = []
    for surface, half in (("delta_a", 0.02), ("delta_r", 0.015)):
        for what, change, alike in (
            ("delay", partial(_late, 0.07 * size), ("lag", "rate_limit")),
            ("lag", partial(_lagging, 0.08 * size), ("delay", "rate_limit")),
            ("rate_limit", partial(_limited, 0.35 / size), ("lag", "delay")),
            ("deadband", partial(_banded, half * size), ()),
        ):
            near = tuple((f"control_{other}", surface, "") for other in alike)
            name = (f"control_{what}", surface, "")
            made.append(SidePlant(f"{what} {surface}", (name,), near, surfaces={surface: change}))
    return tuple(made)


def _of_the_body(size: float, sign: float, end: float, span: float) -> tuple[SidePlant, ...]:
    s, when = size * sign, 0.45 * end
    asymmetry = (("thrust_asymmetry", "", ""), ("step_change", "C_n", ""))
    imbalance = (("cg_shift", "y", ""), ("step_change", "C_l", ""))
    lost = (("step_change", "", ""), ("thrust_change", "", ""), ("thrust_scale", "", ""))
    return (
        SidePlant(
            "I_xz", (("inertia", "I_xz", ""),), (("aero_term", "C_n", "delta_a"), ("aero_term", "C_n", "p_hat")),
            product_of_inertia=0.12 * s,
        ),
        SidePlant("engine fails", asymmetry, lost, engine=(when, 0.25 * size, 0.16 * span * sign)),
        SidePlant(
            "one engine pulls less", (("thrust_asymmetry", "", ""), ("aero_term", "C_n", "C_T")), lost,
            engine=(0.0, 0.15 * size, 0.16 * span * sign), thrust_moves=True,
        ),
        SidePlant("store released", imbalance, centre=(0.004 * span * s, when)),
        SidePlant(
            "fuel imbalance", imbalance, (("aero_term", "C_l", "alpha"), ("aero_term", "C_l", "V_hat")),
            cases=("six",), centre=(0.012 * span * s, 0.0),
        ),
        SidePlant("step C_n", asymmetry[::-1], jumps={"C_n": (0.004 * s, when)}),
        SidePlant("step C_l", imbalance[::-1], jumps={"C_l": (0.005 * s, when)}),
        SidePlant(
            "step C_Y", (("step_change", "C_Y", ""),), (("step_change", "", ""),), jumps={"C_Y": (0.03 * s, when)}
        ),
        SidePlant(
            "step C_Y, C_l, C_n", tuple(("step_change", c, "") for c in ("C_Y", "C_l", "C_n")),
            jumps={"C_Y": (0.02 * s, when), "C_l": (0.004 * s, when), "C_n": (-0.004 * s, when)},
        ),
    )  # fmt: skip


def _of_the_unit(size: float, sign: float, span: float) -> tuple[SidePlant, ...]:
    """All accelerometers in one unit that is not where it is declared."""
    place = (0.08 * span * size * sign, 0.0, 0.03 * span * size)
    return (
        SidePlant(
            "position of the unit", (("sensor_position", "accelerometers", ""),), (("sensor_position", "", ""),),
            cases=("six",), positions=dict.fromkeys(("a_x", "a_y", "a_z"), place),
        ),
    )  # fmt: skip


def catalogue(size: float, sign: float, end: float, span: float) -> tuple[SidePlant, ...]:
    """Every kind at a size.

    Parameters
    ----------
    size : float
        1 is several times the noise of the channel that shows it best.
    sign : float
        1 or -1, where either is an aircraft.
    end : float
        Of the record, s.
    span : float
        Wing span, m.
    """
    return (
        *_of_terms(size, sign),
        *_of_sensors(size, sign, span),
        *_of_controls(size),
        *_of_the_body(size, sign, end, span),
        *_of_the_unit(size, sign, span),
    )
