"""Notes on the coverage of a mesh: hull-like bodies, and the reasons why lengths stay bare."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from coneskin.geometry.mesh import Mesh

from .axis_plan import AxisPlan
from .intervals import longest_intervals
from .profile import RadialProfile
from .side import StraightSide, azimuth_columns
from .surface_samples import SurfaceSamples

__all__ = ["bare_lengths", "hull_note"]

Floats = NDArray[np.float64]

MAX_HULL_FACES = 5000  #: faces; a convex mesh with more is a smooth body, not a collision hull


def hull_note(mesh: Mesh, samples: SurfaceSamples, visual: bool = False) -> str:
    """Return a note if the mesh is a convex hull of few faces, as some collision bodies are; else an empty string.

    The positions of the samples decide, not the volume, which open and wrongly wound meshes do not have.

    Args:
        mesh: the link.
        samples: of its hull.
        visual: True where the mesh is called the visual one, and is taken for the link.
    """
    from scipy.spatial import ConvexHull, QhullError

    if len(mesh.faces) > MAX_HULL_FACES:
        return ""
    try:
        hull = ConvexHull(mesh.outermost)
    except QhullError:
        return ""
    points = samples.points[:: max(1, len(samples) // 1000)]
    depth = -(points @ hull.equations[:, :3].T + hull.equations[:, 3]).max(axis=1)
    share = float((depth < 0.002 * mesh.size.max()).mean())
    if share < 0.95:
        return ""
    found = (
        f"{100.0 * share:.0f} % of the surface lies on the convex hull, as in simplified collision bodies, which have"
    )
    if visual:
        return f"{found} lost the tubes; it is called visual, and taken for the link: hold the test piece against that"
    asked = "use the visual mesh of the link, or allow_hull (--allow-hull) if this is the visual mesh"
    return f"{found} lost the tubes; {asked}"


def bare_lengths(
    profile: RadialProfile,
    sides: list[StraightSide],
    tolerance: float,
    min_length: float,
    further: AxisPlan | None = None,
) -> list[tuple[float, float, str]]:
    """Return the lengths without a sheet: start, end and reason.

    Start and end are heights along the axis from end 1 of the first side [m].

    Args:
        profile: the hull about the axis.
        sides: the sheets about the axis.
        tolerance: largest distance between a sheet and the hull [m].
        min_length: smallest length of a sheet [m].
        further: a sheet that could be added if one more were allowed; None where there is none.
    """
    high, low = profile.bounds(tolerance)
    follows = profile.radius.min(axis=1)
    covered = np.zeros(len(high), bool)
    for side in sides:
        covered[side.first : side.end] = True
    spread = np.where(low > 0.0, high - low, math.inf)
    reason = np.where(spread <= 2.0 * tolerance, 1, np.where(low > 0.0, 2, np.where(follows > 0.0, 2, 3)))
    reason[covered] = 0
    zero = float(profile.z[sides[0].first]) if sides else float(profile.z[0]) - 0.5 * profile.step
    partial = any(side.columns < len(profile.phi) for side in sides)
    bare: list[tuple[float, float, str]] = []
    first = 0
    for k in range(1, len(high) + 1):
        same = k < len(high) and (reason[k] == 0) == (reason[first] == 0)
        if same:
            continue
        if reason[first] and k - first > 1:  # a single slice at a rim does not count
            kinds = np.bincount(reason[first:k], minlength=4)
            length = (k - first) * profile.step
            finite = spread[first:k][np.isfinite(spread[first:k])]
            worst = float(np.median(finite if len(finite) else (high - follows)[first:k]))
            if kinds[1] >= max(kinds[2], kinds[3]):
                straight = _straight_length(profile, high, low, slice(first, k), tolerance, min_length)
                if length < min_length:
                    text = f"round, but shorter than {min_length * 1e3:g} mm"
                elif straight == 0.0:
                    text = "round, but it curves away from a straight side"
                else:
                    text = f"round, and straight over {straight * 1e3:.0f} mm, but " + (
                        "a sheet there would cover too little, or run into another"
                        if further is None or not _lies_along(profile, slice(first, k), further)
                        else "no further sheet was allowed: raise the number of sheets or wires"
                    )
            elif kinds[3] > kinds[2]:
                text = "open: no surface on one side of the axis"
            else:
                text = f"not round: the radius varies by {worst * 1e3:.1f} mm about the axis"
            if partial and kinds[2] >= kinds[1]:
                text += ", even within the angle wrapped"
            low_end = float(profile.z[first]) - 0.5 * profile.step - zero
            bare.append((low_end, low_end + length, text))
        first = k
    return bare


def _lies_along(profile: RadialProfile, rows: slice, plan: AxisPlan) -> bool:
    """Tell whether a sheet of a plan covers at least half of the length of some slices."""
    for side in plan.sides:
        across = azimuth_columns(plan.profile, side.column, side.columns)
        z = profile.frame.local(plan.profile.points()[side.first : side.end][:, across].reshape(-1, 3))[:, 2]
        reach = min(float(z.max()), float(profile.z[rows][-1])) - max(float(z.min()), float(profile.z[rows][0]))
        if reach >= 0.5 * profile.step * (rows.stop - rows.start):
            return True
    return False


def _straight_length(
    profile: RadialProfile, high: Floats, low: Floats, rows: slice, tolerance: float, min_length: float
) -> float:
    """Return the length of the longest straight side within some slices [m]; 0 where none is long enough."""
    least = max(2, math.ceil(min_length / profile.step))
    if rows.stop - rows.start < least:
        return 0.0
    ends = longest_intervals(profile.z[rows], high[rows], low[rows], tolerance, least)
    return max(end - start for start, end in enumerate(ends)) * profile.step
