"""Cross-validation over contiguous blocks of a record, where there is no validation record.

Each block is predicted with the parameters estimated from the rest. With the innovations e, slopes S and information A
of the whole regression, deleting rows b changes the parameters by -(A - S_b' S_b)^-1 S_b' e_b, so that no regression is
repeated (the block form of the deletion formula of Belsley, Kuh & Welsch, Regression Diagnostics, 1980, section 2.1).
The innovations after a block depend on it too, as many as the autoregression's order, and are deleted with it.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from aerosid.equation_error.equations.channels import COEFFICIENT
from aerosid.equation_error.regression.design import Design, compared, in_space_of_instruments
from aerosid.equation_error.regression.estimate import Estimate
from aerosid.equation_error.regression.inverse_information import inverse_of_shown
from aerosid.equation_error.regression.standard_errors import corrected_covariance
from aerosid.equation_error.selection.cross_validation import PredictionResidual, PredictionResiduals, without_constants
from aerosid.equation_error.settings import EquationErrorSettings

Array = NDArray[np.float64]

FEWEST = 2
"""Numerical: blocks below which there is nothing to predict from."""

SHOWN = 1e-9
"""Numerical: fraction of the whole information, 1, below which the rest does not determine a parameter."""


@dataclass(frozen=True)
class Block:
    """A contiguous part of a record: index of the record, first sample and one past the last sample in the band."""

    recording: int
    first: int
    stop: int


def blocks_of(found: Estimate) -> tuple[Block, ...]:
    """The blocks of the identification records: each record of several is one, a single record is divided.

    Blocks of a single record hold equal shares of the coefficients' variance, so that each excites the motion; as many
    as the settings allow, none shorter than their least length. Empty where a single record is too short for two.
    """
    design, settings = found.design, found.problem.settings
    lengths = _lengths(design)
    if len(lengths) > 1:
        return tuple(Block(index, 0, length) for index, length in sorted(lengths.items()))
    ((index, length),) = lengths.items()
    interval = found.problem.recordings[index].interval * found.problem.recordings[index].band.step
    shares = np.cumsum(_motion(design, index, length))
    for count in range(settings.blocks, FEWEST - 1, -1):
        inner = np.searchsorted(shares, shares[-1] * np.arange(1, count) / count)
        edges = [0, *inner.tolist(), length]
        if min(np.diff(edges)) * interval >= settings.block_length:
            return tuple(Block(index, a, b) for a, b in itertools.pairwise(edges))
    return ()


def _lengths(design: Design) -> dict[int, int]:
    """Samples in the band of each record, the fewest of its equations."""
    lengths: dict[int, int] = {}
    for s, (index, _) in enumerate(design.segments):
        rows = design.rows(s)
        lengths[index] = min(lengths.get(index, rows.stop - rows.start), rows.stop - rows.start)
    return lengths


def _motion(design: Design, index: int, length: int) -> Array:
    """The square of each sample's coefficients about their means, each coefficient's sum one, (length,)."""
    total = np.zeros(length)
    for s, (recording, _) in enumerate(design.segments):
        if recording == index:
            values = design.target[design.rows(s)][:length]
            squares = (values - values.mean()) ** 2
            total += squares / max(float(squares.sum()), 1e-300)
    return total


def block_residuals(found: Estimate, blocks: Sequence[Block]) -> PredictionResiduals:
    """Prediction residual of each coefficient of every block from the rest of the records, by block and coefficient.

    Constants are fitted in the block, and the response to the vane's difference from the inertial path is removed.
    Equations that are compared by instrumental variables are predicted in their space.
    """
    design, solution, settings = in_space_of_instruments(found.design), found.solution, found.problem.settings
    residuals = compared(design, solution.residuals[:, None], design.instruments)[:, 0]
    bread = np.diag(solution.covariance)
    scale = np.sqrt(np.diag(corrected_covariance(design, solution)) / np.maximum(bread, 1e-300))
    information, _ = design.normal_equations(solution.slopes, solution.whitened)
    own_to_block = ("one", "drift", "gust", "rotary_gust")
    free = [p for p, unknown in enumerate(design.unknowns) if unknown[0] in own_to_block]
    retained = [p for p in range(len(design.unknowns)) if p not in set(free)]
    result: dict[tuple[int, str], PredictionResidual] = {}
    for number, block in enumerate(blocks):
        inside, out = _rows(design, block, settings)
        slopes = solution.slopes[out]
        covariance = _inverse(information - slopes.T @ slopes, np.diag(information))
        change = -covariance @ (slopes.T @ solution.whitened[out])
        covariance = covariance * np.outer(scale, scale)
        for equation, rows in inside.items():
            columns = design.columns[rows]
            residual = residuals[rows] - columns @ change
            own = columns[:, free]
            residual, tilted = without_constants(residual, columns[:, retained], own)
            measured, own_covariance = design.target[rows], covariance[np.ix_(retained, retained)]
            result[number, equation] = PredictionResidual(measured - measured.mean(), residual, tilted, own_covariance)
    return result


def _rows(
    design: Design, block: Block, settings: EquationErrorSettings
) -> tuple[dict[str, NDArray[np.int64]], NDArray[np.int64]]:
    """The rows of a block by coefficient, and all rows deleted with it."""
    inside, out = {}, []
    for s, (index, equation) in enumerate(design.segments):
        if index != block.recording or equation not in COEFFICIENT:
            continue
        rows = design.rows(s)
        inside[equation] = np.arange(rows.start + block.first, rows.start + block.stop)
        out.append(np.arange(rows.start + block.first, min(rows.start + block.stop + settings.order, rows.stop)))
    return inside, np.concatenate(out)


def _inverse(information: Array, whole: Array) -> Array:
    """The pseudo-inverse (P, P); parameters without information keep their values, as constants of a deleted record do.

    `whole` (P,): information of each parameter with nothing deleted.
    """
    scale = np.sqrt(np.maximum(whole, 1e-300))
    scales = np.outer(scale, scale)
    return np.asarray(inverse_of_shown(information / scales, SHOWN) / scales)
