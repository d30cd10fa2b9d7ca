"""The spreads of d(t): of what is missing, and none where the flight shows none."""

from __future__ import annotations

import numpy as np
from problems import LIGHT, Problem, Truth

from aerosid.estimation.manoeuvre import prepare
from aerosid.loop.identification import asked_of
from aerosid.loop.methods import Question
from aerosid.model_error.flight_sweep import FlightSweeps
from aerosid.model_error.paper_chain import ChainSettings
from aerosid.model_error.swept_model import Sweep, SweepSettings
from aerosid.search.model_error_attribution import swept_start
from aerosid.search.model_error_settings import ModelErrorSearchSettings

QUICK = SweepSettings(searches=(0,), first_spread=None, first_memory=3.0, settled=0.1, shown=2.7)


def estimated(undeclared: Truth, settings: SweepSettings) -> Sweep:
    log = Problem(undeclared=undeclared, duration=8.0).fly(22)
    model, _ = asked_of([log], [], LIGHT)
    asked = Question(LIGHT, model, (), (), (prepare(log, LIGHT, model.columns),), ())
    search = ModelErrorSearchSettings(sweeps=settings)
    start = swept_start(model, asked.manoeuvres, asked.free, (), LIGHT.coefficients, ChainSettings(), search)
    return FlightSweeps(asked.manoeuvres, LIGHT.coefficients, settings).estimate(start)


def test_where_nothing_is_missing_every_spread_is_at_its_least() -> None:
    assert estimated({}, QUICK).swept.statistics.spread == (QUICK.least_spread,) * 3


def test_a_missing_term_leaves_its_own_coefficient_alone_with_error() -> None:
    quick = estimated({("C_m", "alpha^2"): -1.715}, QUICK).swept.statistics.spread
    assert quick[:2] == (QUICK.least_spread,) * 2
    whole = estimated({("C_m", "alpha^2"): -1.715}, SweepSettings()).swept.statistics.spread
    np.testing.assert_allclose(quick[2], whole[2], rtol=0.05)
