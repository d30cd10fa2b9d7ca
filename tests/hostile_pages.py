"""A result whose every text from a file says what a careless page would run, and a strict reader of pages."""

from __future__ import annotations

import dataclasses
from html.parser import HTMLParser

import numpy as np
from problems_report import closed_loop

from aerosid.logs.flight_log import FlightLog
from aerosid.loop.model_validation.open_loop_errors import ErrorRow
from aerosid.loop.result import ClosedLoop
from aerosid.model_error.paper_chain.screening import ScreeningRow

VOID = {"meta", "link", "br", "img", "input", "hr"}

HOSTILE = "<img src=x onerror=alert(1)>\"$x^$'&{{7*7}}"


class Page(HTMLParser):
    """A strict reading: every element is closed in order; ids, attributes and texts are kept."""

    def __init__(self, text: str) -> None:
        super().__init__(convert_charrefs=True)
        self.open: list[str] = []
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.texts: list[str] = []
        self.data: dict[str, str] = {}
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, dict(attrs)))

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if self.open[-1:] == ["script"]:
            name = self.elements[-1][1].get("id") or ""
            self.data[name] = self.data.get(name, "") + data
        else:
            self.texts.append(data)

    def all(self, tag: str) -> list[dict[str, str | None]]:
        return [attributes for name, attributes in self.elements if name == tag]

    @property
    def text(self) -> str:
        return " ".join(self.texts)


def hostile_result() -> ClosedLoop:
    """Every text that comes from a file says something that a careless page would run."""
    made = closed_loop(samples=80)
    first = made.simulated[0]
    log = first.log
    extra = {HOSTILE: np.sin(log.time)}
    log = FlightLog(
        HOSTILE,
        log.time,
        {**log.channels, **extra},
        {**log.units, HOSTILE: HOSTILE},
        log.sources,
        {},
        (HOSTILE,),
        HOSTILE,
    )
    first = dataclasses.replace(first, log=log, measured={**first.measured, **extra}, after={**first.after, **extra})
    aircraft = dataclasses.replace(made.aircraft, name=HOSTILE, source=HOSTILE, path=HOSTILE)
    return dataclasses.replace(
        made,
        aircraft=aircraft,
        identification=(log,),
        simulated=(first, made.simulated[1]),
        summary=HOSTILE,
        effects=tuple(dataclasses.replace(e, kind=HOSTILE, where=HOSTILE, term=HOSTILE) for e in made.effects),
        errors=(ErrorRow(HOSTILE, "identification", HOSTILE, HOSTILE, None, 2.0, 1.0, None, 0.1), *made.errors),
        screening=(ScreeningRow(HOSTILE, HOSTILE, 0.1, 0.1, np.inf, 0.1, False),),
        model_error=tuple(dataclasses.replace(h, log=HOSTILE, terms=(HOSTILE,)) for h in made.model_error),
        prefilter=dataclasses.replace(made.prefilter, reason=HOSTILE),
        notes=(HOSTILE,),
    )
