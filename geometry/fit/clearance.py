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
    out = np.stack([np.cos(profile.phi), np.sin(profile.phi), np.zeros(len(profile.phi))], axis=1)
    out = out @ profile.frame.columns.T
    feet = profile.frame.origin + profile.z[:, None, None] * profile.frame.axis + profile.radius[..., None] * out
    ca = 1.0 / math.hypot(1.0, side.slope)
    sa = side.slope * ca
    low = float(other.z[side.first]) - 0.5 * other.step
    high = float(other.z[side.end - 1]) + 0.5 * other.step
    width = 2.0 * math.pi / len(other.phi)
    full = side.columns == len(other.phi)
    # cells lie up to a step apart: a sheet that slips between two of them is caught by the wider border
    slack = gap + 0.5 * max(profile.step, other.step)
    base = ((feet - other.frame.origin) @ other.frame.columns).reshape(-1, 3)
    reach = 2.0 * (thickness + slack)  # beyond which no layer above a cell comes near
    above = np.abs((np.hypot(base[:, 0], base[:, 1]) - side.radius - side.slope * base[:, 2]) * ca)
    near = np.flatnonzero((above < reach) & (base[:, 2] > low - reach) & (base[:, 2] < high + reach))
    base = base[near]
    way = (out @ other.frame.columns)[near % len(profile.phi)]
    met = np.zeros(len(near), bool)
    for layer in np.linspace(0.0, thickness, _LAYERS):
        x, y, z = (base + layer * way).T
        rho = np.hypot(x, y)
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
