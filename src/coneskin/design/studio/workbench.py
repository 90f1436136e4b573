"""Workbench: a link, the sheets found in it, and the handles that shorten, narrow and turn a sheet. No page in it."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from coneskin.core.errors import GeometryError
from coneskin.design.folder import write_design
from coneskin.design.link_design import LinkMesh, find_link_sheets, with_seams
from coneskin.design.sheets.sheet_design import DesignOptions, SheetDesign, design_assembly, design_sheets
from coneskin.geometry.fit.cones import LinkFit
from coneskin.geometry.fit.fitted_sheet import FittedSheet
from coneskin.geometry.placed_frustum import PlacedFrustum

_MIN_LENGTH = 0.010  # m; a sheet cannot be shorter than this
_TIGHT_SHARE = 0.9  # of the tolerance, from which on a deviation is worth a warning
_BRIDGED_SHARE = 0.05  # share of a sheet over holes, from which on it is worth a warning
_COARSE_COUNT = 0.002  # m for one count of the converter, from which on it is worth a warning


@dataclass(frozen=True, slots=True)
class Handles:
    """What a person has set for one sheet; nothing set leaves it as it was found.

    Attributes:
        from_end1: length that the sheet is shorter at its end 1, along the axis [m].
        from_end2: the same at its end 2.
        wrap: angle that it covers [rad]; None for all of what was found.
        seam: angle by which the start of the wrap is turned about the axis [rad]; within what was found where that is
            no full wrap.
    """

    from_end1: float = 0.0
    from_end2: float = 0.0
    wrap: float | None = None
    seam: float = 0.0


def _adjusted(placed: PlacedFrustum, handles: Handles) -> PlacedFrustum:
    """Return a sheet with its handles applied; it never covers what the found one does not.

    Raises:
        GeometryError: nothing, or not enough for a sheet, would be left.
    """
    cone = placed.frustum
    if handles.from_end1 < 0.0 or handles.from_end2 < 0.0:
        raise GeometryError("a sheet may be shortened, not lengthened: beyond its ends the link has another shape")
    height = cone.height - handles.from_end1 - handles.from_end2
    if height < _MIN_LENGTH:
        raise GeometryError(
            f"{1e3 * cone.height:.0f} mm less {1e3 * handles.from_end1:.0f} mm and {1e3 * handles.from_end2:.0f} mm "
            f"leaves {1e3 * height:.0f} mm; a sheet needs {1e3 * _MIN_LENGTH:.0f} mm along the axis"
        )
    wrap = cone.wrap if handles.wrap is None else min(handles.wrap, cone.wrap)
    if wrap <= 0.0:
        raise GeometryError(f"the wrap must be above 0 deg, got {math.degrees(wrap):g} deg")
    turn = handles.seam
    if cone.wrap < math.tau:  # a partial wrap can only be moved within what was found
        turn = min(max(turn, 0.0), cone.wrap - wrap)
    if cone.wrap == math.tau and turn % math.tau:
        placed, turn = placed.turned(turn), 0.0
    ends = handles.from_end1 / cone.cos_half_angle, cone.slant - handles.from_end2 / cone.cos_half_angle
    if turn == 0.0 and wrap == cone.wrap and ends == (0.0, cone.slant):
        return placed
    return placed.part(*ends, turn, turn + wrap)


@dataclass(slots=True)
class Workbench:
    """Link under design.

    Attributes:
        link: its mesh.
        fit: the sheets found in it: cones, or sides of another section where they cover more.
        options: of the design.
        handles: of each sheet.
        designs: of the sheets as they are now; empty where none can be made.
        refusal: why none can be made; empty otherwise.
    """

    link: LinkMesh
    fit: LinkFit
    options: DesignOptions
    handles: list[Handles] = field(default_factory=list)
    designs: tuple[SheetDesign, ...] = ()
    refusal: str = ""

    @classmethod
    def of(
        cls,
        link: LinkMesh,
        options: DesignOptions | None = None,
        tolerance: float = 0.001,
        progress: Callable[[str], None] | None = None,
    ) -> Workbench:
        """Return the workbench for a link, with the sheets that are found in it.

        Args:
            link: the link.
            options: of the design.
            tolerance: largest distance between a sheet and the link [m].
            progress: called with the name of each step.

        Raises:
            GeometryError: the tolerance is not above 0.
            MeshError: no face of the mesh is visible from outside.
        """
        fit = find_link_sheets(link, progress or (lambda _step: None), tolerance=tolerance)
        if fit.sheets:
            link, fit = with_seams(link, fit, progress or (lambda _step: None))
        made = cls(link, fit, replace(options or DesignOptions(), link=link.name))
        made.handles = [Handles() for _ in fit.sheets]
        made.update()
        return made

    @property
    def adjusted_fit(self) -> LinkFit:
        """The fit with the sheets as the handles leave them; their deviations stay those of the whole sheet.

        Raises:
            GeometryError: nothing would be left of a sheet.
        """
        sheets: list[FittedSheet] = []
        for sheet, handles in zip(self.fit.sheets, self.handles, strict=True):
            if handles == Handles():
                sheets.append(sheet)
                continue
            placed = _adjusted(sheet.placed, handles)
            share = placed.frustum.height / sheet.frustum.height
            area = share * placed.frustum.wrap / sheet.frustum.wrap
            length, covered = sheet.length_share * share, sheet.area_share * area
            sheets.append(replace(sheet, placed=placed, length_share=length, area_share=covered))
        return replace(self.fit, sheets=tuple(sheets))

    def handle(self, sheet: int, handles: Handles) -> None:
        """Set the handles of a sheet, and design all sheets again.

        Args:
            sheet: index of it.
            handles: what is set.
        """
        self.handles[sheet] = handles
        self.update()

    def update(self) -> None:
        """Design the sheets again; ``refusal`` says why, where that cannot be."""
        try:
            self.designs, self.refusal = design_sheets(self.adjusted_fit, self.options), ""
        except GeometryError as exc:
            self.designs, self.refusal = (), str(exc)

    def warnings(self) -> list[str]:
        """Return what a person should look at before anything is cut, one sentence each."""
        found = list(dict.fromkeys((*self.link.notes, *self.fit.notes)))
        if self.refusal:
            found.insert(0, self.refusal)
        for number, sheet in enumerate(self.fit.sheets, 1):
            if sheet.max_deviation > _TIGHT_SHARE * self.fit.tolerance:
                found.append(
                    f"sheet {number} is up to {1e3 * sheet.max_deviation:.2f} mm off the link, near the tolerance of "
                    f"{1e3 * self.fit.tolerance:g} mm"
                )
            if sheet.bridged_share > _BRIDGED_SHARE:
                found.append(
                    f"{100.0 * sheet.bridged_share:.0f} % of sheet {number} spans holes, up to "
                    f"{1e3 * sheet.bridged_depth:.1f} mm deep: it can be pressed in there"
                )
        for design in self.designs:
            worst = max(max(item.along, item.around) for item in design.forecasts())
            if worst > _COARSE_COUNT:
                found.append(
                    f"{design.name}: one count of the converter is {1e3 * worst:.1f} mm; take one of more bits"
                )
        return found

    def write(self, folder: Path, overwrite: bool = False, pictures: bool = True) -> Sequence[str]:
        """Write the folder that ``coneskin design`` writes.

        Args:
            folder: to write.
            overwrite: an earlier design in it may be replaced.
            pictures: draw them too.

        Returns:
            the files of the design, as paths in the folder.

        Raises:
            GeometryError: there is no sheet, or the folder is in use.
            MissingExtra: a package that the drawings need is not installed.
        """
        if not self.designs:
            raise GeometryError(self.refusal or self.fit.reason)
        # the cables of the page go on as the sheets do; those of the folder lie on the link
        designs, left_out = design_assembly(self.adjusted_fit, self.options, self.link.mesh)
        if not designs:
            raise GeometryError("; ".join(left_out))
        data = write_design(
            folder,
            designs,
            fit=replace(self.adjusted_fit, sheets=tuple(design.fit for design in designs if design.fit is not None)),
            mesh=self.link.mesh,
            title=self.link.name,
            source=self.link.mesh.source,
            frame=self.link.frame,
            notes=(*self.link.notes, *left_out),
            pictures=pictures,
            replace=overwrite,
        )
        return [str(name) for name in data["files"]]
