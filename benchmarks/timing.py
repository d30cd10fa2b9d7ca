"""Times that can be compared: the best of several, taken in turn; and how they grow with the length of a record."""

from __future__ import annotations

import os
import platform
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np


def best_in_turn(runs: Sequence[Callable[[], float]], rounds: int) -> list[float]:
    """The shortest time of each, taken in turn so that all meet the same load."""
    best = [float("inf")] * len(runs)
    for _ in range(rounds):
        best = [min(shortest, run()) for shortest, run in zip(best, runs, strict=True)]
    return best


def exponent(points: Sequence[tuple[int, float]]) -> float:
    """Slope of the logarithm of a cost over that of the samples: 1 where it is linear."""
    samples, costs = np.log(np.array(points, dtype=np.float64)).T
    return float(np.polyfit(samples, costs, 1)[0])


def growth(points: Sequence[tuple[int, float]], what: str = "time") -> str:
    """How a cost grows with samples, in a sentence."""
    if len(points) < 2:
        return "One length only: no growth to tell."
    return f"Growth: {what} as samples^{exponent(points):.2f}."


def machine() -> str:
    """Processor, its cores, and their load now."""
    load = f", load {os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else ""
    return f"{_processor()}, {os.cpu_count()} processors{load}"


def _processor() -> str:
    try:
        text = Path("/proc/cpuinfo").read_text(encoding="utf-8")
    except OSError:
        return platform.processor() or platform.machine()
    names = [line.split(":", 1)[1].strip() for line in text.splitlines() if line.startswith("model name")]
    return names[0] if names else platform.machine()
