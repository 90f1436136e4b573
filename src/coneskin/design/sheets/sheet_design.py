"""Design of sheets from their places on a link: trimmed, laid out, and drawn for every layer.

A strip over the blind seam of a full wrap is a sheet of its own, on top of the one below.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Literal

from coneskin.core.errors import GeometryError, SensorError
from coneskin.geometry.drawing.cut_sheet import CutSheet, FaceUp, cut_sheets
from coneskin.geometry.drawing.electrode_layout import (
    ElectrodePlan,
    ResolutionForecast,
    SheetLayout,
    best_layout,
    forecast_resolution,
    lay_out_sheet,
)
from coneskin.geometry.drawing.layer_stack import PAPER_STACK, LayerStack
from coneskin.geometry.drawing.surface_shape import SheetSide
from coneskin.geometry.frustum import Frustum
from coneskin.geometry.placed_frustum import PlacedFrustum
from coneskin.scene.tables.sensor_tables import with_key_names
from coneskin.skin.electronics import Electronics, GivenElectronics, match_electronics
from coneskin.skin.materials import SheetMaterial, match_sheet_materials
from coneskin.skin.sensor import sheet_resistances

if TYPE_CHECKING:
    from coneskin.geometry.fit.cones import LinkFit
    from coneskin.geometry.fit.fitted_sheet import FittedSheet

JigSurface = Literal["link", "cone", "none"]
_MIN_GRIP = 4e-3  # m


@dataclass(frozen=True, slots=True)
class JigPlan:
    """Dimensions of a jig [m].

    Attributes:
        surface: what the lip lies on: "link" for the negative of the mesh (of the cone where there is no mesh), "cone"
            for the negative of the cone, "none" for no jig.
        wall: thickness of its wall.
        clearance: gap to the link and to the sheet.
        parts: into how many parts a collar around a full wrap is split; of a partial wrap no part is longer than half
            a turn.
        reach: length of the sleeve over the sheet.
        grip: length of the lip on the link.

    Raises:
        GeometryError: a dimension is out of range.
    """

    surface: JigSurface = "link"
    wall: float = 3e-3
    clearance: float = 0.3e-3
    parts: int = 2
    reach: float = 20e-3
    grip: float = 15e-3

    def __post_init__(self) -> None:
        limits = {"wall": (1.5e-3, 20e-3), "clearance": (0.0, 3e-3), "reach": (8e-3, 0.2), "grip": (_MIN_GRIP, 0.1)}
        for name, (least, most) in limits.items():
            value = getattr(self, name)
            if not 0.999 * least <= value <= 1.001 * most:  # millimetres in SI are not exact
                raise GeometryError(
                    f"{name} of the jig must be {least * 1e3:g} to {most * 1e3:g} mm, got {value * 1e3:.4g} mm"
                )
        if not 2 <= self.parts <= 8:
            raise GeometryError(f"a jig is split into 2 to 8 parts, got {self.parts}")


@dataclass(frozen=True, slots=True)
class _SheetJoint:
    """The joint between a sheet and the next one on the axis.

    Attributes:
        inner: distance along the axis at the faces on the link [m].
        outer: the same at the outer faces [m].
        trimmed: length by which both sheets together were shortened along the axis [m].
    """

    inner: float
    outer: float
    trimmed: float


def _adjoin(one: PlacedFrustum, two: PlacedFrustum) -> bool:
    """Tell whether two sheets follow each other along one axis, with the same wrap."""
    turn = one.link_frustum.inverse() @ two.link_frustum
    x, y, z = turn.translation
    tilt = math.hypot(turn.rotation[0][2], turn.rotation[1][2])
    same = abs(one.frustum.wrap - two.frustum.wrap) < 1e-6
    same &= one.frustum.wrap > math.tau - 1e-6 or turn.rotation[0][0] > 1.0 - 1e-9
    return same and tilt < 1e-6 and math.hypot(x, y) < 1e-6 and z > 0.5 * one.frustum.height


def _find_joint(one: PlacedFrustum, two: PlacedFrustum, stack: LayerStack, gap: float) -> _SheetJoint:
    """Return the joint of two neighbours, trimmed so that no layer of one runs into the other.

    A face at the height t above the link is shifted along the axis by -t sin(half angle): at a belt the outer faces
    separate, at a waist they approach.
    """
    start = two.link_frustum.translation
    apart = one.link_frustum.inverse().apply(start)[2] - one.frustum.height
    opening = stack.thickness * (one.frustum.sin_half_angle - two.frustum.sin_half_angle)
    trimmed = max(0.0, gap - apart - min(0.0, opening))
    return _SheetJoint(apart + trimmed, apart + trimmed + opening, trimmed)


_LOWER_CONDUCTIVE, _UPPER_CONDUCTIVE = 1, 3  # indices of the layers in the stack
_MOST_STRAIN = 0.4  # of a face of a wrapped layer; foam wrinkles or tears beyond
_STRAIGHT_SHARE = 0.02  # of the fit's tolerance; a taper below it is noise of the mesh, and the side a cylinder's


@dataclass(frozen=True, slots=True)
class DesignOptions:
    """Materials, widths and electronics of a design; lengths in metres.

    Attributes:
        stack: the five layers.
        plan: electrodes, tabs, holes, for all sheets; None to choose those that leave most of each sheet active.
        wires: side where the wires leave, for all sheets; None for end 1, but end 2 of the last of several on one axis:
            tabs do not run into the neighbour.
        electronics: as far as they are fixed; the rest is chosen to match each sheet (``match_electronics``).
        upper_sheet_ohms: sheet resistance of the upper conductive layer [ohm per square]; None to choose a material
            for the shape of each sheet (``match_sheet_materials``).
        lower_sheet_ohms: the same of the lower conductive layer.
        seam_gap: gap of the seam of a full wrap, at the narrow end of the innermost face.
        overlap: width of a flap on the upper substrate that closes the seam.
        cover_seam: True for a strip over the seam of each full wrap, a sensor of its own that closes it.
        sheet_gap: smallest distance between neighbouring sheets along the axis.
        kerf: width of the cut.
        snap: a pattern is cut as a rectangle if that moves no cut by more.
        face_up: face that is up in the drawings.
        link: name of the link, on every part.
        connector: distance from the rim of the sheet to the connector in which its wires end.
        jig: printed collars that hold the sheet at its place on the link.
    """

    stack: LayerStack = PAPER_STACK
    plan: ElectrodePlan | None = None
    wires: SheetSide | None = None
    electronics: GivenElectronics = field(default_factory=GivenElectronics)
    upper_sheet_ohms: float | None = None
    lower_sheet_ohms: float | None = None
    seam_gap: float = 0.0
    overlap: float = 0.0
    cover_seam: bool = False
    sheet_gap: float = 1e-3
    kerf: float = 0.0
    snap: float = 1e-5
    face_up: FaceUp = "work"
    link: str = ""
    connector: float = 0.06
    jig: JigPlan = field(default_factory=JigPlan)


@dataclass(frozen=True, slots=True)
class SheetDesign:
    """One sheet, ready to be written.

    Attributes:
        name: "sheet 1" and so on.
        place: the side of the link that the sheet covers, with its pose.
        layout: electrodes and holes.
        cuts: seven cut sheets, from the link outwards.
        active: the upper conductive sheet between the inner edges of B, A (end 1, end 2) and D, C (phi = 0, wrap);
            a touch is located on it.
        options: of the design.
        conductive: the upper and the lower conductive sheet, given or chosen.
        electronics: those given, and those that match.
        next_joint: joint with the next sheet; None for the last one.
        fit: fit of the place to the mesh; None for a link given by its dimensions.
        above: name of the sheet on which it lies, where it is a strip over the seam of that.
        seam_offset: angle from edge 0 of such a strip to the middle of the seam below it [rad].
    """

    name: str
    place: PlacedFrustum
    layout: SheetLayout
    cuts: tuple[CutSheet, ...]
    active: PlacedFrustum
    options: DesignOptions
    conductive: tuple[SheetMaterial, SheetMaterial]
    electronics: Electronics
    next_joint: _SheetJoint | None = None
    fit: FittedSheet | None = None
    above: str = ""
    seam_offset: float = 0.0

    def __repr__(self) -> str:
        return f"<SheetDesign {self.name!r}: {self.dimensions}>"

    @property
    def dimensions(self) -> str:
        """Radii and wrap of the side of the link that it covers, in words."""
        side = self.place.frustum
        wrap = f"height {1e3 * side.height:.1f} mm, wrap {math.degrees(side.wrap):.0f} deg"
        return f"radii {1e3 * side.radius1:.1f} and {1e3 * side.radius2:.1f} mm, {wrap}"

    @property
    def has_seam(self) -> bool:
        """Whether its two edges meet, or nearly; otherwise the link is bare between them."""
        return self.place.frustum.wrap > 2.0 * math.pi - 0.5

    def forecasts(self) -> list[ResolutionForecast]:
        """Return the resolution at five evenly spaced places from end 1 to end 2 of the active area."""
        active, parts = self.active.frustum, self.electronics
        step = parts.adc_volts / parts.full_count / parts.supply_volts
        return [forecast_resolution(active, step, active.slant * i / 4) for i in range(5)]

    @property
    def drive_currents(self) -> tuple[float, float]:
        """Drive currents of the untouched sensor in the radial and in the angular phase [A]."""
        parts = self.electronics
        radial, angular = _resistances(self.active.frustum, self.conductive)
        leads = parts.lead_ohms
        return parts.supply_volts / (radial + leads.a + leads.b), parts.supply_volts / (angular + leads.c + leads.d)


def design_sheets(
    places: LinkFit | Sequence[PlacedFrustum], options: DesignOptions | None = None, first: int = 1
) -> tuple[SheetDesign, ...]:
    """Design a sheet for each place on a link.

    Args:
        places: the sheets found on a link; or places in order along one axis, in the frame of the link.
        options: of the design.
        first: number of the first sheet.

    Raises:
        GeometryError: there is no place, or a sheet cannot be made for one; the message says why, or names the sheet.
    """
    options = options or DesignOptions()
    fits: Sequence[FittedSheet] = () if isinstance(places, Sequence) else places.sheets
    links = places if isinstance(places, Sequence) else [sheet.placed for sheet in fits]
    if not links:
        why = "no place was given" if isinstance(places, Sequence) else places.reason
        raise GeometryError(f"there is no sheet to design: {why}")
    if not isinstance(places, Sequence):
        links = [_straightened(link, _STRAIGHT_SHARE * places.tolerance) for link in links]
    if not (math.isfinite(options.sheet_gap) and options.sheet_gap >= 0.0):
        raise GeometryError(f"sheet gap must be finite and not negative, got {options.sheet_gap * 1e3:.4g} mm")
    joints = [
        _find_joint(a, b, options.stack, options.sheet_gap) if _adjoin(a, b) else None
        for a, b in itertools.pairwise(links)
    ]
    cuts = [0.0, *(0.5 * joint.trimmed if joint else 0.0 for joint in joints), 0.0]
    designs = []
    for i, link in enumerate(links):
        name = f"sheet {i + first}"
        try:
            _check_wrap(link, options)
            place = _seam_opened(_trimmed(link, cuts[i], cuts[i + 1]), options.seam_gap)
            before, after = (i > 0 and joints[i - 1]), (i < len(joints) and joints[i])
            auto: SheetSide = "end2" if before and not after else "end1"
            layout = best_layout(place.frustum, options.plan, options.wires or auto)
            active = _active(place, layout, options.stack)
            squares = sheet_resistances(active.frustum, 1.0, 1.0)[0]
            conductive = match_sheet_materials(squares, options.upper_sheet_ohms, options.lower_sheet_ohms)
            drawn = cut_sheets(
                layout,
                _with_materials(options.stack, conductive),
                place,
                title=f"{options.link}: {name}" if options.link else name,
                kerf=options.kerf,
                overlap=options.overlap,
                snap=options.snap,
                face_up=options.face_up,
            )
            electronics = match_electronics(*_resistances(active.frustum, conductive), options.electronics)
        except GeometryError as exc:
            raise GeometryError(f"{name}: {exc}") from exc
        except SensorError as exc:
            raise GeometryError(f"{name}: {with_key_names(str(exc))}") from exc
        designs.append(
            SheetDesign(
                name=name,
                place=place,
                layout=layout,
                cuts=drawn,
                active=active,
                options=options,
                conductive=conductive,
                electronics=electronics,
                next_joint=joints[i] if i < len(joints) else None,
                fit=fits[i] if i < len(fits) else None,
            )
        )
    return tuple(designs)


def _with_materials(stack: LayerStack, conductive: tuple[SheetMaterial, SheetMaterial]) -> LayerStack:
    """Return the stack with the conductive sheets that were chosen, where the stack names none of its own."""
    layers = list(stack.layers)
    for index, sheet in ((_UPPER_CONDUCTIVE, conductive[0]), (_LOWER_CONDUCTIVE, conductive[1])):
        if layers[index].material == PAPER_STACK.layers[index].material:
            layers[index] = replace(layers[index], material=sheet.label)
    a, b, c, d, e = layers
    return replace(stack, layers=(a, b, c, d, e))


def _check_wrap(link: PlacedFrustum, options: DesignOptions) -> None:
    """Refuse layers that are too thick for the link, and a flap where there is no seam to close."""
    if min(link.frustum.radius1, link.frustum.radius2) > 0.0:
        for index, layer in enumerate(options.stack.layers):
            strain = max(options.stack.strain(link, index), key=abs)
            if abs(strain) > _MOST_STRAIN:
                raise GeometryError(
                    f"{layer.name} is strained by {strain:+.0%} at the narrow end, at most {_MOST_STRAIN:.0%} is "
                    f"possible: make it thinner than {layer.thickness * 1e3:g} mm, or choose another "
                    "layers.assembly"
                )
    if options.overlap and link.frustum.wrap < math.tau - 1e-9:
        wrap = math.degrees(link.frustum.wrap)
        raise GeometryError(f"an overlap closes the seam of a full wrap, this one is of {wrap:.4g} deg: leave it out")


def _straightened(link: PlacedFrustum, tolerance: float) -> PlacedFrustum:
    """Return a cylinder in the place of a cone whose radii differ from their mean by less than a tolerance [m]."""
    side = link.frustum
    if link.bends or side.radius1 == side.radius2 or 0.5 * abs(side.radius2 - side.radius1) > tolerance:
        return link
    mean = 0.5 * (side.radius1 + side.radius2)
    return PlacedFrustum(Frustum(mean, mean, side.height, side.wrap), link.link_frustum)


def _resistances(active: Frustum, conductive: tuple[SheetMaterial, SheetMaterial]) -> tuple[float, float]:
    """Return the resistances of the two sheets [ohm]."""
    return sheet_resistances(active, conductive[0].ohms, conductive[1].ohms)


def _trimmed(link: PlacedFrustum, start: float, end: float) -> PlacedFrustum:
    """Return a place, shortened by lengths along the axis at its start and end [m]."""
    if start == end == 0.0:
        return link
    side = link.frustum
    if side.cos_half_angle == 0.0 or start + end >= side.height:
        raise GeometryError(
            f"the gap to its neighbours takes {1e3 * (start + end):.4g} mm of a sheet "
            f"{1e3 * side.height:.4g} mm high: reduce the sheet gap"
        )
    return link.part(start / side.cos_half_angle, side.slant - end / side.cos_half_angle, 0.0, side.wrap)


def _seam_opened(link: PlacedFrustum, gap: float) -> PlacedFrustum:
    """Return a full wrap with a gap of the seam [m], half of it on either side of phi = 0; a partial wrap as it is."""
    side = link.frustum
    narrow = min(side.radius1, side.radius2)
    if not (math.isfinite(gap) and gap >= 0.0):
        raise GeometryError(f"seam gap must be finite and not negative, got {gap * 1e3:.4g} mm; for a flap use overlap")
    if gap == 0.0 or side.wrap < math.tau - 1e-9:
        return link
    if gap >= math.tau * narrow:
        raise GeometryError(
            f"seam gap of {gap * 1e3:.4g} mm takes the whole narrow end, {math.tau * narrow * 1e3:.4g} mm"
        )
    turn = gap / narrow
    return link.part(0.0, side.slant, 0.5 * turn, side.wrap - 0.5 * turn)


def _active(place: PlacedFrustum, layout: SheetLayout, stack: LayerStack) -> PlacedFrustum:
    """Return the cone between the electrodes, on the middle surface of the wrapped upper conductive layer."""
    height = stack.middle(_UPPER_CONDUCTIVE)
    box = layout.field
    phi1, phi2 = (place.azimuth_above(height, phi) for phi in (box.phi1, box.phi2))
    return place.parallel(height).part(box.u1, box.u2, phi1, phi2)


_SEAM_TURN_SHARE = 0.9  # of a turn; from there on a wrap has a seam rather than a side without a sheet


def _blind_angle(design: SheetDesign) -> float:
    """Return the angle about the axis in which a sheet locates no touch: its seam, and what it does not wrap [rad]."""
    return math.tau - (design.layout.active.phi2 - design.layout.active.phi1)


def cover_seams(designs: Sequence[SheetDesign]) -> tuple[SheetDesign, ...]:
    """Add a strip over the seam of every full wrap, where the options ask for it.

    A strip is a sensor of its own, with four wires that leave on the same side. It is glued on the outer face of its
    sheet; its electrodes D and C stand exactly where the active area of that sheet ends and begins.

    Args:
        designs: sheets, as ``design_sheets`` makes them.

    Returns:
        the sheets, followed by their strips.

    Raises:
        GeometryError: no sheet wraps a whole turn; a strip would meet itself on the other side of its sheet, or cannot
            be made.
    """
    strips: list[SheetDesign] = []
    for design in designs:
        if design.options.cover_seam and design.place.frustum.wrap > _SEAM_TURN_SHARE * math.tau:
            plan = design.layout.plan
            options = replace(design.options, plan=plan, wires=plan.wires, seam_gap=0.0, overlap=0.0, cover_seam=False)
            number = len(designs) + len(strips) + 1
            place, offset = _strip_place(design)
            (strip,) = design_sheets([place], options, number)
            strips.append(replace(strip, above=design.name, seam_offset=offset))
    if not strips and any(design.options.cover_seam for design in designs):
        widest = max(design.place.frustum.wrap for design in designs)
        raise GeometryError(
            f"no sheet has a seam to cover: the widest wraps {math.degrees(widest):.0f} deg, and a seam needs at least "
            f"{math.degrees(_SEAM_TURN_SHARE * math.tau):.0f}; leave the covered seam out"
        )
    return (*designs, *strips)


def _strip_place(design: SheetDesign) -> tuple[PlacedFrustum, float]:
    """Return the side that the strip of a sheet covers, and the angle from its edge 0 to the middle of the seam."""
    stack, side = design.options.stack, design.place.frustum
    plan = design.layout.plan
    if plan.wires.startswith("edge"):
        raise GeometryError(
            f"{design.name}: its wires leave at the seam, where its strip lies: let them leave at an end"
        )
    above = design.place.parallel(stack.thickness)
    outer = above.frustum
    trial = Frustum(outer.radius1, outer.radius2, outer.height, 0.5 * math.tau)
    inside = lay_out_sheet(trial, plan).active
    before, after = inside.phi1, trial.wrap - inside.phi2
    wrap = before + _blind_angle(design) + after
    if wrap > 0.5 * math.tau:
        raise GeometryError(
            f"{design.name}: a strip over its seam would have to wrap {math.degrees(wrap):.0f} deg, at most 180: make "
            "electrodes and margins narrower"
        )
    start = design.layout.active.phi2 - before
    return above.part(0.0, outer.slant, start, start + wrap), 0.5 * (side.wrap + math.tau) - start
