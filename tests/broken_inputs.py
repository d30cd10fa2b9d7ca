"""Broken logs and channel maps: what each is, its exit code, and what its one sentence must name."""

from __future__ import annotations

import gzip
from dataclasses import dataclass

HEADER = "time [s],V [m/s],alpha [rad],q [rad/s],delta_e [rad]\n"
ROWS = [f"{0.1 * k:.1f},{100 + k % 3},0.0{k % 7},0.00{k % 5},0.{k % 4}" for k in range(30)]
GOOD = HEADER + "\n".join(ROWS) + "\n"
BARE = "\n".join(row.replace(",", " ") for row in ROWS) + "\n"
MAP = """schema = 1
format = "ascii"
time = { column = 1, unit = "s" }
[channels]
alpha = { column = 3, unit = "rad" }
"""


@dataclass(frozen=True)
class Broken:
    """A log that cannot be used, with the words its message must hold."""

    label: str
    file: str
    content: bytes | None
    code: int
    names: tuple[str, ...]
    channel_map: str | None = None

    def __str__(self) -> str:
        return self.label


def _csv(label: str, text: str, *names: str, code: int = 3) -> Broken:
    return Broken(label, "log.csv", text.encode(), code, ("log.csv", *names))


def _row(number: int, text: str) -> str:
    """The good log with data row `number` (from 0, at line number + 2) replaced."""
    return HEADER + "\n".join([*ROWS[:number], text, *ROWS[number + 1 :]]) + "\n"


def _map(label: str, text: str, *names: str, code: int = 2) -> Broken:
    return Broken(label, "log.asc", BARE.encode(), code, names, text)


BROKEN = [
    Broken("not there", "log.csv", None, 3, ("log.csv", "does not exist")),
    _csv("empty", "", "empty"),
    _csv("blank", " \n\n \n", "empty"),
    _csv("comments only", "# a\n# b\n", "header"),
    _csv("header only", HEADER, "0 samples"),
    _csv("too few samples", HEADER + "\n".join(ROWS[:3]), "3 samples"),
    Broken("binary", "log.csv", bytes(range(256)) * 20, 3, ("log.csv", "byte 1", "binary")),
    Broken("UTF-16", "log.csv", GOOD.encode("utf-16"), 3, ("log.csv", "binary")),
    Broken("Latin-1 header", "log.csv", GOOD.replace("V", "Vé").encode("latin-1"), 3, ("line 1", "UTF-8")),
    Broken("truncated gzip", "log.csv.gz", gzip.compress(GOOD.encode())[:-30], 3, ("log.csv.gz", "truncated")),
    _csv("truncated in the last row", GOOD[:-9], "line 31", "fields", "truncated"),
    _csv("no header", "\n".join(ROWS), "line 1", "header"),
    _csv("no unit", GOOD.replace("q [rad/s]", "q"), "line 1", "column 4", "'q'"),
    _csv("semicolons", GOOD.replace(",", ";"), "line 1"),
    _csv("a name twice", GOOD.replace("q [rad/s]", "alpha [rad]"), "alpha", "columns 3 and 4"),
    _csv("no time", GOOD.replace("time [s]", "clock [s]"), "time"),
    _csv("text in numbers", _row(7, "0.7,abc,0,0,0"), "line 9", "column 2", "'abc'"),
    _csv("truth in numbers", _row(7, "0.7,True,0,0,0"), "line 9", "column 2", "'True'"),
    _csv("truth everywhere", HEADER + "\n".join(f"{k},TRUE,0,0,0" for k in range(12)), "line 2", "column 2", "'TRUE'"),
    _csv("comment at the end", GOOD + "# end\n", "line 32", "1 field,"),
    _csv("decimal comma", _row(7, "0,7,100,0,0,0"), "line 9", "6 fields"),
    _csv("underscore", _row(7, "0.7,1_00,0,0,0"), "line 9", "'1_00'"),
    _csv("infinite", _row(7, "0.7,inf,0,0,0"), "line 9", "infinite"),
    _csv("overflow", _row(7, "0.7,1e999,0,0,0"), "line 9", "infinite"),
    _csv("too many fields", _row(7, "0.7,100,0,0,0,5"), "line 9", "6 fields"),
    _csv("too few fields", _row(7, "0.7,100,0"), "line 9", "3 fields"),
    _csv("ragged twice", _row(7, "0.7,1,0,0,0,5").replace(ROWS[9], "0.9,1,0,0"), "line 9", "6 fields"),
    _csv("time goes back", _row(7, "0.2,100,0,0,0"), "time", "line 9", "goes back"),
    _csv("time repeats", _row(7, "0.6,100,0,0,0"), "time", "line 9", "repeats"),
    _csv("time missing", _row(7, ",100,0,0,0"), "line 9", "time"),
    _csv("wrong dimension", GOOD.replace("alpha [rad]", "alpha [kg]"), "alpha", "'kg'", "[rad]"),
    _csv("per cent for an angle", GOOD.replace("delta_e [rad]", "delta_e [%]"), "delta_e", "'%'", "[rad]"),
    _csv("unknown unit", GOOD.replace("alpha [rad]", "alpha [furlogs]"), "alpha", "'furlogs'"),
    _csv("empty unit", GOOD.replace("alpha [rad]", "alpha []"), "alpha", "unit"),
    _csv("tower of powers", GOOD.replace("alpha [rad]", "alpha [9**9**9**9]"), "alpha", "unit"),
    _csv("unit as code", GOOD.replace("alpha [rad]", "alpha [__import__('os')]"), "alpha", "unit"),
    _csv("endless unit", GOOD.replace("alpha [rad]", f"alpha [{'m*' * 50_000}m]"), "alpha", "characters"),
    _csv("brackets", GOOD.replace("alpha [rad]", f"alpha [{'(' * 3000}]"), "alpha", "characters"),
    Broken("unknown suffix", "log.xyz", GOOD.encode(), 3, ("log.xyz", "'.xyz'")),
    Broken("no map", "log.asc", BARE.encode(), 2, ("log.asc", "channel map")),
    Broken("text for ascii", "log.asc", b"hello\nworld\n" * 40, 3, ("log.asc", "no row of numbers"), MAP),
    Broken("ragged ascii", "log.asc", (BARE + "3.0 1\n" + "3.1 1 1 1 1\n").encode(), 3, ("line 31", "2 fields"), MAP),
    Broken("nan time in ascii", "log.asc", (BARE + "nan 1 1 1 1\n").encode(), 3, ("line 31", "time"), MAP),
    Broken("no MATLAB", "log.mat", b"hello", 3, ("log.mat", "MATLAB"), MAP.replace("ascii", "mat")),
    Broken("MATLAB head only", "log.mat", b"MATLAB 5.0" + b" " * 30, 3, ("log.mat",), MAP.replace("ascii", "mat")),
    Broken("MATLAB 7.3", "log.mat", b"MATLAB 7.3 MAT-file" + b" " * 600, 3, ("-v7",), MAP.replace("ascii", "mat")),
    _map("map is no TOML", "schema = = 1", "TOML", "line 1"),
    _map("map with deep brackets", "schema = " + "[" * 3000, "channels.toml"),
    _map("map is empty", "", "'schema'", "missing"),
    _map("unknown schema", MAP.replace("schema = 1", "schema = 2"), "'schema'", "'2'"),
    _map("unknown key", MAP.replace('unit = "rad"', 'units = "rad"'), "'channels.alpha.units'", "not known"),
    _map("unknown format", MAP.replace("ascii", "abacus"), "'abacus'", "mat"),
    _map("no time in map", MAP.replace('time = { column = 1, unit = "s" }\n', ""), "'time'", "missing"),
    _map("no channels", MAP.split("[channels]")[0], "'channels'", "missing"),
    _map("no column", MAP.replace("column = 3, ", ""), "'channels.alpha'", "column"),
    _map("column and columns", MAP.replace("column = 3", "column = 3, columns = [1, 2]"), "'channels.alpha'"),
    _map("column 0", MAP.replace("column = 3", "column = 0"), "'channels.alpha.column'", "'0'"),
    _map("column too far", MAP.replace("column = 3", "column = 6"), "alpha", "column 6", "5 columns"),
    _map("column is true", MAP.replace("column = 3", "column = true"), "'channels.alpha.column'"),
    _map("named column without names", MAP.replace("column = 3", 'column = "AL"'), "alpha", "'AL'"),
    _map("no unit anywhere", MAP.replace(', unit = "rad"', ""), "alpha", "unit"),
    _map("wrong dimension in map", MAP.replace('unit = "rad"', 'unit = "kt"'), "alpha", "'kt'", "[rad]"),
    _map("sign 2", MAP.replace('unit = "rad"', 'unit = "rad", sign = 2'), "'channels.alpha.sign'", "'2'"),
    _map("scale 0", MAP.replace('unit = "rad"', 'unit = "rad", scale = 0.0'), "'channels.alpha'", "scale"),
    _map("offset nan", MAP.replace('unit = "rad"', 'unit = "rad", offset = nan'), "'channels.alpha.offset'"),
    _map("delay too long", MAP.replace('unit = "rad"', 'unit = "rad", delay = 99.0'), "alpha", "99 s"),
    _map("two numbers for a position", MAP.replace('unit = "rad"', 'unit = "rad", position = [1, 2]'), "position"),
    _map("time among the channels", MAP + 'time = { column = 2, unit = "s" }\n', "time"),
    _map("time in metres", MAP.replace('unit = "s"', 'unit = "m"'), "time", "'m'"),
]
