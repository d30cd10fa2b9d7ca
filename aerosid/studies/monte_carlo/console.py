"""A study on the terminal: a table for each level, and the requirements of the accuracy study."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from aerosid.notation import number
from aerosid.studies.monte_carlo.page import level_name, percent
from aerosid.studies.monte_carlo.run import Study
from aerosid.studies.monte_carlo.statistics import DerivativeStatistics, LevelStatistics
from aerosid.studies.settings import EFFICIENCY

if TYPE_CHECKING:
    from rich.console import Console


def print_study(study: Study, console: Console) -> None:
    """Print the statistics of every level."""
    from rich.table import Table

    for level in study.levels:
        facts = [level_name(level), f"{level.runs} runs"]
        facts += [f"{level.failed} failed"] if level.failed else []
        facts += [] if level.detected is None else [f"all identified in {100.0 * level.detected:.1f} %"]
        facts += (
            [] if level.false_alarms is None else [f"another effect identified in {100.0 * level.false_alarms:.1f} %"]
        )
        table = Table(title=", ".join(facts), title_justify="left")
        table.add_column("derivative")
        headings = ("true", "bias", "rms error", "bound", "error/bound", "covered %", "published %", "plain %")
        for heading in headings:
            table.add_column(heading, justify="right")
        for row in level.derivatives:
            table.add_row(
                f"{row.coefficient} {row.term}",
                number(row.true, 4),
                number(row.bias, 2),
                number(row.rmse, 3),
                number(row.crlb, 3),
                number(row.rmse_over_crlb, 3),
                *(percent(share) for share in (row.coverage95, row.coverage95_published, row.coverage95_plain)),
            )
        console.print(table)
    for reason, count in study.failures.items():
        console.print(f"{count} runs without a result: {reason}")


def print_demands(study: Study, console: Console) -> None:
    """Print the requirements of an accuracy study, with the worst result for each."""
    for level in study.levels:
        for line in demands(level):
            console.print(f"{level_name(level)}: {line}")


def demands(level: LevelStatistics) -> list[str]:
    """One line for each requirement on a level: met or not, with the worst derivative."""
    lines = []
    known = [row for row in level.derivatives if row.crlb is not None]
    white = level.noise_colour == 0.0
    if known and white:
        sharp = [row for row in known if row.crlb is not None and row.crlb < EFFICIENCY.best_known * abs(row.true)]
        if sharp:
            ratios = [row.rmse_over_crlb or 0.0 for row in sharp]
            worst = int(np.argmax(ratios))
            met = ratios[worst] <= EFFICIENCY.most_ratio
            lines.append(_line(met, "error/bound at most", EFFICIENCY.most_ratio, ratios[worst], sharp[worst]))
        medians = [abs(row.median_error) / row.crlb for row in known if row.crlb is not None]
        worst = int(np.argmax(medians))
        limit = EFFICIENCY.most_median
        lines.append(_line(medians[worst] < limit, "|median error|/bound below", limit, medians[worst], known[worst]))
    if all(row.coverage95 is not None for row in level.derivatives) and level.derivatives:
        low, high = EFFICIENCY.coverage_white if white else EFFICIENCY.coverage_coloured
        covers = [row.coverage95 or 0.0 for row in level.derivatives]
        for met, words, limit, place in (
            (min(covers) >= low, "coverage at least", low, int(np.argmin(covers))),
            (max(covers) <= high, "coverage at most", high, int(np.argmax(covers))),
        ):
            lines.append(_line(met, words, limit, covers[place], level.derivatives[place]))
    return lines


def _line(met: bool, words: str, limit: float, found: float, row: DerivativeStatistics) -> str:
    return f"{'met' if met else 'NOT met'}: {words} {limit:g}; worst {found:.3f} ({row.coefficient} {row.term})"
