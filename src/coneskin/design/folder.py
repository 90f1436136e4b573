"""Output folder of a design, written under a temporary name and renamed at the end.

Where it replaces an earlier design, what a person has put beside that design stays.
"""

from __future__ import annotations

import csv
import io
import json
import os
import shutil
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from coneskin.core.errors import GeometryError
from coneskin.core.files import explain_os_error
from coneskin.core.text import printable, read_json
from coneskin.geometry.drawing.cut_sheet import CutSheet, make_test_piece, nest_sheets
from coneskin.geometry.drawing.dxf import ArcStyle, to_dxf
from coneskin.geometry.drawing.nesting import MaterialBed, nest_on_beds
from coneskin.geometry.drawing.pdf import PageSize, to_pdf
from coneskin.geometry.drawing.svg import to_svg
from coneskin.geometry.solid import WrappedLayer, require_step_writer, to_stl, write_step

from .report import report_text
from .sheets.sheet_design import SheetDesign
from .sheets.summary import design_summary, material_rows, sensor_toml, sheet_folder
from .workshop.build_figures import BuildFigures, measure_build
from .workshop.placement import find_datum_faces

if TYPE_CHECKING:
    from coneskin.geometry.fit.cones import LinkFit
    from coneskin.geometry.mesh import Mesh

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
        try:
            data = read_json((target / DESIGN_FILE).read_bytes())
            ours = isinstance(data["files"], list) and isinstance(data.get("sheets", data.get("links")), list)
        except (OSError, ValueError, TypeError, KeyError):
            ours = False
        if not ours:
            raise GeometryError(f"{target} is not a design (no {DESIGN_FILE} in it), so it is not replaced")


@contextmanager
def _new_folder(target: Path, replace: bool = False) -> Iterator[Path]:
    """Open a temporary folder that becomes the target if the block succeeds, and is removed if it fails."""
    target = Path(os.path.realpath(target))
    check_target(target, replace)
    with explain_os_error(GeometryError, f"{target} cannot be written"):
        target.parent.mkdir(parents=True, exist_ok=True)
        draft = Path(tempfile.mkdtemp(prefix=f".{target.name}-", dir=target.parent))
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
    with explain_os_error(GeometryError, f"{old} still has files of yours", "; the new design is whole"):
        for name in own:
            (target / name).parent.mkdir(parents=True, exist_ok=True)
            (old / name).replace(target / name)
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


class _Draft:
    """A folder in the making, and the paths in it of all files so far."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.files = folder, list[str]()

    def write(self, name: Path, content: str | bytes) -> None:
        self.place(name).write_bytes(content if isinstance(content, bytes) else content.encode("utf-8"))

    def place(self, name: Path) -> Path:
        """Return where a new file belongs."""
        self.files.append(name.as_posix())
        (self.folder / name).parent.mkdir(parents=True, exist_ok=True)
        return self.folder / name

    def write_drawing(self, stem: Path, sheets: tuple[CutSheet, ...], title: str, options: FileOptions) -> None:
        self.write(stem.with_name(f"{stem.name}.dxf"), to_dxf(sheets, options.arcs, options.tolerance))
        self.write(stem.with_name(f"{stem.name}.svg"), to_svg(sheets, title))


def _measured(sheets: tuple[SheetDesign, ...], mesh: Mesh | None, frame: str, first: int) -> list[BuildFigures]:
    """Return the figures for building the sheets of a link, the first of which has that number as a sensor."""
    faces = () if mesh is None else find_datum_faces(mesh)
    return [
        measure_build(design, first + index, frame, mesh, sheets[:index], faces, sheets)
        for index, design in enumerate(sheets)
    ]


def _nested(sheets: Sequence[SheetDesign], options: FileOptions) -> tuple[tuple[MaterialBed, ...], tuple[str, ...]]:
    """Return the parts of sheets on beds, with a test piece of each material, and a sentence for what is larger."""
    cuts = [cut for design in sheets for cut in design.cuts]
    pieces = [make_test_piece(material) for material in dict.fromkeys(cut.material for cut in cuts)]
    return nest_on_beds([*cuts, *pieces], *options.bed, options.bed_gap)


def write_design(
    folder: Path | str,
    designs: Sequence[SheetDesign],
    *,
    fit: LinkFit | None = None,
    mesh: Mesh | None = None,
    title: str = "a link",
    source: str = "",
    frame: str = "mesh",
    notes: Sequence[str] = (),
    options: FileOptions | None = None,
    pictures: bool = True,
    replace: bool = False,
    progress: Callable[[str], None] = lambda _: None,
    first_sensor: int = 0,
    figures: Sequence[BuildFigures] | None = None,
) -> dict[str, Any]:
    """Write everything that a person needs to build the sheets, and the guard to use them.

    Args:
        folder: to write; it appears as a whole, or not at all.
        designs: the sheets, as ``design_sheets`` makes them.
        fit: the fit that they come from, for the report.
        mesh: of the link, for the pictures.
        title: name of the link, for the report.
        source: file that the link comes from; by default the title.
        frame: name of the frame of all poses.
        notes: on the link, for the report.
        options: of the drawings.
        pictures: True to draw pictures too, which needs the extra ``pictures``.
        replace: True to allow an earlier design in the folder; files that are not of that design stay.
        progress: called with the name of each step.
        first_sensor: number of the first sensor in the wire format.
        figures: for building each sheet; None to work them out.

    Returns:
        the content of design.json; "files" lists all files of the design, as paths in the folder.

    Raises:
        GeometryError: the folder is in use, a scene would refuse a sensor of the design, or a STEP file is wanted of a
            sheet that is not round; nothing is written then.
        MissingExtra: a package that the drawings or pictures need is not installed.
    """
    sheets, options = tuple(designs), options or FileOptions()
    if options.step:
        _require_step(sheets)
    title, source, frame, *notes = map(printable, (title, source, frame, *notes))  # a file's name may be no text
    figures = figures or _measured(sheets, mesh, frame, first_sensor)
    data: dict[str, Any] = {"link": source or title, "frame": frame, "notes": list(notes)}
    data["sheets"] = [
        design_summary(design) | item.as_data(design) for design, item in zip(sheets, figures, strict=True)
    ]
    if fit is not None:
        data["bare_areas"] = [{"share": round(b.share, 4), "reason": b.reason} for b in fit.bare_areas]
    beds, larger = _nested(sheets, options)
    for sentence in larger:
        progress(sentence)
    data["beds"] = [
        {"file": f"nested/{bed.slug}", "material": bed.material, "waste": round(bed.waste, 4)} for bed in beds
    ]
    data["larger_than_bed"] = list(larger)
    with _new_folder(Path(folder), replace) as temporary:
        draft = _Draft(temporary)
        drawn: list[tuple[str, str]] = []
        if pictures:
            from .pictures import draw_pictures

            tolerance, areas = (0.0, ()) if fit is None else (fit.tolerance, fit.bare_areas)
            weights = None if fit is None else fit.touch_weights
            drawn = draw_pictures(temporary, sheets, figures, mesh, tolerance, progress, areas, weights)
            draft.files += [file for _, file in drawn]
        notes = (*notes, *larger, f"Frame of all poses: {frame}")
        draft.write(Path("report.md"), report_text(sheets, figures, title, notes, fit, drawn, beds, first_sensor))
        for index, (design, item) in enumerate(zip(sheets, figures, strict=True)):
            place = sheet_folder(sheets, index)
            progress(f"{design.name}: writing drawings")
            draft.write(place / "sensor.toml", sensor_toml(design, first_sensor + index, frame))
            _write_cuts(draft, place / "cut", design, options)
            if item.collars:
                progress(f"{design.name}: writing the jig")
            for collar in item.collars:
                for part in collar.parts:
                    words = f"{design.options.link} {design.name} {collar.slug(part)}".strip()
                    draft.write(place / "jig" / f"{collar.slug(part)}.stl", to_stl(part.surface, words))
            if options.step:
                progress(f"{design.name}: writing the wrapped layers")
                write_step(draft.place(place / "wrapped.step"), _wrapped_layers(design))
        for bed in beds:
            progress(f"writing {bed.slug}")
            draft.write_drawing(Path("nested") / bed.slug, bed.sheets, bed.slug, options)
        rows = material_rows(sheets)
        table = io.StringIO()
        writer = csv.DictWriter(table, rows[0], lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
        draft.write(Path("materials.csv"), table.getvalue())
        data["files"] = [*draft.files, DESIGN_FILE]
        draft.write(Path(DESIGN_FILE), json.dumps(data, indent=2) + "\n")
        progress(f"{len(draft.files)} files")
    return data


def _write_cuts(draft: _Draft, folder: Path, design: SheetDesign, options: FileOptions) -> None:
    """Write each layer of a sheet, the test piece, and all of them together."""
    piece = make_test_piece("every material")
    drawings: list[tuple[str, tuple[CutSheet, ...], str]] = [
        *((cut.slug, (cut,), f"{design.name}, {cut.name}") for cut in design.cuts),
        (piece.slug, (piece,), f"{design.name}, test piece"),
        ("all", nest_sheets(design.cuts), design.name),
    ]
    for name, sheets, title in drawings:
        draft.write_drawing(folder / name, sheets, title, options)
        draft.write(folder / f"{name}.pdf", to_pdf(sheets, options.page, title))


def _require_step(sheets: Sequence[SheetDesign]) -> None:
    """Refuse STEP files before anything is drawn."""
    for sheet in sheets:
        if sheet.place.bends:
            raise GeometryError(
                f"{sheet.name} is bent as a {sheet.place.kind}, of which no STEP file is written: leave out "
                "drawings.step, or use cones only (--set search.round_only=true)"
            )
    require_step_writer()


def _wrapped_layers(design: SheetDesign) -> list[WrappedLayer]:
    """Return the layers of a sheet as they lie on the link."""
    stack = design.options.stack
    inner = [design.place.parallel(stack.face_offset(index)) for index in range(5)]
    return [
        WrappedLayer(f"{design.name} {layer.name}", side.frustum, layer.thickness, side.link_frustum)
        for layer, side in zip(stack.layers, inner, strict=True)
    ]
