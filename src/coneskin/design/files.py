"""Output folder of ``coneskin design``, written under a temporary name and renamed at the end.

Where it replaces an earlier design, what a person has put beside that design stays.
"""

from __future__ import annotations

import csv
import io
import json
import os
import shutil
import tempfile
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from coneskin.core.errors import GeometryError
from coneskin.geometry.drawing.cut_sheet import CutSheet, make_test_piece, nest_sheets
from coneskin.geometry.drawing.dxf import ArcStyle, to_dxf
from coneskin.geometry.drawing.nesting import MaterialBed
from coneskin.geometry.drawing.pdf import PageSize, to_pdf
from coneskin.geometry.drawing.svg import to_svg

from .sheets.sheet_design import SheetDesign
from .sheets.summary import material_rows, sensor_toml

__all__ = ["DESIGN_FILE", "FileOptions", "check_target", "new_folder", "sheet_folder", "write_sheets"]

#: summary of a design; only a folder with this file may be replaced
DESIGN_FILE = "design.json"
_MIN_TOLERANCE = 1e-7  # m; a flattened arc of 1 m then has 2000 lines
_MAX_TOLERANCE = 1e-3  # m


@dataclass(frozen=True, slots=True)
class FileOptions:
    """Options of the drawings.

    Attributes:
        arcs: style of arcs in DXF files.
        tolerance: largest distance of flattened lines from the arcs [m].
        page: paper size of the PDF files.
        bed: width and depth of the cutter's bed [m], on which the parts of each material are nested.
        bed_gap: between nested parts [m].
        step: True for a STEP file of the layers of each sheet as they lie on the link, which needs the extra ``cad``.
    """

    arcs: ArcStyle = "bulge"
    tolerance: float = 1e-5
    page: PageSize = "A4"
    bed: tuple[float, float] = (0.6, 0.4)
    bed_gap: float = 3e-3
    step: bool = False

    def __post_init__(self) -> None:
        if not 0.999 * _MIN_TOLERANCE <= self.tolerance <= 1.001 * _MAX_TOLERANCE:  # millimetres in SI are not exact
            raise GeometryError(
                f"the tolerance of the cut must be from {_MIN_TOLERANCE * 1e3:g} to {_MAX_TOLERANCE * 1e3:g} mm, got "
                f"{self.tolerance * 1e3:.4g} mm"
            )


def check_target(target: Path, replace: bool = False) -> None:
    """Refuse a target folder that a design must not replace.

    Args:
        target: the folder to write.
        replace: True to allow an earlier design there.

    Raises:
        GeometryError: the target exists, and is not an earlier design or must not be replaced.
    """
    if target.exists() and not (target.is_dir() and not any(target.iterdir())):
        if not replace:
            raise GeometryError(
                f"{target} exists already: choose another folder, or replace the design there (--force, replace=True)"
            )
        if not (target / DESIGN_FILE).is_file():
            raise GeometryError(f"{target} is not a design (no {DESIGN_FILE} in it), so it is not replaced")


@contextmanager
def new_folder(target: Path, replace: bool = False) -> Iterator[Path]:
    """Open a temporary folder that becomes the target if the block succeeds, and is removed if it fails.

    Args:
        target: the folder to write.
        replace: True to allow an earlier design there.

    Yields:
        the temporary folder.

    Raises:
        GeometryError: the target exists already, or cannot be made; or a file of a person's there has the name of a new
            one.
    """
    target = Path(os.path.realpath(target))
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
            _replace(target, draft)
        else:
            draft.replace(target)
    finally:
        shutil.rmtree(draft, ignore_errors=True)


def _replace(target: Path, draft: Path) -> None:
    """Put a new design in the place of an earlier one, and carry over the files that are not of the earlier one."""
    own = _own_files(target)
    clash = next((name for name in own if os.path.lexists(draft / name)), None)
    if clash is not None:
        raise GeometryError(f"{target / clash} is not of the earlier design, but of the new one: move it away first")
    old = Path(tempfile.mkdtemp(prefix=f".{target.name}-old-", dir=target.parent))
    target.replace(old)
    draft.replace(target)
    try:
        for name in own:
            (target / name).parent.mkdir(parents=True, exist_ok=True)
            (old / name).replace(target / name)
    except OSError as exc:
        raise GeometryError(f"{old} still has files of yours: {exc.strerror or exc}; the new design is whole") from exc
    shutil.rmtree(old)


def _own_files(target: Path) -> list[Path]:
    """Return the files of a folder that its design.json does not list, as paths in the folder."""
    try:
        listed = {Path(name) for name in json.loads((target / DESIGN_FILE).read_text(encoding="utf-8"))["files"]}
    except (OSError, ValueError, KeyError, TypeError):
        listed = {Path(DESIGN_FILE)}
    return sorted(
        path.relative_to(target)
        for path in target.rglob("*")
        if (path.is_symlink() or not path.is_dir()) and path.relative_to(target) not in listed
    )


def sheet_folder(designs: tuple[SheetDesign, ...], index: int) -> Path:
    """Return the folder of a sheet, relative to the output folder; a single sheet has no folder of its own."""
    return Path() if len(designs) == 1 else Path(f"sheet-{index + 1}")


def write_sheets(
    folder: Path,
    designs: tuple[SheetDesign, ...],
    data: dict[str, Any],
    options: FileOptions,
    progress: Callable[[str], None],
    beds: Iterable[MaterialBed] = (),
    others: Iterable[str] = (),
) -> list[str]:
    """Write drawings, sensor files, the table of materials and design.json.

    Args:
        folder: an empty folder.
        designs: the sheets.
        data: content of design.json; its "frame" names the frame of the poses; the list of files is added.
        options: of the drawings.
        progress: called with the name of each step.
        beds: parts of each material, nested.
        others: files of the design that are in the folder already, as paths in it.

    Returns:
        the files of the design, as paths in the folder.
    """
    files: list[str] = list(others)

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
        piece = make_test_piece("every material")
        _write_drawing(write, place / "cut" / piece.slug, (piece,), f"{design.name}, test piece", options)
        _write_drawing(write, place / "cut" / "all", nest_sheets(design.cuts), design.name, options)
    for bed in beds:
        progress(f"writing {bed.slug}")
        stem = Path("nested") / bed.slug
        write(stem.with_name(f"{stem.name}.dxf"), to_dxf(bed.sheets, options.arcs, options.tolerance))
        write(stem.with_name(f"{stem.name}.svg"), to_svg(bed.sheets, bed.slug))
    rows = material_rows(designs)
    table = io.StringIO()
    writer = csv.DictWriter(table, rows[0], lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    write(Path("materials.csv"), table.getvalue())
    files.append(DESIGN_FILE)
    data["files"] = files
    (folder / DESIGN_FILE).write_text(json.dumps(data, indent=2) + "\n", encoding="utf-8")
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
