"""Table 2: coefficients of the continuous system, with their error against sampling, weight and initial states."""

from __future__ import annotations

from dataclasses import dataclass

from aerosid.studies.paper.continuous_example import CASES, START, solve_case
from aerosid.studies.paper.polynomial_fit import COEFFICIENTS, PolynomialFit
from aerosid.studies.paper.view import TableView, number, scientific

WRONG_START = (1.5 * START[0], 1.5 * START[1])
INTERVALS = (0.02, 0.05, 0.1, 0.2)
"""Design: s, sampling intervals of the study of discretisation."""

DENSITIES = (1e-4, 1e-2, 1.0, 1e2)
"""Design: spectral densities Q2^-1 of the model error for comparison."""

TRUSTED = 1e-6
"""Design: prior variance of wrong initial states: so small that the recursion relies on them."""


@dataclass(frozen=True)
class Table2:
    """Table 2 and its supplementary studies.

    Attributes
    ----------
    fits : tuple of PolynomialFit
        The table itself, cases I to IV.
    direct : tuple of PolynomialFit
        d^ of (23) regressed on the candidates themselves, as described in the paper.
    errors : dict of (float, float) to float
        Worst error of case III against the interval [s] and the density of the model error.
    wrong_start, iterated : tuple of PolynomialFit
        Initial states 50 % off with a small prior variance; and after one forward-backward iteration.
    """

    fits: tuple[PolynomialFit, ...]
    direct: tuple[PolynomialFit, ...]
    errors: dict[tuple[float, float], float]
    wrong_start: tuple[PolynomialFit, ...]
    iterated: tuple[PolynomialFit, ...]


def make_table2() -> Table2:
    """Table 2 and its supplementary studies."""
    third = CASES[2]
    return Table2(
        fits=tuple(solve_case(case) for case in CASES),
        direct=tuple(solve_case(case, responded=False) for case in CASES),
        errors={
            (interval, density): solve_case(third, interval=interval, density=density).worst
            for interval in INTERVALS
            for density in DENSITIES
        },
        wrong_start=tuple(solve_case(case, start=WRONG_START, initial_covariance=TRUSTED) for case in CASES),
        iterated=tuple(
            solve_case(case, start=WRONG_START, initial_covariance=TRUSTED, backward_runs=1) for case in CASES
        ),
    )


def view(table: Table2) -> TableView:
    """Table 2 for the page."""
    rows = [
        (fit.case, *(number(fit.values[name], 6) for name in COEFFICIENTS), scientific(fit.worst),
         scientific(direct.worst), str(fit.samples))
        for fit, direct in zip(table.fits, table.direct, strict=True)
    ]  # fmt: skip
    return TableView(
        "Table 2. Continuous system (30), (31): coefficients of (32)",
        ("case", "a1 (X1)", "a2 (X2)", "a3 (X2²)", "a4 (X2³)", "worst error", "worst, direct", "points"),
        (("true", "−0.125", "−0.390625", "0", "−0.019531", "", "", ""), *rows),
        (
            (
                "Case I lacks X2³, case II X2 and X2³ (figure 3), case III X1, X2 and X2³, case IV is case III on "
                "fewer points; the rows of the paper's table did not survive the scan, nor did it print the sampling "
                "interval and X(0): ours are 0.1 s, (1, 0.5), both states measured."
            ),
            (
                "Ours regresses d̂ on what the estimator would have shown of each candidate. 'Direct' regresses d̂ "
                "of (23) on the candidates at the same samples: d̂ lags by half a sampling interval, which a1, the "
                "coefficient of the derivative of X2, takes up."
            ),
            (
                "What is left in ours is the candidates' curvature between the samples, which falls with the square "
                "of the interval. Where the weight leaves too little room for model error (Q2⁻¹ = 10⁻⁴) the "
                "estimated states no longer follow the true ones, and candidates formed on them are wrong."
            ),
            (
                "Initial states 50 % off and believed: worst error "
                f"{scientific(max(fit.worst for fit in table.wrong_start))}; after one forward-backward iteration "
                f"{scientific(max(fit.worst for fit in table.iterated))}."
            ),
        ),
    )


def error_view(table: Table2) -> TableView:
    """Worst error of case III against interval and weight."""
    return TableView(
        "Table 2, case III: worst error against sampling interval and weight",
        ("interval [s]", *(f"Q2⁻¹ = {density:g}" for density in DENSITIES)),
        tuple(
            (f"{interval:g}", *(scientific(table.errors[interval, density]) for density in DENSITIES))
            for interval in INTERVALS
        ),
        ("300 points each; Q1 = 10⁶ / interval in all.",),
    )
