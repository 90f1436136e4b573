"""Design of the sheets of a link in one call: from its mesh or its dimensions to a folder for the workshop.

A link is a mesh file, or a link of a URDF.
"""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from coneskin.core.errors import GeometryError, MeshError
from coneskin.geometry.drawing.electrode_layout import NARROWEST_PLAN
from coneskin.geometry.drawing.nesting import require_nesting
from coneskin.geometry.fit.fit_options import check_names
from coneskin.geometry.frustum import Frustum
from coneskin.geometry.mesh import Mesh, load_mesh, terms_of
from coneskin.geometry.placed_frustum import PlacedFrustum
from coneskin.geometry.solid import require_step_writer

from .folder import FileOptions, check_target, write_design
from .sheets.sheet_design import DesignOptions, SheetDesign, cover_seams, design_assembly, design_sheets

if TYPE_CHECKING:
    from coneskin.geometry.fit.cones import LinkFit
    from coneskin.geometry.fit.touch_weights import TouchWeights

_LEAST_LEFT = 0.005  # of the hull, of what sheets leave as they are built
_LEFT_GRID = (24, 96)  # points of a sheet along and around
_LEFT_REASON = "no room there for a sheet as it is built, with its seam, its wires and its neighbors"
#: words in the name of a file or folder
_VISUAL_WORDS, _HULL_WORDS = {"visual", "visuals"}, {"collision", "collisions", "hull", "hulls", "convex"}


@dataclass(frozen=True, slots=True)
class LinkMesh:
    """The mesh of a link.

    Attributes:
        name: of the link, for titles.
        mesh: its surface.
        frame: frame of its coordinates, in words.
        notes: notes on the mesh, one sentence each.
        visual: True where it is called the visual mesh, by a URDF or by its path: no collision body, though convex.
    """

    name: str
    mesh: Mesh
    frame: str
    notes: tuple[str, ...]
    visual: bool = False


def load_link(
    link: str | Mesh,
    unit: str | None = None,
    packages: Mapping[str, str | Path] | None = None,
    arguments: Mapping[str, str] | None = None,
) -> Iterator[LinkMesh]:
    """Load the meshes of a LINK.

    Args:
        link: a mesh file, FILE.urdf#LINK, or a mesh; a xacro file is expanded.
        unit: of a mesh file; None to guess.
        packages: folders of the ROS packages in a URDF's package:// paths (``load_urdf_link``).
        arguments: of a xacro file.

    Yields:
        the meshes of the link, the best first: the visual mesh of a URDF is closer to the real surface than its
        collision mesh, which is often a convex hull.

    Raises:
        MeshError: the file, the link or its mesh cannot be found or read.
    """
    if isinstance(link, Mesh):
        yield _named(link, Path(link.source).stem)
        return
    path, hash_sign, name = link.partition("#")
    if not hash_sign and not path.lower().endswith((".urdf", ".xacro")):
        yield _named(load_mesh(path, unit), Path(path).name)
        return
    from coneskin.geometry.urdf import load_urdf_link, urdf_links

    if not name:
        names = ", ".join(urdf_links(path, packages, arguments))
        raise MeshError(f"{path}: name a link as {Path(path).name}#LINK; its links are: {names}")
    errors: list[MeshError] = []
    for kind in ("visual", "collision"):
        try:
            mesh = load_urdf_link(path, name, kind, packages, arguments)
        except MeshError as exc:
            errors.append(exc)
            continue
        said = tuple(str(error) for error in errors)
        notes = (f"{kind} mesh of the URDF", *said, *dict.fromkeys((*terms_of(path + name), *mesh.notes)))
        yield LinkMesh(name, mesh, f"the URDF link {name}", notes, kind == "visual")
    if len(errors) == 2:
        raise errors[0]


def _named(mesh: Mesh, file: str) -> LinkMesh:
    """Return a mesh as the link that its source names."""
    notes = tuple(dict.fromkeys((*terms_of(mesh.source), *mesh.notes)))
    return LinkMesh(
        Path(mesh.source).stem, mesh, f"the mesh's coordinates in {file}", notes, _called_visual(mesh.source)
    )


def _fit_link(
    link: str | Mesh,
    unit: str | None,
    packages: Mapping[str, str | Path] | None,
    progress: Callable[[str], None],
    arguments: Mapping[str, str] | None,
    **search: Any,
) -> tuple[LinkMesh, LinkFit]:
    """Return the first mesh of a link in which sheets are found, with its fit; else the first mesh.

    Without ``seam_direction`` the seams are where the link shields them most (``place_seams``).
    """
    facing = search.get("seam_direction")
    search = {name: value for name, value in search.items() if name != "seam_direction" or facing}
    tries: list[tuple[LinkMesh, LinkFit]] = []
    if isinstance(link, str):
        progress(f"reading {link}")
    for source in load_link(link, unit, packages, arguments):
        progress(f"{source.name}: {len(source.mesh.faces)} faces")
        fit = find_link_sheets(source, progress, **search)
        # what the search noted goes beside the notes on the mesh
        more = (note for note in fit.notes if note not in source.mesh.notes)
        source = replace(source, notes=(*source.notes, *more))
        if fit.sheets:
            return (source, fit) if facing else with_seams(source, fit, progress, search.get("weights"))
        tries.append((source, fit))
    return tries[0]


def find_link_sheets(source: LinkMesh, progress: Callable[[str], None], **search: Any) -> LinkFit:
    """Return the fit of a mesh; a convex one is refused as a collision hull, unless it is called the visual mesh.

    Args:
        source: the mesh.
        progress: called with the name of each step.
        search: fields of ``FitOptions``, and ``round_only``.

    Raises:
        GeometryError: an argument of the search is out of range.
    """
    from coneskin.geometry.fit.bare_areas import hull_note
    from coneskin.geometry.fit.developable.packing import find_sheets
    from coneskin.geometry.fit.surface_samples import sample_surface
    from coneskin.geometry.ray_casting import RayCaster

    asked = bool(search.pop("allow_hull", False))
    fit = find_sheets(source.mesh, progress=progress, allow_hull=asked or source.visual, **search)
    if asked or not source.visual or not fit.sheets:
        return fit
    note = hull_note(source.mesh, sample_surface(source.mesh, RayCaster(source.mesh)), visual=True)
    return replace(fit, notes=(*fit.notes, note)) if note else fit


def room_for(options: DesignOptions) -> dict[str, Any]:
    """Return those fields of ``FitOptions`` that leave room for the sheets, electrodes and gaps of a design."""
    plan = options.plan or NARROWEST_PLAN
    return {
        "thickness": options.stack.thickness,
        "gap": options.sheet_gap,
        "min_radius": 2.0 * plan.lead,
        "min_arc": plan.least_arc,
    }


def _called_visual(path: str) -> bool:
    """Tell whether a path calls its mesh the visual one, as ROS descriptions do; the nearest name counts."""
    for part in reversed(Path(path).parts):
        words = set(re.split("[^a-z]+", part.lower()))
        if words & _HULL_WORDS:
            return False
        if words & _VISUAL_WORDS:
            return True
    return False


def with_seams(
    source: LinkMesh, fit: LinkFit, progress: Callable[[str], None], weights: TouchWeights | None = None
) -> tuple[LinkMesh, LinkFit]:
    """Return a link with its seams at the places that it shields, and with a note of each reason."""
    from coneskin.geometry.fit.seam_place import place_seams

    fit, reasons = place_seams(fit, source.mesh, weights)
    for reason in reasons:
        progress(reason)
    return replace(source, notes=(*source.notes, *reasons)), fit


def as_built(fit: LinkFit, sheets: Sequence[SheetDesign]) -> LinkFit:
    """Return a fit with its sheets as they are built. What is left of them is one more area without a sheet."""
    import numpy as np

    from coneskin.geometry.fit.bare_areas import BareArea

    built = tuple(sheet.fit for sheet in sheets if sheet.fit is not None)
    share = sum(one.area_share for one in fit.sheets) - sum(one.area_share for one in built)
    if share < _LEAST_LEFT:
        return dataclasses.replace(fit, sheets=built)
    places, left = {id(sheet.found): sheet.place for sheet in sheets}, []
    for one in fit.sheets:
        side = one.frustum
        grid = np.meshgrid(np.linspace(0.0, side.slant, _LEFT_GRID[0]), np.linspace(0.0, side.wrap, _LEFT_GRID[1]))
        points = one.placed.place(*grid)[0].reshape(-1, 3)
        if (place := places.get(id(one))) is not None:
            u, phi, _ = place.locate_all(points)
            parts = u / place.frustum.slant, phi / place.frustum.wrap
            points = points[np.any([np.abs(part - 0.5) > 0.5005 for part in parts], axis=0)]
        left.append(points)
    bare = BareArea(_LEFT_REASON, share, np.concatenate(left))
    return dataclasses.replace(fit, sheets=built, bare_areas=(*fit.bare_areas, bare))


class NothingFits(GeometryError):
    """No sheet fits the mesh of a link.

    Attributes:
        source: the mesh.
        fit: the search, with its reason and the nearest sheet.
    """

    def __init__(self, source: str, fit: LinkFit) -> None:
        super().__init__(f"there is no sheet to design: {fit.reason}")
        self.source, self.fit = source, fit


@dataclass(frozen=True, slots=True)
class LinkDesign:
    """Design of all sheets of one link.

    Attributes:
        name: of the link.
        sheets: in order along their axis.
        fit: fit of the sheets to the mesh, with what stays bare; None for a link given by its dimensions.
        mesh: of the link, in the frame of the sheets; None for a link given by its dimensions.
        frame: frame of all poses, in words.
        notes: on the mesh, one sentence each.
        folder: that was written; None where none was.
        data: content of its design.json; empty where none was written.
    """

    name: str
    sheets: tuple[SheetDesign, ...]
    fit: LinkFit | None
    mesh: Mesh | None
    frame: str
    notes: tuple[str, ...]
    folder: Path | None = None
    data: Mapping[str, Any] = field(default_factory=dict)

    def written(self, folder: str | Path, source: str, **options: Any) -> LinkDesign:
        """Return the design, written to a folder as that of a file, with options of ``write_design``."""
        data = write_design(
            folder,
            self.sheets,
            fit=self.fit,
            mesh=self.mesh,
            title=self.name,
            source=source,
            frame=self.frame,
            notes=self.notes,
            **options,
        )
        return dataclasses.replace(self, folder=Path(folder), data=data)

    def __repr__(self) -> str:
        sheets = "; ".join(repr(sheet) for sheet in self.sheets)
        return f"<LinkDesign {self.name!r}: {sheets}; {self.folder or 'not written'}>"

    def _repr_html_(self) -> str:
        """Return what a notebook shows: the upper conductive sheets flat, their dimensions, and the next call."""
        from coneskin.core.text import html_card
        from coneskin.geometry.drawing.svg import to_svg

        drawn = "".join(to_svg([sheet.cuts[4]], sheet.name).partition("?>")[2] for sheet in self.sheets)
        rows = [(sheet.name, sheet.dimensions) for sheet in self.sheets]
        rows += [("note", note) for note in self.notes]
        step = "write_design('skin', design.sheets)" if self.folder is None else f"open {self.folder}/report.md"
        style = "<style>.coneskin-flat svg{max-width:100%;height:auto}.coneskin-flat g{stroke-width:.5px}</style>"
        return html_card(f"design of {self.name}", rows, step, f"{style}<div class='coneskin-flat'>{drawn}</div>")


def design_link(
    link: str | Path | Mesh | Frustum | Sequence[PlacedFrustum],
    folder: str | Path | None = None,
    *,
    options: DesignOptions | None = None,
    unit: str | None = None,
    packages: Mapping[str, str | Path] | None = None,
    arguments: Mapping[str, str] | None = None,
    files: FileOptions | None = None,
    pictures: bool = True,
    replace: bool = False,
    progress: Callable[[str], None] = lambda _: None,
    **search: Any,
) -> LinkDesign:
    """Find the sheets of a link, design them, and write everything that a workshop needs.

    Args:
        link: a mesh file; FILE.urdf#LINK; a mesh; the side of a link by its dimensions; or places along one axis.
        folder: to write; None to write nothing.
        options: of the design.
        unit: of a mesh file, a key of ``UNITS``; None to guess.
        packages: folders of the ROS packages that a URDF names.
        arguments: of a xacro file.
        files: options of the drawings.
        pictures: True to draw pictures too, which needs the extra ``pictures``.
        replace: True to allow an earlier design in the folder; files that are not of that design stay.
        progress: called with the name of each step.
        search: fields of ``FitOptions``, such as ``tolerance=0.002`` [m].

    Returns:
        the design.

    Raises:
        MeshError: the mesh cannot be found or read.
        NothingFits: no sheet fits the mesh, with the nearest one.
        GeometryError: a sheet cannot be made, or the folder is in use; nothing is written then.
        MissingExtra: a package that the mesh, the drawings or the pictures need is not installed.
    """
    if folder is not None:
        check_target(Path(folder), replace)
        require_nesting()  # before the search, which takes a minute
        if files is not None and files.step:
            require_step_writer()
    said = set()

    def say(step: str) -> None:
        said.add(step)
        progress(step)

    options = options or DesignOptions()
    check_names(search, ("round_only",))
    fit: LinkFit | None = None
    name, frame, origin = "a link by its dimensions", "the axis of the link (z from end 1, x at phi = 0)", ""
    notes: tuple[str, ...] = ()
    places: Sequence[PlacedFrustum] = ()
    mesh: Mesh | None = None
    if isinstance(link, str | Path | Mesh):
        origin = "" if isinstance(link, Mesh) else str(link)
        search = room_for(options) | search
        source, fit = _fit_link(link if isinstance(link, Mesh) else origin, unit, packages, say, arguments, **search)
        if fit is not None and not fit.sheets:
            raise NothingFits(source.mesh.source, fit)
        mesh, name, frame, notes = source.mesh, source.name, source.frame, source.notes
        # a unit that was guessed wrongly should be seen before anything is cut
        for note in (note for note in notes if note not in said):
            progress(f"note: {note}")
        options = options if options.link else dataclasses.replace(options, link=name)
    elif search:
        raise GeometryError(f"{next(iter(search))} is an option of the search in a mesh, and this link has no mesh")
    elif isinstance(link, Frustum):
        places = (PlacedFrustum(link),)
    else:
        places = link
    if fit is None:
        sheets = design_sheets(places, options)
    else:
        progress("placing sheets, tabs and cables")
        sheets, left_out = design_assembly(fit, options, mesh)
        if not sheets:
            raise GeometryError("there is no sheet to design: " + "; ".join(left_out))
        fit = as_built(fit, sheets)
        notes = (*notes, *left_out)
        for note in left_out:
            progress(f"note: {note}")
    sheets = cover_seams(sheets, mesh)
    design = LinkDesign(name, sheets, fit, mesh, frame, notes)
    if folder is None:
        return design
    return design.written(folder, origin or name, options=files, pictures=pictures, replace=replace, progress=progress)
