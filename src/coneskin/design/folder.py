"""Folder of a design: drawings, sensor files, report, pictures and design.json, written as one."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from coneskin.core.errors import GeometryError
from coneskin.core.text import printable
from coneskin.geometry.drawing.cut_sheet import make_test_piece
from coneskin.geometry.drawing.layer_stack import parallel_frustum
from coneskin.geometry.drawing.nesting import nest_on_beds
from coneskin.geometry.pose import Pose
from coneskin.geometry.solid import WrappedLayer, require_step_writer, to_stl, write_step

from .files import FileOptions, new_folder, sheet_folder, write_sheets
from .report import report_text
from .sheets.sheet_design import SheetDesign
from .sheets.summary import design_summary
from .workshop.build_figures import measure_build
from .workshop.placement import find_datum_faces

if TYPE_CHECKING:
    from coneskin.geometry.fit.cones import LinkFit
    from coneskin.geometry.mesh import Mesh

    from .workshop.jig import Collar

__all__ = ["write_design"]


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
    faces = () if mesh is None else find_datum_faces(mesh)
    figures = [measure_build(design, index, frame, mesh, sheets[:index], faces) for index, design in enumerate(sheets)]
    data: dict[str, Any] = {"link": source or title, "frame": frame, "notes": list(notes)}
    data["sheets"] = [
        design_summary(design) | item.as_data(design) for design, item in zip(sheets, figures, strict=True)
    ]
    if fit is not None:
        data["bare"] = [{"start_mm": 1e3 * b.start, "end_mm": 1e3 * b.end, "reason": b.reason} for b in fit.bare]
        data["bare_areas"] = [{"share": round(b.share, 4), "reason": b.reason} for b in fit.bare_areas]
    cuts = [cut for design in sheets for cut in design.cuts]
    pieces = [make_test_piece(material) for material in dict.fromkeys(cut.material for cut in cuts)]
    beds, larger = nest_on_beds([*cuts, *pieces], *options.bed, options.bed_gap)
    for sentence in larger:
        progress(sentence)
    data["beds"] = [
        {"file": f"nested/{bed.slug}", "material": bed.material, "waste": round(bed.waste, 4)} for bed in beds
    ]
    data["larger_than_bed"] = list(larger)
    with new_folder(Path(folder), replace) as draft:
        drawn: list[tuple[str, str]] = []
        if pictures:
            from .pictures import draw_pictures

            tolerance, areas = (0.0, ()) if fit is None else (fit.tolerance, fit.bare_areas)
            weights = None if fit is None else fit.touch_weights
            drawn = draw_pictures(draft, sheets, figures, mesh, tolerance, progress, areas, weights)
        text = report_text(sheets, figures, title, (*notes, *larger, f"Frame of all poses: {frame}"), fit, drawn, beds)
        (draft / "report.md").write_text(text, encoding="utf-8")
        written = ["report.md", *(file for _, file in drawn)]
        for index, (design, item) in enumerate(zip(sheets, figures, strict=True)):
            if item.collars:
                progress(f"{design.name}: writing the jig")
                written += _write_jig(draft, sheet_folder(sheets, index), design, item.collars)
            if options.step:
                progress(f"{design.name}: writing the wrapped layers")
                written.append(_write_wrapped(draft, sheet_folder(sheets, index), design))
        write_sheets(draft, sheets, data, options, progress, beds, written)
        progress(f"{sum(1 for path in draft.rglob('*') if path.is_file())} files in {folder}")
    return data


def _require_step(sheets: Sequence[SheetDesign]) -> None:
    """Refuse STEP files before anything is drawn.

    Raises:
        GeometryError: a sheet is not round.
        MissingExtra: cadquery-ocp is not installed.
    """
    for sheet in sheets:
        if sheet.place.bends:
            raise GeometryError(
                f"{sheet.name} is bent as a {sheet.place.kind}, of which no STEP file is written: leave out "
                "drawings.step, or use cones only (--set search.round_only=true)"
            )
    require_step_writer()


def _write_wrapped(draft: Path, place: Path, design: SheetDesign) -> str:
    """Write the layers of a sheet as they lie on the link as a STEP file; return its path in the folder.

    Args:
        draft: the folder of the design.
        place: folder of the sheet, in it.
        design: the sheet.

    Raises:
        GeometryError: the CAD kernel refuses a layer.
    """
    stack, side = design.options.stack, design.place.frustum
    layers = []
    for index, layer in enumerate(stack.layers):
        height = stack.face_offset(index)
        pose = design.place.link_frustum @ Pose(translation=(0.0, 0.0, -height * side.sin_half_angle))
        name = f"{design.name} {layer.name}"
        layers.append(WrappedLayer(name, parallel_frustum(side, height), layer.thickness, pose))
    (draft / place).mkdir(parents=True, exist_ok=True)
    write_step(draft / place / "wrapped.step", layers)
    return (place / "wrapped.step").as_posix()


def _write_jig(draft: Path, place: Path, design: SheetDesign, collars: Sequence[Collar]) -> list[str]:
    """Write the parts of a jig as STL files; return their paths in the folder.

    Args:
        draft: the folder of the design.
        place: folder of the sheet, in it.
        design: the sheet.
        collars: its jig.
    """
    (draft / place / "jig").mkdir(parents=True)
    written = []
    for collar in collars:
        for part in collar.parts:
            name = place / "jig" / f"{collar.slug(part)}.stl"
            title = f"{design.options.link} {design.name} {collar.slug(part)}".strip()
            (draft / name).write_bytes(to_stl(part.surface, title))
            written.append(name.as_posix())
    return written
