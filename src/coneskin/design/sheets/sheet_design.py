"""Design of sheets from their places on a link: trimmed, laid out, and drawn for every layer.

A strip over the blind seam of a full wrap is a sheet of its own, on top of the one below.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import ArrayLike

from coneskin.core.arrays import Floats
from coneskin.core.errors import GeometryError, SensorError
from coneskin.geometry.drawing.cut_sheet import CutSheet, FaceUp, cut_sheets
from coneskin.geometry.drawing.electrode_layout import (
    ElectrodePlan,
    ResolutionForecast,
    SheetLayout,
    forecast_resolution,
    lay_out_sheet,
)
from coneskin.geometry.drawing.layer_stack import PAPER_STACK, LayerStack
from coneskin.geometry.drawing.surface_shape import SheetSide
from coneskin.geometry.frustum import Frustum
from coneskin.geometry.mesh import Mesh
from coneskin.geometry.placed_frustum import PlacedFrustum, check_place
from coneskin.geometry.ray_casting import RayCaster
from coneskin.scene.tables.sensor_tables import with_key_names
from coneskin.skin.electronics import Electronics, GivenElectronics, match_electronics
from coneskin.skin.materials import SheetMaterial, match_sheet_materials
from coneskin.skin.sensor import sheet_resistances

from .assembly import PlacedSheet, assemble, sheet_gap
from .cable_way import Body, CableWay, SheetBody, TabApron

if TYPE_CHECKING:
    from coneskin.geometry.fit.axis_plan import FittedSheet
    from coneskin.geometry.fit.cones import LinkFit

JigSurface = Literal["link", "cone", "none"]
_MIN_GRIP = 4e-3  # m
_CONNECTOR_LIMITS = (0.03, 2.0)  # m; from the rim to the connector
_NEAR_SHEET = 0.02  # m; a sheet so near is a neighbor
_JOINED_COSINE = 0.95  # of the axes of sheets whose ends run along each other


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


_LOWER_CONDUCTIVE, _UPPER_CONDUCTIVE = 1, 3  # indices of the layers in the stack
_MOST_STRAIN = 0.4  # of a face of a wrapped layer; foam wrinkles or tears beyond
_SEAM_TURN_SHARE = 0.9  # of a turn; from there on a wrap has a seam rather than a side without a sheet
_STRAIGHT_SHARE = 0.02  # of the fit's tolerance; a taper below it is noise of the mesh, and the side a cylinder's


@dataclass(frozen=True, slots=True)
class DesignOptions:
    """Materials, widths and electronics of a design; lengths in metres.

    Attributes:
        stack: the five layers.
        plan: electrodes, tabs, holes, for all sheets; None to choose those that leave most of each sheet active.
        wires: side where the wires leave, for all sheets; None for the side of each sheet where they find room.
        electronics: as far as they are fixed; the rest is chosen to match each sheet (``match_electronics``).
        upper_sheet_ohms: sheet resistance of the upper conductive layer [ohm per square]; None to choose a material
            for the shape of each sheet (``match_sheet_materials``).
        lower_sheet_ohms: the same of the lower conductive layer.
        seam_gap: gap of the seam of a full wrap, at the narrow end of the innermost face.
        overlap: width of a flap on the upper substrate that closes the seam.
        cover_seam: True for a strip over the seam of each full wrap, a sensor of its own that closes it.
        sheet_gap: smallest distance between neighboring sheets.
        kerf: width of the cut.
        snap: a pattern is cut as a rectangle if that moves no cut by more.
        face_up: face that is up in the drawings.
        link: name of the link, on every part.
        connector: wished way from the rim of the sheet to the connector in which its wires end; where there is no room
            it is shorter.
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
        apron: strip of its tabs beyond the rim.
        way: of its cable on the link.
        gaps: least distance to each other sheet nearer than 20 mm, by its name [m].
        joints: what meets its "end 1" and its "end 2", by the number of the joint, such as {1: "end 1 of sheet 2"}.
        found: sheet on the mesh that the place is made from; None for a link given by its dimensions.
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
    apron: TabApron
    way: CableWay
    gaps: Mapping[str, float] = field(default_factory=dict)
    joints: Mapping[str, Mapping[int, str]] = field(default_factory=dict)
    found: FittedSheet | None = None
    above: str = ""
    seam_offset: float = 0.0

    def __repr__(self) -> str:
        return f"<SheetDesign {self.name!r}: {self.dimensions}>"

    @property
    def fit(self) -> FittedSheet | None:
        """Fit of the place to the mesh: what was found there, as it is built; None where nothing was."""
        return self.found and self.found.covering(self.place)

    @property
    def dimensions(self) -> str:
        """Radii and wrap of the side of the link that it covers, in words."""
        return _dimensions(self.place.frustum)

    @property
    def has_seam(self) -> bool:
        """Whether its two edges meet, or nearly; otherwise the link is bare between them."""
        return self.place.frustum.wrap > 2.0 * math.pi - 0.5

    def outer_face(self, u: ArrayLike, phi: ArrayLike) -> tuple[Floats, Floats]:
        """Return points of the outer face [m], shape (..., 3), and their normals, at u [m] and phi [rad]."""
        points, normals = self.place.place(u, phi)
        return points + self.options.stack.thickness * normals, normals

    def outer_triangles(self) -> Floats:
        """Return the triangles of the outer face [m], shape (n, 3, 3)."""
        side = self.place.frustum
        u, phi = np.meshgrid(np.linspace(0.0, side.slant, 41), np.linspace(0.0, side.wrap, 181), indexing="ij")
        grid = self.outer_face(u, phi)[0]
        p, q, r, s = (part.reshape(-1, 3) for part in (grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]))
        return np.concatenate([np.stack([p, q, r], axis=1), np.stack([p, r, s], axis=1)])

    def forecasts(self) -> list[ResolutionForecast]:
        """Return the resolution at five evenly spaced places from end 1 to end 2 of the active area."""
        active, parts = self.active.frustum, self.electronics
        step = parts.adc_volts / parts.full_count / parts.supply_volts
        return [forecast_resolution(active, step, active.slant * i / 4) for i in range(5)]

    @property
    def drive_currents(self) -> tuple[float, float]:
        """Drive currents of the untouched sensor in the radial and in the angular phase [A]."""
        parts = self.electronics
        radial, angular = sheet_resistances(self.active.frustum, *(sheet.ohms for sheet in self.conductive))
        leads = parts.lead_ohms
        return parts.supply_volts / (radial + leads.a + leads.b), parts.supply_volts / (angular + leads.c + leads.d)


def _dimensions(side: Frustum) -> str:
    wrap = f"height {1e3 * side.height:.1f} mm, wrap {math.degrees(side.wrap):.0f} deg"
    return f"radii {1e3 * side.radius1:.1f} and {1e3 * side.radius2:.1f} mm, {wrap}"


def design_sheets(
    places: LinkFit | Sequence[PlacedFrustum], options: DesignOptions | None = None, mesh: Mesh | None = None
) -> tuple[SheetDesign, ...]:
    """Design a sheet for each place on a link, as ``design_assembly`` does.

    Raises:
        GeometryError: there is no place, or a sheet cannot be built; the message says why.
    """
    designs, left_out = design_assembly(places, options, mesh)
    if left_out:
        raise GeometryError(left_out[0])
    return designs


def design_assembly(
    places: LinkFit | Sequence[PlacedFrustum],
    options: DesignOptions | None = None,
    mesh: Mesh | None = None,
    first: int = 1,
    beside: Sequence[Body] = (),
) -> tuple[tuple[SheetDesign, ...], tuple[str, ...]]:
    """Design the sheets for places on a link, all at once: none of them, or of their wires, meets another.

    Args:
        places: the sheets found on a link; or places in its frame.
        options: of the design.
        mesh: of the link, on which the cables lie; None where it goes on beyond its sheets as they do.
        first: number of the first sheet.
        beside: further bodies that none may meet.

    Returns:
        the sheets that can be built, and a sentence for each other one.

    Raises:
        GeometryError: there is no place, or a value is out of range; the message names the sheet.
    """
    options = options or DesignOptions()
    if not (isinstance(places, Sequence) or hasattr(places, "sheets")):
        raise GeometryError(f"the link must be a mesh file, a Mesh, a Frustum or places, got {places!r}")
    fits: Sequence[FittedSheet] = () if isinstance(places, Sequence) else places.sheets
    links = places if isinstance(places, Sequence) else [sheet.placed for sheet in fits]
    if not links:
        raise GeometryError(f"there is no sheet to design: {getattr(places, 'reason', 'no place was given')}")
    for place in links:
        check_place(place)
    if not isinstance(places, Sequence):
        links = [_straightened(link, _STRAIGHT_SHARE * places.tolerance) for link in links]
    if not (math.isfinite(options.sheet_gap) and options.sheet_gap >= 0.0):
        raise GeometryError(f"sheet gap must be finite and not negative, got {options.sheet_gap * 1e3:.4g} mm")
    low, high = _CONNECTOR_LIMITS
    if not low <= options.connector <= high:
        got = f"got {options.connector * 1e3:.4g} mm"
        raise GeometryError(f"the connector must be {low * 1e3:g} to {high * 1e3:g} mm from the rim, {got}")
    opened = []
    for number, link in enumerate(links, first):
        try:
            _check_wrap(link, options)
            opened.append(_seam_opened(link, options.seam_gap))
        except GeometryError as exc:
            raise GeometryError(f"sheet {number}: {exc}") from exc
    placed, refused = assemble(
        opened,
        options.plan,
        options.wires,
        thickness=options.stack.thickness,
        tab_height=options.stack.middle(_LOWER_CONDUCTIVE),
        gap=options.sheet_gap,
        connector=options.connector,
        rays=None if mesh is None else RayCaster(mesh),
        found=bool(fits),
        beside=beside,
    )
    left_out = [f"sheet {index + first}: {why}" for index, why in refused.items()]
    if fits:
        left_out = [f"no sheet of {_dimensions(links[index].frustum)}: {why}" for index, why in refused.items()]
    designs = []
    joints = _joints(placed, first)
    for number, one in enumerate(placed, first):
        apart = {f"sheet {k}": sheet_gap(one.sheet, two.sheet)[0] for k, two in enumerate(placed, first) if k != number}
        try:
            found = fits[one.index] if fits else None
            designs.append(_sheet_design(f"sheet {number}", one, options, apart, joints[number], found))
        except GeometryError as exc:
            raise GeometryError(f"sheet {number}: {exc}") from exc
        except SensorError as exc:
            raise GeometryError(f"sheet {number}: {with_key_names(str(exc))}") from exc
    return tuple(designs), tuple(left_out)


def _joints(placed: Sequence[PlacedSheet], first: int) -> dict[int, dict[str, dict[int, str]]]:
    """Return, by sheet and end, what meets it, with the number of the joint; no sheet about an axis across its own."""
    found: dict[int, dict[str, dict[int, str]]] = {number: {} for number in range(first, first + len(placed))}
    count = 0
    for (i, one), (j, two) in combinations(enumerate(placed, first), 2):
        gaps = sheet_gap(one.sheet, two.sheet), sheet_gap(two.sheet, one.sheet)
        shares = [u / sheet.place.frustum.slant for (_, u), sheet in zip(gaps, (one, two), strict=True)]
        axis, other = (sheet.place.link_frustum.rotate((0.0, 0.0, 1.0)) for sheet in (one.sheet, two.sheet))
        along = abs(float(np.dot(axis, other))) > _JOINED_COSINE
        if along and gaps[0][0] < _NEAR_SHEET and all(abs(share - 0.5) > 0.45 for share in shares):
            count += 1
            ends = [f"end {1 if share < 0.5 else 2}" for share in shares]
            found[i].setdefault(ends[0], {})[count] = f"{ends[1]} of sheet {j}"
            found[j].setdefault(ends[1], {})[count] = f"{ends[0]} of sheet {i}"
    return found


def _sheet_design(
    name: str,
    placed: PlacedSheet,
    options: DesignOptions,
    apart: Mapping[str, float],
    joints: Mapping[str, Mapping[int, str]],
    found: FittedSheet | None,
) -> SheetDesign:
    """Return a sheet with its drawings and its electronics."""
    active = _active(placed.place, placed.layout, options.stack)
    squares = sheet_resistances(active.frustum, 1.0, 1.0)[0]
    conductive = match_sheet_materials(squares, options.upper_sheet_ohms, options.lower_sheet_ohms)
    resistances = sheet_resistances(active.frustum, *(sheet.ohms for sheet in conductive))
    drawn = cut_sheets(
        placed.layout,
        _with_materials(options.stack, conductive),
        placed.place,
        title=f"{options.link}: {name}" if options.link else name,
        kerf=options.kerf,
        overlap=options.overlap,
        snap=options.snap,
        face_up=options.face_up,
        joints=tuple(" ".join(f"JOINT {number}" for number in joints.get(end, ())) for end in ("end 1", "end 2")),
    )
    return SheetDesign(
        name=name,
        place=placed.place,
        layout=placed.layout,
        cuts=drawn,
        active=active,
        options=options,
        conductive=conductive,
        electronics=match_electronics(*resistances, options.electronics),
        apron=placed.apron,
        way=placed.way,
        gaps={other: gap for other, gap in apart.items() if gap < _NEAR_SHEET},
        joints=joints,
        found=found,
    )


def _with_materials(stack: LayerStack, conductive: tuple[SheetMaterial, SheetMaterial]) -> LayerStack:
    """Return the stack with the conductive sheets that were chosen, where the stack names none of its own."""
    layers = list(stack.layers)
    for index, sheet in ((_UPPER_CONDUCTIVE, conductive[0]), (_LOWER_CONDUCTIVE, conductive[1])):
        if layers[index].material == PAPER_STACK.layers[index].material:
            layers[index] = replace(layers[index], material=sheet.label)
    a, b, c, d, e = layers
    return replace(stack, layers=(a, b, c, d, e))


def _check_wrap(link: PlacedFrustum, options: DesignOptions) -> None:
    """Refuse layers that are too thick for the link."""
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


def _seam_opened(link: PlacedFrustum, gap: float) -> PlacedFrustum:
    """Return a wrap whose seam has at least a gap [m], half of it on either side; one without a seam as it is."""
    side = link.frustum
    narrow = min(side.radius1, side.radius2)
    if not (math.isfinite(gap) and gap >= 0.0):
        raise GeometryError(f"seam gap must be finite and not negative, got {gap * 1e3:.4g} mm; for a flap use overlap")
    if gap == 0.0 or side.wrap <= _SEAM_TURN_SHARE * math.tau:
        return link
    if gap >= math.tau * narrow:
        raise GeometryError(
            f"seam gap of {gap * 1e3:.4g} mm takes the whole narrow end, {math.tau * narrow * 1e3:.4g} mm"
        )
    turn = gap / narrow - (math.tau - side.wrap)
    return link.part(0.0, side.slant, 0.5 * turn, side.wrap - 0.5 * turn) if turn > 0.0 else link


def _active(place: PlacedFrustum, layout: SheetLayout, stack: LayerStack) -> PlacedFrustum:
    """Return the cone between the electrodes, on the middle surface of the wrapped upper conductive layer."""
    height = stack.middle(_UPPER_CONDUCTIVE)
    box = layout.field
    phi1, phi2 = (place.azimuth_above(height, phi) for phi in (box.phi1, box.phi2))
    return place.parallel(height).part(box.u1, box.u2, phi1, phi2)


def _blind_angle(design: SheetDesign) -> float:
    """Return the angle about the axis in which a sheet locates no touch: its seam, and what it does not wrap [rad]."""
    return math.tau - (design.layout.active.phi2 - design.layout.active.phi1)


def cover_seams(designs: Sequence[SheetDesign], mesh: Mesh | None = None) -> tuple[SheetDesign, ...]:
    """Add a strip over the seam of every full wrap, where the options ask for it.

    A strip is a sensor of its own, with four wires that leave on the same side. It is glued on the outer face of its
    sheet; its electrodes D and C stand exactly where the active area of that sheet ends and begins.

    Args:
        designs: sheets, as ``design_sheets`` makes them.
        mesh: of the link.

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
            place, offset = _strip_place(design)
            bodies: list[Body] = [SheetBody(d.place, d.options.stack.thickness) for d in designs if d is not design]
            bodies += [body for d in (*designs, *strips) for body in (d.apron.body(), d.way.body())]
            made, why = design_assembly([place], options, mesh, len(designs) + len(strips) + 1, bodies)
            if why:
                raise GeometryError(f"{design.name}: no room for the strip over its seam: {why[0]}")
            (strip,) = made
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
        raise GeometryError(f"{design.name}: its wires leave at the seam, under its strip: let them leave at an end")
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
