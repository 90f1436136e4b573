"""From a place on a link to a sheet: trimmed, laid out, drawn for every layer, with the sensor that the guard loads."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from .errors import GeometryError
from .geometry.cut_sheet import CutSheet, FaceUp, cut_sheets
from .geometry.electrodes import ElectrodePlan, Layout, lay_out
from .geometry.forecast import Converter, Forecast, forecast
from .geometry.frustum import Frustum
from .geometry.pen import Side
from .geometry.placed import PlacedFrustum
from .geometry.pose import Pose
from .geometry.stack import PAPER_STACK, Stack, parallel

if TYPE_CHECKING:
    from .geometry.cones import Sheet

__all__ = ["Choices", "Seam", "SheetDesign", "design_sheets"]

_TURN = 2.0 * math.pi
_UPPER = 3  # index of the upper conductive layer


@dataclass(frozen=True, slots=True)
class Choices:
    """What a sheet shall be made of and how; lengths in metres.

    Attributes:
        stack: the five layers.
        plan: electrodes, tabs, holes.
        wires: the side where the wires leave, for all sheets; None for end 1, and end 2 of the last of several, so that
            tabs do not run into the neighbour.
        converter: what reads the potentials.
        upper_sheet_ohms: sheet resistance of the upper conductive layer [ohm per square], for the sensor file.
        lower_sheet_ohms: the same of the lower one.
        current_full_scale: drive current that the electronics read as their highest count [A], for the sensor file.
        seam_gap: how far the innermost face stays open at the narrow end of a full wrap.
        overlap: width of a flap on the upper substrate that closes the seam.
        sheet_gap: least distance between neighbouring sheets, along the axis.
        kerf: width that the cutter takes away.
        snap: a pattern is a rectangle where that moves no cut by more.
        face_up: which face the drawings show.
    """

    stack: Stack = PAPER_STACK
    plan: ElectrodePlan = field(default_factory=ElectrodePlan)
    wires: Side | None = None
    converter: Converter = field(default_factory=Converter)
    upper_sheet_ohms: float = 1000.0
    lower_sheet_ohms: float = 1000.0
    current_full_scale: float = 0.02
    seam_gap: float = 0.0
    overlap: float = 0.0
    sheet_gap: float = 1e-3
    kerf: float = 0.0
    snap: float = 1e-5
    face_up: FaceUp = "work"


@dataclass(frozen=True, slots=True)
class Seam:
    """The joint between a sheet and the next one on the axis.

    Attributes:
        inner: distance along the axis at the faces on the link [m].
        outer: the same at the outer faces [m].
        trimmed: how much both sheets together were shortened for it, along the axis [m].
    """

    inner: float
    outer: float
    trimmed: float


@dataclass(frozen=True, slots=True)
class SheetDesign:
    """One sheet, ready to be written.

    Attributes:
        name: "sheet 1" and so on.
        place: the side of the link that the sheet covers, and where it is on the link.
        layout: electrodes and holes.
        cuts: seven cut sheets, from the link outwards.
        active: the upper conductive sheet between the inner edges of B, A (end 1, end 2) and D, C (phi = 0, wrap);
            a touch is located on it.
        choices: what was asked for.
        next_seam: the joint with the next sheet, if there is one.
        fit: how well the place fits the mesh; None where it was given by numbers.
    """

    name: str
    place: PlacedFrustum
    layout: Layout
    cuts: tuple[CutSheet, ...]
    active: PlacedFrustum
    choices: Choices
    next_seam: Seam | None = None
    fit: Sheet | None = None

    def forecasts(self, count: int = 5) -> list[Forecast]:
        """Steps of the converter from end 1 to end 2 of the active area."""
        slant = self.active.frustum.slant
        return [forecast(self.active.frustum, self.choices.converter, slant * i / (count - 1)) for i in range(count)]


def design_sheets(
    links: Sequence[PlacedFrustum], choices: Choices, fits: Sequence[Sheet | None] = ()
) -> tuple[SheetDesign, ...]:
    """Design a sheet for each place on a link.

    Args:
        links: the places, in order along one axis, in the frame of the link.
        choices: what the sheets shall be.
        fits: how well each place fits the mesh.

    Raises:
        GeometryError: a sheet for a place cannot be.
    """
    if not (math.isfinite(choices.sheet_gap) and choices.sheet_gap >= 0.0):
        raise GeometryError(f"sheet gap must be finite and not negative, got {choices.sheet_gap * 1e3:.4g} mm")
    seams = [_seam(a, b, choices) for a, b in itertools.pairwise(links)]
    cuts = [0.0, *(0.5 * seam.trimmed for seam in seams), 0.0]
    designs = []
    for i, link in enumerate(links):
        name = f"sheet {i + 1}"
        try:
            place = _seam_opened(_trimmed(link, cuts[i], cuts[i + 1]), choices.seam_gap)
            auto: Side = "end2" if 0 < i == len(links) - 1 else "end1"
            layout = lay_out(place.frustum, replace(choices.plan, wires=choices.wires or auto))
            drawn = cut_sheets(
                layout,
                choices.stack,
                title=name,
                kerf=choices.kerf,
                overlap=choices.overlap,
                snap=choices.snap,
                face_up=choices.face_up,
            )
        except GeometryError as exc:
            raise GeometryError(f"{name}: {exc}") from exc
        designs.append(
            SheetDesign(
                name=name,
                place=place,
                layout=layout,
                cuts=drawn,
                active=_active(place, layout, choices.stack),
                choices=choices,
                next_seam=seams[i] if i < len(seams) else None,
                fit=fits[i] if i < len(fits) else None,
            )
        )
    return tuple(designs)


def _trimmed(link: PlacedFrustum, start: float, end: float) -> PlacedFrustum:
    """A place without a length along the axis [m] at its start and end."""
    if start == end == 0.0:
        return link
    side = link.frustum
    if side.cos_half_angle == 0.0 or start + end >= side.height:
        raise GeometryError(
            f"the gap to its neighbours takes {1e3 * (start + end):.4g} mm of a sheet {1e3 * side.height:.4g} mm high"
        )
    u1, u2 = start / side.cos_half_angle, side.slant - end / side.cos_half_angle
    shorter = Frustum(side.radius_at(u1), side.radius_at(u2), side.height - start - end, side.wrap)
    return PlacedFrustum(shorter, link.link_frustum @ Pose(translation=(0.0, 0.0, start)))


def _seam_opened(link: PlacedFrustum, gap: float) -> PlacedFrustum:
    """A full wrap without a gap [m], half of it on either side of phi = 0; a partial wrap has no seam."""
    side = link.frustum
    narrow = min(side.radius1, side.radius2)
    if not (math.isfinite(gap) and gap >= 0.0):
        raise GeometryError(f"seam gap must be finite and not negative, got {gap * 1e3:.4g} mm; for a flap use overlap")
    if gap == 0.0 or side.wrap < _TURN - 1e-9:
        return link
    if gap >= _TURN * narrow:
        raise GeometryError(f"seam gap of {gap * 1e3:.4g} mm takes the whole narrow end, {_TURN * narrow * 1e3:.4g} mm")
    turn = gap / narrow
    open_side = Frustum(side.radius1, side.radius2, side.height, side.wrap - turn)
    return PlacedFrustum(open_side, link.link_frustum @ Pose.from_xyz_rpy(rpy=(0.0, 0.0, 0.5 * turn)))


def _seam(one: PlacedFrustum, two: PlacedFrustum, choices: Choices) -> Seam:
    """The joint of two neighbours, trimmed so that no layer of one runs into the other.

    A face at the height t above the link is shifted along the axis by -t sin(half angle): at a belt the outer faces
    part, at a waist they collide.
    """
    start = two.link_frustum.translation
    apart = one.link_frustum.inverse().apply(start)[2] - one.frustum.height
    opening = choices.stack.thickness * (one.frustum.sin_half_angle - two.frustum.sin_half_angle)
    trimmed = max(0.0, choices.sheet_gap - apart - min(0.0, opening))
    return Seam(apart + trimmed, apart + trimmed + opening, trimmed)


def _active(place: PlacedFrustum, layout: Layout, stack: Stack) -> PlacedFrustum:
    """The field between the electrodes, on the middle of the upper conductive layer where it lies when wrapped."""
    height = stack.face_offset(_UPPER) + 0.5 * stack.layers[_UPPER].thickness
    side, box = parallel(place.frustum, height), layout.field
    between = Frustum(
        side.radius_at(box.u1), side.radius_at(box.u2), (box.u2 - box.u1) * side.cos_half_angle, box.phi2 - box.phi1
    )
    shift = box.u1 * side.cos_half_angle - height * side.sin_half_angle
    turned = Pose.from_xyz_rpy((0.0, 0.0, shift), (0.0, 0.0, box.phi1))
    return PlacedFrustum(between, place.link_frustum @ turned)
