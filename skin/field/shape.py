"""Outlines of contacts that are no discs, cut off at the edges of the sheet.

An outline is given about its own middle, as a distance for each direction; directions are measured in the flat
sheet from e_u (towards end 2) to e_phi. What lies off the sheet is cut away, and the rest is described again about
its own centroid.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from coneskin.core.errors import FieldError

from .sheet import SectorSheet

__all__ = ["Outline", "Region", "clip", "disc", "ellipse", "rectangle"]

Floats = NDArray[np.float64]
Complex = NDArray[np.complex128]

#: Distance of the outline [m] in each direction [rad].
Outline = Callable[[Floats], Floats]

_RAYS_PER_SECTOR = 16  # rays
_FINE_DIRECTIONS = 4096  # directions in which an outline is sampled; a chord misses (pi/4096)^2/2 = 3e-7 of the radius


@dataclass(frozen=True, slots=True, eq=False)
class Region:
    """A piece of the sheet that can be seen whole from its centre.

    Attributes:
        u: slant distance of the centre from end 1 [m].
        phi: azimuth of the centre [rad].
        radius: in equidistant directions from 0 [m], shape (n,); with corners, of the sector of equal area.
        toward: exp(i direction), shape (n,); with corners, the sector's centroid in units of 2/3 radius.
        cut: an edge of the sheet cuts it.
    """

    u: float
    phi: float
    radius: Floats
    toward: Complex
    cut: bool


def disc(radius: float) -> Outline:
    """Return the outline of a circle [m]."""
    _positive("radius", radius)
    return lambda angle: np.full_like(angle, radius)


def ellipse(along: float, across: float, turn: float = 0.0) -> Outline:
    """Return the outline of an ellipse of two half-axes [m], the first turned from e_u by an angle [rad]."""
    _positive("half-axis", along)
    _positive("half-axis", across)
    return lambda angle: 1.0 / np.hypot(np.cos(angle - turn) / along, np.sin(angle - turn) / across)


def rectangle(along: float, across: float, turn: float = 0.0) -> Outline:
    """Return the outline of a rectangle of two half-sides [m], the first turned from e_u by an angle [rad]."""
    _positive("half-side", along)
    _positive("half-side", across)
    return lambda angle: 1.0 / np.maximum(np.abs(np.cos(angle - turn)) / along, np.abs(np.sin(angle - turn)) / across)


def _positive(name: str, value: float) -> None:
    if not (math.isfinite(value) and value > 0.0):
        raise FieldError(f"{name} of an outline must be positive and finite [m], got {value!r}")


def clip(sheet: SectorSheet, u: float, phi: float, outline: Outline, directions: int) -> Region:
    """Return the part of an outline that lies on the sheet.

    Args:
        sheet: the sheet.
        u: slant distance of the outline's middle from end 1 [m]; may lie off the sheet.
        phi: azimuth of the middle [rad]; may lie off the sheet.
        outline: the shape.
        directions: how many to describe the result by.

    Raises:
        FieldError: nothing of it lies on the sheet, or the rest cannot be seen whole from its centroid.
    """
    if not (math.isfinite(u) and math.isfinite(phi)):
        raise FieldError(f"the middle of a contact must be finite, got u={u!r} m, phi={phi!r} rad")
    if sheet.curvature * u <= -1.0:
        raise FieldError(f"the middle of a contact must not lie beyond the apex, got u={u!r} m")
    angle = 2.0 * math.pi * np.arange(_FINE_DIRECTIONS) / _FINE_DIRECTIONS
    radius = np.asarray(outline(angle), dtype=np.float64)
    if not (np.isfinite(radius).all() and (radius > 0.0).all()):
        worst = radius[~(np.isfinite(radius) & (radius > 0.0))].flat[0]
        raise FieldError(f"an outline must be positive and finite in every direction [m], got {worst} m")
    rim = radius * np.exp(1j * angle)
    u1, phi1, offset = u, phi, 0.0j
    cut = False
    room = sheet.edge_distances(u, phi).min() if 0.0 <= u <= sheet.width and 0.0 <= phi <= sheet.wrap else -1.0
    if radius.max() > room:
        cut = True
        u1, phi1 = _centroid(sheet, u, phi, radius, angle)
        offset = complex(sheet.flat(np.array(u), np.array(phi), (u1, phi1)))
        # The frame turns with azimuth: directions at (u, phi), seen from (u1, phi1).
        rim = offset + rim * np.exp(1j * sheet.curvature * sheet.arc * (phi - phi1) / sheet.wrap)
    seen = np.unwrap(np.angle(rim))
    if not (np.diff(seen) > 0.0).all() or seen[-1] - seen[0] > 2.0 * math.pi:
        raise FieldError("a contact cut by an edge must be visible whole from its middle; split it in two")
    if not cut and not _cornered(radius):
        ray = 2.0 * math.pi * np.arange(directions) / directions
        return Region(u, phi, np.asarray(outline(ray), dtype=np.float64), np.exp(1j * ray), False)
    # Sectors keep the area and the centroid of the piece that they stand for, so that corners need no cell of their
    # own.
    count = directions * _RAYS_PER_SECTOR
    wanted = 2.0 * math.pi * (np.arange(count) + 0.5 - _RAYS_PER_SECTOR / 2) / count
    distance = np.exp(np.interp(wanted, seen, np.log(np.abs(rim)), period=2.0 * math.pi))
    rays = np.minimum(distance, _to_edges(sheet, u1, phi1, wanted))
    square = (rays**2).reshape(directions, _RAYS_PER_SECTOR).mean(axis=1)
    cube = (rays**3 * np.exp(1j * wanted)).reshape(directions, _RAYS_PER_SECTOR).mean(axis=1)
    # The mean direction within a sector shortens the centroid of a circle too; a ring's own curvature is exact already.
    straight = np.sinc(1.0 / directions)
    radius = np.sqrt(square)
    return Region(u1, phi1, radius, cube / (square * radius * straight), cut)


def _cornered(radius: Floats) -> bool:
    """Tell whether the outline has corners: its slope jumps between two of the fine directions."""
    log = np.log(radius)
    return bool(np.abs(np.roll(log, 1) - 2.0 * log + np.roll(log, -1)).max() > 0.3 * 2.0 * math.pi / _FINE_DIRECTIONS)


def _centroid(sheet: SectorSheet, u: float, phi: float, radius: Floats, angle: Floats) -> tuple[float, float]:
    """Return the centroid of what lies on the sheet, in the rectangle's coordinates."""
    t = (np.arange(64) + 0.5) / 64.0
    step = angle.size // 128
    local = t[:, None] * (radius * np.exp(1j * angle))[None, ::step]
    weight = t[:, None] * (radius[None, ::step] ** 2)
    kappa = sheet.curvature
    stretch = float(sheet.stretch(u))
    w = local if kappa == 0.0 else np.log(1.0 + kappa * local / stretch) / kappa
    y0 = sheet.arc * (phi / sheet.wrap)
    x0 = u if kappa == 0.0 else math.log1p(kappa * u) / kappa
    x, y = x0 + w.real, y0 + w.imag
    inside = (x > 0.0) & (x < sheet.length) & (y > 0.0) & (y < sheet.breadth)
    if not inside.any():
        raise FieldError(f"the contact at u={u:.6g} m, phi={phi:.6g} rad lies off the sheet")
    weight = np.where(inside, weight, 0.0)
    u1, phi1 = sheet.locate((weight * x).sum() / weight.sum(), (weight * y).sum() / weight.sum())
    return float(u1), float(phi1)


def _to_edges(sheet: SectorSheet, u: float, phi: float, angle: Floats) -> Floats:
    """Return the distance from a point of the sheet to its boundary in each direction [m]."""
    kappa = sheet.curvature
    stretch = float(sheet.stretch(u))
    last = float(sheet.stretch(sheet.width))
    forward = stretch * np.cos(angle)
    out = np.full_like(angle, math.inf)
    with np.errstate(divide="ignore", invalid="ignore"):
        # kappa rho^2 + 2 rho h cos + C = 0 on either arc
        for c in ((1.0 + stretch) * u, -(sheet.width - u) * (stretch + last)):
            root = np.sqrt(forward * forward - kappa * c)
            for sign in (1.0, -1.0):
                rho = -c / (forward + sign * root)
                out = np.where(rho > 0.0, np.fmin(out, rho), out)
        for y, side in ((sheet.arc * phi / sheet.wrap, -1.0), (sheet.arc * (sheet.wrap - phi) / sheet.wrap, 1.0)):
            turn = kappa * y
            if abs(turn) < 0.5 * math.pi:
                cos = np.cos(angle - side * (0.5 * math.pi + turn))
                rho = stretch * y * np.sinc(turn / math.pi) / cos
                out = np.where(cos > 0.0, np.fmin(out, rho), out)
    return out
