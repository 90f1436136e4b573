"""Workbench: a link, the sides found on it, and the sheets that a person wants on them; and the links of a robot."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from coneskin.core.errors import GeometryError
from coneskin.design.folder import write_design
from coneskin.design.link_design import LinkMesh, as_built, find_link_sheets, load_link, room_for, with_seams
from coneskin.design.sheets.sheet_design import DesignOptions, SheetDesign, design_assembly
from coneskin.geometry.fit.axis_plan import FittedSheet
from coneskin.geometry.fit.cones import LinkFit
from coneskin.geometry.placed_frustum import PlacedFrustum
from coneskin.geometry.pose import Pose
from coneskin.geometry.urdf import link_poses, urdf_joints, urdf_links

_MIN_LENGTH = 0.010  # m; a sheet cannot be shorter than this
_TIGHT_SHARE = 0.9  # of the tolerance, from which on a deviation is worth a warning
_BRIDGED_SHARE = 0.05  # share of a sheet over holes, from which on it is worth a warning
_COARSE_COUNT = 0.002  # m for one count of the converter, from which on it is worth a warning


@dataclass(frozen=True, slots=True)
class Handles:
    """What a person has set for one sheet; nothing set leaves it as it was found.

    Attributes:
        side: number of the side that it lies on, in the order in which they were found.
        along: from end 1 of that side to end 1 of the sheet, along the axis [m].
        length: of the sheet along the axis [m]; None for all that is beyond.
        wrap: angle that it covers [rad]; None for all of what was found.
        seam: angle by which the start of the wrap is turned about the axis [rad]; within what was found where that is
            no full wrap.
    """

    side: int = 0
    along: float = 0.0
    length: float | None = None
    wrap: float | None = None
    seam: float = 0.0


def _adjusted(placed: PlacedFrustum, handles: Handles) -> PlacedFrustum:
    """Return a sheet with its handles applied; it never covers what the found one does not.

    Raises:
        GeometryError: nothing, or not enough for a sheet, would be left.
    """
    cone = placed.frustum
    if handles.along < 0.0:
        raise GeometryError("a sheet may be shortened, not lengthened: beyond its ends the link has another shape")
    beyond = cone.height - handles.along
    height = beyond if handles.length is None else min(handles.length, beyond)
    if height < _MIN_LENGTH:
        raise GeometryError(f"a sheet of {1e3 * height:.0f} mm: it needs {1e3 * _MIN_LENGTH:.0f} mm along the axis")
    wrap = cone.wrap if handles.wrap is None else min(handles.wrap, cone.wrap)
    if wrap <= 0.0:
        raise GeometryError(f"the wrap must be above 0 deg, got {math.degrees(wrap):g} deg")
    turn = handles.seam
    if cone.wrap < math.tau:  # a partial wrap can only be moved within what was found
        turn = min(max(turn, 0.0), cone.wrap - wrap)
    if cone.wrap == math.tau and turn % math.tau:
        placed, turn = placed.turned(turn), 0.0
    start = handles.along / cone.cos_half_angle
    end = cone.slant if height == beyond else start + height / cone.cos_half_angle
    if turn == 0.0 and wrap == cone.wrap and (start, end) == (0.0, cone.slant):
        return placed
    return placed.part(start, end, turn, turn + wrap)


@dataclass(frozen=True, slots=True)
class Wish:
    """What is wanted of a link.

    Attributes:
        fit: the sides found on it.
        handles: of each sheet that is wanted.
        seam_notes: why the seams are where they were found.
        search: what was asked of the sides: fields of ``FitOptions``.
    """

    fit: LinkFit
    handles: tuple[Handles, ...]
    seam_notes: tuple[str, ...] = ()
    search: Mapping[str, Any] = field(default_factory=dict)

    @classmethod
    def found(cls, link: LinkMesh, options: DesignOptions, **search: Any) -> Wish:
        """Look for the sides of a link, and want all of each.

        Args:
            link: the link.
            options: of the design.
            search: fields of ``FitOptions``, such as ``tolerance=0.002`` [m].

        Raises:
            GeometryError: a value of the search is out of range.
            MeshError: no face of the mesh is visible from outside.
        """
        fit = find_link_sheets(link, lambda _step: None, **room_for(options), **search)
        notes: tuple[str, ...] = ()
        if fit.sheets:
            turned, fit = with_seams(link, fit, lambda _step: None, search.get("weights"))
            notes = tuple(note.removesuffix("; --seam puts it elsewhere") for note in turned.notes[len(link.notes) :])
        return cls(fit, tuple(Handles(side) for side in range(len(fit.sheets))), notes, search)

    @property
    def untouched(self) -> bool:
        """Whether all is wanted as it was found."""
        return self.handles == tuple(Handles(side) for side in range(len(self.fit.sheets)))

    def sheet(self, handles: Handles) -> FittedSheet:
        """Return a sheet as its handles leave it; its deviation stays that of the whole side.

        Raises:
            GeometryError: nothing would be left of it.
        """
        side = self.fit.sheets[handles.side]
        if handles == Handles(handles.side):
            return side
        return side.covering(_adjusted(side.placed, handles))


class Workbench:
    """Link under design.

    Args:
        link: its mesh.
        wish: what is wanted on it.
        options: of the design.

    Attributes:
        designs: of the sheets that can be made.
        places: number of each of them among the handles of the wish.
        left_out: why one that is wanted cannot be made, one sentence each.
    """

    def __init__(self, link: LinkMesh, wish: Wish, options: DesignOptions | None = None) -> None:
        self.link, self.wish = link, wish
        self.options = replace(options or DesignOptions(), link=link.name)
        self.designs: tuple[SheetDesign, ...] = ()
        self.places: tuple[int, ...] = ()
        self.left_out: tuple[str, ...] = ()
        self._past: list[Wish] = []
        self._fit = wish.fit
        self._design()

    @classmethod
    def of(cls, link: LinkMesh, options: DesignOptions | None = None, **search: Any) -> Workbench:
        """Return the workbench for a link, with the sheets found on it; arguments and errors of ``Wish.found``."""
        return cls(link, Wish.found(link, options or DesignOptions(), **search), options)

    def change(self, wish: Wish) -> None:
        """Want something else; ``undo`` goes back to what was wanted before."""
        if wish != self.wish:
            self._past.append(self.wish)
            self.wish = wish
            self._design()

    def handle(self, number: int, handles: Handles, again: bool = False) -> None:
        """Set the handles of a sheet; ``again`` where the last change was a move of the same handle: one to undo."""
        kept, past = self.wish.handles, len(self._past)
        self.change(replace(self.wish, handles=(*kept[:number], handles, *kept[number + 1 :])))
        if again:
            del self._past[max(past, 1) :]

    def delete(self, number: int) -> None:
        """Want a sheet no more."""
        kept = self.wish.handles
        self.change(replace(self.wish, handles=kept[:number] + kept[number + 1 :]))

    def add(self, side: int) -> None:
        """Want one sheet more on a side, where it is bare on the greatest length.

        Raises:
            GeometryError: the side is covered all along.
        """
        found = self.wish.fit.sheets[side].frustum
        taken = [one for one in self.wish.handles if one.side == side]
        ends = sorted((one.along, found.height if one.length is None else one.along + one.length) for one in taken)
        gap = self.options.sheet_gap
        starts = [0.0, *(end + gap for _, end in ends)]
        stops = [*(start - gap for start, _ in ends), found.height]
        length, along = max((stop - start, start) for start, stop in zip(starts, stops, strict=True))
        if length < _MIN_LENGTH:
            raise GeometryError(f"surface {side + 1} is covered all along: make the sheet on it shorter first")
        new = Handles(side) if not taken else Handles(side, along, length)
        self.change(replace(self.wish, handles=(*self.wish.handles, new)))

    def undo(self) -> None:
        """Go back to what was wanted before the last change; nothing where there was none."""
        if self._past:
            self.wish = self._past.pop()
            self._design()

    def _design(self) -> None:
        """Design what is wanted, as ``coneskin design`` does: on the mesh, with cables and tabs."""
        fits: dict[int, FittedSheet] = {}
        refused: list[str] = []
        for number, handles in enumerate(self.wish.handles):
            try:
                fits[number] = self.wish.sheet(handles)
            except GeometryError as exc:
                refused.append(f"no sheet on surface {handles.side + 1}: {exc}")
        found = self.wish.fit
        bare = found.bare_areas if self.wish.untouched else ()
        self._fit = replace(found, sheets=tuple(fits.values()), bare_areas=bare)
        self.designs = ()
        if fits:
            try:
                self.designs, left_out = design_assembly(self._fit, self.options, self.link.mesh)
                refused += left_out
            except GeometryError as exc:
                refused.append(str(exc))
        self.places = tuple(next(n for n, fit in fits.items() if fit is design.found) for design in self.designs)
        self.left_out = tuple(refused)

    def seam_notes(self) -> tuple[str, ...]:
        """Say where the seams of full wraps face, and why where nobody has moved them."""
        if self.wish.untouched and not self.left_out:
            return self.wish.seam_notes
        said = []
        for design in self.designs:
            if design.has_seam:
                x, y, z = (f"{value:z.2f}" for value in design.place.link_frustum.rotate((1.0, 0.0, 0.0)))
                said.append(f"the seam of {design.name} faces ({x}, {y}, {z}) of the link's frame")
        return tuple(said)

    def warnings(self) -> list[str]:
        """Return what a person should look at before anything is cut, one sentence each."""
        fit = self.wish.fit
        found = list(dict.fromkeys((*self.left_out, *self.link.notes, *self.seam_notes(), *fit.notes)))
        for design in self.designs:
            if design.fit is not None and design.fit.max_deviation > _TIGHT_SHARE * fit.tolerance:
                found.append(
                    f"{design.name} is up to {1e3 * design.fit.max_deviation:.2f} mm off the link, near the tolerance "
                    f"of {1e3 * fit.tolerance:g} mm"
                )
            if design.fit is not None and design.fit.bridged_share > _BRIDGED_SHARE:
                found.append(
                    f"{100.0 * design.fit.bridged_share:.0f} % of {design.name} spans holes, up to "
                    f"{1e3 * design.fit.bridged_depth:.1f} mm deep: it can be pressed in there"
                )
            worst = max(max(item.along, item.around) for item in design.forecasts())
            if worst > _COARSE_COUNT:
                found.append(
                    f"{design.name}: one count of the converter is {1e3 * worst:.1f} mm; take one of more bits"
                )
        return found or ([fit.reason] if fit.reason else [])

    def write(
        self, folder: Path, overwrite: bool = False, pictures: bool = True, first_sensor: int = 0
    ) -> Sequence[str]:
        """Write the folder that ``coneskin design`` writes.

        Args:
            folder: to write.
            overwrite: an earlier design in it may be replaced.
            pictures: draw them too.
            first_sensor: number of the first sensor.

        Returns:
            the files of the design, as paths in the folder.

        Raises:
            GeometryError: there is no sheet, or the folder is in use.
            MissingExtra: a package that the drawings need is not installed.
        """
        if not self.designs:
            raise GeometryError("; ".join(self.left_out) or self.wish.fit.reason or "no sheet is wanted: add one")
        data = write_design(
            folder,
            self.designs,
            fit=as_built(self._fit, self.designs),
            mesh=self.link.mesh,
            title=self.link.name,
            source=self.link.mesh.source,
            frame=self.link.frame,
            notes=(*self.link.notes, *self.seam_notes(), *self.left_out),
            pictures=pictures,
            replace=overwrite,
            first_sensor=first_sensor,
        )
        return [str(name) for name in data["files"]]


class RobotLinks:
    """Links of a robot, each with a workbench once it was opened.

    Args:
        robot: a URDF or xacro file.
        bench_of: makes the workbench of a link.
        urdf: ``packages`` and ``arguments``, as ``load_link`` takes them.

    Attributes:
        names: of the links that have a mesh.
        opened: workbenches, by the names of their links.

    Raises:
        MeshError: the file cannot be read.
    """

    def __init__(self, robot: str, bench_of: Callable[[LinkMesh], Workbench], **urdf: Any) -> None:
        self.names = urdf_links(robot, **urdf)
        self.opened: dict[str, Workbench] = {}
        self._robot, self._bench_of, self._urdf = robot, bench_of, urdf
        self._meshes: dict[str, LinkMesh] = {}

    def link(self, name: str) -> LinkMesh:
        """Return a link.

        Raises:
            MeshError: its mesh cannot be found or read.
        """
        if name not in self._meshes:
            self._meshes[name] = next(iter(load_link(f"{self._robot}#{name}", **self._urdf)))
        return self._meshes[name]

    def open(self, name: str) -> Workbench:
        """Return the workbench of a link; errors as those of ``link`` and ``Wish.found``."""
        if name not in self.opened:
            self.opened[name] = self._bench_of(self.link(name))
        return self.opened[name]

    def poses(self) -> dict[str, Pose]:
        """Return where the links are when each joint is as near to 0 as it can be."""
        joints = urdf_joints(self._robot, **self._urdf)
        poses = link_poses(joints, [min(max(0.0, joint.lower), joint.upper) for joint in joints])
        return {name: poses.get(name, Pose()) for name in self.names}
