"""Export of a run to other programs: CSV, Parquet and NumPy tables, or one MCAP file.

A NumPy file is written column by column from the disk, so that a long run is never in memory.
"""

from __future__ import annotations

import csv
import zipfile
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import ExitStack
from itertools import chain
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, BinaryIO

from coneskin.core.errors import RecordingError
from coneskin.core.files import draft_of, explain_os_error
from coneskin.core.progress import Progress, silent
from coneskin.runs.replay.run import Run

from .tables import Pieces, Table, table_pieces, write_parquet

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


def _write_npz(path: Path, tables: Mapping[str, Pieces]) -> int:
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
        with self._path.open("rb") as stored:
            for dtype, count in self._parts:
                file.write(np.frombuffer(stored.read(dtype.itemsize * count), dtype).astype(final).tobytes())


def _array(values: Sequence[Any]) -> NDArray[Any]:
    import numpy as np

    known = [value for value in values if value is not None]
    if len(known) < len(values):
        text = bool(known) and isinstance(known[0], str)
        values = [("" if text else np.nan) if value is None else value for value in values]
    return np.array(values)


FORMATS = ("csv", "parquet", "npz", "mcap")


def export_run(run: Run, target: Path, form: str | None = None, progress: Progress = silent) -> dict[Path, int]:
    """Write a run for other programs.

    Args:
        target: csv, parquet: folder for one file for each table; it is made. npz, mcap: the file.
        form: one of ``FORMATS``; None: as the target's name ends, else csv.

    Returns:
        file -> its number of rows or messages.

    Raises:
        RecordingError: the form is another, or not the one that the target is named after; a file is there already, or
            cannot be written; the run has nothing to export.
        MissingExtra: a package that the form needs is not installed.
    """
    named = target.suffix[1:].lower()
    form = form or (named if named in FORMATS else "csv")
    if form not in FORMATS:
        raise RecordingError(f"a run is exported as {', '.join(FORMATS)}, got {form!r}")
    if named in FORMATS and named != form:
        raise RecordingError(f"{target} is named as {named}, but the format is {form}: name another, or choose {named}")
    if target.exists() and (target.is_file() or form in ("npz", "mcap")):
        raise RecordingError(f"{target} is there already; nothing is overwritten: name another")
    with explain_os_error(RecordingError, f"cannot write {target}"):
        if form in ("csv", "parquet"):
            write = _write_csv if form == "csv" else write_parquet
            if not (written := _write_folder(target, table_pieces(run, progress), form, write)):
                raise _nothing(run)
            return written
        target.parent.mkdir(parents=True, exist_ok=True)
        with draft_of(target) as draft:
            if form == "npz":
                rows = _write_npz(draft, table_pieces(run, progress))
            else:
                from .mcap_file import write_mcap

                rows = write_mcap(run, draft, progress)
            if not rows:
                raise _nothing(run)
            return {target: rows}


def _nothing(run: Run) -> RecordingError:
    lost = f": {run.missing}" if run.missing else ""
    return RecordingError(f"the run has no events, frames, states or commands, so nothing is exported{lost}")


def _write_folder(
    folder: Path, tables: Mapping[str, Pieces], suffix: str, write: Callable[[Path, Iterable[Table]], int]
) -> dict[Path, int]:
    """Write a file for each table that has rows; all of them, or none."""
    folder.mkdir(parents=True, exist_ok=True)
    files = {name: folder / f"{name}.{suffix}" for name in tables}
    if there := [str(path) for path in files.values() if path.exists()]:
        raise RecordingError(f"{', '.join(there)} is there already; nothing is overwritten: name another folder")
    rows: dict[Path, int] = {}
    with ExitStack() as drafts:
        for name, path in files.items():
            pieces = tables[name]()
            first = next(pieces, None)
            if first is not None:
                rows[path] = write(drafts.enter_context(draft_of(path)), chain([first], pieces))
    return rows


def _write_csv(path: Path, pieces: Iterable[Table]) -> int:
    """Write a table as CSV; floats with every digit that it takes to read them back, nothing for None."""
    rows = 0
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file)
        for piece in pieces:
            if not rows:
                writer.writerow(piece)
            writer.writerows(zip(*piece.values(), strict=True))
            rows += len(next(iter(piece.values())))
    return rows
