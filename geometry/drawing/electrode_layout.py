"""Layout of the electrodes, leads, tabs and holes of a sheet in surface coordinates, the same for every layer.

Two electrodes on each conductive sheet (paper, figure 3 and 5): B and A on the arcs of the upper one, D and C on the
straight edges of the lower one. The edge electrodes are wedges: both of their borders are rays, because the
equipotentials of that sheet are rays; a strip of constant width would bend the field. Widths become angles at the
narrow end, so that nothing is narrower than requested.

All four wires leave on one side. The two electrodes that run towards this side end there in their tabs. Of the other
two, the near one has a tab too, and the far one a lead, for which its conductive sheet is cut back along one edge: the
lead runs above the wedge (or strip) of the other sheet, where nothing is measured.

Outside the electrodes each sheet is at one potential and carries no current. Only the corners lie in this inactive
margin of both sheets, so that a hole through all layers there disturbs no field. The corner beside the lead has no
hole: with three holes, a layer that is mirrored or turned does not fit.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import get_args

from coneskin.core.errors import GeometryError
from coneskin.geometry.frustum import Frustum

from .surface_shape import ShapeCorner, ShapeTab, SheetSide, SurfaceShape

#: side of the wires -> the electrode beside it, the one opposite to it, and the two that run towards it
_SIDE_ELECTRODES = {"end1": "BADC", "end2": "ABDC", "edge0": "DCBA", "edge1": "CDBA"}
_MIN_CUT_WIDTH = 1e-4  # m; no cutter makes a narrower strip or gap
_MIN_ACTIVE_LENGTH = 1e-3  # m; less between the electrodes is no sensor
_MIN_WEB = 1e-3  # m; least width of material around a hole


@dataclass(frozen=True, slots=True)
class ElectrodePlan:
    """Widths for the layout of a sheet [m].

    Attributes:
        margin: from the rim of the sheet to the electrodes, inactive.
        electrode: width of the four electrodes.
        setback: distance of the conductive sheets from the rim, so that they do not touch at the seam.
        lead: width of leads and tabs.
        clearance: distance between a lead and other foil.
        tab: length of the tabs beyond the rim; 0 for none.
        hole: diameter of the registration holes; 0 for none.
        wires: the side where all four wires leave: end1 (u = 0), end2, edge0 (phi = 0) or edge1 (phi = wrap).

    Raises:
        GeometryError: a width is below 0.1 mm (where 0 does not mean none), or the hole or a tab does not fit.
    """

    margin: float = 6e-3
    electrode: float = 6e-3
    setback: float = 1e-3
    lead: float = 4e-3
    clearance: float = 1.5e-3
    tab: float = 12e-3
    hole: float = 2.5e-3
    wires: SheetSide = "end1"

    def __post_init__(self) -> None:
        for name in ("electrode", "setback", "lead", "clearance", "margin", "tab", "hole"):
            value, may_be_none = getattr(self, name), name in ("margin", "tab", "hole")
            if not (_MIN_CUT_WIDTH <= value < math.inf or (may_be_none and value == 0.0)):
                rule = f"{'0 or ' if may_be_none else ''}finite and at least {_MIN_CUT_WIDTH * 1e3:g} mm"
                raise GeometryError(f"{name} must be {rule}, got {value * 1e3:.4g} mm")
        if self.wires not in get_args(SheetSide):
            raise GeometryError(f"wires must leave at one of {', '.join(get_args(SheetSide))}, got {self.wires!r}")
        if self.setback > self.margin:
            raise GeometryError(
                f"setback must be at most the margin ({self.margin * 1e3:.4g} mm), got {self.setback * 1e3:.4g} mm"
            )
        room = self.margin - self.setback - 2.0 * _MIN_WEB
        if self.hole and self.hole > room:
            raise GeometryError(
                f"hole must be at most margin - setback - 2 mm = {max(room, 0.0) * 1e3:.4g} mm, "
                f"got {self.hole * 1e3:.4g} mm: widen the margin, or set the hole to 0 for none"
            )
        if self.lead > self.electrode:
            raise GeometryError(
                f"lead must be at most the electrode ({self.electrode * 1e3:.4g} mm), got {self.lead * 1e3:.4g} mm"
            )

    @property
    def led_across(self) -> str:
        """The electrode on the far side, whose lead crosses the sheet to the wires, where its own layer is cut away."""
        return _SIDE_ELECTRODES[self.wires][1]

    @property
    def least_arc(self) -> float:
        """Length around the narrow end of a sheet below which electrodes, lead and tabs may find no room [m]."""
        back = max(self.margin, self.setback + self.lead + self.clearance) + self.lead + self.clearance
        tabs = back + 2.0 * self.clearance + self.lead if self.tab else back
        return max(self.margin + self.electrode + _MIN_ACTIVE_LENGTH, tabs) + self.margin + self.electrode


@dataclass(frozen=True, slots=True)
class SurfaceRectangle:
    """A rectangle in surface coordinates: between two slant distances [m] and two azimuths [rad]."""

    u1: float
    u2: float
    phi1: float
    phi2: float

    def area(self, frustum: Frustum) -> float:
        """Return the area of the rectangle on a frustum [m2]."""
        return (self.phi2 - self.phi1) * (self.u2 - self.u1) * frustum.radius_at(0.5 * (self.u1 + self.u2))


@dataclass(frozen=True, slots=True)
class SheetLayout:
    """Layout of a sheet: the outlines of its layers and electrodes, and its holes.

    Attributes:
        sheet: the side of the link that the sheet covers.
        field: between the electrodes: u1 is the inner edge of B, u2 of A, phi1 of D, phi2 of C. The decoder maps the
            readings 0..1 to it.
        active: area in which a touch is located, inside the field of both sheets.
        rim: outline of substrates and isolation.
        upper: outline of the upper conductive sheet.
        lower: outline of the lower conductive sheet.
        foils: outlines of the electrodes A, B, C, D with their leads and tabs.
        marks: lines on the "upper" and the "lower" conductive sheet that show the places of its electrodes.
        folds: line across the tab of each electrode, at the rim.
        holes: centres (u, phi) of the holes.
    """

    sheet: Frustum
    plan: ElectrodePlan
    field: SurfaceRectangle
    active: SurfaceRectangle
    rim: SurfaceShape
    upper: SurfaceShape
    lower: SurfaceShape
    foils: dict[str, SurfaceShape]
    marks: dict[str, tuple[SurfaceShape, ...]]
    folds: dict[str, SurfaceShape]
    holes: tuple[tuple[float, float], ...]

    @property
    def active_share(self) -> float:
        """Share of the sheet on which a touch is located."""
        return self.active.area(self.sheet) / self.sheet.area

    def electrode_middle(self, name: str, u: float, phi: float) -> tuple[float, float]:
        """Return the point of an electrode's middle line at slant distance u [m] (C, D) or azimuth phi [rad] (A, B)."""
        half, field = 0.5 * self.plan.electrode, self.field
        turn = half / min(self.sheet.radius1, self.sheet.radius2)
        return {
            "A": (field.u2 + half, phi),
            "B": (field.u1 - half, phi),
            "C": (u, field.phi2 + turn),
            "D": (u, field.phi1 - turn),
        }[name]


def lay_out_sheet(sheet: Frustum, plan: ElectrodePlan | None = None) -> SheetLayout:
    """Place electrodes, leads, tabs and holes on a sheet.

    Raises:
        GeometryError: no active area would remain, or tabs do not fit.
    """
    plan = plan or ElectrodePlan()
    narrow = min(sheet.radius1, sheet.radius2)
    if narrow <= 0.0:
        raise GeometryError("a sheet cannot reach an apex: end it where the radius is above 0 mm")
    at_end = plan.wires.startswith("end")
    # p runs from the side of the wires across the sheet, q along this side; each in its own unit (m or rad)
    p_unit, q_unit = (1.0, 1.0 / narrow) if at_end else (1.0 / narrow, 1.0)
    p_all, q_all = (sheet.slant, sheet.wrap) if at_end else (sheet.wrap, sheet.slant)
    mp, ep, sp = plan.margin * p_unit, plan.electrode * p_unit, plan.setback * p_unit
    mq, eq, sq = plan.margin * q_unit, plan.electrode * q_unit, plan.setback * q_unit
    if plan.tab and not at_end and _edge_room(sheet) < plan.tab + plan.clearance:
        raise GeometryError(
            f"tabs of {plan.tab * 1e3:.4g} mm at {plan.wires} run into the other edge of the flat pattern, "
            f"{_edge_room(sheet) * 1e3:.4g} mm away: let the wires leave at an end"
        )
    spread = _spread(sheet, plan, narrow) if at_end else 1.0
    lead, clear = plan.lead * spread, plan.clearance * spread
    lead_q = max(mq, sq + lead + clear)  # beside the tab of the electrode that runs along the low side
    back = lead_q + lead + clear  # here the conductive sheet beside the lead begins
    low, far, high = max(mq + eq, back), p_all - mp - ep, q_all - mq - eq
    _check_room(plan, "from end to end" if at_end else "around the narrow end", far - mp - ep, p_all, p_unit)
    _check_room(plan, "around the narrow end" if at_end else "from end to end", high - low, q_all, q_unit)
    tab_q = (back + clear + 0.5 * lead, lead_q + 0.5 * lead, sq + 0.5 * lead, high + 0.5 * eq)
    if plan.tab and tab_q[0] + 0.5 * lead + clear > high:
        raise GeometryError(
            f"four tabs of {plan.lead * 1e3:.4g} mm do not fit on {plan.wires}: reduce the width of the leads"
        )

    def corner(p: float, q: float) -> ShapeCorner:
        if at_end:
            return ShapeCorner(p if plan.wires == "end1" else sheet.slant - p, q)
        return ShapeCorner(q, p if plan.wires == "edge0" else sheet.wrap - p)

    def shape(*corners: tuple[float, float]) -> SurfaceShape:
        return tuple(corner(p, q) for p, q in corners)

    def tab(p: float, q: float) -> SurfaceShape:
        """Return the outline from an electrode at p to the rim, around the tab and back."""
        foot = corner(0.0, q)
        if not plan.tab:
            return ()
        out = ShapeTab(foot.u, foot.phi, plan.lead, plan.tab, plan.wires)
        after, before = q + 0.5 * lead, q - 0.5 * lead
        return (*shape((p, after), (0.0, after)), out, *shape((0.0, before), (p, before)))

    def fold(q: float) -> SurfaceShape:
        rim = corner(0.0, q)
        half = 0.45 * plan.lead / (sheet.radius_at(rim.u) if at_end else 1.0)
        return shape((0.0, q - half), (0.0, q + half))

    end_p, end_q, edge_p, edge_q = p_all - sp, q_all - sq, p_all - mp, q_all - mq
    across = shape((sp, back), (sp, end_q), (end_p, end_q), (end_p, sq), (far, sq), (far, back))
    along = shape((sp, sq), (sp, end_q), (end_p, end_q), (end_p, sq))
    near_foil = shape((mp + ep, back), (mp + ep, end_q), (mp, end_q)) + tab(mp, tab_q[0]) + shape((mp, back))
    far_foil = shape((edge_p, lead_q), (edge_p, end_q), (far, end_q)) + (
        tab(far, tab_q[1])[:-1] or shape((far, lead_q + lead), (0.0, lead_q + lead), (0.0, lead_q))
    )
    low_foil = (
        shape((end_p, mq), (end_p, mq + eq), (sp, mq + eq)) + tab(sp, tab_q[2]) + shape((sp, sq), (mp, sq), (mp, mq))
    )
    high_foil = shape((end_p, high), (end_p, edge_q), (sp, edge_q)) + tab(sp, tab_q[3]) + shape((sp, high))
    across_marks = (
        *(shape((p, back), (p, end_q)) for p in (mp, mp + ep, far)),
        shape((edge_p, sq), (edge_p, end_q)),
    )
    along_marks = tuple(shape((sp, q), (end_p, q)) for q in (mq, mq + eq, high, edge_q))
    hole_p, hole_q = 0.5 * (mp + sp), 0.5 * (mq + sq)
    holes = shape((hole_p, q_all - hole_q), (p_all - hole_p, q_all - hole_q), (p_all - hole_p, hole_q))
    return SheetLayout(
        sheet=sheet,
        plan=plan,
        field=_patch(corner(mp + ep, mq + eq), corner(far, high)),
        active=_patch(corner(mp + ep, low), corner(far, high)),
        rim=shape((0.0, 0.0), (0.0, q_all), (p_all, q_all), (p_all, 0.0)),
        upper=across if at_end else along,
        lower=along if at_end else across,
        foils=dict(sorted(zip(_SIDE_ELECTRODES[plan.wires], (near_foil, far_foil, low_foil, high_foil), strict=True))),
        marks={"upper" if at_end else "lower": across_marks, "lower" if at_end else "upper": along_marks},
        folds={name: fold(q) for name, q in zip(_SIDE_ELECTRODES[plan.wires], tab_q, strict=True)} if plan.tab else {},
        holes=tuple((at.u, at.phi) for at in holes if isinstance(at, ShapeCorner)) if plan.hole else (),
    )


LEAST_ACTIVE_SHARE = 0.40  #: of a sheet; one of less costs four wires and feels touches hardly anywhere
NARROWEST_PLAN = ElectrodePlan(2e-3, 3e-3, lead=3e-3, clearance=1e-3, hole=0.0)  #: as a knife and a hand still make it
#: with holes, which show a layer that is turned or mirrored
_PLANS = (ElectrodePlan(), ElectrodePlan(5e-3, 4e-3, lead=3e-3, clearance=1e-3, hole=2e-3))
_HOLE_WORTH = 0.9  # of the active area of the narrowest plan: a wider one that leaves as much is taken, for its holes


def best_layout(sheet: Frustum, plan: ElectrodePlan | None = None, wires: SheetSide = "end1") -> SheetLayout:
    """Lay out a sheet with a given plan, or with the one that leaves most active; wider ones for their holes.

    Raises:
        GeometryError: no active area would remain, or tabs do not fit.
    """
    if plan is not None:
        return lay_out_sheet(sheet, replace(plan, wires=wires))
    narrowest = lay_out_sheet(sheet, replace(NARROWEST_PLAN, wires=wires))
    for wider in _PLANS:
        try:
            layout = lay_out_sheet(sheet, replace(wider, wires=wires))
        except GeometryError:
            continue
        if layout.active_share >= _HOLE_WORTH * narrowest.active_share:
            return layout
    return narrowest


def _spread(sheet: Frustum, plan: ElectrodePlan, narrow: float) -> float:
    """Return the azimuth per length along an end [rad/m], at the tips of the tabs if these lie further inwards."""
    tip = sheet.radius_at(-plan.tab if plan.wires == "end1" else sheet.slant + plan.tab)
    if tip < 2.0 * plan.lead:
        raise GeometryError(
            f"tabs of {plan.tab * 1e3:.4g} mm meet at the apex beyond {plan.wires}: make them shorter, or choose "
            "another side for the wires"
        )
    return 1.0 / min(narrow, tip)


def _edge_room(sheet: Frustum) -> float:
    """Return the room beside an edge up to the other edge of the flat pattern [m]; infinite on a cylinder."""
    taper = abs(sheet.sin_half_angle)
    opening = 2.0 * math.pi - sheet.wrap * taper
    if not taper or opening >= math.pi:
        return math.inf
    return min(sheet.radius1, sheet.radius2) / taper * math.sin(min(opening, 0.5 * math.pi))


def _check_room(plan: ElectrodePlan, where: str, active: float, whole: float, unit: float) -> None:
    """Refuse a sheet that would have no active area left in one direction."""
    if active > _MIN_ACTIVE_LENGTH * unit:
        return
    raise GeometryError(
        f"the sheet measures {whole / unit * 1e3:.4g} mm {where}; margins of {plan.margin * 1e3:.4g} mm and electrodes "
        f"of {plan.electrode * 1e3:.4g} mm on both sides leave less than 1 mm active: make them smaller"
    )


def _patch(a: ShapeCorner, b: ShapeCorner) -> SurfaceRectangle:
    return SurfaceRectangle(min(a.u, b.u), max(a.u, b.u), min(a.phi, b.phi), max(a.phi, b.phi))


@dataclass(frozen=True, slots=True)
class ResolutionForecast:
    """Change of the location for one count of the A/D converter, at one slant distance."""

    u: float  #: slant distance from end 1 of the active area [m]
    along: float  #: change of the slant distance [m]
    azimuth: float  #: change of the azimuth about the axis [rad]
    around: float  #: the change of azimuth as a length on the sheet [m]
    theta: float  #: the change of azimuth as a polar angle on the flat sheet [rad]; 0 on a cylinder


def forecast_resolution(active: Frustum, step: float, u: float) -> ResolutionForecast:
    """Forecast the resolution at a slant distance on the active area; it is the same for all azimuths.

    Eq. 25 of the paper, dU/dr = U0 / (r ln(r1/r2)), is regular in the link's radii, because r is proportional to rho
    along the side: a step dU of the potential moves the location by rho(u) L / |sin a| * dU/U0 with
    L = |ln(rho2/rho1)|, and L / |sin a| tends to slant / rho on a cylinder. Eq. 26, dU/dtheta = U0 / theta0, gives
    wrap * dU/U0 of azimuth.

    Args:
        active: the cone between the inner edges of the four electrodes, on the conductive sheet.
        step: one count of the A/D converter that reads the potentials, as a fraction of U0.
        u: slant distance from end 1 of the active cone [m].

    Raises:
        GeometryError: an end is an apex, where no current can flow.
    """
    if min(active.radius1, active.radius2) <= 0.0:
        raise GeometryError("a forecast needs both radii above 0 m: no current flows to an apex")
    rho = active.radius_at(u)
    growth = (active.radius2 - active.radius1) / active.radius1
    stretch = math.log1p(growth) / growth if growth else 1.0
    along = rho / active.radius1 * active.slant * stretch * step
    azimuth = active.wrap * step
    return ResolutionForecast(u, along, azimuth, rho * azimuth, azimuth * abs(active.sin_half_angle))
