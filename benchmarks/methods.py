"""What each stage of the paper's method is worth: parts left out one at a time, beside other methods.

    python -m benchmarks.methods --flights 200 --seed 0 [--suite FOLDER ...] [--methods NAME,...] [--page FILE]

Half of the fresh flights lack an aerodynamic term, a quarter something of the sensors, the control or a sudden change,
from a quarter nothing is missing. A suite is a folder of cases with a `key.json` as `benchmarks.wide_detection --keep`
writes it: identification.csv, validation.csv, aircraft.toml. Every answer is kept in a journal, so that a run may be
stopped and resumed, and methods asked on different numbers of flights; --page makes the page from it.

Only names and derivatives are asked for: no simulations of errors, no report. The second flight is only given.
"""

from __future__ import annotations

import argparse
import json
import os
import tempfile
import time as clock
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from aerosid.aircraft import load_aircraft
from aerosid.aircraft.declared_model import declared_model
from aerosid.errors import AerosidError
from aerosid.estimation.declared_effects import declared_effects
from aerosid.estimation.effect_columns import with_columns_of
from aerosid.estimation.manoeuvre import initial_state, prepare
from aerosid.flight_model.aerodynamics import controls_of
from aerosid.flight_model.terms import parse_term
from aerosid.logs.formats import read_log
from aerosid.loop.identification import declared_with_candidates
from aerosid.loop.identification_problem import IdentificationProblem, with_identified_instrument_errors
from aerosid.loop.methods import run_method
from aerosid.loop.settings import LoopSettings
from aerosid.model_error.flight_sweeps.swept_model import SweepSettings
from aerosid.model_error.paper_chain.chain import ChainSettings
from aerosid.search.partial_correlation.settings import ModelErrorSearchSettings
from aerosid.studies.cramer_rao import sensitivity
from benchmarks.coefficient_regressions import Label, Values, sparse, stepwise
from benchmarks.methods_page import Verdict, write_page
from benchmarks.planted_flights import NOISE, Circumstances
from benchmarks.plants import Plant
from benchmarks.wide_detection import matches, written

SUITES = "AEROSID_PRACTICE_SUITES"
"""Folders of suites, separated as PATH is, where --suite names none."""

PAPER = LoopSettings(method="iebmee")


def _settings_of(**changes: Any) -> LoopSettings:
    return replace(PAPER, model_error=ModelErrorSearchSettings(**changes))


PARTS: dict[str, LoopSettings] = {
    "paper's method (iebmee)": PAPER,
    "no prefilter": replace(PAPER, chain=ChainSettings(filtering="off")),
    "filter for fixed interval": _settings_of(sweeps=SweepSettings(smoothed=False)),
    "plain correlation": _settings_of(partial=False),
    "no coloured correction": _settings_of(sweeps=SweepSettings(coloured=False)),
    "default method": LoopSettings(),
}
REGRESSIONS: dict[str, Callable[[IdentificationProblem], tuple[list[Label], Values]]] = {
    "stepwise regression": stepwise,
    "PySINDy": sparse,
}
METHODS = (*PARTS, *REGRESSIONS)
OTHERS = (1, 2, 4, 5, 6, 7, 8)
"""Kinds of `in_catalogue` that are no terms: control, sensors, a jump."""


@dataclass(frozen=True)
class Case:
    """A pair of flights in a folder with its key; `flown` and `plants` of a fresh one."""

    name: str
    folder: Path
    key: Mapping[str, Any]
    flown: Circumstances | None = None
    plants: tuple[Plant, ...] = ()

    @cached_property
    def bounds(self) -> dict[tuple[str, str], tuple[float, float]]:
        """True value and Cramer-Rao bound, structure known, of each declared derivative of a flight of terms alone.

        None elsewhere: with an effect of sensor or control beside them the derivatives have another bound.
        """
        at = self.flown
        if at is None or any(not plant.terms for plant in self.plants):
            return {}
        further = {(c, text): number for plant in self.plants for c, text, number in plant.terms}
        true = {**at.body.terms, **further}
        terms = [(c, parse_term(text)) for c, text in further]
        aircraft, log = load_aircraft(self.folder / "aircraft.toml"), read_log(self.folder / "identification.csv")
        model = declared_model(aircraft, at.body.airspeed, [term for _, term in terms]).extended(terms)
        model = model.with_values(np.array([true[c, str(term)] for c, term in model.entries]))
        manoeuvre = prepare(log, aircraft, model.columns)
        noisy = np.array([name == "delta_e" for name in model.extra_columns])
        held = sensitivity(model, manoeuvre, initial_state(manoeuvre.flight), model.entries, noisy)
        assert held is not None  # nothing acts but terms
        noise = np.zeros((len(manoeuvre.outputs), len(manoeuvre.outputs), log.time.size))
        for place, channel in enumerate(manoeuvre.outputs):
            noise[place, place] = (at.noise * NOISE[channel]) ** 2 * at.memory ** np.arange(log.time.size)
        found = held.bound(noise, np.full(int(noisy.sum()), (at.elevator_noise * NOISE["delta_e"]) ** 2))
        of = {(c, str(term)): float(bound) for (c, term), bound in zip(model.entries, found, strict=True)}
        return {key: (value, of[key]) for key, value in at.body.terms.items() if np.isfinite(of[key])}


def main() -> None:
    """Fly, ask every method, write the page."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--flights", type=int, default=12)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument(
        "--suite", action="append", default=[], help=f"folder; repeatable; by default those of {SUITES}"
    )
    parser.add_argument("--methods", default=",".join(METHODS))
    parser.add_argument("--page", default="")
    parser.add_argument("--remark", default="", help="a sentence for the page: what of it was made how")
    parser.add_argument("--journal", default="")
    arguments = parser.parse_args()
    journal = Path(arguments.journal or f"methods_{arguments.seed}.jsonl")
    known = [Verdict(**json.loads(line)) for line in journal.read_text().splitlines()] if journal.exists() else []
    suites = arguments.suite or [part for part in os.environ.get(SUITES, "").split(os.pathsep) if part]
    methods = [name.strip() for name in arguments.methods.split(",")]
    done = {(verdict.flight, verdict.method) for verdict in known}
    with tempfile.TemporaryDirectory() as scratch:
        for name, made in chain(_fresh(Path(scratch), arguments.flights, arguments.seed), _of_suites(suites)):
            left = [method for method in methods if (name, method) not in done]
            case = made() if left else None  # a simulation takes as long as an answer
            if case is None:
                continue
            for method in left:
                known.append(asked(case, method))
                with journal.open("a") as file:
                    file.write(json.dumps(vars(known[-1])) + "\n")
    if arguments.page:
        write_page(Path(arguments.page), known, METHODS, arguments.remark)


Cases = Iterator[tuple[str, Callable[[], Case | None]]]
"""Names, each with what makes the case; None where what was planted cannot be flown."""


def _fresh(scratch: Path, flights: int, seed: int) -> Cases:
    for n in range(flights):
        yield f"fresh {seed}/{n}", partial(_flown, scratch / f"{n:03d}", n, seed)


def _flown(folder: Path, n: int, seed: int) -> Case | None:
    """The n-th flight of a seed."""
    try:
        flown, plants = written(folder, *_planted(n, seed))
    except ArithmeticError:
        return None
    return Case(f"fresh {seed}/{n}", folder, json.loads((folder / "key.json").read_text()), flown, tuple(plants))


def _of_suites(folders: Sequence[str]) -> Cases:
    for folder in map(Path, folders):
        for name, key in json.loads((folder / "key.json").read_text()).items():
            yield f"{folder.name}/{name}", partial(Case, f"{folder.name}/{name}", folder / name, key)


def _planted(n: int, seed: int) -> tuple[str, list[int], int]:
    """What the n-th flight lacks, as `written` takes it."""
    if n % 4 == 3:
        return "none", [seed, n], n
    return "one", [seed, n], 0 if n % 2 == 0 else OTHERS[n // 4 % len(OTHERS)]


def asked(case: Case, method: str) -> Verdict:
    """What a method says of a case."""
    begun = clock.process_time()
    try:
        question = _question(case.folder)
        labels, values = (
            REGRESSIONS[method](question) if method in REGRESSIONS else by_settings(question, PARTS[method])
        )
    except ImportError as error:
        return Verdict(case.name, method, "not installed", str(error), (), 0.0)
    except AerosidError as error:
        return Verdict(case.name, method, "crashed", str(error), (), clock.process_time() - begun)
    seconds = clock.process_time() - begun
    told = "; ".join("/".join(label) for label in labels)
    return Verdict(case.name, method, outcome(labels, case.key), told, errors_over_bound(case, values), seconds)


def outcome(labels: Sequence[Label], key: Mapping[str, Any]) -> str:
    """In a word, whether the first name is one that the key accepts; where it wants `every`, whether all are there."""
    accepted = [tuple(wanted) for wanted in key["accept"]]
    if not any(kind == "gust" for kind, _, _ in accepted):
        labels = [label for label in labels if label[0] != "gust"]  # air that moves is neither right nor wrong
    near = [tuple(wanted) for wanted in key["near"]]
    if not accepted:
        return "false alarm" if labels else "clean"
    if not labels:
        return "missed"
    hits = [any(matches(label, wanted) for label in labels) for wanted in accepted]
    first = any(matches(labels[0], wanted) for wanted in accepted)
    if key["every"]:
        if any(hits):
            return "found" if all(hits) else "partial"
    elif first:
        return "found"
    return "near" if any(matches(labels[0], wanted) for wanted in near) else "wrong"


def by_settings(question: IdentificationProblem, settings: LoopSettings) -> tuple[list[Label], Values]:
    """Names and derivatives of a method of the loop, without simulations and reports."""
    question = with_identified_instrument_errors(question, settings)
    found = run_method(question, settings, lambda _stage: None).found
    labels = [(finding.kind, finding.where, finding.term) for finding in found.findings]
    model = found.completed.model
    return labels, {(entry[0], str(entry[1])): model.value(entry) for entry in found.completed.free}


def _question(folder: Path) -> IdentificationProblem:
    aircraft = load_aircraft(folder / "aircraft.toml")
    logs = [read_log(folder / f"{role}.csv") for role in ("identification", "validation")]
    model, candidates = declared_with_candidates(logs[:1], logs[1:], aircraft)
    manoeuvres = [prepare(log, aircraft, model.columns) for log in logs]
    given = declared_effects(aircraft, controls_of(model), manoeuvres[:1])
    declared = with_columns_of(model, given)
    return IdentificationProblem(
        aircraft, declared, tuple(given), candidates, tuple(manoeuvres[:1]), tuple(manoeuvres[1:])
    )


def errors_over_bound(case: Case, values: Values) -> tuple[float, ...]:
    """Errors of the declared derivatives over their bound; what is dropped from a model counts with its full value."""
    return tuple(abs(values.get(key, 0.0) - true) / bound for key, (true, bound) in case.bounds.items())


if __name__ == "__main__":
    main()
