"""Channels with a model error are those whose output errors exceed the noise, by independent whitening."""

from __future__ import annotations

import numpy as np
import pytest
from problems import BOTH_SQUARES, Problem, entry

from aerosid.estimation.fit_settings import TRIAL
from aerosid.estimation.maximum_likelihood import refine
from aerosid.estimation.open_loop import respond
from aerosid.estimation.residual_tests import coloured_noise, unexplained_channels


@pytest.mark.parametrize("complete", [False, True])
def test_channels_with_residuals_above_noise_are_those_of_a_simulation(complete: bool) -> None:
    problem = Problem(undeclared=BOTH_SQUARES)
    model, manoeuvre = problem.prepared(problem.fly())
    squares = tuple(entry(*key) for key in BOTH_SQUARES) if complete else ()
    found = refine(model.extended(squares), [manoeuvre], (*model.entries, *squares), settings=TRIAL)
    errors = respond(found.model, manoeuvre, found.variance).rms
    gross = {name for name, error in errors.items() if error > 2.0 * manoeuvre.noise[manoeuvre.row(name)]}
    told = set(unexplained_channels(found, [manoeuvre]))
    assert gross <= told
    assert bool(told) is not complete
    assert coloured_noise(found, [manoeuvre]) == ()
    assert np.isfinite(list(errors.values())).all()
