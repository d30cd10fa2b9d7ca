"""Sensitivity of the side force's sideslip derivative to the accelerometer's place, where no vane shows sideslip.

A lateral accelerometer x ahead of the centre of gravity reads x r' in addition to the side force, and in a Dutch roll
r' is N_beta beta: C_Y beta moves by -m b C_n beta/I_zz for each metre that the accelerometer sits further ahead than
declared.
"""

from __future__ import annotations

from collections.abc import Sequence

from aerosid.aircraft import Aircraft
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.flight_model.aerodynamics import AerodynamicModel
from aerosid.flight_model.terms import parse_term
from aerosid.notation import number

WEATHERCOCK = ("C_n", parse_term("beta"))
SIDE = ("C_Y", parse_term("beta"))


def note_on_unmeasured_sideslip(
    aircraft: Aircraft, model: AerodynamicModel, manoeuvres: Sequence[Manoeuvre]
) -> tuple[str, ...]:
    """A sentence where sideslip was simulated and not measured.

    Parameters
    ----------
    model : AerodynamicModel
        As estimated.
    """
    lacking = without_sideslip(manoeuvres)
    modelled = [entry in model.entries for entry in (WEATHERCOCK, SIDE)]
    if not lacking or not all(modelled) or aircraft.span is None or aircraft.I_zz is None:
        return ()
    each_metre = aircraft.mass * aircraft.span * model.value(WEATHERCOCK) / aircraft.I_zz
    sentence = (
        f"{', '.join(lacking)}: beta was not recorded. C_Y beta then depends on the position of the lateral "
        f"accelerometer: it changes by {number(-each_metre)} per metre that the accelerometer is farther ahead of the "
        "centre of gravity than declared (-m b C_n beta/I_zz). Give its position in the channel map if it is known."
    )
    return (sentence,)


def note_on_missing_chain(manoeuvres: Sequence[Manoeuvre]) -> tuple[str, ...]:
    """Reason why there is no model error d(t), and so no recursive least-squares estimate."""
    if lacking := without_sideslip(manoeuvres):
        return (f"The model error d(t) was not estimated: beta was not recorded on {', '.join(lacking)}.",)
    return ("The model-error recursion failed: derivatives of recursive least squares are missing.",)


def without_sideslip(manoeuvres: Sequence[Manoeuvre]) -> list[str]:
    """The logs whose sideslip is integrated and not measured."""
    return [each.name for each in manoeuvres if not each.sideslip_measured]
