"""replay.html: the recursive identification of a flight with a time slider, in one file that loads nothing."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

import numpy as np

from aerosid.model_error.paper_chain.in_flight import Frame
from aerosid.notation import finite_throughout
from aerosid.reporting.script_data import safe_inside_element
from aerosid.reporting.scripts import Script, content_policy
from aerosid.reporting.templating import REPORT_TEMPLATES, page_environment, page_style

_DIGITS = 5
"""Display: significant digits of the frames, more than a strip shows."""


def render_replay(frames: Sequence[Frame], log: str, aircraft: str, coefficients: Sequence[str]) -> str:
    """The page of a replay.

    Parameters
    ----------
    frames : sequence of Frame
        At least one.
    log, aircraft : str
        Names; escaped.
    coefficients : sequence of str
        Coefficients whose d(t) is shown.
    """
    script = (REPORT_TEMPLATES / "replay.js").read_text(encoding="utf-8")
    scripts = (Script(frames_json(frames), data="replay-data"), Script(script))
    strips, ranges = zip(*(_strip(frames, axis) for axis in range(len(coefficients))), strict=True)
    return (
        page_environment(Path(REPORT_TEMPLATES))
        .get_template("replay.html")
        .render(
            title=f"Replay of {log}",
            log=log,
            aircraft=aircraft,
            axes=coefficients,
            last=frames[-1],
            count=len(frames),
            strips=strips,
            ranges=ranges,
            scripts=scripts,
            policy=content_policy(scripts),
            style=page_style(),
        )
    )


def frames_json(frames: Sequence[Frame]) -> str:
    """The frames as JSON that is safe inside an element: no `<`, null for unknown values."""
    text = json.dumps([finite_throughout(asdict(frame), _DIGITS) for frame in frames], allow_nan=False)
    return safe_inside_element(text)


def _strip(frames: Sequence[Frame], axis: int) -> tuple[str, tuple[float, float]]:
    """The path of d in one coefficient, scaled to a box of 1000 by 100, and its range."""
    time = np.array([frame.time for frame in frames])
    d = np.array([frame.model_error[axis] for frame in frames])
    present = np.isfinite(d)
    if not present.any():
        return "", (math.nan, math.nan)
    low, high = float(d[present].min()), float(d[present].max())
    x = 1000.0 * (time - time[0]) / max(float(np.ptp(time)), np.finfo(float).tiny)
    y = 95.0 - 90.0 * (d - low) / max(high - low, np.finfo(float).tiny)
    path, pen = [], "M"
    for k in range(time.size):
        if not present[k]:
            pen = "M"
            continue
        path.append(f"{pen}{x[k]:.1f} {y[k]:.1f}")
        pen = "L"
    return "".join(path), (low, high)
