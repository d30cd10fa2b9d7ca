"""Restarts where what is missing is gross: a control's effect is profiled over values that it may have."""

import lateral_flights as commuter
import numpy as np
import pytest
from equations_decided import questioned

from aerosid.effects.hypothesis import Hypothesis
from aerosid.estimation.fit_settings import TRIAL
from aerosid.estimation.maximum_likelihood import refine
from aerosid.search.hypotheses import effect_hypotheses
from aerosid.search.restarts import profiled
from aerosid.search.settings import AttributionSettings
from aerosid.search.structure_search import StructureSearch


def test_a_surface_far_behind_its_record_begins_near_where_it_is() -> None:
    late = {"delta_a": lambda time, given: np.interp(time - 0.4, time, given)}
    log = commuter.Lateral(seed=31, surfaces=late, duration=12.0).log()
    aircraft = commuter.aircraft(commuter.SIDE)
    model, manoeuvre = questioned(aircraft, log)
    free = [(d.coefficient, d.term) for d in aircraft.derivatives]
    declared = refine(model, [manoeuvre], free, settings=TRIAL)
    offered: tuple[Hypothesis, ...] = effect_hypotheses(model, [manoeuvre])
    delays = [each for each in offered if each.label == ("control_delay", "delta_a", "")]
    search = StructureSearch((manoeuvre,), tuple(delays), (), declared, AttributionSettings(), model)
    (start,) = profiled(search, declared, delays, np.inf)
    (active,) = start.effects
    assert active.values[0] == pytest.approx(0.4, rel=0.5)
