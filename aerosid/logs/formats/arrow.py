"""Apache Parquet and Feather (Arrow IPC), through pyarrow: one table, one stream."""

from __future__ import annotations

import io
from functools import partial
from typing import Any

import numpy as np

from aerosid.errors import LogError
from aerosid.logs.formats.damaged_columns import guarded
from aerosid.logs.recording import TICKS, AnyArray, Clock, Column, Recording, Stream


def read_parquet(data: bytes, path: str) -> Recording:
    """The columns of a Parquet file, each read on demand.

    Raises
    ------
    LogError
        If the file is damaged, or contains no numeric column.
    """
    import pyarrow as pa
    from pyarrow import parquet

    try:
        file = parquet.ParquetFile(io.BytesIO(data))
        schema = file.schema_arrow
        table = partial(_parquet_column, data)
        return _recording("parquet", schema, table, path)
    except (pa.ArrowException, OSError) as error:
        raise LogError(f"{path}: {_damaged(error)}") from None


def read_feather(data: bytes, path: str) -> Recording:
    """The columns of a Feather (Arrow IPC) file.

    Raises
    ------
    LogError
        If the file is damaged, or contains no numeric column.
    """
    import pyarrow as pa
    from pyarrow import feather

    try:
        table = feather.read_table(io.BytesIO(data))
        return _recording("feather", table.schema, partial(_table_column, table), path)
    except (pa.ArrowException, OSError) as error:
        raise LogError(f"{path}: {_damaged(error)}") from None


def _damaged(error: Exception) -> str:
    return f"the file is damaged or truncated ({' '.join(str(error).split())[:80]}); copy or save it again."


def _parquet_column(data: bytes, name: str) -> Any:
    from pyarrow import parquet

    return parquet.read_table(io.BytesIO(data), columns=[name]).column(name)


def _table_column(table: Any, name: str) -> Any:
    return table.column(name)


def _recording(form: str, schema: Any, load: Any, path: str) -> Recording:
    import pyarrow as pa

    columns: dict[str, Column] = {}
    clocks: list[Clock] = []
    for field in schema:
        if pa.types.is_timestamp(field.type):
            stamps = load(field.name).combine_chunks().cast(pa.int64())
            if stamps.null_count == 0:
                clocks.append(Clock(field.name, np.asarray(stamps), TICKS[field.type.unit]))
        elif pa.types.is_integer(field.type) or pa.types.is_floating(field.type) or pa.types.is_boolean(field.type):
            metadata = field.metadata or {}
            unit = metadata.get(b"unit", metadata.get(b"units"))
            unit = unit.decode("utf-8", "replace") if unit else None
            columns[field.name] = guarded(partial(_numbers, load, field.name), path, field.name, unit)
    if not columns:
        raise LogError(f"{path}: the table holds no column of numbers; check that this is the right file.")
    return Recording(form, (Stream("", columns, tuple(clocks)),))


def _numbers(load: Any, name: str) -> AnyArray:
    """The values; a null is a missing sample, NaN."""
    import pyarrow as pa

    values = load(name).combine_chunks()
    if values.null_count or pa.types.is_boolean(values.type):
        values = values.cast(pa.float64())
    return np.asarray(values.to_numpy(zero_copy_only=False))
