"""The derivative table over manoeuvres as CSV, Markdown and LaTeX."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Mapping, Sequence

from aerosid import notation
from aerosid.flight_model.terms import Factor
from aerosid.reporting import words
from aerosid.studies.batch.one_log import CONDITION
from aerosid.studies.batch.table import Measured, Structure, TableRow

UNITS = {"V": "m/s", "h": "m", "mach": "1", "alpha": "rad", "mass": "kg"}

_LATEX = {"alpha": r"\alpha", "beta": r"\beta", "theta": r"\theta", "phi": r"\phi", "rho": r"\rho", "delta": r"\delta"}
_ACCENTS = {"hat": r"\hat", "dot": r"\dot", "bar": r"\bar"}
_SPECIAL = {"\\": r"\textbackslash{}", "~": r"\textasciitilde{}", "^": r"\textasciicircum{}"}
_SPECIAL |= {character: f"\\{character}" for character in "&%$#_{}"}


def table_csv(table: Sequence[TableRow]) -> str:
    """One line for each derivative at each condition, SI; empty where a number is unknown."""
    header = ["coefficient", "term", "declared", "value", "std_error", "scatter", "manoeuvres", "left_out", "condition"]
    header += ["structure", "cochran_q", "p_homogeneous"]
    header += [f"{name} [{UNITS[name]}]" for name in CONDITION]
    lines = (
        [
            row.coefficient, row.term, row.declared, row.value, row.std_error, row.scatter, row.manoeuvres,
            row.left_out, row.group, row.structure, row.heterogeneity, row.p_value,
            *(row.condition[name] for name in CONDITION),
        ]
        for row in table
    )  # fmt: skip
    return _csv(header, lines)


def manoeuvres_csv(entries: Sequence[Measured], group_of: Mapping[str, int]) -> str:
    """One line for each derivative from each manoeuvre, SI."""
    header = ["log", "condition", "coefficient", "term", "declared", "value", "std_error", "shown"]
    header += [f"{name} [{UNITS[name]}]" for name in CONDITION]
    lines = (
        [
            entry.log, group_of[entry.log], entry.coefficient, entry.term, entry.declared, entry.value,
            entry.std_error, "true" if entry.shown else "false", *(entry.condition[name] for name in CONDITION),
        ]
        for entry in entries
    )  # fmt: skip
    return _csv(header, lines)


def _csv(header: Sequence[str], lines: Iterable[Sequence[object]]) -> str:
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(header)
    writer.writerows(["" if cell is None else repr(cell) if isinstance(cell, float) else cell for cell in line]
                     for line in lines)  # fmt: skip
    return stream.getvalue()


def condition_words(row: TableRow) -> list[str]:
    """V, h, mach, alpha and mass of a row in display units, a dash where not recorded."""
    shown = []
    for name in CONDITION:
        value = row.condition[name]
        factor = words.shown_unit(UNITS[name]).factor
        shown.append(
            notation.MISSING if value is None else notation.number(factor * value, 4 if name in ("h", "mass") else 3)
        )
    return shown


def structure_words(structure: Structure) -> str:
    """The effects of a structure in addition to the declared model, in the names of the files."""
    names = [
        f"{where} {term}" if kind == "aero_term" else f"{kind.replace('_', ' ')} of {where}".removesuffix(" of ")
        for kind, where, term in structure
    ]
    return "declared" + "".join(f" + {name}" for name in names)


def headings() -> list[str]:
    """The columns of the printed tables."""
    units = [f"{name} [{words.shown_unit(UNITS[name]).text}]".removesuffix(" []") for name in CONDITION]
    numbers = ["value ± standard error", "scatter", "scatter / error", "p (one number)", "n", "structure"]
    return ["derivative", "declared", *numbers, *units]


def cells(row: TableRow) -> list[str]:
    """A row of the printed tables without the derivative's name."""
    return [
        notation.number(row.declared, 4),
        notation.with_deviation(row.value, row.std_error),
        notation.number(row.scatter, 2),
        notation.number(row.honest, 2),
        notation.MISSING if row.p_value is None else notation.p_value(row.p_value) + ("" if row.homogeneous else " !"),
        f"{row.manoeuvres}" + (f" (+{row.left_out})" if row.left_out else ""),
        str(row.structure),
        *condition_words(row),
    ]


def table_markdown(table: Sequence[TableRow]) -> str:
    """The table in Markdown."""

    def line(row: Sequence[str]) -> str:
        return "| " + " | ".join(cell.replace("|", r"\|") for cell in row) + " |\n"

    rule = "|" + "|".join([" --- ", *[" ---: "] * (len(headings()) - 1)]) + "|\n"
    body = "".join(line([f"{row.coefficient} {row.term}", *cells(row)]) for row in table)
    return line(headings()) + rule + body + "\n" + NOTE + "\n"


NOTE = (
    "value: mean over the manoeuvres of a condition, weighted with their standard errors. standard error: corrected "
    "for coloured residuals, of one manoeuvre. scatter: between repeats; about as large as the standard error if that "
    "is correct. n: manoeuvres that determine the derivative (+ those with too little information on it, which are "
    "left out). p (one number): that the repeats are estimates of one number, by Cochran's Q; marked with ! below "
    "0.01, where the mean is over different numbers. structure: effects missing from the declared model; estimates of "
    "different structures are never combined."
)


def table_latex(table: Sequence[TableRow]) -> str:
    """The table in LaTeX, as a plain `tabular` without packages."""
    columns = "l" + "r" * (len(headings()) - 1)
    lines = [rf"\begin{{tabular}}{{{columns}}}", r"\hline"]
    lines.append(" & ".join(_escaped(heading) for heading in headings()) + r" \\")
    lines.append(r"\hline")
    for row in table:
        name = f"${_symbol(row.coefficient)}$ ${_term(row.term)}$"
        lines.append(" & ".join([name, *(_escaped(cell) for cell in cells(row))]) + r" \\")
    lines += [r"\hline", r"\end{tabular}", "", f"% {NOTE}", ""]
    return "\n".join(lines)


_MATHS = {"±": r"$\pm$", "−": "$-$", "·": r"$\cdot$", "–": "--", "²": "$^2$"}
_RAISED = dict(zip("⁰¹²³⁴⁵⁶⁷⁸⁹⁻", "0123456789-", strict=True))


def _escaped(text: str) -> str:
    """A text escaped for LaTeX."""
    out, raised = [], ""
    for character in [*text, ""]:
        if character in _RAISED and character:
            raised += _RAISED[character]
            continue
        if raised:
            out.append(f"$^{{{raised}}}$")
            raised = ""
        out.append(_MATHS.get(character) or _SPECIAL.get(character) or character)
    return "".join(out)


def _symbol(name: str) -> str:
    base, *marks = name.split("_")
    body = _LATEX.get(base, base if base.isalnum() and len(base) == 1 else rf"\mathrm{{{_escaped(base)}}}")
    for mark in marks:
        body = rf"{_ACCENTS[mark]}{{{body}}}" if mark in _ACCENTS else rf"{body}_{{{_escaped(mark)}}}"
    return body


def _term(text: str) -> str:
    factors = words.factors_of(text)
    if factors is None:
        return rf"\mathrm{{{_escaped(text)}}}"
    return r"\,".join(_factor(factor) for factor in factors) or "1"


def _factor(factor: Factor) -> str:
    body = _symbol(factor.variable)
    if factor.shape == "abs":
        body = f"|{body}|"
    elif factor.shape == "pos":
        sign = "-" if factor.offset >= 0.0 else "+"
        inner = body if factor.offset == 0.0 else f"{body} {sign} {abs(factor.offset):g}"
        body = rf"\mathrm{{pos}}({inner})"
    return body if factor.power == 1 else f"{body}^{{{factor.power}}}"
