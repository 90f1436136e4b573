"""The folder that ``coneskin design`` leaves behind: written beside its place, then renamed, so never half there."""

from __future__ import annotations

import csv
import io
import json
import os
import shutil
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from .design import SheetDesign
from .design_summary import materials, sensor_toml
from .errors import GeometryError
from .geometry.cut_sheet import CutSheet, nest
from .geometry.dxf import Arcs, to_dxf
from .geometry.pdf import Page, to_pdf
from .geometry.svg import to_svg

__all__ = ["FileOptions", "check_target", "new_folder", "sheet_folder", "write_sheets"]

_MARK = "design.json"  # only a folder with this file may be replaced


@dataclass(frozen=True, slots=True)
class FileOptions:
    """How the drawings are written.

    Attributes:
        arcs: style of arcs in DXF files.
        tolerance: of flattened arcs [m].
        page: paper of the PDF files.
    """

    arcs: Arcs = "bulge"
    tolerance: float = 1e-5
    page: Page = "A4"


def check_target(target: Path, replace: bool = False) -> None:
    """Refuse a folder that a design may not take the place of.

    Args:
        target: the folder to be.
        replace: whether an earlier design may be there already.

    Raises:
        GeometryError: the target is there already, and is no earlier design or may not be replaced.
    """
    if target.exists() and not (target.is_dir() and not any(target.iterdir())):
        if not replace:
            raise GeometryError(f"{target} is there already: choose another folder, or --force to replace a design")
        if not (target / _MARK).is_file():
            raise GeometryError(f"{target} is not a design (no {_MARK} in it), so it is not replaced")


@contextmanager
def new_folder(target: Path, replace: bool = False) -> Iterator[Path]:
    """A temporary folder that takes the place of the target where the block ends well, and vanishes where not.

    Args:
        target: the folder to be.
        replace: whether an earlier design may be there already.

    Raises:
        GeometryError: the target is there already, or cannot be made.
    """
    target = Path(os.path.abspath(target))
    check_target(target, replace)
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        draft = Path(tempfile.mkdtemp(prefix=f".{target.name}-", dir=target.parent))
    except OSError as exc:
        raise GeometryError(f"{target} cannot be written: {exc.strerror or exc}") from exc
    try:
        yield draft
        draft.chmod(0o755)  # mkdtemp makes it private
        if target.exists():
            old = Path(tempfile.mkdtemp(prefix=f".{target.name}-old-", dir=target.parent))
            target.replace(old)
            draft.replace(target)
            shutil.rmtree(old)
        else:
            draft.replace(target)
    finally:
        shutil.rmtree(draft, ignore_errors=True)


def sheet_folder(designs: tuple[SheetDesign, ...], index: int) -> Path:
    """Where the files of a sheet go: the folder itself where there is only one sheet."""
    return Path() if len(designs) == 1 else Path(f"sheet-{index + 1}")


def write_sheets(
    folder: Path,
    designs: tuple[SheetDesign, ...],
    data: dict[str, Any],
    options: FileOptions,
    progress: Callable[[str], None],
) -> list[str]:
    """Write drawings, sensor files, the table of materials and design.json.

    Args:
        folder: an empty folder.
        designs: the sheets.
        data: for design.json; its "frame" says what poses refer to; the list of files is added.
        options: how.
        progress: called with the name of each step.

    Returns:
        the files, as paths in the folder.
    """
    files: list[str] = []

    def write(name: Path, content: str | bytes) -> None:
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content if isinstance(content, bytes) else content.encode("utf-8"))
        files.append(name.as_posix())

    for index, design in enumerate(designs):
        progress(f"{design.name}: writing drawings")
        place = sheet_folder(designs, index)
        write(place / "sensor.toml", sensor_toml(design, index, str(data["frame"])))
        for cut in design.cuts:
            _write_drawing(write, place / "cut" / cut.slug, (cut,), f"{design.name}, {cut.name}", options)
        _write_drawing(write, place / "cut" / "all", nest(design.cuts), design.name, options)
    rows = materials(designs)
    table = io.StringIO()
    writer = csv.DictWriter(table, rows[0], lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    write(Path("materials.csv"), table.getvalue())
    files.append(_MARK)
    data["files"] = files
    (folder / _MARK).write_text(json.dumps(data, indent=2) + "\n", encoding="utf-8")
    return files


def _write_drawing(
    write: Callable[[Path, str | bytes], None],
    stem: Path,
    sheets: tuple[CutSheet, ...],
    title: str,
    options: FileOptions,
) -> None:
    write(stem.with_suffix(".dxf"), to_dxf(sheets, options.arcs, options.tolerance))
    write(stem.with_suffix(".svg"), to_svg(sheets, title))
    write(stem.with_suffix(".pdf"), to_pdf(sheets, options.page, title))
