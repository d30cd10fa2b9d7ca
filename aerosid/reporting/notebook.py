"""Results in a notebook: a closed loop with a display, plots and files."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

from aerosid.aircraft import Aircraft
from aerosid.errors import UsageError
from aerosid.logs.flight_log import FlightLog
from aerosid.loop import closed_loop
from aerosid.loop.model_validation.open_loop_errors import Simulated
from aerosid.loop.provenance import NOBODY, Provenance
from aerosid.loop.result import ClosedLoop
from aerosid.loop.settings import USUAL, LoopSettings, Progress
from aerosid.nomenclature import CHANNELS
from aerosid.notation import number, p_value, with_deviation
from aerosid.reporting.roles import label_of
from aerosid.reporting.tables import unit_of
from aerosid.reporting.words import effect_sentence, ratio, shown_unit, term_label
from aerosid.reporting.writing import write_report

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class Result(ClosedLoop):
    """A closed loop with methods for a notebook; all its data are those of `ClosedLoop`."""

    @classmethod
    def of(cls, closed: ClosedLoop) -> Result:
        """The same result with these methods."""
        return cls(**{entry.name: getattr(closed, entry.name) for entry in fields(ClosedLoop)})

    def write(self, folder: str | Path, *, interactive: bool = True) -> tuple[Path, ...]:
        """Write the report and the files for scripts; their paths. As `write_report`."""
        return write_report(self, Path(folder), interactive=interactive)

    def plot(self, log: str | None = None) -> Figure:
        """Measured, re-estimated and completed response of one log, by default of the last one not used in the fit.

        Parameters
        ----------
        log : str, optional
            Name of the log.

        Returns
        -------
        matplotlib.figure.Figure
            One strip per channel, in degrees where it is an angle, over the log's own time, s.

        Raises
        ------
        UsageError
            Where the result contains no such log.
        """
        return _histories(self._simulated(log), self)

    def _simulated(self, log: str | None) -> Simulated:
        if log is None:
            return self.simulated[-1]
        for each in self.simulated:
            if each.log.name == log:
                return each
        found = ", ".join(each.log.name for each in self.simulated)
        raise UsageError(f"the result holds no log {log!r}, expected one of {found}; give one of these names.")

    def _repr_html_(self) -> str:
        """Verdict, sentence, effects, derivatives and errors, as displayed by a notebook."""
        verdict = self.verdict.name.lower().replace("_", " ")
        parts = [f"<p><b>{escape(verdict)}</b>. {escape(self.summary)}</p>"]
        if self.effects:
            parts.append(_table("Effects missing from the declared model", ("", "value", "unit", "p"), _effects(self)))
        head = ("", "", "declared", "re-estimated", "completed")
        if self.identified:
            parts.append(_table("Derivatives", head, _derivatives(self)))
        for each in self.simulated:
            rows = [row for row in self.errors if (row.log, row.role) == (each.log.name, each.role)]
            cells = [
                [row.channel, row.unit, *(number(v, 2) for v in (row.before, row.after)), ratio(row.after, row.before)]
                for row in rows
            ]
            title = f"Open-loop error of {each.log.name} ({label_of(each.role, self)})"
            parts.append(_table(title, ("", "unit", "before", "after", "before / after"), cells))
        return "\n".join(parts)


def close_loop(
    identification: Sequence[FlightLog],
    aircraft: Aircraft,
    validation: Sequence[FlightLog] = (),
    settings: LoopSettings = USUAL,
    progress: Progress = lambda _stage: None,
    *,
    hold_out: Sequence[FlightLog] = (),
    provenance: Provenance = NOBODY,
) -> Result:
    """The effects missing from the declared model, the completed model and the errors before and after, on every log.

    As `aerosid.loop.closed_loop.close_loop`, with the same parameters and exceptions; the result has methods for
    display, plots and files.
    """
    closed = closed_loop.close_loop(
        identification, aircraft, validation, settings, progress, hold_out=hold_out, provenance=provenance
    )
    return Result.of(closed)


def _effects(result: ClosedLoop) -> list[list[str]]:
    return [
        [
            effect_sentence(effect),
            with_deviation(effect.value, effect.std_error),
            effect.unit,
            p_value(effect.evidence.p_value),
        ]
        for effect in result.effects
    ]


def _derivatives(result: ClosedLoop) -> list[list[str]]:
    return [
        [
            row.coefficient,
            term_label(row.term),
            number(row.declared, 4),
            number(row.refitted, 4),
            with_deviation(row.value, row.std_error) if row.shown else f"{number(row.value, 4)}, not significant",
        ]
        for row in result.derivatives
    ]


def _table(title: str, head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table of texts, all of them escaped."""
    heading = "".join(f"<th>{escape(cell)}</th>" for cell in head)
    body = "".join("<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in rows)
    return f"<table><caption>{escape(title)}</caption><thead><tr>{heading}</tr></thead><tbody>{body}</tbody></table>"


def _histories(simulated: Simulated, result: ClosedLoop) -> Figure:
    from matplotlib.figure import Figure

    names = list(simulated.measured)
    figure = Figure(figsize=(7.0, 1.1 * len(names) + 0.8), layout="constrained")
    strips: Any = figure.subplots(len(names), 1, sharex=True, squeeze=False)
    for strip, name in zip(strips[:, 0], names, strict=True):
        unit = shown_unit(unit_of(name))
        lines: list[tuple[str, str, dict[str, Any]]] = [
            ("measured", "measured", {"linestyle": "none", "marker": ".", "markersize": 2.0, "color": "0.5"}),
            ("before", "before", {"linewidth": 1.0, "color": "tab:orange"}),
            ("after", "after", {"linewidth": 1.0, "color": "tab:blue"}),
        ]
        for attribute, label, style in lines:
            strip.plot(simulated.log.time, unit.factor * getattr(simulated, attribute)[name], label=label, **style)
        strip.set_ylabel(f"{name} [{unit.text}]" if unit.text else name)
        if name in CHANNELS:
            strip.set_title(CHANNELS[name].name, fontsize="small", loc="left")
    strips[0, 0].legend(loc="upper right", fontsize="small")
    strips[-1, 0].set_xlabel("time [s]")
    figure.suptitle(f"{simulated.log.name} ({label_of(simulated.role, result)})", fontsize="medium")
    return figure
