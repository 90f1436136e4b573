"""Export of a run to other programs: CSV, Parquet and NumPy tables, or one MCAP file."""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterable, Mapping
from contextlib import ExitStack
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING

from coneskin.core.errors import RecordingError
from coneskin.core.files import draft_of
from coneskin.runs.block_progress import Progress, silent

from .tables import Pieces, Table, table_pieces

if TYPE_CHECKING:
    from coneskin.runs.replay.run import Run

__all__ = ["FORMATS", "export_run"]

FORMATS = ("csv", "parquet", "npz", "mcap")


def export_run(run: Run, target: Path, form: str, progress: Progress = silent) -> dict[Path, int]:
    """Write a run for other programs.

    Args:
        run: the run.
        target: csv, parquet: folder for one file for each table; it is made. npz, mcap: the file.
        form: one of ``FORMATS``.
        progress: called now and then with the fraction of the skin's frames that is done.

    Returns:
        file -> its number of rows or messages.

    Raises:
        RecordingError: the form is another, a file is there already, or cannot be written.
        MissingExtra: a package that the form needs is not installed.
    """
    if form not in FORMATS:
        raise RecordingError(f"a run is exported as {', '.join(FORMATS)}, got {form!r}")
    if target.exists() and (target.is_file() or form in ("npz", "mcap")):
        raise RecordingError(f"{target} is there already; nothing is overwritten: name another")
    try:
        if form in ("csv", "parquet"):
            from .parquet_file import write_parquet

            return _write_folder(
                target, table_pieces(run, progress), form, _write_csv if form == "csv" else write_parquet
            )
        target.parent.mkdir(parents=True, exist_ok=True)
        with draft_of(target) as draft:
            if form == "npz":
                from .npz_file import write_npz

                return {target: write_npz(draft, table_pieces(run, progress))}
            from .mcap_file import write_mcap

            return {target: write_mcap(run, draft, progress)}
    except OSError as exc:
        raise RecordingError(f"cannot write {target}: {exc.strerror or exc}") from exc


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
