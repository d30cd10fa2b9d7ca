"""What each stage of the paper's method is worth: parts left out one at a time, on fresh flights with known truth.

    python -m benchmarks.methods --flights 12 --seed 0 [--page reports/methods.md] [--journal FILE]

Half of the flights lack an aerodynamic term, a quarter something of the sensors, the control or a sudden change, from a
quarter nothing is missing. Judged as `benchmarks.wide_detection` does. The table says how often what was planted was
named first (found), something hardly different (near), something else (wrong), nothing (missed); false alarms where
nothing was missing; the median error of the declared derivatives in their own stated deviations, which is 0.67 where
these are right; and the seconds a flight. Results are kept in a journal, so that a run may be resumed.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time as clock
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy import stats

from aerosid.aircraft import load_aircraft
from aerosid.errors import AerosidError
from aerosid.estimation.declared_effects import declared_effects
from aerosid.estimation.effect_columns import with_columns_of
from aerosid.estimation.manoeuvre import prepare
from aerosid.flight_model.aerodynamics import controls_of
from aerosid.logs.formats import read_log
from aerosid.loop.identification import asked_of
from aerosid.loop.methods import Question, answer
from aerosid.loop.settings import LoopSettings
from aerosid.model_error.coefficient_match import Corrected
from aerosid.model_error.paper_chain import ChainSettings, feed
from aerosid.model_error.swept_model import SweepSettings
from aerosid.search.model_error_settings import ModelErrorSearchSettings
from benchmarks.planted_flights import Circumstances
from benchmarks.plants import Plant
from benchmarks.wide_detection import matches, written

Label = tuple[str, str, str]

QUIET = LoopSettings(method="iebmee")
PARTS: dict[str, LoopSettings] = {
    "paper's method (iebmee)": QUIET,
    "no prefilter": replace(QUIET, chain=ChainSettings(filtering="off")),
    "filter, no fixed interval": replace(
        QUIET, model_error=ModelErrorSearchSettings(sweeps=SweepSettings(smoothed=False))
    ),
    "plain correlation": replace(QUIET, model_error=ModelErrorSearchSettings(partial=False)),
    "no coloured correction": replace(
        QUIET, model_error=ModelErrorSearchSettings(sweeps=SweepSettings(coloured=False))
    ),
    "default method": LoopSettings(),
}
STEPWISE = "stepwise regression"
OTHERS = (1, 2, 4, 5, 6, 7, 8)
"""Kinds of `in_catalogue` that are no terms: control, sensors, a jump."""


@dataclass(frozen=True)
class Verdict:
    """What one method said of one flight; `errors` of derivatives in their own deviations."""

    flight: str
    method: str
    outcome: str
    told: str
    errors: tuple[float, ...]
    seconds: float


def main() -> None:
    """Fly, ask every method, write the page."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--flights", type=int, default=12)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--page", default="")
    parser.add_argument("--journal", default="")
    parser.add_argument("--without", default="", help="methods to leave out, separated by commas")
    arguments = parser.parse_args()
    journal = Path(arguments.journal or f"methods_{arguments.seed}.jsonl")
    known = [Verdict(**json.loads(line)) for line in journal.read_text().splitlines()] if journal.exists() else []
    left_out = {name.strip() for name in arguments.without.split(",")}
    methods = [name for name in (*PARTS, STEPWISE) if name not in left_out]
    with tempfile.TemporaryDirectory() as scratch:
        for n in range(arguments.flights):
            folder = Path(scratch) / f"{n:03d}"
            kind, number = planted(n)
            try:
                at, plants = written(folder, kind, [arguments.seed, n], number)
            except ArithmeticError:
                continue  # what was planted cannot be flown
            for method in methods:
                name = f"{arguments.seed}/{n}"
                if any((v.flight, v.method) == (name, method) for v in known):
                    continue
                known.append(asked(name, method, folder, at, plants))
                with journal.open("a") as file:
                    file.write(json.dumps(vars(known[-1])) + "\n")
                print(known[-1], flush=True)  # noqa: T201
    if arguments.page:
        write_page(Path(arguments.page), known, methods, arguments.seed)


def planted(n: int) -> tuple[str, int]:
    """What the n-th flight lacks, as `written` takes it."""
    if n % 4 == 3:
        return "none", n
    return ("one", 0) if n % 2 == 0 else ("one", OTHERS[n // 4 % len(OTHERS)])


def asked(flight: str, method: str, folder: Path, at: Circumstances, plants: Sequence[Plant]) -> Verdict:
    """What a method says of a case folder."""
    begun = clock.perf_counter()
    try:
        labels, values = stepwise(folder) if method == STEPWISE else by_settings(folder, PARTS[method])
    except AerosidError as error:
        return Verdict(flight, method, "crashed", str(error), (), clock.perf_counter() - begun)
    seconds = clock.perf_counter() - begun
    errors = tuple(
        abs(value - at.body.terms[entry]) / error
        for entry, (value, error) in values.items()
        if entry in at.body.terms and 0.0 < error < np.inf
    )
    told = "; ".join("/".join(label) for label in labels)
    return Verdict(flight, method, outcome(labels, plants), told, errors, seconds)


def outcome(labels: Sequence[Label], plants: Sequence[Plant]) -> str:
    """In one word, whether the first name is meant."""
    if not plants:
        return "false alarm" if labels else "clean"
    if not labels:
        return "missed"
    if any(matches(labels[0], wanted) for plant in plants for wanted in plant.accept):
        return "found"
    return "near" if any(matches(labels[0], wanted) for plant in plants for wanted in plant.near) else "wrong"


Answered = tuple[list[Label], dict[tuple[str, str], tuple[float, float]]]


def by_settings(folder: Path, settings: LoopSettings) -> Answered:
    """Names, and derivatives with deviations, of a method of the loop; without simulations and reports."""
    question = _question(folder)
    found = answer(question, settings, lambda _stage: None).found
    labels = [(finding.kind, finding.where, finding.term) for finding in found.findings if finding.kind != "gust"]
    values = {
        (coefficient, str(term)): (
            found.completed.model.value((coefficient, term)),
            float(found.completed_deviations.corrected[n]),
        )
        for n, (coefficient, term) in enumerate(found.completed.free)
    }
    return labels, values


def _question(folder: Path) -> Question:
    aircraft = load_aircraft(folder / "aircraft.toml")
    logs = [read_log(folder / f"{role}.csv") for role in ("identification", "validation")]
    model, candidates = asked_of(logs[:1], logs[1:], aircraft)
    manoeuvres = [prepare(log, aircraft, model.columns) for log in logs]
    given = declared_effects(aircraft, controls_of(model), manoeuvres[:1])
    declared = with_columns_of(model, given)
    return Question(aircraft, declared, given, candidates, tuple(manoeuvres[:1]), tuple(manoeuvres[1:]))


LEAST_F = 20.0
"""Partial F below which a term does not enter: Klein & Morelli, Aircraft System Identification, section 5.4."""

LEAST_SHARE = 0.005
"""Rise of R^2 below which it does not either: the same section."""


def stepwise(folder: Path) -> Answered:
    """Klein & Morelli's stepwise regression on smoothed coefficients, each by itself."""
    question = _question(folder)
    (manoeuvre,) = question.manoeuvres
    model = question.declared.extended(question.candidates)
    corrected = Corrected.of(model, (), manoeuvre, feed(manoeuvre, ChainSettings()))
    measured = corrected.measured
    labels: list[tuple[float, Label]] = []
    values: dict[tuple[str, str], tuple[float, float]] = {}
    for place, name in enumerate(("C_X", "C_Z", "C_m")):
        column = _columns(corrected, model.entries, place)
        entries = [entry for entry in question.free if entry[0] == name]
        open_ = [entry for entry in question.candidates if entry[0] == name]
        target = measured[:, place]
        held = np.isfinite(target)
        while True:
            X = np.column_stack([column(entry)[held] for entry in entries])
            solution, rest = _fitted(X, target[held])
            total = float(np.sum((target[held] - target[held].mean()) ** 2))
            gains = [(rest - _fitted(np.column_stack([X, column(e)[held]]), target[held])[1], e) for e in open_]
            gain, best = max(gains, key=lambda pair: pair[0])
            freedom = int(held.sum()) - X.shape[1] - 1
            if gain / ((rest - gain) / freedom) < LEAST_F or gain / total < LEAST_SHARE:
                break
            entries.append(best)
            open_.remove(best)
            labels.append((gain / total, ("aero_term", name, str(best[1]))))
        errors = np.sqrt(rest / max(int(held.sum()) - X.shape[1], 1) * np.diag(np.linalg.pinv(X.T @ X)))
        for entry, value, error in zip(entries, solution, errors, strict=True):
            values[entry[0], str(entry[1])] = float(value), float(error)
    return [label for _, label in sorted(labels, reverse=True)], values


def _columns(corrected: Corrected, entries: Sequence, place: int) -> Callable:  # type: ignore[type-arg]
    """Each term along the measured motion."""

    def column(entry) -> np.ndarray:  # type: ignore[no-untyped-def]
        values = np.zeros(len(entries))
        values[list(entries).index(entry)] = 1.0
        return np.nan_to_num(corrected.modelled(values)[:, place])

    return column


def _fitted(X: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, float]:
    solution = np.linalg.lstsq(X, y, rcond=None)[0]
    return solution, float(np.sum((y - X @ solution) ** 2))


OUTCOMES = ("found", "near", "wrong", "missed", "clean", "false alarm", "crashed")


def write_page(page: Path, known: Sequence[Verdict], methods: Sequence[str], seed: int) -> None:
    """The table and the plot."""
    rows = [[v for v in known if v.method == method] for method in methods]
    flights = sorted({v.flight for v in known})
    told = (
        f"{len(flights)} flights of seed {seed} (`python -m benchmarks.methods`): eight aircraft from glider to jet, "
        "inputs of nine shapes, noise of half to three times good sensors', coloured in a quarter. Half lack a term, a "
        "quarter something of control, sensors or a jump, a quarter nothing. `error` is the median of the derivatives' "
        "errors in their own stated deviations, 0.67 where these are right."
    )
    text = [
        "# What is each stage of the paper's method worth?",
        "",
        told,
        "",
        "| method | " + " | ".join(OUTCOMES) + " | error | s a flight |",
        "|---|" + "--:|" * (len(OUTCOMES) + 2),
    ]
    for method, verdicts in zip(methods, rows, strict=True):
        counts = Counter(v.outcome for v in verdicts)
        errors = [e for v in verdicts for e in v.errors]
        numbers = [str(counts[name]) for name in OUTCOMES]
        error = f"{np.median(errors):.2f}" if errors else "–"
        seconds = f"{np.median([v.seconds for v in verdicts]):.1f}" if verdicts else "–"
        text.append(f"| {method} | {' | '.join(numbers)} | {error} | {seconds} |")
    few = stats.binom.interval(0.95, max(len(flights), 1), 0.5)
    caution = (
        f"With {len(flights)} flights a share of one half is known to {few[0]:.0f} to {few[1]:.0f} flights: small "
        "differences between rows decide nothing."
    )
    text += [
        "",
        caution,
        "",
        f"![Flights named rightly, and wrongly, by each method]({page.stem}.svg)",
        "",
    ]
    page.write_text("\n".join(text))
    _draw(page.with_suffix(".svg"), methods, rows)


def _draw(path: Path, methods: Sequence[str], rows: Sequence[Sequence[Verdict]]) -> None:
    import matplotlib as mpl

    mpl.use("svg")
    mpl.rcParams["svg.hashsalt"] = "methods"
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(figsize=(7.0, 0.45 * len(methods) + 1.2), layout="constrained")
    for sign, names, colour in (
        (1, ("found", "clean"), "#2a6f97"),
        (-1, ("wrong", "missed", "false alarm"), "#bc4749"),
    ):
        counts = [sign * sum(v.outcome in names for v in verdicts) for verdicts in rows]
        axes.barh(range(len(methods)), counts, color=colour, label=", ".join(names))
    axes.set_yticks(range(len(methods)), methods)
    axes.invert_yaxis()
    axes.axvline(0.0, color="black", linewidth=0.8)
    axes.set_xlabel("flights")
    axes.legend(frameon=False, fontsize="small")
    figure.savefig(path, metadata={"Date": None})
    plt.close(figure)


if __name__ == "__main__":
    main()
