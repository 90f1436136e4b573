"""NumPy file of tables, written column by column from the disk, so that a long run is never in memory."""

from __future__ import annotations

import zipfile
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, BinaryIO

from .tables import Pieces

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

__all__ = ["write_npz"]


def write_npz(path: Path, tables: Mapping[str, Pieces]) -> int:
    """Write each column as an array "table.column" and return the number of rows of all tables.

    A missing number is NaN, a missing text empty.
    """
    rows = 0
    with TemporaryDirectory(dir=path.parent) as folder, zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as target:
        for name, pieces in tables.items():
            columns: dict[str, _Column] = {}
            for piece in pieces():
                for column, values in piece.items():
                    if column not in columns:
                        columns[column] = _Column(Path(folder) / str(len(columns)))
                    columns[column].add(values)
            for column, written in columns.items():
                with target.open(f"{name}.{column}.npy", "w", force_zip64=True) as file:
                    written.copy_to(file)  # type: ignore[arg-type]
            rows += next(iter(columns.values())).rows if columns else 0
    return rows


class _Column:
    """Values of one column, kept in a file."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._parts: list[tuple[np.dtype[Any], int]] = []
        path.write_bytes(b"")

    @property
    def rows(self) -> int:
        return sum(count for _, count in self._parts)

    def add(self, values: Sequence[Any]) -> None:
        array = _array(values)
        self._parts.append((array.dtype, len(array)))
        with self._path.open("ab") as file:
            file.write(array.tobytes())

    def copy_to(self, file: BinaryIO) -> None:
        import numpy as np

        final = np.result_type(*(dtype for dtype, _ in self._parts))
        head = {"descr": np.lib.format.dtype_to_descr(final), "fortran_order": False, "shape": (self.rows,)}
        np.lib.format.write_array_header_1_0(file, head)
        for array in self._stored():
            file.write(array.astype(final).tobytes())

    def _stored(self) -> Iterator[NDArray[Any]]:
        import numpy as np

        with self._path.open("rb") as file:
            for dtype, count in self._parts:
                yield np.frombuffer(file.read(dtype.itemsize * count), dtype)


def _array(values: Sequence[Any]) -> NDArray[Any]:
    import numpy as np

    known = [value for value in values if value is not None]
    if len(known) < len(values):
        text = bool(known) and isinstance(known[0], str)
        values = [("" if text else np.nan) if value is None else value for value in values]
    return np.array(values)
