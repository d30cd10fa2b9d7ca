"""Channel maps: the meaning of the columns of other recorders."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    StrictBool,
    StrictInt,
    StrictStr,
    ValidationError,
    model_validator,
)

from aerosid.errors import ChannelMapError
from aerosid.logs.derived_channels import LAWS
from aerosid.logs.formats.table import shown

Column = Annotated[StrictInt, Field(ge=1)] | Annotated[StrictStr, Field(min_length=1)]
Finite = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]


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
        """The columns that are summed."""
        if self.columns is not None:
            return self.columns
        return () if self.column is None else (self.column,)


class ChannelColumnMap(ColumnMap):
    """As `ColumnMap`, with the properties of a measured channel.

    Attributes
    ----------
    delay : float
        Its delay, s.
    position : (float, float, float), optional
        Position of its sensor from the centre of gravity, m, body axes.
    noise, resolution : float, optional
        Standard deviation and resolution in the given unit; they take precedence over estimates from the samples.
    held : bool
        Whether a sample is held until the next: a switch, a mode, a counter.
    time : ColumnMap, optional
        The column of its time stamps, where it is not that of the recording.
    clock : str, optional
        The clock of its stream to use, by name.
    note : str, optional
        A remark on the channel for readers of the result.
    """

    delay: Finite = 0.0
    noise: Positive | None = None
    resolution: Positive | None = None
    position: tuple[Finite, Finite, Finite] | None = None
    held: StrictBool = False
    time: ColumnMap | None = None
    clock: StrictStr | None = None
    note: StrictStr | None = None


class DerivedMap(BaseModel):
    """One channel computed from others by a law."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    law: StrictStr
    from_: Annotated[tuple[StrictStr, ...] | None, Field(alias="from")] = None
    position: tuple[Finite, Finite, Finite] | None = None

    @model_validator(mode="after")
    def _known(self) -> DerivedMap:
        if self.law not in LAWS:
            raise ValueError(f"`law` is one of {', '.join(LAWS)}")
        law = LAWS[self.law]
        if self.from_ is not None and len(self.from_) != len(law.inputs):
            raise ValueError(f"`from` names {len(law.inputs)} channels: {', '.join(name for name, _ in law.inputs)}")
        if law.constants and self.position is None:
            raise ValueError("`position` of the vane from the centre of gravity is needed, m, body axes")
        return self


class TextMap(BaseModel):
    """Layout of a table of text, where it cannot be determined from the file itself."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    delimiter: Annotated[StrictStr, Field(min_length=1, max_length=1)] | None = None
    decimal: Literal[".", ","] | None = None
    names_line: Annotated[StrictInt, Field(ge=1)] | None = None


def _as_alternatives(entry: Any) -> Any:
    return [entry] if isinstance(entry, dict) else entry


Alternatives = Annotated[tuple[ChannelColumnMap, ...], Field(min_length=1), BeforeValidator(_as_alternatives)]


class ChannelMap(BaseModel):
    """One channel map file.

    Attributes
    ----------
    time : ColumnMap, optional
        The column of time; not needed where the format defines each stream's stamps.
    clock : str, optional
        The clock to use in streams that have several, by name; the sample's own by default.
    raster : float or str, optional
        Rate, Hz, or the channel to whose stamps all others are resampled; by default the slowest motion channel.
    optional : bool
        Whether channels missing from the recording are left out with a note instead of being an error.
    channels : dict of str to tuple of ChannelColumnMap
        For each channel its possible columns, in order of preference.
    derived : dict of str to DerivedMap
        Channels computed from these.
    align : dict of str to str
        Channel and reference: the clock of the channel's stream is aligned with that of the reference's.
    text : TextMap, optional
        Separator, decimals and header of a table of text.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    schema_: Annotated[Literal[1], Field(alias="schema")] = 1
    format: StrictStr | None = None
    time: ColumnMap | None = None
    clock: StrictStr | None = None
    raster: Annotated[float, Field(gt=0.0, allow_inf_nan=False)] | StrictStr | None = None
    optional: StrictBool = False
    channels: Annotated[dict[str, Alternatives], Field(min_length=1)]
    derived: dict[str, DerivedMap] = {}
    align: dict[str, StrictStr] = {}
    text: TextMap | None = None

    @property
    def resamples(self) -> bool:
        """Whether the map requires processing of clocks or rates, also for a table."""
        whole = self.raster is not None or self.clock is not None or bool(self.align)
        entries = [entry for alternatives in self.channels.values() for entry in alternatives]
        return whole or any(entry.held or entry.time is not None or entry.clock is not None for entry in entries)


def find_channel_map(log: Path, given: Path | None) -> Path | None:
    """The map of a log: the given one, LOG.channels.toml next to it, channels.toml in its folder, or None."""
    if given is not None:
        return given
    # LOG is the file's full name, or its name without the suffix.
    stem = log.name.removesuffix(".gz")
    names = (f"{log.name}.channels.toml", f"{stem}.channels.toml", f"{Path(stem).stem}.channels.toml", "channels.toml")
    return next((path for name in names if _is_there(path := log.parent / name)), None)


def _is_there(path: Path) -> bool:
    try:
        return path.is_file()
    except OSError:  # its name is longer than the file system allows, where that of the log just fits
        return False


def load_channel_map(path: Path) -> ChannelMap:
    """The validated contents of a channel map file.

    Raises
    ------
    ChannelMapError
        If the file cannot be read, is not TOML, or contains a wrong key or value; the message names the key.
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
        raise ChannelMapError(f"{path}: the channel map is not valid TOML ({reason}); correct that place.") from None
    except RecursionError:
        raise ChannelMapError(f"{path}: the channel map is nested too deeply; write it as the README shows.") from None
    if "schema" not in content:
        raise ChannelMapError(f"{path}: key 'schema' is missing; add it.")
    return checked_map(content, str(path))


def checked_map(content: Mapping[str, Any], label: str) -> ChannelMap:
    """The validated map.

    Parameters
    ----------
    content : mapping
        The contents of a map file; a mapping of channel names to columns or entries alone is sufficient.
    label : str
        Its source, for messages.

    Raises
    ------
    ChannelMapError
        If a key or value is wrong; the message names the key.
    """
    if "channels" not in content:
        whole = {name: {"column": entry} if isinstance(entry, str | int) else entry for name, entry in content.items()}
        content = {"channels": whole} if "schema" not in content else content
    try:
        return ChannelMap.model_validate(dict(content))
    except ValidationError as error:
        raise ChannelMapError(f"{label}: {_first_problem(error)}") from None


def _first_problem(error: ValidationError) -> str:
    """One sentence on the first error."""
    first = error.errors(include_url=False)[0]
    # The branches of a union are pydantic's, not keys of the file.
    branches = ("constrained-", "function-", "int", "str", "tuple")
    keys = [str(part) for part in first["loc"] if isinstance(part, str) and not part.startswith(branches)]
    key = shown(".".join(keys), 80)
    if first["type"] == "missing" and isinstance(first["loc"][-1], int):
        needed = first["loc"][-1] + 1
        return f"key {key} has {len(first['input'])} entries, but entry {needed} is needed; write all of them."
    if first["type"] == "missing":
        return f"key {key} is missing; add it."
    if first["type"] == "extra_forbidden":
        return f"key {key} is not known; remove it or correct its spelling."
    reason = first["msg"].removeprefix("Value error, ")
    found = "" if isinstance(first["input"], dict) else f", found {shown(first['input'])}"
    return f"key {key} is wrong: {reason}{found}; correct it."
