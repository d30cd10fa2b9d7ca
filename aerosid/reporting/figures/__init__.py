"""Figures as data, and their rendering.

`chart` defines the contents of a figure, `layout` places its panels, `strip_charts` and `cross_plots` make figures of
results. `svg` draws a chart into the page, `pdf` onto paper, and `interactive` writes it for plotly: the same chart
three times. `numbered` numbers the figures of a report.
"""
