"""Parquet files, which DuckDB, pandas and Polars read."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import ExitStack
from pathlib import Path

from coneskin.core.errors import MissingExtra, RecordingError
from coneskin.core.files import explain_os_error

from .tables import Table


def write_parquet(path: Path, pieces: Iterable[Table]) -> int:
    """Write a table, in pieces with the same columns, as a Parquet file, and return the number of its rows.

    Raises:
        MissingExtra: pyarrow is not installed.
        RecordingError: the file cannot be written.
    """
    try:
        import pyarrow as pa
        import pyarrow.parquet as pq
    except ImportError as exc:
        raise MissingExtra("pyarrow", "a Parquet file", "tables") from exc
    rows = 0
    with explain_os_error(RecordingError, f"cannot write {path}"), ExitStack() as stack:
        writer = None
        for piece in pieces:
            part = pa.table(dict(piece), schema=None if writer is None else writer.schema)
            if writer is None:
                kinds = [
                    (column.name, pa.int64() if pa.types.is_null(column.type) else column.type)
                    for column in part.schema
                ]
                writer = stack.enter_context(pq.ParquetWriter(path, pa.schema(kinds), compression="zstd"))
                part = part.cast(writer.schema)
            writer.write_table(part)
            rows += part.num_rows
    return rows
