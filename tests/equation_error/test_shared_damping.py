"""What C_m q_hat takes in of an undeclared alphadot, against a regression whose target holds one."""

from dataclasses import replace

import numpy as np
import pytest
from equations_decided import decided

from aerosid.effects.hypothesis import Hypothesis
from aerosid.equation_error.regression.design import solve
from aerosid.equation_error.selection.candidates import term_candidates
from aerosid.equation_error.selection.shared_damping import DAMPING, DOWNWASH, SharedDamping
from benchmarks.turbulent_flights import BODIES, aircraft_of, flown


def test_an_alphadot_in_the_target_moves_the_derivative_of_pitch_rate_by_its_share() -> None:
    body = BODIES[0]
    logs = [flown(name, body, 6100 + n, air=0.3, seconds=24.0) for n, name in enumerate(("one", "two"))]
    decision = decided(aircraft_of(body, 0.08, np.random.default_rng(6)), logs[:1], logs[1:])
    assert decision.findings == ()
    damping = decision.damping
    assert damping is not None
    found = decision.completed
    downwash = ("C_m", DOWNWASH)
    (candidate,) = term_candidates(found.frame, found, [Hypothesis("aero_term", *map(str, downwash), (downwash,))])
    lacking = -6.0
    held = replace(found.design, target=found.design.target + lacking * candidate.columns[:, 0])
    moved = solve(held, found.solution.weights).values - solve(found.design, found.solution.weights).values
    place = found.design.unknowns.index(("term", ("C_m", DAMPING)))
    assert moved[place] == pytest.approx(damping.share * lacking, rel=1e-6)
    assert damping.own < 0.01
    assert damping.share > 0.5


def test_the_own_part_is_what_gives_the_sum_with_an_alphadot_of_the_usual_size() -> None:
    least, most = SharedDamping(value=-24.0, share=0.8, own=0.002).parts
    assert least * (1.0 + 0.8 * 0.5) == pytest.approx(-24.0)
    assert most * (1.0 + 0.8 * 0.3) == pytest.approx(-24.0)
