"""Fitted sheet: one side of a plan as a frustum on the link, and how well it fits."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from coneskin.core.arrays import Bools, Floats
from coneskin.geometry.frustum import Frustum
from coneskin.geometry.placed_frustum import PlacedFrustum
from coneskin.geometry.pose import Pose

from .axis_plan import AxisPlan
from .side import StraightSide
from .surface_samples import SurfaceSamples


@dataclass(frozen=True, slots=True)
class FittedSheet:
    """One sheet, its place on the link and how well it fits.

    Attributes:
        placed: the frustum and its pose in the link's frame; the wrap begins at phi = 0.
        max_deviation: largest distance between sheet and hull, bridged holes left out [m].
        rms_deviation: root mean square of that distance [m].
        bridged_share: share of the sheet that spans holes and grooves, deeper below their rims than the tolerance.
        bridged_depth: depth of the deepest bridged hole [m]; 0 without one.
        length_share: length of the sheet over the length of the link along the axis.
        area_share: share of the hull that the sheet covers.
        facet_rise: mean distance by which the corners of the mesh lie outside its facets [m]; the radii include it.
        axis: number of its axis; sheets with the same number lie about the same axis.
        touch_share: share of the hull that the sheet covers, weighed by what touches count there; without weights the
            same as ``area_share``.
    """

    placed: PlacedFrustum
    max_deviation: float
    rms_deviation: float
    bridged_share: float
    bridged_depth: float
    length_share: float
    area_share: float
    facet_rise: float
    axis: int = 0
    touch_share: float = 0.0

    @property
    def facet_height(self) -> float:
        """Largest distance by which the facets of the mesh lie inside the surface of their corners [m].

        A facet of a tube lies two thirds of that inside on average, which is ``facet_rise``.
        """
        return 1.5 * self.facet_rise

    @property
    def frustum(self) -> Frustum:
        """Side of the sheet."""
        return self.placed.frustum


def deviations(miss: Floats, hole: Bools) -> dict[str, float]:
    """Return the deviations of a sheet from its distances to cells of the hull [m], and which of these are in holes."""
    seen = miss[~hole]
    return {
        "max_deviation": float(np.abs(seen).max()) if seen.size else math.inf,
        "rms_deviation": math.sqrt(float((seen**2).mean())) if seen.size else math.inf,
        "bridged_share": float(hole.mean()),
        "bridged_depth": float(-miss[hole].min()) if hole.any() else 0.0,
    }


def fitted_sheet(
    plan: AxisPlan,
    side: StraightSide,
    axis: int,
    hull: SurfaceSamples,
    tolerance: float,
    worth: Floats | None = None,
) -> FittedSheet:
    """Return one side of a plan as a sheet on the link.

    Args:
        plan: about the axis.
        side: one of its sides.
        axis: number of the axis.
        hull: samples of the link.
        tolerance: largest distance between sheet and hull [m].
        worth: what each sample counts, shape (n,); the same for all by default.
    """
    profile, frame = plan.profile, plan.profile.frame
    start, end = _ends(plan)[plan.sides.index(side)]
    radii = side.radius + side.slope * start, side.radius + side.slope * end
    width = math.tau / len(profile.phi)
    full = side.columns == len(profile.phi)
    wrap = math.tau if full else (side.columns - 1) * width
    turn = 0.0 if full else side.column * width
    spin = np.array([[math.cos(turn), -math.sin(turn), 0.0], [math.sin(turn), math.cos(turn), 0.0], [0, 0, 1]])
    base = frame.origin + start * frame.axis
    rows = [(float(a), float(b), float(c)) for a, b, c in frame.columns @ spin]
    pose = Pose((rows[0], rows[1], rows[2]), (float(base[0]), float(base[1]), float(base[2])))
    cells = profile.azimuths(side.column, side.columns)
    cosine = 1.0 / math.hypot(1.0, side.slope)
    line = side.radii(profile.z[side.first : side.end])[:, None]
    radius = profile.radius[side.first : side.end][:, cells]
    hole = profile.bridged[side.first : side.end][:, cells] - radius > tolerance
    miss = (radius - line) * cosine
    below = side.covers(profile, hull, tolerance)
    return FittedSheet(
        placed=PlacedFrustum(Frustum(max(radii[0], 0.0), max(radii[1], 0.0), end - start, wrap), pose),
        **deviations(miss, hole),
        length_share=(end - start) / (profile.step * len(profile.z)),
        area_share=float(below.mean()),
        facet_rise=side.rise,
        axis=axis,
        touch_share=float(below.mean() if worth is None else worth[below].sum() / worth.sum()),
    )


def _ends(plan: AxisPlan) -> list[tuple[float, float]]:
    """Return the heights of both ends of each side [m]; full wraps that touch share the circle where they meet."""
    profile, sides = plan.profile, plan.sides
    half = 0.5 * profile.step
    ends = [[float(profile.z[s.first]), float(profile.z[s.end - 1])] for s in sides]
    for n, (one, two) in enumerate(pairwise(sides)):
        gap = two.first - one.end
        if not 0 <= gap <= 4 or one.slope == two.slope or one.columns != two.columns != len(profile.phi):
            continue
        meet = (two.radius - one.radius) / (one.slope - two.slope)
        low, high = ends[n][1] - 8 * half, ends[n + 1][0] + 8 * half
        if low <= meet <= high:
            ends[n][1] = ends[n + 1][0] = meet
    return [(a, b) for a, b in ends]
