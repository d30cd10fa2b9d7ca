"""Figures as data, and their drawing.

`chart` says what a figure holds, `layout` places its panels, `strip_charts` and `cross_plots` make figures of results.
`svg` draws a chart into the page, `pdf` onto paper, and `interactive` hands it to plotly: the same chart three times.
`numbered` counts the figures of a report.
"""
