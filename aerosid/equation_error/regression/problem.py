"""The equations to regress: which records, which equations, with what prior knowledge."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from aerosid.equation_error.equations.channels import COEFFICIENT
from aerosid.equation_error.equations.gust_response import GustResponse
from aerosid.equation_error.equations.points import Equations, Point, Segment, Unknown
from aerosid.equation_error.equations.recording import Recording
from aerosid.equation_error.regression.declared_values import DeclaredValues
from aerosid.equation_error.regression.design import Design, design_of, uses_no_instruments
from aerosid.equation_error.regression.expected_values import gust_responses_among
from aerosid.equation_error.regression.output_density import output_density
from aerosid.equation_error.settings import EquationErrorSettings
from aerosid.estimation.effects_in_flight import acting_model

Array = NDArray[np.float64]


@dataclass(frozen=True)
class RegressionProblem:
    """Some equations of some records, with the settings of their regression.

    `all_fitted`: whether coefficients are regressed on the validation records too. `declared`: a-priori values of
    derivatives, with which estimates may disagree. `gust_responses`: a-priori responses of coefficients to gusts.
    `rotary_gusts`: the vanes whose rotary gusts are regressors of the moments.
    `of_recorded_motion`: whether the likelihood is that of the recorded motion in place of the residuals.
    """

    recordings: tuple[Recording, ...]
    kinds: tuple[str, ...]
    settings: EquationErrorSettings
    all_fitted: bool = False
    declared: DeclaredValues | None = None
    gust_responses: Mapping[Unknown, GustResponse] = field(default_factory=dict)
    rotary_gusts: tuple[str, ...] = ()
    of_recorded_motion: bool = False

    @cached_property
    def _equations(self) -> Equations:
        return Equations(
            self.recordings, self.settings, self.kinds, all_fitted=self.all_fitted, rotary_gusts=self.rotary_gusts
        )

    def acting(self, point: Point) -> Point:
        """The point without effects of records whose coefficients are not compared: they are not identifiable here."""
        if self.all_fitted or self.kinds != COEFFICIENT:
            return point
        names = {recording.name for recording in self.recordings if recording.fitted}
        effects = tuple(active for active in point.effects if not (active.values and active.log) or active.log in names)
        return point if len(effects) == len(point.effects) else replace(point, effects=effects)

    def segments(self, point: Point) -> list[Segment]:
        """The equations at a point."""
        return self._equations.at(point)

    def design(self, point: Point) -> Design:
        """The regression at a point. Kinematic equations have the same columns at all points, and are stacked once."""
        segments = self.segments(point)
        if any(each.equation in COEFFICIENT for each in segments):
            return self._with_density(self.with_prior_knowledge(design_of(segments, self.settings)), point)
        names = tuple((each.recording, each.equation) for each in segments)
        if names not in self._kinematic:
            self._kinematic[names] = design_of(segments, self.settings)
        return replace(self._kinematic[names], target=np.concatenate([each.target for each in segments]))

    def with_prior_knowledge(self, design: Design) -> Design:
        """A design with the a-priori values of its unknowns and of their relations."""
        declared = None if self.declared is None else self.declared.among(design.unknowns)
        return replace(design, declared=declared, expected=gust_responses_among(self.gust_responses, design.unknowns))

    def _with_density(self, design: Design, point: Point) -> Design:
        # In the space of instruments the residuals have no density of the whole motion, and need none: it corrects
        # what the correlation of disturbance and regressor does to least squares.
        if not self.of_recorded_motion or not uses_no_instruments(design):
            return design
        samples = {index: design.rows(s).stop - design.rows(s).start for s, (index, _) in enumerate(design.segments)}
        model = acting_model(point.model, point.effects)
        return replace(design, density=output_density(self.recordings, model, design.unknowns, samples))

    @cached_property
    def _kinematic(self) -> dict[tuple[tuple[int, str], ...], Design]:
        return {}

    def residuals(
        self, point: Point, values: Mapping[Unknown, float], log: str = "", elsewhere: Array | None = None
    ) -> Array:
        """Residuals (R,) of coefficient equations at a point for given linear unknowns.

        `log`: the only record whose residuals differ from those `elsewhere`, (R,); by default all.
        """
        return self._equations.residuals(point, values, log, elsewhere)
