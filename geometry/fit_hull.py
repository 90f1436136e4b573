"""What speaks against a mesh: hull-like bodies, and the reasons for which lengths stay bare."""

from __future__ import annotations

import math

import numpy as np

from .fit_profile import Profile
from .fit_samples import Samples
from .fit_side import Side
from .mesh import Mesh

__all__ = ["bare_lengths", "hull_note"]

MANY_FACES = 5000  #: a finer mesh that is convex is a smooth body, not a collision hull


def hull_note(mesh: Mesh, samples: Samples) -> str:
    """A sentence where the mesh is a convex hull of few faces, as some collision bodies are; empty where it is not.

    Judged by where the samples lie, not by volume, which open and wrongly wound meshes do not have.
    """
    from scipy.spatial import ConvexHull, QhullError

    if len(mesh.faces) > MANY_FACES:
        return ""
    try:
        hull = ConvexHull(mesh.vertices)
    except QhullError:
        return ""
    points = samples.points[:: max(1, len(samples) // 1000)]
    depth = -(points @ hull.equations[:, :3].T + hull.equations[:, 3]).max(axis=1)
    share = float((depth < 0.002 * mesh.size.max()).mean())
    if share < 0.95:
        return ""
    return (
        f"{100.0 * share:.0f} % of the surface lies on the convex hull, as in simplified collision bodies, where tubes "
        "are lost; take the visual mesh of the link"
    )


def bare_lengths(
    profile: Profile, sides: list[Side], tolerance: float, shortest: float
) -> list[tuple[float, float, str]]:
    """Lengths without a sheet and why, heights along the axis from end 1 of the first side [m]."""
    high, low = profile.bounds()
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
        if reason[first] and k - first > 1:  # a single slice at a rim is no length
            kinds = np.bincount(reason[first:k], minlength=4)
            length = (k - first) * profile.step
            worst = float(np.median(spread[first:k][np.isfinite(spread[first:k])], axis=0)) if kinds[1:3].any() else 0.0
            if kinds[1] >= max(kinds[2], kinds[3]):
                text = (
                    "round, but it curves away from a straight side"
                    if length >= shortest
                    else f"round, but shorter than {shortest * 1e3:g} mm"
                )
            elif kinds[3] > kinds[2]:
                text = "open: no surface on some side of the axis"
            else:
                text = f"not round: the radius differs by {worst * 1e3:.1f} mm about the axis"
            if partial and kinds[2] >= kinds[1]:
                text += ", also within the angle wrapped"
            low_end = float(profile.z[first]) - 0.5 * profile.step - zero
            bare.append((low_end, low_end + length, text))
        first = k
    return bare
