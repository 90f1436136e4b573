"""Design of the sheets of a link in one call: from its mesh, or its dimensions, to a folder for the workshop."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from coneskin.core.errors import GeometryError
from coneskin.geometry.frustum import Frustum
from coneskin.geometry.mesh import Mesh
from coneskin.geometry.placed_frustum import PlacedFrustum
from coneskin.geometry.solid import require_step_writer

from .files import FileOptions, check_target
from .folder import write_design
from .link import LinkMesh, fit_link, fit_mesh
from .sheets.seam_strip import cover_seams
from .sheets.sheet_design import DesignOptions, SheetDesign, design_sheets

if TYPE_CHECKING:
    from coneskin.geometry.fit.cones import LinkFit

__all__ = ["LinkDesign", "NothingFits", "design_link"]


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


def design_link(
    link: str | Path | Mesh | Frustum | Sequence[PlacedFrustum],
    folder: str | Path | None = None,
    *,
    options: DesignOptions | None = None,
    unit: str | None = None,
    up_axis: str = "ignore",
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
        up_axis: how to treat COLLADA's up_axis tag (``load_mesh``).
        packages: folders of the ROS packages that a URDF names.
        arguments: of a xacro file (``expand_xacro``).
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
        if files is not None and files.step:
            require_step_writer()  # before the search, which takes a minute
    said = set()

    def say(step: str) -> None:
        said.add(step)
        progress(step)

    options = options or DesignOptions()
    # neighbours about other axes need room for the sheets of these options
    search = {
        "thickness": options.stack.thickness,
        "gap": options.sheet_gap,
        "min_radius": 2.0 * options.plan.lead,
        "min_arc": options.plan.least_arc,
        **search,
    }
    source: LinkMesh | None = None
    fit: LinkFit | None = None
    name, frame, origin = "a link by its dimensions", "the axis of the link (z from end 1, x at phi = 0)", ""
    notes: tuple[str, ...] = ()
    places: LinkFit | Sequence[PlacedFrustum]
    if isinstance(link, Frustum):
        places = (PlacedFrustum(link),)
    elif isinstance(link, str | Path):
        source, fit = fit_link(str(link), unit, up_axis, packages, say, arguments, **search)
        places, origin = fit, str(link)
    elif isinstance(link, Mesh):
        source, fit = fit_mesh(link, say, **search)
        places = fit
    else:
        places = link
    if source is not None:
        if fit is not None and not fit.sheets:
            raise NothingFits(source.mesh.source, fit)
        name, frame, notes = source.name, source.frame, source.notes
        # a unit that was guessed wrongly should be seen before anything is cut
        for note in (note for note in notes if note not in said):
            progress(f"note: {note}")
    if source is not None and not options.link:
        options = dataclasses.replace(options, link=source.name)
    sheets = cover_seams(design_sheets(places, options))
    mesh = None if source is None else source.mesh
    data: dict[str, Any] = {}
    if folder is not None:
        data = write_design(
            folder,
            sheets,
            fit=fit,
            mesh=mesh,
            title=name,
            source=origin or name,
            frame=frame,
            notes=notes,
            options=files,
            pictures=pictures,
            replace=replace,
            progress=progress,
        )
    return LinkDesign(name, sheets, fit, mesh, frame, notes, None if folder is None else Path(folder), data)
