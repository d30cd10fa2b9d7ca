"""Names of the files of one closed loop: known before the libraries that write them are loaded."""

from __future__ import annotations

RESULT, DERIVATIVES, RESIDUALS, NEXT_INPUT = "result.json", "derivatives.csv", "residuals.csv", "next_input.csv"
PAGE = "report.html"
PAPER = "report.pdf"
COMPLETED_AIRCRAFT = "completed_aircraft.toml"
FILES = (RESULT, DERIVATIVES, RESIDUALS, NEXT_INPUT, PAGE, PAPER, COMPLETED_AIRCRAFT)
