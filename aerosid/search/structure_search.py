"""Structure search by penalised likelihood: hypotheses, penalty of a structure, critical t-ratio.

A hypothesis (a term, an error of a sensor or control, a step change) enters where its fit has the least penalised cost
of all, its t-ratio, corrected for coloured residuals, exceeds the critical value for the number of hypotheses tested
(Bonferroni), and does so together with every other part that entered.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from aerosid.effects import KINDS, ActiveEffect, NoiseEffect
from aerosid.effects.aerodynamic_terms import is_symmetric, rarity, searched_parameters
from aerosid.effects.hypothesis import Hypothesis
from aerosid.effects.step_input import instant_of, is_step_change
from aerosid.estimation.deviations import Deviations, deviations
from aerosid.estimation.effect_columns import with_columns_of, with_offsets
from aerosid.estimation.fit_settings import TRIAL
from aerosid.estimation.likelihood import Whitened
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.estimation.maximum_likelihood import Refinement, Start, refine_on
from aerosid.estimation.residual_tests import unexplained_channels
from aerosid.estimation.score_test import Linearised, Score, score_hypotheses
from aerosid.flight_model.aerodynamics import AerodynamicModel, Entry
from aerosid.flight_model.axes import LONGITUDINAL
from aerosid.flight_model.terms import Term
from aerosid.search.findings import Part
from aerosid.search.settings import AttributionSettings
from aerosid.search.step_change_instants import is_near_step_change

NONLINEAR_KINDS = frozenset(name for name, kind in KINDS.items() if not kind.follows_its_score)
"""Kinds whose effect is far from linear in their parameter."""


class StructureSearch:
    """Hypotheses on a set of manoeuvres, the penalised cost of an estimate, and stored intermediate fits."""

    def __init__(
        self,
        manoeuvres: tuple[Manoeuvre, ...],
        hypotheses: tuple[Hypothesis, ...],
        step_coefficients: tuple[str, ...],
        declared: Refinement,
        settings: AttributionSettings,
        given: AerodynamicModel | None = None,
    ) -> None:
        self.declared_values = given
        self.manoeuvres = manoeuvres
        self.step_coefficients = step_coefficients
        self.hypotheses = hypotheses
        self.declared = declared
        self.declared_entries = frozenset(declared.free)
        self.settings = settings
        self.last_linearised: tuple[Refinement, Linearised] | None = None
        self.linearised_declared: tuple[Refinement, Linearised] | None = None
        self.last_linearised_alone: tuple[Refinement, Linearised] | None = None
        self.last_deviations: tuple[Refinement, Deviations] | None = None
        self.last_unexplained: tuple[Refinement, tuple[str, ...]] | None = None
        self.reduced_fits: dict[tuple[tuple[Entry, ...], tuple[str, ...]], Refinement] = {}
        self.noise = np.sqrt(self.noise_variances(declared))
        self.critical = float(-ndtri(0.5 * settings.false_alarm / max(len(self.hypotheses), 1)))

    def without_stored_fits(self) -> StructureSearch:
        """The same search before its first fit; a fit that is known would be reused, with other last digits."""
        return StructureSearch(
            self.manoeuvres,
            self.hypotheses,
            self.step_coefficients,
            self.declared,
            self.settings,
            self.declared_values,
        )

    @property
    def samples(self) -> int:
        """Measured values in all manoeuvres and channels."""
        return sum(int(np.isfinite(manoeuvre.flight.measured).sum()) for manoeuvre in self.manoeuvres)

    @property
    def separation_coefficients(self) -> tuple[str, ...]:
        """Coefficients that flow separation changes: along x, across it and in pitch; none unless all are modelled."""
        step_coefficients = tuple(name for name in self.step_coefficients if is_symmetric(name))
        return step_coefficients if len(step_coefficients) == len(LONGITUDINAL.coefficients) else ()

    def noise_variances(self, start: Refinement) -> NDArray[np.float64]:
        """The logs' own noise variances, so that a disturbance, not sensor noise, takes in the model error."""
        squares = np.nan_to_num(np.array([manoeuvre.noise**2 for manoeuvre in self.manoeuvres]))
        known = np.count_nonzero(squares, axis=0)
        return np.where(known > 0, squares.sum(axis=0) / np.maximum(known, 1), start.variance)

    def has_gross_residual(self, current: Refinement) -> bool:
        """Whether some channel's residual is many times its noise."""
        return bool(
            np.any(np.sqrt(current.variance) > self.settings.trials.gross * np.nan_to_num(self.noise, nan=np.inf))
        )

    def is_inadequate(self, current: Refinement) -> bool:
        """Whether a residual remains, or the model is a staircase, so that flow separation or disturbances are tried.

        One step change is one event. Several on a flight approximate any slow variation by a staircase.
        """
        if current.held_to_data > 0.0:
            return False
        instants = {(active.log, round(instant_of(active))) for active in current.effects if is_step_change(active)}
        logs = [log for log, _ in instants]
        is_staircase = any(logs.count(log) > 1 for log in logs)
        return is_staircase or bool(self.unexplained_channels(current))

    def unexplained_channels(self, current: Refinement) -> tuple[str, ...]:
        """The channels with a residual above noise; those of the last estimate are stored."""
        if self.last_unexplained is None or self.last_unexplained[0] is not current:
            whitened = self.stored_whitened(current)
            self.last_unexplained = current, unexplained_channels(current, self.manoeuvres, whitened=whitened)
        return self.last_unexplained[1]

    def penalised_cost(self, trial: Refinement, inflation: float = 1.0) -> float:
        """Penalised -2 ln L of an estimate.

        `inflation`: variance inflation of the parts in question by coloured residuals, 1 where they are white; -2 ln L
        is so many times that of independent samples, to which the penalty refers.
        """
        return trial.cost / inflation + self.penalty(trial)

    def penalty(self, trial: Refinement | Start) -> float:
        """Penalty on the number of parameters of an estimate."""
        count = len(trial.free) + sum(map(searched_parameters, self.added_terms(trial)))
        count += sum(len(active.values) for active in trial.effects)
        return self.rarity_penalty(trial) + self.settings.price * count

    def rarity_penalty(self, trial: Refinement | Start) -> float:
        """Additional gain that an estimate needs compared with a commoner one of the same fit."""
        rare = sum(map(rarity, self.added_terms(trial)))
        effects = [active.effect for active in trial.effects if active.values and active.effect.kind in KINDS]
        return rare + sum(KINDS[effect.kind].rarity_at(effect.where) for effect in effects)

    def added_terms(self, trial: Refinement | Start) -> list[Term]:
        """The terms that are not declared."""
        return [entry[1] for entry in trial.free if entry not in self.declared_entries]

    def parts(self, current: Refinement, uncertainty: Deviations | None) -> list[Part]:
        """Everything that was added to the declared model, with standard deviations where they are given."""
        parts = []
        for n, entry in enumerate(current.free):
            if entry not in self.declared_entries:
                error = float(uncertainty.corrected[n]) if uncertainty is not None else 0.0
                parts.append(Part(entry, None, current.model.value(entry), 0.0, error))
        place = 0
        for active in current.effects:
            if active.held:
                continue  # declared
            errors: tuple[float, ...] = ()
            if isinstance(active.effect, NoiseEffect):
                error = active.values[0] / np.sqrt(2.0 * self.independent_gust_samples(active))
            elif uncertainty is not None:
                errors = tuple(float(number) for number in uncertainty.effects[place : place + active.slopes])
                error = errors[0]
            else:
                error = 0.0
            parts.append(Part(None, active, active.values[0], active.effect.parameters[0].null, error, errors))
            place += active.slopes
        return parts

    def is_shown_by_kinematics(self, part: Part) -> bool:
        """Whether a part is an instrument error that kinematics show, with the value that they give it."""
        active, deviations = part.active, self.settings.final_deviations
        shown = self.settings.shown_by_kinematics
        return active is not None and any(each.is_that_of(active, deviations) for each in shown)

    def groups(self, current: Refinement) -> list[list[Part]]:
        """The added parts; step changes of one record at about the same instant form one group."""
        groups: dict[object, list[Part]] = {}
        for part in self.parts(current, None):
            if part.is_disturbance:
                continue
            groups.setdefault(part.label if part.time is None else (part.log, round(part.time, 0)), []).append(part)
        return list(groups.values())

    def independent_gust_samples(self, active: ActiveEffect) -> float:
        """Number of scale lengths flown through: the number of independent samples of the disturbance's size."""
        length = 0.0
        for manoeuvre in self.manoeuvres:
            length += float(np.ptp(manoeuvre.flight.time)) * manoeuvre.mean_airspeed
        return max(length / active.values[-1], 1.0)

    def quick_deviations(self, current: Refinement) -> Deviations:
        """Standard deviations of sufficient accuracy for a search; those of the last estimate are stored."""
        if self.last_deviations is None or self.last_deviations[0] is not current:
            whitened = self.stored_whitened(current)
            self.last_deviations = current, deviations(current, self.manoeuvres, quick=True, whitened=whitened)
        return self.last_deviations[1]

    def stored_whitened(self, current: Refinement) -> tuple[Whitened, ...] | None:
        """The whitened stretches of an estimate, where its stored expansion was computed from them; else None."""
        known = self.last_linearised
        return known[1].whitened if known is not None and known[0] is current else None

    def scores(self, current: Refinement) -> tuple[Score, ...]:
        """Scores of the hypotheses that the estimate does not hold."""
        if current.held_to_data == 0.0:
            return self.linearised_with_candidates(current).scores()
        candidates = self.candidate_hypotheses(current)
        return score_hypotheses(self.with_candidate_columns(current, candidates), self.manoeuvres, candidates)

    def candidate_hypotheses(self, current: Refinement) -> list[Hypothesis]:
        """The hypotheses that the estimate does not hold."""
        present = {part.label for part in self.parts(current, None)}
        present |= {(*active.name, "") for active in current.effects if active.held}
        spacing = self.settings.trials.jump_spacing
        return [
            h
            for h in self.hypotheses
            if h.label not in present and not is_near_step_change(h, current.effects, self.manoeuvres, spacing)
        ]

    def with_candidate_columns(self, current: Refinement, hypotheses: Sequence[Hypothesis]) -> Refinement:
        """The estimate with the input columns that the effects of some hypotheses fill."""
        with_columns = self.with_step_columns(current)
        effects = [active for hypothesis in hypotheses for active in hypothesis.effects]
        return replace(with_columns, model=with_columns_of(with_columns.model, effects))

    def with_step_columns(self, current: Refinement) -> Refinement:
        """The estimate with input columns for step changes."""
        if not self.step_coefficients or current.held_to_data > 0.0:
            return current
        return replace(current, model=with_offsets(current.model, self.step_coefficients))

    def linearised_with_candidates(self, current: Refinement) -> Linearised:
        """Second-order expansion of the likelihood with all candidates.

        Those of the last estimate and of the declared structure, to which a search returns, are stored.
        """
        if self.linearised_declared is not None and current is self.declared:
            self.last_linearised = self.linearised_declared
        if self.last_linearised is None or self.last_linearised[0] is not current:
            candidates = self.candidate_hypotheses(current)
            self.last_linearised = (
                current,
                Linearised(self.with_candidate_columns(current, candidates), self.manoeuvres, candidates),
            )
        if current is self.declared:
            self.linearised_declared = self.last_linearised
        return self.last_linearised[1]

    def linearised_alone(self, current: Refinement) -> Linearised:
        """Second-order expansion of the likelihood, without candidates unless one with them is stored."""
        for known in (self.last_linearised, self.linearised_declared, self.last_linearised_alone):
            if known is not None and known[0] is current:
                return known[1]
        self.last_linearised_alone = current, Linearised(current, self.manoeuvres, ())
        return self.last_linearised_alone[1]

    def reduced_structure(self, current: Refinement, parts: Sequence[Part]) -> Refinement:
        """The structure without some parts, the other parameters unchanged."""
        entries = [part.entry for part in parts if part.entry is not None]
        effects = [part.active for part in parts if part.active is not None]
        return replace(
            current,
            model=current.model.without(entries),
            free=tuple(entry for entry in current.free if entry not in entries),
            effects=tuple(active for active in current.effects if active not in effects),
        )

    def re_estimated_without(
        self, current: Refinement, parts: Sequence[Part], origin: Refinement | None = None
    ) -> Refinement:
        """The re-estimated structure without some parts; `origin` or the declared one's estimate where that is left."""
        reduced = self.reduced_structure(current, parts)
        if self._is_declared(reduced):
            return self.declared
        if origin is not None and origin.converged and _have_same_structure(reduced, origin):
            return origin
        structure = reduced.free, reduced.effects
        if structure not in current.reduced:
            current.reduced[structure] = self._reduced_fit(current, reduced, parts)
        return current.reduced[structure]

    def _is_declared(self, reduced: Refinement) -> bool:
        """Whether a structure is the declared one, of which an estimate by the same likelihood is known."""
        declared = self.declared
        comparable = declared.is_maximum and declared.converged and reduced.held_to_data == declared.held_to_data == 0.0
        return comparable and (reduced.free, reduced.effects) == (declared.free, declared.effects)

    def _reduced_fit(self, current: Refinement, reduced: Refinement, parts: Sequence[Part]) -> Refinement:
        if current.effects or current.held_to_data > 0.0:
            return refine_on(reduced, self.manoeuvres, TRIAL)
        known = self.reduced_fits.get((reduced.free, reduced.model.columns))
        if known is None:
            entries = [part.entry for part in parts if part.entry is not None]
            near = self.linearised_alone(current).without_terms(entries)
            point = replace(near, values=np.array(reduced.model.values))
            known = refine_on(reduced, self.manoeuvres, TRIAL, point=point)
            known = known if known.converged else refine_on(reduced, self.manoeuvres, TRIAL)
            self.reduced_fits[reduced.free, reduced.model.columns] = known
        return known

    def store_trials(self, trials: Sequence[Refinement]) -> None:
        """Store trial fits of terms alone: their maximum of the likelihood does not depend on the start."""
        for trial in trials:
            if trial.converged and not trial.effects and trial.held_to_data == 0.0:
                known = self.reduced_fits.setdefault((trial.free, trial.model.columns), trial)
                if trial.cost < known.cost:
                    self.reduced_fits[trial.free, trial.model.columns] = trial

    def refined(self, current: Refinement) -> Refinement:
        """A trial fit continued to convergence, from its stored linearisation."""
        point, last = None, self.last_linearised
        # One in the filter form, or with disturbances, is continued from a likelihood of its own kind.
        of_own_kind = not current.is_disturbed and current.held_to_data == 0.0
        if last is not None and last[0] is current and of_own_kind:
            point = replace(last[1].with_terms(()), values=np.array(current.model.values))
        return refine_on(current, self.manoeuvres, point=point)


def _have_same_structure(first: Refinement, second: Refinement) -> bool:
    """Whether two estimates have the same free terms and effects, whatever their values."""
    if (first.free, first.held_to_data) != (second.free, second.held_to_data):
        return False
    unvalued = [[(a.effect, a.log, len(a.values), a.held) for a in each.effects] for each in (first, second)]
    return unvalued[0] == unvalued[1]
