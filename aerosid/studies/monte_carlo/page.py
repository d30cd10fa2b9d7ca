"""study.html: the results of a study, in one file that loads nothing and runs nothing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from aerosid import __version__, notation
from aerosid.reporting import words
from aerosid.reporting.figures.chart import Chart
from aerosid.reporting.figures.numbered import Figure, FigureBook
from aerosid.reporting.templating import page_environment, page_style
from aerosid.studies.monte_carlo import figures
from aerosid.studies.monte_carlo.run import Study
from aerosid.studies.monte_carlo.statistics import LevelStatistics

_TEMPLATES = Path(__file__).parent / "templates"


@dataclass(frozen=True)
class Drawn:
    """A figure with the names of its lines, by the role that gives their colour."""

    figure: Figure
    names: tuple[tuple[str, str], ...]


def level_name(level: LevelStatistics) -> str:
    """A noise level in words."""
    if level.snr is None:
        return "no noise"
    name = "recorded noise" if level.snr == "recorded" else f"SNR {level.snr:g}"
    return name if level.noise_colour == 0.0 else f"{name}, AR(1) of {level.noise_colour:g}"


def percent(share: float | None) -> str:
    """A fraction in per cent; a dash for None."""
    return notation.MISSING if share is None else f"{100.0 * share:.1f}"


def drawn_figures(study: Study) -> list[tuple[str, list[Drawn]]]:
    """The figures of each colour of noise, by its name in words."""
    book = FigureBook()
    truth = study.trials.truth
    signal = dict(zip(truth.identification.manoeuvre.outputs, truth.signal.tolist(), strict=True))
    groups = []
    for colour in dict.fromkeys(level.noise_colour for level in study.levels if level.snr is not None) or {0.0: None}:
        levels = [level for level in study.levels if level.noise_colour == colour or level.snr is None]
        shares = [figures.noise_share(level, signal) for level in levels]
        if any(level.derivatives for level in levels):
            words_of = "White noise" if colour == 0.0 else f"Coloured noise, AR(1) of {colour:g}"
            groups.append((words_of if truth.recorded is None else "Recorded noise", _drawn(book, levels, shares)))
    return groups


def _drawn(book: FigureBook, levels: Sequence[LevelStatistics], shares: Sequence[float]) -> list[Drawn]:
    def add(chart: Chart, caption: str, *names: tuple[str, str]) -> Drawn:
        return Drawn(book.add(chart, caption, caption), names)

    found = [
        add(
            figures.error_chart(levels, shares),
            "Error of each derivative in per cent of its true value, against the noise: root mean square over the "
            "runs, the least possible for an unbiased estimator, and the size of the bias.",
            ("measured", "Cramér-Rao bound"),
            ("after", "root-mean-square error"),
            ("declared", "bias"),
        ),
        add(
            figures.coverage_chart(levels, shares),
            "Fraction of 95 % intervals of each derivative that contain the true value; the faint line is 95 %.",
            ("declared", "as if residuals were white"),
            ("before", "corrected as published"),
            ("after", "corrected, as reported"),
        ),
    ]
    if any(level.false_alarms is not None for level in levels):
        found.append(
            add(
                figures.detection_chart(levels, shares),
                "Fraction of runs that identify every undeclared effect, and of those that identify another.",
                ("after", "all identified"),
                ("declared", "another effect identified"),
            )
        )
    if any(level.prediction for level in levels):
        found.append(
            add(
                figures.prediction_chart(levels, shares),
                "Error of a flight that is only predicted: median over the runs of its root mean square.",
                ("before", "declared structure, re-estimated"),
                ("after", "completed model"),
            )
        )
    return found


def page_html(study: Study, groups: Sequence[tuple[str, Sequence[Drawn]]]) -> str:
    """The text of study.html; identical for an identical study and the same versions.

    Parameters
    ----------
    study : Study
    groups : sequence of (str, sequence of Drawn)
        From `drawn_figures`.
    """
    template = page_environment(_TEMPLATES).get_template("study.html")
    return template.render(
        study=study,
        plan=study.plan,
        groups=groups,
        level_name=level_name,
        shown=lambda value, unit: notation.number(None if value is None else value * words.shown_unit(unit).factor, 2),
        percent=percent,
        style=page_style(),
        version=__version__,
    )
