"""Channel maps: what the columns of any other recorder mean."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, StrictInt, StrictStr, ValidationError, model_validator

from aerosid.errors import ChannelMapError
from aerosid.logs.formats.table import shown

Column = Annotated[StrictInt, Field(ge=1)] | Annotated[StrictStr, Field(min_length=1)]
Finite = Annotated[float, Field(allow_inf_nan=False)]


class ColumnMap(BaseModel):
    """One channel: value = sign * scale * x + offset, x the sum of its columns, the offset in the given unit."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    column: Column | None = None
    columns: Annotated[tuple[Column, ...], Field(min_length=1)] | None = None
    unit: StrictStr | None = None
    sign: Literal[1, -1] = 1
    scale: Finite = 1.0
    offset: Finite = 0.0

    @model_validator(mode="after")
    def _one_way(self) -> ColumnMap:
        if (self.column is None) == (self.columns is None):
            raise ValueError("give either `column` or `columns`")
        if self.scale == 0.0:
            raise ValueError("`scale` must not be 0")
        return self

    @property
    def parts(self) -> tuple[int | str, ...]:
        """The columns to be summed."""
        if self.columns is not None:
            return self.columns
        return () if self.column is None else (self.column,)


class ChannelColumnMap(ColumnMap):
    """As `ColumnMap`, with what only a measured channel has: how late it is, s, and where its sensor sits, m."""

    delay: Finite = 0.0
    position: tuple[Finite, Finite, Finite] | None = None


class ChannelMap(BaseModel):
    """One channel map file."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    schema_: Annotated[Literal[1], Field(alias="schema")]
    format: StrictStr | None = None
    time: ColumnMap
    channels: Annotated[dict[str, ChannelColumnMap], Field(min_length=1)]


def find_channel_map(log: Path, given: Path | None) -> Path | None:
    """The map for a log: the given one, LOG.channels.toml beside it, channels.toml in its folder, or none."""
    if given is not None:
        return given
    # LOG is the file's whole name, or its name without the suffix.
    stem = log.name.removesuffix(".gz")
    names = (f"{log.name}.channels.toml", f"{stem}.channels.toml", f"{Path(stem).stem}.channels.toml", "channels.toml")
    return next((path for name in names if (path := log.parent / name).is_file()), None)


def load_channel_map(path: Path) -> ChannelMap:
    """The checked content of a channel map file.

    Raises
    ------
    ChannelMapError
        If the file cannot be read, is no TOML, or holds a wrong key or value; the message names the key.
    """
    try:
        content = tomllib.loads(path.read_bytes().decode("utf-8"))
    except OSError as error:
        reason = error.strerror or "it cannot be read"
        raise ChannelMapError(f"{path}: the channel map cannot be opened ({reason}); check the path.") from None
    except UnicodeDecodeError as error:
        raise ChannelMapError(f"{path}: byte {error.start + 1} is not UTF-8; save the channel map as UTF-8.") from None
    except tomllib.TOMLDecodeError as error:
        reason = " ".join(str(error).split())[:120]
        raise ChannelMapError(f"{path}: the channel map is no valid TOML ({reason}); correct that place.") from None
    except RecursionError:
        raise ChannelMapError(f"{path}: the channel map is nested too deeply; write it as the README shows.") from None
    try:
        return ChannelMap.model_validate(content)
    except ValidationError as error:
        raise ChannelMapError(f"{path}: {_first_problem(error)}") from None


def _first_problem(error: ValidationError) -> str:
    """One sentence on the first thing that is wrong."""
    first = error.errors(include_url=False)[0]
    # The branches of a union are pydantic's, not keys of the file.
    keys = [str(part) for part in first["loc"] if not str(part).startswith(("constrained-", "function-", "int", "str"))]
    key = shown(".".join(keys), 80)
    if first["type"] == "missing":
        return f"key {key} is missing; add it."
    if first["type"] == "extra_forbidden":
        return f"key {key} is not known; remove it or correct its spelling."
    reason = first["msg"].removeprefix("Value error, ")
    found = "" if isinstance(first["input"], dict) else f", found {shown(first['input'])}"
    return f"key {key} is wrong: {reason}{found}; correct it."
