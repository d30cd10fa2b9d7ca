"""Stepwise and sparse regression of measured force and moment coefficients: what a user would run in their place.

Each takes the question that the loop's methods are asked: the declared terms and the candidates, one coefficient by
itself, from accelerometers and the derivative of q on low-passed channels. Neither looks at sensors or controls.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.flight_model.aerodynamics import Entry
from aerosid.loop.identification_problem import IdentificationProblem
from aerosid.model_error.paper_chain.chain import ChainSettings, feed
from aerosid.model_error.paper_chain.coefficient_match import Corrected

Array = NDArray[np.float64]
Label = tuple[str, str, str]
Values = dict[tuple[str, str], float]

LEAST_F = 20.0
"""Partial F below which a term does not enter: Klein & Morelli, Aircraft System Identification, section 5.4."""

LEAST_SHARE = 0.005
"""Rise of R^2 below which it does not either: the same section."""

THRESHOLDS = np.geomspace(1e-3, 3.0, 25)
"""Of normalised columns, those of `benchmarks/rivals/sparse_regression.py`."""

WITHIN = 1.05
"""The sparsest model whose error on the second flight is within 5 % of the best, as there."""


def stepwise(question: IdentificationProblem) -> tuple[list[Label], Values]:
    """Klein & Morelli's forward regression by partial F: names by their shares of the variance, and the derivatives."""
    labels: list[tuple[float, Label]] = []
    values: Values = {}
    for name in question.aircraft.coefficients:
        declared = [entry for entry in question.free if entry[0] == name]
        rest = [entry for entry in question.candidates if entry[0] == name]
        columns, target = _columns(question, question.manoeuvres[0], name, [*declared, *rest])
        held = list(range(len(declared)))
        left = list(range(len(declared), columns.shape[1]))
        total = float(np.sum((target - target.mean()) ** 2))
        while left:
            _, now = _fitted(columns[:, held], target)
            squares = [_fitted(columns[:, [*held, place]], target)[1] for place in left]
            best = int(np.argmin(squares))
            freedom = target.size - len(held) - 1
            gain = now - squares[best]
            if gain / (squares[best] / freedom) < LEAST_F or gain / total < LEAST_SHARE:
                break
            held.append(left.pop(best))
            labels.append((gain / total, ("aero_term", name, str([*declared, *rest][held[-1]][1]))))
        solution, _ = _fitted(columns[:, held], target)
        values |= {_key([*declared, *rest][place]): float(v) for place, v in zip(held, solution, strict=True)}
    return [label for _, label in sorted(labels, reverse=True)], values


def sparse(question: IdentificationProblem) -> tuple[list[Label], Values]:
    """Sequentially thresholded least squares by PySINDy; it chooses among declared terms and candidates alike.

    Raises
    ------
    ImportError
        Where PySINDy is not installed.
    """
    import warnings

    from pysindy import STLSQ

    labels: list[tuple[float, Label]] = []
    values: Values = {}
    for name in question.aircraft.coefficients:
        declared = [entry for entry in question.free if entry[0] == name]
        entries = [*declared, *(entry for entry in question.candidates if entry[0] == name)]
        columns, target = _columns(question, question.manoeuvres[0], name, entries)
        unseen, wanted = _columns(question, question.others[0], name, entries)
        tried: list[tuple[int, float, Array]] = []
        for threshold in THRESHOLDS:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # a threshold that leaves nothing says so
                found = STLSQ(threshold=float(threshold), alpha=0.0, normalize_columns=True).fit(
                    columns, target[:, None]
                )
            table = np.asarray(found.coef_)[0]
            tried.append((int(np.count_nonzero(table)), float(np.mean((wanted - unseen @ table) ** 2)), table))
        least = min(error for _, error, _ in tried)
        _, _, table = min((one for one in tried if one[1] <= WITHIN * least), key=lambda one: one[:2])
        values |= {_key(entry): float(v) for entry, v in zip(entries, table, strict=True)}
        sizes = np.abs(table) * columns.std(axis=0) / max(float(target.std()), np.finfo(float).tiny)
        labels += [
            (float(size), ("aero_term", name, str(entry[1])))
            for entry, size in zip(entries, sizes, strict=True)
            if size > 0.0 and entry not in declared
        ]
    return [label for _, label in sorted(labels, reverse=True)], values


def _key(entry: Entry) -> tuple[str, str]:
    return entry[0], str(entry[1])


def _columns(
    question: IdentificationProblem, manoeuvre: Manoeuvre, name: str, entries: Sequence[Entry]
) -> tuple[Array, Array]:
    """Terms (N, m) along the measured motion, and the measured coefficient (N,), where both are known."""
    model = question.declared.extended([entry for entry in entries if entry not in question.declared.entries])
    corrected = Corrected.of(model, (), manoeuvre, feed(manoeuvre, ChainSettings()))
    place = question.aircraft.coefficients.index(name)
    unit = np.eye(len(model.entries))
    columns = np.column_stack([corrected.modelled(unit[model.entries.index(entry)])[:, place] for entry in entries])
    target = corrected.measured[:, place]
    held = np.isfinite(target) & np.isfinite(columns).all(axis=1)
    return columns[held], target[held]


def _fitted(X: Array, y: Array) -> tuple[Array, float]:
    solution = np.linalg.lstsq(X, y, rcond=None)[0]
    return solution, float(np.sum((y - X @ solution) ** 2))
