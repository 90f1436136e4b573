"""Clearance between sheets about different axes: the cells of a profile on which a sheet would run into another."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from .axis_plan import AxisPlan, SheetRequirements
from .profile import RadialProfile
from .side import StraightSide

__all__ = ["clashing_cells", "kept_clear"]

_LAYERS = 4  # heights at which the space above a cell is tested


def clashing_cells(
    profile: RadialProfile, other: RadialProfile, side: StraightSide, thickness: float, gap: float
) -> NDArray[np.bool_]:
    """Return the cells above which the space of a sheet meets that of another sheet, shape (k, p).

    Args:
        profile: the hull about the axis of the sheet to come.
        other: the profile of the sheet that is there.
        side: of the sheet that is there.
        thickness: of both sheets, from the link outwards [m].
        gap: smallest distance between two sheets [m].
    """
    turned = profile.frame.columns.T @ other.frame.columns
    out = np.stack([np.cos(profile.phi), np.sin(profile.phi)], axis=1) @ turned[:2]
    foot = (profile.frame.origin - other.frame.origin) @ other.frame.columns
    # a coordinate at a time: numpy is slow with arrays of three columns
    x, y, z = (foot[i] + profile.z[:, None] * turned[2, i] + profile.radius * out[:, i] for i in range(3))
    ca = 1.0 / math.hypot(1.0, side.slope)
    sa = side.slope * ca
    low = float(other.z[side.first]) - 0.5 * other.step
    high = float(other.z[side.end - 1]) + 0.5 * other.step
    width = 2.0 * math.pi / len(other.phi)
    full = side.columns == len(other.phi)
    # cells lie up to a step apart: a sheet that slips between two of them is caught by the wider border
    slack = gap + 0.5 * max(profile.step, other.step)
    reach = 2.0 * (thickness + slack)  # beyond which no layer above a cell comes near
    above = np.abs((np.sqrt(x * x + y * y) - side.radius - side.slope * z) * ca)
    near = np.flatnonzero((above < reach) & (z > low - reach) & (z < high + reach))
    base = np.stack([x.flat[near], y.flat[near], z.flat[near]], axis=1)
    way = out[near % len(profile.phi)]
    met = np.zeros(len(near), bool)
    for layer in np.linspace(0.0, thickness, _LAYERS):
        x, y, z = (base + layer * way).T
        rho = np.sqrt(x * x + y * y)
        height = (rho - side.radius - side.slope * z) * ca
        foot = z + height * sa  # along the normal of the side
        inside = (height > -slack) & (height < thickness + slack) & (foot > low - slack) & (foot < high + slack)
        if not full:
            margin = slack / np.maximum(rho, 1e-3)
            azimuth = (np.arctan2(y, x) - side.column * width + margin) % (2.0 * math.pi)
            inside &= azimuth < (side.columns - 1) * width + 2.0 * margin
        met |= inside
    clash = np.zeros(profile.radius.shape, bool)
    clash.flat[near[met]] = True
    return clash


def kept_clear(profile: RadialProfile, plans: list[AxisPlan], requirements: SheetRequirements) -> RadialProfile:
    """Return a profile on which no sheet may lie where it would run into those of plans about other axes.

    Args:
        profile: the hull about an axis.
        plans: about other axes.
        requirements: on the sheets.
    """
    for plan in plans:
        for side in plan.sides:
            cells = clashing_cells(profile, plan.profile, side, requirements.thickness, requirements.gap)
            if cells.any():
                profile = profile.blocked(cells)
    return profile
