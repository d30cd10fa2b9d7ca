"""Injected effects, which no aircraft file declares, and their notation on a command line.

    KIND[:WHERE[:TERM]]=NUMBER[,NUMBER...][@TIME]

as in `C_m:alpha^2=-1.7` (short for `aero_term:C_m:alpha^2`), `control_lag=0.15`, `sensor_bias:alpha=0.01`,
`cg_shift=150,-1.0`, `icing=1@5`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from aerosid.errors import AircraftError, UsageError
from aerosid.flight_model.axes import LATERAL, LONGITUDINAL, SIX
from aerosid.flight_model.terms import parse_term


@dataclass(frozen=True)
class InjectedKind:
    """Parameters of a kind of effect.

    Attributes
    ----------
    numbers : tuple of str
        Their meaning and unit, the optional ones last.
    required : int
        Number of required ones.
    where : tuple of str
        Permitted text after the first colon; empty where there is none.
    timed : bool
        Whether it may begin at a time of the log, s; without one it acts from the start.
    help : str
        Description in one line.
    least, most : float
        Bounds of each number.
    """

    numbers: tuple[str, ...]
    required: int
    where: tuple[str, ...]
    timed: bool
    help: str
    least: float = -math.inf
    most: float = math.inf


_COEFFICIENTS = SIX.coefficients
_SENSORS = tuple(name for name in (*LONGITUDINAL.outputs, *LATERAL.outputs) if not name.endswith("_dot"))
_PLACED = ("alpha", "beta", "a_x", "a_y", "a_z")
_CONTROLS = ("delta_e", "delta_a", "delta_r")
_INERTIAS = ("I_xx", "I_yy", "I_zz", "I_xz")

KINDS: Mapping[str, InjectedKind] = MappingProxyType(
    {
        "aero_term": InjectedKind(("value",), 1, _COEFFICIENTS, True, "a term, as in C_m:alpha^2=-1.7"),
        "step_change": InjectedKind(("jump",), 1, _COEFFICIENTS, True, "a coefficient jumps"),
        "control_lag": InjectedKind(("time constant [s]",), 1, _CONTROLS, False, "first-order actuator", least=0.0),
        "control_delay": InjectedKind(("delay [s]",), 1, _CONTROLS, False, "the surface follows late", least=0.0),
        "control_rate_limit": InjectedKind(
            ("limit [rad/s]",), 1, _CONTROLS, False, "the surface moves no faster", least=0.0
        ),
        "control_deadband": InjectedKind(
            ("width [rad]",), 1, _CONTROLS, False, "free play to either side of trim", least=0.0
        ),
        "sensor_bias": InjectedKind(("bias",), 1, _SENSORS, False, "measured = true + bias"),
        "sensor_scale": InjectedKind(("scale",), 1, _SENSORS, False, "measured = scale * true"),
        "sensor_delay": InjectedKind(("delay [s]",), 1, _SENSORS, False, "recorded late", least=0.0),
        "sensor_lag": InjectedKind(("time constant [s]",), 1, _SENSORS, False, "first-order sensor", least=0.0),
        "sensor_position": InjectedKind(
            ("forward [m]", "right [m]", "below [m]"), 1, _PLACED, False, "from the centre of gravity, undeclared"
        ),
        "cg_shift": InjectedKind(
            ("mass [kg]", "forward [m]", "below [m]", "right [m]"), 2, (), True,
            "a point mass; cg, mass and inertia follow",
        ),
        "inertia": InjectedKind(("kg m^2",), 1, _INERTIAS, False, "flown in place of the aircraft file's"),
        "icing": InjectedKind(("severity",), 1, (), True, "1: the iced Twin Otter's loss of lift, damping and control"),
        "flap": InjectedKind(("share of full travel",), 1, (), True, "flap of an aircraft of JSBSim"),
        "gear": InjectedKind(("1 down",), 1, (), True, "landing gear of an aircraft of JSBSim"),
        "thrust_loss": InjectedKind(("share lost",), 1, (), True, "the recorded thrust does not show it"),
        "ground_effect": InjectedKind(("gain of lift at the ground",), 1, (), False, "fades with height over span"),
        "stall_hysteresis": InjectedKind(
            ("alpha of reattachment [rad]", "alpha of stall [rad]", "C_Z", "C_m", "C_X"), 3, (), False,
            "what the coefficients change by between stall and reattachment",
        ),
        "turbulence": InjectedKind(
            ("severity 1 to 7",), 1, (), False, "Dryden, MIL-F-8785C", least=1.0, most=7.0
        ),
    }
)  # fmt: skip
"""Every effect that can be injected."""


@dataclass(frozen=True)
class InjectedEffect:
    """One effect with its numbers.

    Attributes
    ----------
    kind, where, term : str
        As in result.json; `where` and `term` are empty where they have no meaning.
    values : tuple of float
        In the order of `KINDS`, SI.
    time : float or None
        Start, s; None: from the start of the log.

    Raises
    ------
    UsageError
        Where kind, place, numbers or time are inconsistent.
    """

    kind: str
    values: tuple[float, ...]
    where: str = ""
    term: str = ""
    time: float | None = None

    def __post_init__(self) -> None:
        kind = KINDS.get(self.kind)
        if kind is None:
            raise UsageError(f"the effect {self.kind!r} is unknown; give one of {', '.join(KINDS)}.")
        if not kind.required <= len(self.values) <= len(kind.numbers) or not all(map(math.isfinite, self.values)):
            raise UsageError(
                f"the effect {self.kind} takes {', '.join(kind.numbers)} and was given "
                f"{', '.join(f'{value:g}' for value in self.values) or 'nothing'}; give finite numbers with commas."
            )
        lowest = min(self.values)
        if lowest < kind.least:
            raise UsageError(
                f"the effect {self.kind} was given {lowest:g}; give {kind.numbers[0]} of at least {kind.least:g}."
            )
        if (highest := max(self.values)) > kind.most:
            raise UsageError(
                f"the effect {self.kind} was given {highest:g}; give {kind.numbers[0]} of at most {kind.most:g}."
            )
        where = self.where or (kind.where[0] if kind.where[:1] == _CONTROLS[:1] else "")
        if where not in (kind.where or ("",)):
            expected = ", ".join(kind.where) or "nothing"
            raise UsageError(
                f"the effect {self.kind} names {where or 'no place'!r}; expected {expected} after the colon."
            )
        object.__setattr__(self, "where", where)
        if (self.kind == "aero_term") != bool(self.term):
            raise UsageError(
                f"the effect {self.kind} is written as in {_EXAMPLES.get(self.kind, self.kind + '=NUMBER')}."
            )
        if self.term:
            try:
                parse_term(self.term)
            except AircraftError as error:
                raise UsageError(f"the effect {self.kind}: {error}") from None
        if self.time is not None and not (kind.timed and self.time >= 0.0):
            raise UsageError(f"the effect {self.kind} cannot begin at {self.time:g} s; delete the time.")

    def __str__(self) -> str:
        place = ":".join(word for word in (self.kind, self.where, self.term) if word)
        began = "" if self.time is None else f"@{self.time:g}"
        return f"{place}={','.join(f'{value:g}' for value in self.values)}{began}"


_EXAMPLES = {"aero_term": "C_m:alpha^2=-1.7"}


def parse_effect(text: str) -> InjectedEffect:
    """The effect written as in the command line.

    Raises
    ------
    UsageError
        Where it cannot be read.
    """
    name, _, numbers = text.partition("=")
    numbers, _, began = numbers.partition("@")
    words = [word.strip() for word in name.split(":")]
    if words[0] in _COEFFICIENTS:
        words.insert(0, "aero_term")
    kind, where, term = [*words, "", ""][:3]
    try:
        values = tuple(float(number) for number in numbers.split(","))
        time = float(began) if began else None
    except ValueError:
        raise UsageError(
            f"--effect {text!r} cannot be read; write KIND[:WHERE[:TERM]]=NUMBER[,NUMBER...][@TIME], as in "
            "control_lag=0.15."
        ) from None
    return InjectedEffect(kind, values, where, term, time)
