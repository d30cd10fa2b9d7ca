"""The page of the methods' study: what each method found and how well it knew the derivatives, as tables and a plot."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.stats import binomtest

OUTCOMES = ("found", "near", "partial", "wrong", "missed", "clean", "false alarm", "crashed")
"""Columns of the table; a method that is not installed has none."""

RIGHT = ("found", "clean")
MISLED = ("wrong", "false alarm")


@dataclass(frozen=True)
class Verdict:
    """What one method said of one flight.

    Attributes
    ----------
    flight : str
        "fresh SEED/N", or "SUITE/CASE".
    method, outcome : str
    told : str
        The names, or an error's sentence.
    errors : sequence of float
        Of the declared derivatives over their Cramer-Rao bound, where it is known.
    seconds : float
        Of one processor.
    """

    flight: str
    method: str
    outcome: str
    told: str
    errors: Sequence[float]
    seconds: float

    @property
    def suite(self) -> str:
        """Where the flight is from."""
        return self.flight.partition("/")[0].partition(" ")[0]


def write_page(page: Path, known: Sequence[Verdict], methods: Sequence[str], remark: str = "") -> None:
    """The tables of fresh flights and of each suite, and the plot beside it as an SVG of the same name."""
    seeds = sorted({v.flight.partition(" ")[2].partition("/")[0] for v in known if v.suite == "fresh"}, key=int)
    suites = list(dict.fromkeys(verdict.suite for verdict in known))
    text = ["# What is each stage of the paper's method worth?", "", TOLD, *([remark, ""] if remark else [])]
    for suite in suites:
        title = f"Fresh flights, seed {' and '.join(seeds)}" if suite == "fresh" else f"Practice suite `{suite}`"
        text += [f"## {title}", "", *_table([v for v in known if v.suite == suite], methods), ""]
        if suite == "fresh":
            shared = _shared([v for v in known if v.suite == suite], methods)
            if shared:
                count = len({v.flight for v in shared})
                text += [f"The {count} of them on which all were asked:", "", *_table(shared, methods), ""]
            text += [f"![Flights judged rightly, and wrongly, by each method]({page.stem}.svg)", ""]
            text += [*_paired([v for v in known if v.suite == suite], methods), ""]
    absent = sorted({verdict.method for verdict in known if verdict.outcome == "not installed"})
    text += [f"{name} was not installed where this was run (`pip install 'aerosid[compare]'`).\n" for name in absent]
    page.parent.mkdir(parents=True, exist_ok=True)
    page.write_text("\n".join(text).rstrip() + "\n", encoding="utf-8")
    draw(page.with_suffix(".svg"), [v for v in known if v.suite == "fresh"], methods)


TOLD = """The paper's method (prefilter, continuous IEBMEE with the fixed interval, partial correlation in coloured
noise, recursive least squares), its parts left out one at a time, the default method, and two regressions of measured
coefficients: Klein & Morelli's stepwise regression and PySINDy. Made by `python -m benchmarks.methods --flights N
--seed SEED --page reports/methods/index.md`; practice suites are given with `--suite FOLDER`. Methods may have been
asked on different numbers of flights, which the tables tell.

Fresh flights: eight aircraft from glider to jet, inputs of nine shapes, 20 to 100 Hz, noise of half to three times good
sensors', coloured in up to a quarter, derivatives declared up to 12 % off. Half lack a term, a quarter something of the
control, the sensors or a jump, from a quarter nothing is missing. *Found*: what was planted is named first (where
several things are, all of them); *near*: what hardly differs from it. The regressions see terms alone: what else is
planted they can only miss or take for a term. *Error / bound*: median over the declared derivatives of |error| over its
Cramér-Rao bound, structure known, on flights that lack a term or nothing; 0.67 is the best that an unbiased estimate
can be. *s*: median seconds of one processor a flight, reading included.
"""


def _table(known: Sequence[Verdict], methods: Sequence[str]) -> Iterator[str]:
    shown = [name for name in OUTCOMES if any(v.outcome == name for v in known)]
    bounded = any(v.errors for v in known)
    headings = ["method", "flights", *shown, *(["error / bound"] if bounded else []), "s"]
    yield f"| {' | '.join(headings)} |"
    yield "|---|" + "--:|" * (len(headings) - 1)
    for method in methods:
        own = [v for v in known if v.method == method and v.outcome != "not installed"]
        if not own:
            continue
        counts, errors = Counter(v.outcome for v in own), [e for v in own for e in v.errors]
        cells = [method, str(len(own)), *(str(counts[name]) for name in shown)]
        if bounded:
            cells.append(f"{np.median(errors):.2f}" if errors else "")
        yield f"| {' | '.join([*cells, f'{np.median([v.seconds for v in own]):.1f}'])} |"


def _shared(known: Sequence[Verdict], methods: Sequence[str]) -> list[Verdict]:
    """The verdicts on flights on which every method was asked that was asked at all; none where that is all of them."""
    flights = {m: {v.flight for v in known if v.method == m} for m in methods if any(v.method == m for v in known)}
    common = set.intersection(*flights.values()) if flights else set()
    return [v for v in known if v.flight in common] if any(common != own for own in flights.values()) else []


def _paired(known: Sequence[Verdict], methods: Sequence[str]) -> Iterator[str]:
    """Each method beside the first on the flights that both were asked: how often only one of them was right."""
    first, *others = methods
    base = {v.flight: v.outcome in RIGHT for v in known if v.method == first}
    yield f"On the same flights, right ({' or '.join(RIGHT)}) where the other is not; by a sign test:"
    yield ""
    yield f"| method | flights | only it | only {first} | p |"
    yield "|---|--:|--:|--:|--:|"
    for method in others:
        pairs = [
            (v.outcome in RIGHT, base[v.flight])
            for v in known
            if v.method == method and v.flight in base and v.outcome != "not installed"
        ]
        if not pairs:
            continue
        here, there = sum(a and not b for a, b in pairs), sum(b and not a for a, b in pairs)
        p = binomtest(here, here + there).pvalue if here + there else 1.0
        yield f"| {method} | {len(pairs)} | {here} | {there} | {p:.2g} |"


def draw(path: Path, known: Sequence[Verdict], methods: Sequence[str]) -> None:
    """Shares of flights judged rightly to the right, of wrong names to the left, with 95 % intervals."""
    import matplotlib as mpl

    mpl.use("svg")
    mpl.rcParams["svg.hashsalt"] = "methods"
    from matplotlib import pyplot as plt

    rows = {name: [v.outcome for v in known if v.method == name and v.outcome != "not installed"] for name in methods}
    asked = [name for name in methods if rows[name]]
    figure, axes = plt.subplots(figsize=(7.5, 0.45 * len(asked) + 1.4), layout="constrained")
    sides = ((1.0, RIGHT, "#2a6f97", "right: found, or clean"), (-1.0, MISLED, "#bc4749", "misled: a wrong name"))
    for sign, names, colour, label in sides:
        shares, low, high = [], [], []
        for name in asked:
            count, total = sum(outcome in names for outcome in rows[name]), len(rows[name])
            interval = binomtest(count, total).proportion_ci(method="wilson")
            shares.append(100.0 * sign * count / total)
            low.append(100.0 * (count / total - interval.low))
            high.append(100.0 * (interval.high - count / total))
        whiskers = (low, high) if sign > 0.0 else (high, low)
        axes.barh(range(len(asked)), shares, xerr=whiskers, color=colour, label=label, ecolor="0.3", capsize=2)
    axes.set_yticks(range(len(asked)), [f"{name} ({len(rows[name])})" for name in asked])
    axes.invert_yaxis()
    axes.axvline(0.0, color="black", linewidth=0.8)
    axes.xaxis.set_major_formatter(lambda share, _place: f"{abs(share):.0f}")
    axes.set_xlabel("flights, % (number asked in brackets), with 95 % intervals")
    figure.legend(loc="outside upper center", ncols=2, frameon=False, fontsize="small")
    figure.savefig(path, metadata={"Date": None})
    plt.close(figure)
