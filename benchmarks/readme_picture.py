"""The README's picture: a flight that was not fitted, measured, and simulated before and after the loop.

python -m benchmarks.readme_picture docs/pictures/before_after.png
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

import aerosid
from aerosid.loop.model_validation.open_loop_errors import Simulated

CHANNELS = {"alpha": "alpha [deg]", "q": "q [deg/s]", "a_x": "a_x [m/s²]"}
DEGREES = ("alpha", "q")


def sample_loop() -> aerosid.ClosedLoop:
    """The loop on the sample flight, its second flight as validation."""
    flights = aerosid.bundled_folder("flight_data")
    settings = aerosid.LoopSettings(next_flight=False, linear_analysis=False)
    return aerosid.close_loop(
        [aerosid.read_log(flights / "light_transport_doublet.csv")],
        aerosid.load_aircraft("light_transport"),
        [aerosid.read_log(flights / "light_transport_3211.csv")],
        settings,
    )


def draw(result: aerosid.ClosedLoop, path: Path) -> None:
    """The validation flight of a result as a PNG."""
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot as plt

    (flight,) = (simulated for simulated in result.simulated if simulated.role == "validation")
    figure, axes = plt.subplots(len(CHANNELS), 1, sharex=True, figsize=(7.2, 4.6), layout="constrained")
    for axis, (channel, label) in zip(axes, CHANNELS.items(), strict=True):
        factor = np.rad2deg(1.0) if channel in DEGREES else 1.0
        _lines(axis, flight, channel, factor)
        axis.set_ylabel(label)
        axis.grid(alpha=0.25, linewidth=0.5)
        axis.spines[["top", "right"]].set_visible(False)
    axes[-1].set_xlabel("time [s]")
    figure.align_ylabels()
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside upper center", ncols=3, frameon=False)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=120, metadata={"Software": None})
    plt.close(figure)


def _lines(axis: object, flight: Simulated, channel: str, factor: float) -> None:
    time = flight.log.time
    style = {"linewidth": 1.3}
    axis.plot(time, factor * flight.measured[channel], ".", color="0.55", markersize=2.5, label="measured")  # type: ignore[attr-defined]
    axis.plot(time, factor * flight.before[channel], color="#c2571a", label="before: derivatives re-estimated", **style)  # type: ignore[attr-defined]
    axis.plot(time, factor * flight.after[channel], color="#1b5fa6", label="after: completed model", **style)  # type: ignore[attr-defined]


def main() -> None:
    """Draw it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("path", type=Path, help="PNG to write")
    draw(sample_loop(), parser.parse_args().path)


if __name__ == "__main__":
    main()
