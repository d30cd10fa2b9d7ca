"""The figures of a report, numbered in reading order."""

from __future__ import annotations

from dataclasses import dataclass, field

from markupsafe import Markup

from aerosid.reporting.figures.chart import Chart
from aerosid.reporting.figures.svg import chart_svg


@dataclass(frozen=True)
class Figure:
    """A figure with its number, its caption and a text alternative for readers who cannot see it.

    `inline`: whether its drawing is part of the page's text; on paper it is drawn from the chart.
    """

    number: int
    chart: Chart
    caption: str
    label: str
    inline: bool = True

    @property
    def identity(self) -> str:
        """The figure's id in the page."""
        return f"figure-{self.number}"

    @property
    def drawing(self) -> Markup:
        """The figure as SVG; empty where it is drawn elsewhere."""
        if not self.inline:
            return Markup()
        return chart_svg(self.chart, f"{self.identity}-svg", self.label)


@dataclass
class FigureBook:
    """Collects figures; every section of a report draws its figures through the same one."""

    figures: list[Figure] = field(default_factory=list)
    inline: bool = True

    def add(self, chart: Chart, caption: str, label: str) -> Figure:
        """The chart as the next figure.

        Parameters
        ----------
        chart : Chart
            What is drawn.
        caption : str
            Caption: what the reader should see in it.
        label : str
            Text alternative, for readers who cannot see it.
        """
        figure = Figure(len(self.figures) + 1, chart, caption, label, self.inline)
        self.figures.append(figure)
        return figure
